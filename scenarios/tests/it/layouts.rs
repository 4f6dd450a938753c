//! Layouts place every robot free of all others and of obstacles, inside the world, the same for the same seed.

use model::Scenario;
use nalgebra::distance;
use proptest::prelude::*;
use shoal_scenarios::{Overrides, parse};

fn layout(lines: &str, seed: u64) -> Scenario {
    let text = format!("[world]\nx_m = [-60, 60]\ny_m = [-60, 60]\n[layout]\n{lines}\n");
    let overrides = Overrides { seed: Some(seed), ..Overrides::default() };
    parse("layout.toml", &text, &overrides).unwrap_or_else(|problems| panic!("{problems}"))
}

/// Smallest distance from surface to surface between starts, and between goals.
fn spread(scenario: &Scenario) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    for (i, a) in scenario.robots.iter().enumerate() {
        for b in &scenario.robots[..i] {
            let bodies = a.radius_m + b.radius_m;
            least[0] = least[0].min(distance(&a.start, &b.start) - bodies);
            least[1] = least[1].min(distance(a.goals.last().unwrap(), b.goals.last().unwrap()) - bodies);
        }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn none_overlap(seed in any::<u64>(), count in 1_usize..120) {
        for lines in [
            format!("kind = \"circle-swap\"\nrobots = {count}\nradius_m = 30\njitter_m = 0.2"),
            format!("kind = \"ring\"\nrobots = {count}\nradius_m = 30\njitter_m = 0.2"),
            format!("kind = \"grid\"\nrobots = {count}\noffset_m = [20, 0]\njitter_m = 0.4"),
            format!("kind = \"line\"\nrobots = {count}\ngap_m = 10\njitter_m = 0.3"),
            format!("kind = \"random\"\nrobots = {count}\nspread_m = 0.5"),
        ] {
            let scenario = layout(&lines, seed);
            prop_assert_eq!(scenario.robots.len(), count);
            let [starts, goals] = spread(&scenario);
            prop_assert!(starts >= 0.0 && goals >= 0.0, "{lines}: {starts} {goals}");
        }
    }

    #[test]
    fn random_keeps_clear_of_everything(seed in any::<u64>(), count in 1_usize..60) {
        let lines = format!("kind = \"random\"\nrobots = {count}\nspread_m = 0.3\nx_m = [-10, 10]\ny_m = [-10, 10]\ngoal_distance_m_min = 3
            [[obstacle]]\nshape = \"disc\"\ncenter_m = [0, 0]\nradius_m = 2
            [[obstacle]]\nshape = \"polygon\"\ncorners_m = [[4, 4], [8, 4], [8, 8], [4, 8]]
            [[robot]]\nid = \"alone\"\nstart_m = [-5, -5]\ngoal_m = [-5, 5]\nradius_m = 1");
        let scenario = layout(&lines, seed);
        prop_assert!(spread(&scenario).iter().all(|spread| *spread >= 0.3 - 1e-9));
        for robot in scenario.robots.iter().filter(|robot| robot.id != "alone") {
            prop_assert!(distance(&robot.start, &robot.goals[0]) >= 3.0);
            for p in [robot.start, robot.goals[0]] {
                prop_assert!(p.coords.norm() >= 2.0 + 0.2 + 0.3 - 1e-9);
                let (dx, dy) = ((4.0 - p.x).max(p.x - 8.0), (4.0 - p.y).max(p.y - 8.0));
                prop_assert!(dx.max(dy) > 0.0, "{p} is inside the square");
            }
        }
    }
}

#[test]
fn the_seed_decides() {
    let lines = "kind = \"circle-swap\"\nrobots = 8\nradius_m = 5\njitter_m = 0.2";
    assert_eq!(layout(lines, 1), layout(lines, 1));
    assert_ne!(layout(lines, 1).robots, layout(lines, 2).robots);
}

#[test]
fn a_robot_more_moves_no_other_start() {
    let at = |count: usize| layout(&format!("kind = \"random\"\nrobots = {count}"), 5).robots;
    for (few, many) in at(10).iter().zip(&at(11)) {
        assert_eq!((few.start, &few.goals), (many.start, &many.goals));
    }
}

#[test]
fn shapes_of_the_patterns() {
    let show = |lines: &str| {
        let scenario = layout(lines, 1);
        let places = scenario.robots.iter().map(|robot| {
            let (start, goal) = (robot.start, robot.goals[0]);
            format!("{} [{:.1}, {:.1}] -> [{:.1}, {:.1}]", robot.id, start.x, start.y, goal.x, goal.y)
        });
        format!("# {}\n{}\n", lines.replace('\n', ", "), places.collect::<Vec<_>>().join("\n"))
    };
    insta::assert_snapshot!(
        [
            show("kind = \"circle-swap\"\nrobots = 3\nradius_m = 5"),
            show("kind = \"ring\"\nrobots = 4\nradius_m = 5\nphase_rad = 0.7853981633974483\nshift = 1"),
            show("kind = \"ring\"\nrobots = 5\nradius_m = 5\nid_prefix = \"n-\""),
            show("kind = \"grid\"\nrobots = 5\noffset_m = [10, 0]\nspacing_m = 1\ncenter_m = [-5, 0]"),
            show("kind = \"grid\"\nrobots = 2\noffset_m = [10, 0]\ncolumns = 4"),
            show("kind = \"line\"\nrobots = 5\ngap_m = 8\nspacing_m = 2"),
            show(
                "kind = \"list\"\nrobots = 2\nstarts_m = [[0, 1], [2, 3], [4, 5]]\ngoals_m = [[6, 7], [8, 9], [1, 1]]"
            ),
        ]
        .join("\n")
    );
}

#[test]
fn a_list_is_as_long_as_it_is() {
    let problem = |lines: &str| {
        let text = format!("[layout]\nkind = \"list\"\n{lines}\n");
        parse("list.toml", &text, &Overrides::default()).expect_err(lines).to_string()
    };
    let places = "starts_m = [[0, 1], [2, 3]]\ngoals_m = [[3, 2], [1, 0]]";
    let too_many = problem(&format!("robots = 3\n{places}"));
    assert!(too_many.contains("layout.robots: 3 robots, but only 2 are listed"), "{too_many}");
    assert!(too_many.contains("at most 2 robots"), "{too_many}");
    let uneven = problem("robots = 1\nstarts_m = [[0, 1], [2, 3]]\ngoals_m = [[3, 2]]");
    assert!(uneven.contains("layout.goals_m: 1 goals for 2 starts"), "{uneven}");
    let missing = problem("robots = 1\nstarts_m = [[0, 1]]");
    assert!(missing.contains("goals_m"), "{missing}");
    let foreign = problem(&format!("robots = 1\ncenter_m = [0, 0]\n{places}"));
    assert!(foreign.contains("center_m"), "{foreign}");
}
