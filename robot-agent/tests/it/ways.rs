//! What agents need of a map for shortest ways: when it is found for all of them, and how they read it.

use model::Scenario;
use scenarios::Overrides;
use shoal_robot_agent::links_of;

/// Robots with these lines each, on a map of so many squares.
fn scenario(squares: u32, robots: &[&str]) -> Scenario {
    use std::fmt::Write;
    let mut text = "[defaults]\nplanner = \"lanes\"\nknows_map = true\nradius_m = 0.2\n".to_owned();
    for square in 0..squares {
        let (x, y) = (2.0 * f64::from(square % 5), 3.0 + 2.0 * f64::from(square / 5));
        let (right, high) = (x + 1.0, y + 1.0);
        let corners = format!("[[{x}, {y}], [{right}, {y}], [{right}, {high}], [{x}, {high}]]");
        writeln!(text, "[[obstacle]]\nshape = \"polygon\"\ncorners_m = {corners}").unwrap();
    }
    for (index, lines) in robots.iter().enumerate() {
        let y = -(index as f64);
        writeln!(text, "[[robot]]\nid = \"r{index}\"\nstart_m = [0, {y}]\ngoal_m = [5, {y}]\n{lines}").unwrap();
    }
    scenarios::parse("ways.toml", &text, &Overrides::default()).unwrap_or_else(|problems| panic!("{problems}"))
}

#[test]
fn they_are_found_where_several_robots_would_find_the_same() {
    let block = links_of(&scenario(20, &["", ""])).expect("two robots of one size on a large map");
    let three = links_of(&scenario(20, &["", "", "radius_m = 0.1"])).expect("the same two");
    assert_eq!(block, three);
    let four = links_of(&scenario(20, &["", "", "radius_m = 0.1", "radius_m = 0.1"])).expect("two sizes");
    assert!(four.len() > block.len());
    for robots in [
        &["", "radius_m = 0.1"][..],
        &["", "knows_map = false"],
        &["", "planner = \"apf\""],
        &["", "agent = [\"true\"]"],
        &["planner = \"straight\""],
    ] {
        assert_eq!(links_of(&scenario(20, robots)), None, "{robots:?}");
    }
    assert_eq!(links_of(&scenario(4, &["", ""])), None, "a small map");
}

/// The links are a file that agents map; one that was cut is refused.
#[test]
#[expect(clippy::disallowed_methods, reason = "the file of the ways, and what is done to it")]
fn agents_share_them_as_a_file() {
    let address = bus::Address::create().unwrap();
    let path = address.file("ways");
    let take = |links: &'static [u8]| planners::way::tell_links(links);
    bus::attach_ways(&address, |_| panic!("there are none")).unwrap();
    bus::freeze_ways(&address, &links_of(&scenario(20, &["", ""])).unwrap()).unwrap();
    bus::attach_ways(&address, take).unwrap();
    assert_eq!(std::os::unix::fs::MetadataExt::mode(&std::fs::metadata(&path).unwrap()) & 0o777, 0o400);
    let whole = std::fs::read(&path).unwrap();
    for (bytes, cause) in [(&whole[..whole.len() - 4], "it is not whole"), (&[], "it is empty")] {
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, bytes).unwrap();
        let error = bus::attach_ways(&address, take).unwrap_err();
        assert!(error.to_string().contains(cause), "{error}");
    }
    bus::clean::sweep(&address);
}
