//! Who hears whom, who sees what, and when the lists change.

use crate::driver::{Driver, at, robot, scenario};
use geometry::{Capsule, Polygon};
use model::{AtEnd, Motion, Obstacle, Radio, Restart, RobotIndex, Scenario, Shape, TimelineAction};
use nalgebra::Point2;
use proptest::prelude::*;
use protocol::world_to_robot::NeighborRef;

fn heard(driver: &Driver, slot: usize) -> Vec<u32> {
    driver.world.neighbors(slot).iter().map(|neighbor| neighbor.index).collect()
}

fn disc(x: f64, y: f64, radius: f64) -> Obstacle {
    Obstacle { shape: Shape::Capsule(Capsule::disc(Point2::new(x, y), radius)), motion: None }
}

/// One robot drives away from the other and back; the far one hears further than the near one.
fn shuttle() -> Scenario {
    let mut scenario = scenario(vec![robot(0, [0.0, 0.0], [0.0, 0.0]), robot(1, [4.05, 0.0], [6.05, 0.0])]);
    scenario.robots[1].goals.push(Point2::new(4.05, 0.0));
    scenario.robots[1].radio_range_m = 9.0;
    scenario
}

#[test]
fn a_neighbour_once_heard_is_kept_until_it_is_further_away() {
    let mut driver = Driver::new(&shuttle());
    for tick in 0..42 {
        driver.open();
        let x = driver.position(1).x;
        let outwards = tick <= 20;
        // Nobody is heard at once; then range 5 m, kept up to 5.5 m on the way out.
        let expected = tick >= 1 && if outwards { x <= 5.5 } else { x <= 5.0 };
        assert_eq!(heard(&driver, 0), if expected { vec![1] } else { vec![] }, "tick {tick}: {x} m");
        assert_eq!(heard(&driver, 1), if tick >= 1 { vec![0] } else { vec![] }, "the receiver's range counts");
        driver.close();
    }
}

#[test]
fn whom_a_robot_hears_first_is_foreseen() {
    let mut scenario = scenario((0..6).map(|i| robot(i, [2.0 * i as f64, 0.0], [2.0 * i as f64, 0.0])).collect());
    scenario.events = vec![at(3, TimelineAction::Join { robot: 2 })];
    scenario.robots[5].start = Point2::new(90.0, 0.0);
    let mut driver = Driver::new(&scenario);
    let foreseen = driver.world.foreseen();
    assert!(driver.world.participants().is_empty(), "nobody has entered by being foreseen");
    let whole: Vec<usize> = foreseen.iter().map(|(slot, _)| *slot).collect();
    assert_eq!(whole, [0, 1, 3, 4], "one joins later, one is out of everybody's range");
    driver.open();
    driver.close();
    driver.open();
    for (slot, neighbors) in foreseen {
        assert_eq!(driver.world.neighbors(slot), neighbors, "slot {slot}");
    }
    driver.close();
}

#[test]
fn every_body_is_heard_or_seen_but_never_both() {
    let mut scenario = scenario((0..4).map(|i| robot(i, [i as f64, 0.0], [i as f64, 9.0])).collect());
    scenario.obstacles = vec![disc(0.0, -8.0, 0.5)];
    scenario.events = vec![
        at(3, TimelineAction::pause(1, 3)),
        at(4, TimelineAction::Join { robot: 2 }),
        at(5, TimelineAction::kill(3)),
        at(9, TimelineAction::Leave { robot: 3 }),
    ];
    let mut driver = Driver::new(&scenario);
    // What robot 0 hears and sees; pieces: one obstacle out of sight, then the slots.
    let table: [(&[u32], &[u16]); 11] = [
        (&[], &[2, 4]),
        (&[1, 3], &[]),
        (&[1, 3], &[]),
        (&[3], &[2]),
        (&[3], &[2, 3]),
        (&[2], &[2, 4]),
        (&[2], &[2, 4]),
        (&[1, 2], &[4]),
        (&[1, 2], &[4]),
        (&[1, 2], &[]),
        (&[1, 2], &[]),
    ];
    let (mut radio, mut sight) = ((Vec::new(), Vec::new()), Vec::new());
    for (tick, (hears, sees)) in table.into_iter().enumerate() {
        driver.open();
        assert_eq!(heard(&driver, 0), hears, "tick {tick}");
        assert_eq!(driver.world.sensed(0), sees, "tick {tick}");
        let opening = driver.world.opening();
        // Those that speak for the first time are heard a tick later.
        let speaks = |slot: &u32| table[tick + 1].0.contains(slot) && !hears.contains(slot);
        let comes: Vec<u32> = if tick + 1 < table.len() { (1..4).filter(speaks).collect() } else { Vec::new() };
        assert_eq!(driver.world.coming(0).iter().map(|who| who.index).collect::<Vec<_>>(), comes, "tick {tick}");
        let tells = (hears.to_vec(), comes);
        assert_eq!(opening.neighbors.contains(&0), radio != tells, "tick {tick}: written when it changes");
        assert_eq!(opening.sensed.contains(&0), sight != sees, "tick {tick}: written when it changes");
        (radio, sight) = (tells, sees.to_vec());
        driver.close();
    }
}

#[test]
fn a_restarted_neighbour_is_heard_in_its_new_life() {
    let mut scenario = scenario(vec![robot(0, [0.0, 0.0], [0.0, 9.0]), robot(1, [1.0, 0.0], [1.0, 9.0])]);
    scenario.robots[1].restart = Restart::on_failure(1, 0);
    scenario.events = vec![at(3, TimelineAction::kill(1))];
    let mut driver = Driver::new(&scenario);
    let lives: Vec<Option<u32>> = (0..7)
        .map(|_| {
            driver.tick();
            driver.world.neighbors(0).first().map(|neighbor| neighbor.incarnation)
        })
        .collect();
    assert_eq!(lives, [None, Some(0), Some(0), None, None, Some(1), Some(1)]);
}

#[test]
fn pieces_are_written_when_they_appear_or_move() {
    let mut scenario = scenario(vec![robot(0, [0.0, 0.0], [9.0, 0.0]), robot(1, [0.0, 2.0], [9.0, 2.0])]);
    let points = vec![Point2::new(5.0, 5.0), Point2::new(5.25, 5.0)];
    let moving = Motion::Waypoints { points, speed_mps: 1.0, then: AtEnd::Stop };
    let square = [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(Point2::from).to_vec();
    scenario.obstacles = vec![
        Obstacle { shape: Shape::Polygon(square), motion: None },
        Obstacle { motion: Some(moving), ..disc(5.0, 5.0, 0.5) },
    ];
    scenario.events = vec![at(3, TimelineAction::pause(1, 2))];
    let mut driver = Driver::new(&scenario);
    // Pieces: three edges, the disc, two bodies. The paused body is seen again one tick later, but has not moved.
    let table: [&[usize]; 8] = [&[0, 1, 2, 3, 4, 5], &[3], &[3], &[3, 5], &[], &[], &[], &[]];
    for (tick, changed) in table.into_iter().enumerate() {
        driver.open();
        assert_eq!(driver.world.opening().pieces, changed, "tick {tick}");
        driver.close();
    }
    let piece = driver.world.piece(3);
    assert_eq!((piece.ax_m, piece.obstacle, piece.vx_mps), (5.25, 1, 0.0));
    assert_eq!((driver.world.piece(1).obstacle, driver.world.piece(5).obstacle), (0, 3));
}

proptest! {
    #[test]
    fn lists_are_what_all_pairs_say(
        places in prop::collection::vec((-8.0..8.0f64, -8.0..8.0f64), 1..25),
        ranges in prop::collection::vec((0.5..9.0f64, 0.5..6.0f64, any::<bool>(), any::<bool>()), 25),
        walls in prop::collection::vec(((-8.0..8.0f64, -8.0..8.0f64), (-4.0..4.0f64, -4.0..4.0f64), 0.0..1.0f64), 0..12),
        triangles in prop::collection::vec((-8.0..8.0f64, -8.0..8.0f64, 0.5..4.0f64), 0..4),
    ) {
        let mut robots: Vec<_> =
            places.iter().enumerate().map(|(i, (x, y))| robot(i, [*x, *y], [*x + 5.0, *y])).collect();
        for (robot, (radio, sensor, sees_robots, _)) in robots.iter_mut().zip(&ranges) {
            (robot.radio_range_m, robot.sensor_range_m, robot.radio_hysteresis_m) = (*radio, *sensor, 0.0);
            robot.sees_robots = *sees_robots;
        }
        let mut scenario = scenario(robots);
        let wall = |((x, y), (dx, dy), radius): &((f64, f64), (f64, f64), f64)| {
            let a = Point2::new(*x, *y);
            Shape::Capsule(Capsule { a, b: a + nalgebra::Vector2::new(*dx, *dy), radius: *radius })
        };
        let triangle = |(x, y, size): &(f64, f64, f64)| {
            Shape::Polygon(vec![Point2::new(*x, *y), Point2::new(x + size, *y), Point2::new(*x, y + size)])
        };
        let shapes: Vec<Shape> = walls.iter().map(wall).chain(triangles.iter().map(triangle)).collect();
        scenario.obstacles = shapes.iter().map(|shape| Obstacle { shape: shape.clone(), motion: None }).collect();
        scenario.events = vec![at(1, TimelineAction::pause(0, 100))];
        for (slot, _) in ranges.iter().take(scenario.robots.len()).enumerate().filter(|(_, range)| range.3) {
            let radio = Radio { drop: 0.1, ..Radio::PERFECT };
            scenario.events.push(at(1, TimelineAction::Radio { robot: Some(slot), radio }));
        }
        let mut driver = Driver::new(&scenario);
        driver.tick();
        driver.open();
        let count = scenario.robots.len();
        let base: usize = shapes.iter().map(|shape| shape.pieces().len()).sum();
        for (slot, (me, (.., loses))) in scenario.robots.iter().zip(&ranges).enumerate().skip(1) {
            let here = driver.position(slot);
            let hears = |other: &usize| (driver.position(*other) - here).norm() <= me.radio_range_m;
            let expected: Vec<NeighborRef> = (1..count).filter(|other| *other != slot).filter(hears)
                .map(|other| NeighborRef { index: other as u32, incarnation: 0 }).collect();
            prop_assert_eq!(driver.world.neighbors(slot), expected);
            let mut expected = Vec::new();
            let mut index = 0;
            for shape in &shapes {
                let inside = match shape {
                    Shape::Polygon(corners) => Polygon { corners: corners.clone() }.contains(here),
                    Shape::Capsule(_) => false,
                };
                for piece in shape.pieces() {
                    if inside || piece.distance(here) <= me.sensor_range_m {
                        expected.push(index);
                    }
                    index += 1;
                }
            }
            for other in (0..count).filter(|other| *other != slot) {
                let is_heard = other != 0 && hears(&other) && !loses;
                let is_seen = other == 0 || me.sees_robots && !is_heard;
                if is_seen && (driver.position(other) - here).norm() - 0.25 <= me.sensor_range_m {
                    expected.push((base + other) as u16);
                    let piece = driver.world.piece(base + other);
                    prop_assert_eq!(piece.robot(), Some(RobotIndex::of(other)));
                    prop_assert_eq!((piece.ax_m, piece.ay_m), (driver.position(other).x, driver.position(other).y));
                }
            }
            prop_assert_eq!(driver.world.sensed(slot), expected);
        }
        prop_assert!(driver.world.neighbors(0).is_empty() && driver.world.sensed(0).is_empty());
    }
}
