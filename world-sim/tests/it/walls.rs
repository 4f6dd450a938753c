//! Contacts and clearances with the walls of a map, against looking at every wall in every tick.

use crate::driver::{Driver, robot, scenario};
use geometry::map::{Cells, Raster, WALLS_MAX};
use geometry::{Capsule, Map, segment_distance};
use model::{EventKind, MapRef, Partner, Scenario};
use nalgebra::Point2;
use proptest::prelude::*;

const SIDE: u32 = 16;
const OVERLAP_M: f64 = 1e-9;

fn raster(yaw_rad: f64) -> Raster {
    Raster { origin: Point2::new(-3.0, 1.0), yaw_rad, cell_m: 0.9, columns: SIDE, rows: SIDE }
}

fn world(cells: &Cells, raster: Raster, ends: &[[Point2<f64>; 2]]) -> Scenario {
    let robots = ends.iter().enumerate().map(|(slot, [from, to])| robot(slot, (*from).into(), (*to).into()));
    let mut scenario = scenario(robots.collect());
    let map = Map::build(&cells.outlines(&raster, WALLS_MAX), true, Some(raster)).unwrap();
    scenario.map = Some(MapRef::new("test.yaml".to_owned(), map));
    scenario.clock.ticks_max = 300;
    scenario
}

/// Which cell a place is in, in solid ones or outside of all.
fn is_solid(cells: &Cells, raster: &Raster, p: Point2<f64>) -> bool {
    let p = nalgebra::Rotation2::new(-raster.yaw_rad) * (p - raster.origin) / raster.cell_m;
    let inside = p.x >= 0.0 && p.y >= 0.0 && p.x < f64::from(SIDE) && p.y < f64::from(SIDE);
    !inside || cells.is_solid(p.x as usize, p.y as usize)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn contacts_and_clearances_are_those_of_all_walls(
        solid in prop::collection::vec((0..SIDE as usize, 0..SIDE as usize), 0..90),
        ends in prop::collection::vec([(0..SIDE as usize, 0..SIDE as usize), (0..SIDE as usize, 0..SIDE as usize)], 1..5),
        yaw_rad in prop_oneof![Just(0.0), Just(0.4)]
    ) {
        let (mut cells, raster) = (Cells::new(SIDE, SIDE).unwrap(), raster(yaw_rad));
        let free: Vec<(usize, usize)> = ends.iter().map(|[start, _]| *start).collect();
        for place in solid.into_iter().filter(|place| !free.contains(place)) {
            cells.fill(place.0, place.1);
        }
        let place = |(x, y): (usize, usize)| raster.at(x as f64 + 0.47, y as f64 + 0.52);
        let ends: Vec<[Point2<f64>; 2]> = ends.into_iter().map(|ends| ends.map(place)).collect();
        let scenario = world(&cells, raster, &ends);
        let walls: Vec<Capsule> = scenario.walls().unwrap().walls().collect();
        let least = |from: Point2<f64>, to: Point2<f64>| {
            walls.iter().map(|wall| segment_distance(from, to, wall.a, wall.b)).fold(f64::INFINITY, f64::min)
        };
        let (mut driver, mut contacts, mut clearance) = (Driver::new(&scenario), vec![0; ends.len()], f64::INFINITY);
        while !driver.world.finished() {
            driver.open();
            let before: Vec<Point2<f64>> = (0..ends.len()).map(|slot| driver.position(slot)).collect();
            driver.close();
            for (slot, from) in before.into_iter().enumerate() {
                let (to, radius) = (driver.position(slot), scenario.robots[slot].radius_m);
                let near = least(from, to) - radius;
                clearance = near.min(clearance);
                let was_in = least(from, from) - radius < -OVERLAP_M || is_solid(&cells, &raster, from);
                contacts[slot] += u64::from(near < -OVERLAP_M && !was_in);
            }
        }
        let outcome = driver.world.outcome();
        let counted: Vec<u64> = outcome.events.iter().fold(vec![0; ends.len()], |mut counted, event| {
            if let (EventKind::Contact { with: Partner::Map, .. }, Some(robot)) = (&event.kind, event.robot) {
                counted[robot.at()] += 1;
            }
            counted
        });
        prop_assert_eq!(&counted, &contacts);
        prop_assert_eq!(outcome.obstacle_contacts, contacts.iter().sum::<u64>());
        let found = outcome.min_obstacle_clearance_m.unwrap();
        prop_assert!((found - clearance).abs() < 1e-12, "{} against {}", found, clearance);
    }
}

/// Through a block of cells there is one contact, at the surface where it begins; and what was driven through solid walls is
/// compared with no way past them.
#[test]
fn through_a_block_is_one_contact() {
    let (mut cells, raster) = (Cells::new(SIDE, SIDE).unwrap(), raster(0.0));
    (0..SIDE as usize).for_each(|y| (6..10).for_each(|x| cells.fill(x, y)));
    let (from, to) = (raster.at(2.0, 8.0), raster.at(14.0, 8.0));
    let outcome = Driver::new(&world(&cells, raster, &[[from, to]])).run();
    let touches: Vec<_> = outcome.events.iter().filter_map(|event| event.kind.touch()).collect();
    assert_eq!((outcome.obstacle_contacts, touches.len()), (1, 1));
    let surface = raster.at(6.0, 8.0);
    assert!((Point2::from(touches[0].at_m) - surface).norm() < 1e-6, "{touches:?}");
    assert!(outcome.robots[0].arrived && outcome.robots[0].path_ratio.is_none());
}

/// Where there is a way, it is compared with the shortest one.
#[test]
fn the_path_ratio_knows_the_walls() {
    let (mut cells, raster) = (Cells::new(SIDE, SIDE).unwrap(), raster(0.0));
    (0..SIDE as usize - 1).for_each(|y| cells.fill(8, y));
    let (from, to) = (raster.at(2.5, 2.5), raster.at(14.5, 2.5));
    let mut scenario = world(&cells, raster, &[[from, to]]);
    scenario.clock.ticks_max = 600;
    scenario.robots[0].goals = vec![raster.at(2.5, 15.5), raster.at(14.5, 15.5), to];
    let outcome = Driver::new(&scenario).run();
    assert_eq!((outcome.obstacle_contacts, outcome.robots[0].arrived), (0, true));
    let ratio = outcome.robots[0].path_ratio.unwrap();
    assert!((0.97..1.05).contains(&ratio), "{ratio}");
}

/// The map of a run is a file that its processes map; one that was changed, cut or is another one is refused.
#[test]
#[expect(clippy::disallowed_methods, reason = "the file of the map, and what is done to it")]
fn processes_share_the_map_as_a_file() {
    let (cells, raster) = (Cells::new(SIDE, SIDE).unwrap(), raster(0.0));
    let scenario = world(&cells, raster, &[[raster.at(2.0, 2.0), raster.at(4.0, 2.0)]]);
    let known = scenario.map.unwrap();
    let address = bus::Address::create().unwrap();
    let path = address.file("map");
    let told = || as_kept(&known);
    assert!(bus::attach_map(&address, Some(&mut told())).is_err_and(|error| error.is_missing()));
    bus::freeze_map(&address, &known).unwrap();
    let mut attached = told();
    bus::attach_map(&address, Some(&mut attached)).unwrap();
    assert_eq!(attached.map(), known.map());
    bus::attach_map(&address, None).unwrap();
    assert_eq!(std::os::unix::fs::MetadataExt::mode(&std::fs::metadata(&path).unwrap()) & 0o777, 0o400);
    let whole = std::fs::read(&path).unwrap();
    for (bytes, cause) in [
        ([&whole[..200], &[whole[200] ^ 1], &whole[201..]].concat(), "its checksum does not fit"),
        (whole[..whole.len() - 8].to_vec(), "its length does not fit its header"),
        (Map::build(&[], true, None).unwrap().bytes().to_vec(), "it is not the map of this scenario"),
        (Vec::new(), "it is empty"),
    ] {
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, bytes).unwrap();
        let error = bus::attach_map(&address, Some(&mut told())).unwrap_err();
        assert!(error.to_string().contains(cause), "{error}");
    }
    bus::clean::sweep(&address);
}

/// What is read of a scenario that was kept: without the walls.
fn as_kept(map: &MapRef) -> MapRef {
    protocol::codec::decode(&protocol::codec::encode(map).unwrap()).unwrap()
}
