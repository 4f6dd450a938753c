//! No text, however wrong, makes the parser panic or stall.

use proptest::prelude::*;
use shoal_scenarios::{Overrides, catalog, parse};

fn survives(text: &str, set: &[String]) {
    let overrides = Overrides { set: set.to_vec(), ..Overrides::default() };
    if let Err(problems) = parse("fuzz.toml", text, &overrides) {
        assert!(problems.count() > 0);
        assert!(!problems.to_string().is_empty());
    }
}

/// Words that the format knows, and values that are wrong almost everywhere.
const PIECES: &[&str] = &[
    "[world]",
    "[clock]",
    "[fleet]",
    "[processes.agents]",
    "cpus = [0, 1]",
    "cpus = [1, 1]",
    "scheduling = \"fifo\"",
    "priority = 7",
    "[radio]",
    "[defaults]",
    "[kinds.point]",
    "[planners.apf]",
    "[layout]",
    "[expect]",
    "[[robot]]",
    "[[obstacle]]",
    "[[event]]",
    "[robot]",
    "x_m = [0, 1]",
    "kind = \"ring\"",
    "kind = \"random\"",
    "kind = \"unicycle\"",
    "kind = \"join\"",
    "kind = \"radio\"",
    "kind = \"task\"",
    "robots = 3",
    "robots = 1024",
    "radius_m = 1",
    "radius_m = 1e300",
    "start_m = [0, 0]",
    "goal_m = [1, 1]",
    "goal_m = [nan, 1]",
    "id = \"a\"",
    "robot = \"a\"",
    "at_s = 1",
    "at_s = 1e5",
    "for_s = 1",
    "shape = \"polygon\"",
    "shape = \"disc\"",
    "center_m = [1e6, 0]",
    "center_m = [0, 0]",
    "corners_m = [[0, 0], [1, 0], [0, 1]]",
    "corners_m = [[0, 0], [1, 0], [0, 0]]",
    "planner = \"apf\"",
    "params = { eta = 1 }",
    "motion = { kind = \"orbit\", center_m = [0, 0], omega_radps = 1 }",
    "goal_motion = { kind = \"bounce\", velocity_mps = [1, 1] }",
    "tick_hz = 1e4",
    "duration_s = 1e6",
    "spread_m = 1e6",
    "spread_m = 0",
    "jitter_m = 1e6",
    "gap_m = 1",
    "max_robots = 1",
    "arrived = 0",
    "waypoints_m = []",
    "waypoints_m = [[0, 0]]",
    "offset_m = [1, 1]",
    "columns = 1024",
    "shift = 1",
    "radius_m = 1e-300",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn any_text(text in any::<String>()) {
        survives(&text, &[]);
    }

    #[test]
    fn any_mixture_of_known_pieces(picks in proptest::collection::vec(0..PIECES.len(), 0..40)) {
        let mut text = String::new();
        // A key twice in one table is a syntax error and hides everything else: open a new list entry instead.
        let mut table: Vec<&str> = Vec::new();
        for piece in picks.into_iter().map(|pick| PIECES[pick]) {
            let key = piece.split(" =").next().unwrap_or(piece);
            if piece.starts_with('[') {
                if !piece.starts_with("[[") && text.contains(piece) {
                    continue;
                }
                table.clear();
            } else if table.contains(&key) {
                continue;
            }
            table.push(key);
            text.push_str(piece);
            text.push('\n');
        }
        survives(&text, &[]);
    }

    #[test]
    fn mutated_catalog(
        which in 0..catalog().len(),
        at in any::<prop::sample::Index>(),
        length in 0_usize..12,
        insert in "[-\\[\\]{}=\".,0-9a-z_ \n]{0,8}",
    ) {
        let text = catalog()[which].text;
        let begin = at.index(text.len());
        let Some((head, tail)) = text.split_at_checked(begin) else { return Ok(()) };
        let Some(tail) = tail.get(length.min(tail.len())..) else { return Ok(()) };
        survives(&format!("{head}{insert}{tail}"), &[]);
    }

    #[test]
    fn any_override(which in 0..catalog().len(), set in proptest::collection::vec(any::<String>(), 0..3)) {
        survives(catalog()[which].text, &set);
    }

    #[test]
    fn any_override_that_looks_like_one(
        which in 0..catalog().len(),
        set in proptest::collection::vec("(robot|clock|event|layout|obstacle|defaults)(\\[[0-9]\\])?(\\.[a-z_]{1,8}){0,2}=[-\\[\\]{}\"0-9a-z.]{0,6}", 1..4),
    ) {
        survives(catalog()[which].text, &set);
    }
}

#[test]
fn depth_is_bounded() {
    for depth in [50, 1_000, 100_000] {
        survives(&format!("a = {}1{}", "[".repeat(depth), "]".repeat(depth)), &[]);
        survives(&format!("a = {}1{}", "{a=".repeat(depth), "}".repeat(depth)), &[]);
        survives(&format!("{}a = 1", "a.".repeat(depth)), &[]);
        survives(&format!("[{}a]", "a.".repeat(depth)), &[]);
        survives("", &[format!("{}a=1", "a.".repeat(depth))]);
        survives("a = 1", &[format!("a={}1{}", "[".repeat(depth), "]".repeat(depth))]);
    }
}
