//! Worlds from maps: robots that know them and robots that find their way, and problems of the Moving AI lab against a search
//! of our own.

use model::Scenario;
use nalgebra::{Point2, distance};
use scenarios::Overrides;
use shoal_tests::build::Maps;
use shoal_tests::{Recording, Tape};
use std::f64::consts::SQRT_2;

fn set(keys: &[&str]) -> Overrides {
    Overrides { set: keys.iter().map(|key| (*key).to_owned()).collect(), ..Overrides::default() }
}

fn all_arrive(scenario: &Scenario) {
    let outcome = Recording::of(scenario).outcome;
    let arrived = outcome.robots.iter().filter(|robot| robot.arrived).count();
    assert_eq!(arrived, scenario.robots.len(), "{}: {:?}", scenario.name, outcome.robots);
    assert_eq!((outcome.robot_contacts, outcome.obstacle_contacts), (0, 0), "{}", scenario.name);
}

#[test]
fn robots_that_know_the_map_get_through_it() {
    for kind in ["point", "unicycle"] {
        all_arrive(&Maps::scenario("office.toml", &set(&[&format!("defaults.kind=\"{kind}\"")])));
    }
    all_arrive(&Maps::scenario("rooms.toml", &set(&[])));
    let overrides = Overrides { planner: Some("orca".to_owned()), robots: Some(1), ..Overrides::default() };
    all_arrive(&Maps::scenario("rooms.toml", &overrides));
}

#[test]
fn robots_that_only_see_find_their_way() {
    all_arrive(&Maps::scenario("office.toml", &set(&["defaults.knows_map=false", "clock.duration_s=300"])));
    all_arrive(&Maps::scenario(
        "rooms.toml",
        &set(&["defaults.knows_map=false", "clock.duration_s=600", "layout.robots=3"]),
    ));
}

/// Obstacles of the scenario stand before the walls of its map.
#[test]
fn obstacles_and_walls_are_passed_together() {
    let mut scenario = Maps::scenario("office.toml", &set(&[]));
    scenario.robots.truncate(1);
    let shape = model::Shape::Capsule(geometry::Capsule::disc(Point2::new(0.0, 0.3), 0.35));
    scenario.obstacles.push(model::Obstacle { shape, motion: None });
    all_arrive(&scenario);
}

#[test]
fn a_run_on_a_map_is_computed_again() {
    for name in ["office.toml", "rooms.toml"] {
        let scenario = Maps::scenario(name, &Overrides { duration_s: Some(20.0), ..Overrides::default() });
        let tape = Tape::of(&scenario);
        let verdict = tape.verify();
        assert_eq!((verdict.first, verdict.differences), (None, 0), "{name}");
        assert!(verdict.commands > 0 && verdict.steps == verdict.commands, "{name}");
    }
}

/// The rows of the map as its file has them.
fn rows() -> Vec<&'static str> {
    let text = std::str::from_utf8(Maps::file("rooms.map")).unwrap();
    text.lines().skip_while(|line| *line != "map").skip(1).collect()
}

/// Length of the shortest way over cells in octile steps that cut no corner, in cells.
fn octile(rows: &[&str], from: [i64; 2], to: [i64; 2]) -> f64 {
    let free = |[x, y]: [i64; 2]| {
        let cell = rows.get(y as usize).and_then(|row| row.as_bytes().get(x as usize));
        x >= 0 && y >= 0 && cell.is_some_and(|cell| b".GS".contains(cell))
    };
    let width = rows[0].len();
    let index = |[x, y]: [i64; 2]| y as usize * width + x as usize;
    let mut lengths = vec![f64::INFINITY; width * rows.len()];
    lengths[index(from)] = 0.0;
    let mut open = vec![from];
    // A cell that has become nearer tells its neighbours, until none has.
    while let Some([x, y]) = open.pop() {
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
            if free([x + dx, y + dy]) && free([x + dx, y]) && free([x, y + dy]) {
                let length = lengths[index([x, y])] + if dx != 0 && dy != 0 { SQRT_2 } else { 1.0 };
                if length < lengths[index([x + dx, y + dy])] - 1e-9 {
                    lengths[index([x + dx, y + dy])] = length;
                    open.push([x + dx, y + dy]);
                }
            }
        }
    }
    lengths[index(to)]
}

/// Every problem of the list: its start and its goal are where the file has them, its last column is the length that a search of
/// our own finds, and a robot alone drives a way that is hardly longer, without a contact.
#[test]
fn problems_of_moving_ai() {
    let text = std::str::from_utf8(Maps::file("rooms.scen")).unwrap();
    let rows = rows();
    let all = Maps::scenario("rooms.toml", &Overrides { robots: Some(12), ..Overrides::default() });
    assert_eq!(text.lines().count(), 13);
    for (line, robot) in text.lines().skip(1).zip(&all.robots) {
        let words: Vec<&str> = line.split('\t').collect();
        let cell = |at: usize| [words[at], words[at + 1]].map(|word| word.parse::<i64>().unwrap());
        let (from, to, told) = (cell(4), cell(6), words[8].parse::<f64>().unwrap());
        let middle = |[x, y]: [i64; 2]| Point2::new(x as f64 + 0.5, (rows.len() as i64 - y) as f64 - 0.5);
        assert_eq!((robot.start, robot.goals[0]), (middle(from), middle(to)));
        let shortest = octile(&rows, from, to);
        assert!((told - shortest).abs() < 1e-6, "{line}: {shortest}");
        let alone = Scenario { robots: vec![robot.clone()], ..all.clone() };
        let outcome = Recording::of(&alone).outcome;
        let result = &outcome.robots[0];
        assert!(result.arrived && outcome.obstacle_contacts == 0, "{line}: {result:?}");
        let driven = result.path_length_m + robot.goal_tolerance_m;
        let straight = distance(&robot.start, &robot.goals[0]);
        assert!(driven >= straight.max(shortest / 1.083 - 2.0) - 1e-6, "{line}: {driven} m");
        assert!(driven <= 1.01 * shortest + 0.1, "{line}: {driven} m");
        let ratio = result.path_ratio.expect("there is a shortest way");
        assert!((0.97..1.04).contains(&ratio), "{line}: {ratio}");
    }
}
