use super::*;
use geometry::{Capsule, Polygon};
use nalgebra::Vector2;
use proptest::prelude::*;

fn block(id: u32, corners: &[[f64; 2]]) -> Vec<Obstacle> {
    let polygon = Polygon { corners: corners.iter().map(|at| (*at).into()).collect() };
    polygon.edges().map(|shape| Obstacle { id, shape, velocity: Vector2::zeros() }).collect()
}

fn disc(id: u32, at: [f64; 2], radius: f64) -> Obstacle {
    Obstacle { id, shape: Capsule::disc(at.into(), radius), velocity: Vector2::zeros() }
}

/// Follows a way in steps, and says how long it is; the disc of this radius keeps clear of everything.
fn driven_m(map: &[Obstacle], radius_m: f64, from: [f64; 2], goal: [f64; 2]) -> Option<f64> {
    driven_with_toll_m(map, radius_m, from, goal, 0.0)
}

fn driven_with_toll_m(map: &[Obstacle], radius_m: f64, from: [f64; 2], goal: [f64; 2], toll_m: f64) -> Option<f64> {
    const STEP_M: f64 = 0.05;
    let (mut at, goal) = (Point2::from(from), Point2::from(goal));
    let mut way = Way::new(map, radius_m, at, goal, toll_m);
    let promised_m = way.ahead(at)?.left_m;
    let mut length = 0.0;
    while at != goal {
        let ahead = way.ahead(at).expect("there was a way");
        let step = (ahead.at - at).cap_magnitude(STEP_M);
        at += step;
        length += step.norm();
        if (ahead.at - at).norm() < 1e-12 && ahead.is_goal {
            at = goal;
        }
        for obstacle in map {
            assert!(obstacle.shape.distance(at) >= radius_m * (1.0 - 1e-9), "{at} touches {obstacle:?}");
        }
        assert!(length < promised_m + 1.0, "it goes round and round");
    }
    assert!((length - promised_m).abs() < 1e-6 || length < promised_m, "{length} is more than {promised_m}");
    Some(length)
}

#[test]
fn without_anything_in_the_way_it_is_straight() {
    let aside = [disc(0, [0.0, 3.0], 1.0)];
    assert_eq!(driven_m(&aside, 0.2, [-2.0, 0.0], [2.0, 0.0]).map(|m| (m * 1e9).round()), Some(4e9));
}

#[test]
fn round_a_disc_it_is_little_longer_than_tangents_and_arc() {
    let map = [disc(0, [0.0, 0.0], 0.8)];
    let keeps = 0.8 + 0.2 * 1.03;
    let (tangent, angle) = ((9.0f64 - keeps * keeps).sqrt(), std::f64::consts::PI - 2.0 * (keeps / 3.0f64).acos());
    let exact = 2.0 * tangent + keeps * angle;
    let found = driven_m(&map, 0.2, [-3.0, 0.0], [3.0, 0.0]).unwrap();
    assert!(found >= exact - 1e-9 && found < exact * 1.01, "{found} {exact}");
}

#[test]
fn out_of_a_trap_and_through_a_door() {
    let mut trap =
        block(0, &[[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.8], [0.8, 0.8], [0.8, -0.8], [0.0, -0.8]]);
    let found = driven_m(&trap, 0.2, [0.4, 0.0], [2.0, 0.0]).unwrap();
    assert!((4.0..4.3).contains(&found), "{found}");
    // A door that is 2 % wider than the body: narrower than the usual margin asks for.
    trap = block(0, &[[0.0, 0.204], [0.2, 0.204], [0.2, 9.0], [0.0, 9.0]]);
    trap.extend(block(1, &[[0.0, -9.0], [0.2, -9.0], [0.2, -0.204], [0.0, -0.204]]));
    for (id, y) in [(2, 8.0), (3, -8.0)] {
        trap.extend(block(id, &[[-9.0, y], [9.0, y], [9.0, y + 0.1], [-9.0, y + 0.1]]));
    }
    let found = driven_m(&trap, 0.2, [-2.0, 1.0], [2.0, 1.0]).unwrap();
    assert!((4.5..4.6).contains(&found), "{found}");
}

/// Between two round pillars there is little room for the corners of their outlines, wherever these happen to lie.
#[test]
fn through_a_narrow_gap_between_discs_in_any_direction() {
    for turn in [0.0, 0.1, 0.2, 0.3, 0.39, 0.5, 0.7] {
        let turned = |x: f64, y: f64| -> [f64; 2] { (nalgebra::Rotation2::new(turn) * Point2::new(x, y)).into() };
        // 1 cm wider than the body and its margin.
        let map = [disc(0, turned(0.0, 0.811), 0.6), disc(1, turned(0.0, -0.811), 0.6)];
        let found = driven_m(&map, 0.2, turned(-2.0, 0.0), turned(2.0, 0.05)).unwrap();
        assert!((4.0..4.01).contains(&found), "{turn}: {found}");
        let found = driven_m(&map, 0.2, turned(-2.0, 0.4), turned(2.0, 0.4)).unwrap();
        assert!((4.05..4.2).contains(&found), "{turn}: {found}");
    }
}

#[test]
fn there_is_no_way_out_of_a_closed_room() {
    let sides = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let wall = |index: usize| Capsule::segment(sides[index].into(), sides[(index + 1) % 4].into());
    let room: Vec<Obstacle> =
        (0..4).map(|index| Obstacle { id: index as u32, shape: wall(index), velocity: Vector2::zeros() }).collect();
    assert_eq!(driven_m(&room, 0.2, [0.0, 0.0], [3.0, 0.0]), None);
    assert!(driven_m(&room, 0.2, [-0.5, 0.0], [0.5, 0.3]).is_some());
}

#[test]
fn who_stands_too_near_to_a_wall_finds_a_way_all_the_same() {
    let map = block(0, &[[0.0, -1.0], [1.0, -1.0], [1.0, 1.0], [0.0, 1.0]]);
    let mut way = Way::new(&map, 0.2, [-0.2001, 0.0].into(), [2.0, 0.0].into(), 0.0);
    let ahead = way.ahead([-0.2001, 0.0].into()).unwrap();
    assert!(ahead.at.y.abs() > 1.0 && !ahead.is_goal && ahead.left_m < 4.2, "{ahead:?}");
}

#[test]
fn who_was_pushed_against_the_corner_of_a_door_does_not_go_back() {
    let map = [
        block(0, &[[-0.3, 0.3], [0.3, 0.3], [0.3, 6.0], [-0.3, 6.0]]),
        block(1, &[[-0.3, -6.0], [0.3, -6.0], [0.3, -0.3], [-0.3, -0.3]]),
    ]
    .concat();
    // Nearer to the jamb than ways are, all round its corner.
    for degrees in 91..112 {
        let angle = f64::from(degrees).to_radians();
        let at = Point2::new(-0.3, -0.3) + Vector2::new(angle.cos(), angle.sin()) * 0.2027;
        let mut way = Way::new(&map, 0.2, Point2::new(-2.0, 0.0), Point2::new(3.0, -0.4), 0.0);
        let ahead = way.ahead(at).expect("there is a way");
        assert!(ahead.at.x > at.x, "{degrees}: from {at} to {}", ahead.at);
        assert!(ahead.left_m < 3.6, "{}", ahead.left_m);
    }
}

#[test]
fn with_a_toll_obstacles_are_on_the_left_unless_that_is_much_longer() {
    // Heading along +x past a disc that is a little to the right: on its left the way is shorter.
    let map = [disc(0, [0.0, -0.2], 0.8)];
    let first = |toll_m: f64| {
        let mut way = Way::new(&map, 0.2, [-3.0, 0.0].into(), [3.0, 0.0].into(), toll_m);
        way.ahead([-3.0, 0.0].into()).expect("there is a way")
    };
    let (short, long) = (first(0.0), first(0.8));
    assert!(short.at.y > 0.0 && long.at.y < 0.0, "{short:?} {long:?}");
    let more_m = long.left_m - short.left_m;
    assert!((0.1..0.5).contains(&more_m), "{more_m}: the length has no toll in it");
    assert_eq!(first(0.9 * more_m), short);
    assert_eq!(first(1.1 * more_m), long);
}

/// There is one way through a door, and no crossing from one jamb to the other pays.
#[test]
fn with_a_toll_the_way_through_a_door_is_the_same() {
    let mut map = block(0, &[[0.0, 0.5], [0.2, 0.5], [0.2, 90.0], [0.0, 90.0]]);
    map.extend(block(1, &[[0.0, -90.0], [0.2, -90.0], [0.2, -0.5], [0.0, -0.5]]));
    for y in [-3.0, -1.0, -0.4, 0.0, 0.4, 1.0, 3.0] {
        for goal in [[2.0, y], [2.0, -y], [1.0, 2.0], [1.0, -2.0]] {
            let driven = |toll_m| driven_with_toll_m(&map, 0.2, [-1.0, y], goal, toll_m).unwrap();
            assert_eq!(driven(0.0), driven(0.8), "{y} {goal:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, max_global_rejects: 9999, ..ProptestConfig::default() })]
    /// No way is shorter than the straight line, none through an obstacle, and turning the world changes nothing.
    #[test]
    fn ways_past_random_blocks(
        places in prop::collection::vec((-3.0..3.0f64, -3.0..3.0f64, 0.2..0.6f64, 0.0..1.5f64, any::<bool>()), 1..9),
        turn in 0.0..6.0f64, eighths in 0..8u32
    ) {
        let made = |turned: f64| -> Vec<Obstacle> {
            let rotate = nalgebra::Rotation2::new(turned);
            let mut map = Vec::new();
            for (id, (x, y, size, yaw, round)) in places.iter().enumerate() {
                let at = rotate * Point2::new(*x, *y);
                if *round {
                    map.push(disc(id as u32, at.into(), *size));
                } else {
                    let corner = |k: u32| at + nalgebra::Rotation2::new(turned + yaw + f64::from(k) * std::f64::consts::FRAC_PI_2) * Vector2::new(*size, 0.0);
                    let corners: Vec<[f64; 2]> = (0..4).map(|k| corner(k).into()).collect();
                    map.extend(block(id as u32, &corners));
                }
            }
            map
        };
        // Whether a gap counts that is as wide as the body and its margin is for rounding to say.
        let pieces = made(0.0);
        let as_wide_as_the_body = pieces.iter().enumerate().any(|(index, a)| pieces[index + 1..].iter().any(|b| {
            let apart_m = geometry::segment_distance(a.shape.a, a.shape.b, b.shape.a, b.shape.b);
            a.id != b.id && (0.395..0.42).contains(&(apart_m - a.shape.radius - b.shape.radius))
        }));
        prop_assume!(!as_wide_as_the_body);
        // The corners of discs do not turn with the world, but for whole eighths.
        let turn = if places.iter().any(|place| place.4) { f64::from(eighths) * std::f64::consts::FRAC_PI_4 } else { turn };
        let ends = |turned: f64| {
            let rotate = nalgebra::Rotation2::new(turned);
            [[-4.5, 0.0], [4.5, 0.3]].map(|at: [f64; 2]| -> [f64; 2] { (rotate * Point2::from(at)).into() })
        };
        let [from, goal] = ends(0.0);
        let straight = driven_m(&made(0.0), 0.2, from, goal).unwrap();
        prop_assert!(straight >= 9.0);
        // A toll makes the way longer by no more than what it saves: a toll for each obstacle, and for each turn away from one.
        let right = driven_with_toll_m(&made(0.0), 0.2, from, goal, 0.5).unwrap();
        let most = straight + 0.5 * places.len() as f64;
        prop_assert!(right >= 0.99 * straight && right <= most + 1e-9, "{straight} {right}");
        let [from, goal] = ends(turn);
        let turned = driven_m(&made(turn), 0.2, from, goal).unwrap();
        prop_assert!((turned / straight - 1.0).abs() < 1e-6, "{straight} {turned}");
    }
}

fn exploring(way: &mut Option<Way>, sketch: &mut Sketch, seen: &[Obstacle], from: [f64; 2]) -> Ahead {
    let input = PlanInput { position: from.into(), obstacles: seen, ..crate::testing::input() };
    Way::explore(way, sketch, &input)
}

fn standing(id: u32, shape: Capsule) -> Obstacle {
    Obstacle { id, shape, velocity: Vector2::zeros() }
}

#[test]
fn who_has_no_map_goes_round_what_it_has_seen() {
    let (mut way, mut sketch) = (None, Sketch::default());
    let straight = exploring(&mut way, &mut sketch, &[], [0.0, 0.0]);
    assert_eq!((straight.at, straight.is_goal, straight.left_m), (Point2::new(9.0, 0.0), true, 9.0));
    let wall = standing(3, Capsule::segment([4.0, -1.0].into(), [4.0, 2.0].into()));
    let round = exploring(&mut way, &mut sketch, &[wall], [0.0, 0.0]);
    assert!(!round.is_goal && round.at.y < -1.1 && round.left_m > 9.1, "{round:?}");
    // It is remembered when it is out of sight.
    assert_eq!(exploring(&mut way, &mut sketch, &[], [0.0, 0.0]), round);
    // More of it is seen: the other way is shorter.
    let rest = standing(3, Capsule::segment([4.0, -3.0].into(), [4.0, -1.0].into()));
    let round = exploring(&mut way, &mut sketch, &[rest], [0.0, 0.0]);
    assert!(round.at.y > 2.1, "{round:?}");
}

#[test]
fn what_turns_out_to_move_is_no_wall() {
    let disc = |x: f64| Capsule::disc([x, 0.0].into(), 0.5);
    let (mut way, mut sketch) = (None, Sketch::default());
    assert!(!exploring(&mut way, &mut sketch, &[standing(3, disc(4.0))], [0.0, 0.0]).is_goal);
    let moves = Obstacle { velocity: Vector2::x(), ..standing(3, disc(4.1)) };
    assert!(exploring(&mut way, &mut sketch, &[moves], [0.0, 0.0]).is_goal);
    // It stands again, elsewhere, and once more: only the last place counts.
    assert!(!exploring(&mut way, &mut sketch, &[standing(3, disc(5.0))], [0.0, 0.0]).is_goal);
    assert!(!exploring(&mut way, &mut sketch, &[standing(3, disc(6.0))], [0.0, 0.0]).is_goal);
    assert_eq!(sketch.pieces, [standing(3, disc(6.0))]);
}

#[test]
fn a_robot_that_is_heard_later_is_no_wall() {
    let (mut way, mut sketch) = (None, Sketch::default());
    let body = standing(3, Capsule::disc([4.0, 0.0].into(), 0.2));
    assert!(!exploring(&mut way, &mut sketch, &[body], [0.0, 0.0]).is_goal);
    let robot = crate::testing::neighbor(1, [4.1, 0.0]);
    let input = PlanInput { neighbors: &[robot], ..crate::testing::input() };
    assert!(Way::explore(&mut way, &mut sketch, &input).is_goal);
}

#[test]
fn who_has_seen_itself_shut_in_begins_anew() {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(Point2::from);
    let walls = [0, 1, 2, 3]
        .map(|side| standing(side, Capsule::segment(corners[side as usize], corners[(side as usize + 1) % 4])));
    let (mut way, mut sketch) = (None, Sketch::default());
    let ahead = exploring(&mut way, &mut sketch, &walls, [0.0, 0.0]);
    assert!(ahead.is_goal && sketch.pieces.is_empty());
}
