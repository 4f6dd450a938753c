use super::*;
use crate::planner::Obstacle;
use crate::testing::{LIMITS, input, neighbor};
use geometry::Capsule;
use model::Limits;
use proptest::prelude::*;

const IDENTITY: Identity = Identity { seed: 1, robot: 0, incarnation: 0 };

/// A robot that comes from `at` with this wish, has said so a tick ago, and is where it said that it would be.
fn robot(id: u32, at: [f64; 2], wish: [f64; 2]) -> Neighbor {
    let (wish, dt_s) = (Vector2::from(wish), 0.1);
    Neighbor {
        position: Point2::from(at) - wish * dt_s,
        velocity: wish,
        age_s: dt_s,
        next: Some(at.into()),
        intent: Some(Intent { wish, left_m: 9.0, rank: 0.5, corner: None, slow: 0.0, lag: 0.0, yields: false }),
        ..neighbor(id, at)
    }
}

/// What the robot in the origin does that heads along +x, in the second of two ticks.
fn planned(neighbors: &[Neighbor], obstacles: &[Obstacle], allowed: &[HalfPlane]) -> (Vector2<f64>, Intent) {
    let mut planner = Lanes::new(Params::default(), IDENTITY);
    let limits = Limits { speed_mps_max: 1.0, ..LIMITS };
    let first = PlanInput { kind: BodyKind::Point, limits, ..input() };
    planner.plan(&PlanInput { position: Point2::new(-0.1, 0.0), ..first });
    let plan = planner.plan(&PlanInput { tick: 1, velocity: Vector2::x(), neighbors, obstacles, allowed, ..first });
    let Drive::Velocity(velocity) = plan.drive else { panic!("a point has a velocity") };
    (velocity, plan.intent.expect("it says what it is about"))
}

#[test]
fn alone_it_goes_straight_and_says_so() {
    let (velocity, intent) = planned(&[], &[], &[]);
    assert_eq!((velocity, intent.wish), (Vector2::x(), Vector2::x()));
    assert_eq!((intent.left_m, intent.corner), (9.0, None));
}

#[test]
fn it_turns_right_by_no_more_than_passes() {
    let turn = |x: f64| {
        let (velocity, intent) = planned(&[robot(1, [x, 0.0], [-1.0, 0.0])], &[], &[]);
        assert_eq!(intent.wish, Vector2::x(), "the wish is that of a robot that is alone");
        -velocity.y.atan2(velocity.x)
    };
    // The relative wish has to pass at 1.1 times the sum of the radii.
    assert!((turn(4.0) - (0.44f64 / 4.0).asin()).abs() < 1e-9, "{}", turn(4.0));
    assert!(turn(2.0) > turn(4.0));
    // To the side, or behind it, nothing is in the way.
    assert_eq!(
        planned(&[robot(1, [4.0, 3.0], [-1.0, 0.0]), robot(2, [-1.0, 0.0], [1.0, 0.0])], &[], &[]).0,
        Vector2::x()
    );
}

#[test]
fn the_outermost_makes_room_for_those_beside_it() {
    // Nothing is in its own way, but the one at its left has to pass an oncoming robot on the right.
    let comes = robot(1, [4.0, 0.7], [-1.0, 0.0]);
    let (alone, _) = planned(&[comes], &[], &[]);
    assert_eq!(alone, Vector2::x());
    let (beside, _) = planned(&[comes, robot(2, [0.0, 0.6], [1.0, 0.0])], &[], &[]);
    assert!(beside.y < -0.05, "{beside}");
    // One at its right needs no room on this side, one that is far away has enough, one that has arrived stays.
    let (right, far) = (robot(2, [0.0, -0.6], [1.0, 0.0]), robot(2, [0.0, 1.0], [1.0, 0.0]));
    let parked = Neighbor { arrived: true, ..robot(2, [0.0, 0.6], [1.0, 0.0]) };
    for other in [right, far, parked] {
        assert_eq!(planned(&[robot(1, [4.0, 1.1], [-1.0, 0.0]), other], &[], &[]).0, Vector2::x(), "{other:?}");
    }
}

#[test]
fn walls_count_where_it_turns_to() {
    let turn = |y: f64| {
        let wall = Obstacle { id: 0, shape: Capsule::disc([0.0, y].into(), 0.01), velocity: Vector2::zeros() };
        let mut planner = Lanes::new(Params::default(), IDENTITY);
        planner.see(&PlanInput { obstacles: &[wall], ..input() });
        planner.others = vec![other(&robot(1, [0.5, 0.0], [-1.0, 0.0]), 0.1)];
        planner.common_turn(&input(), Vector2::x() * input().limits.speed_mps_max, 9.0, None)
    };
    // Close up it would have to turn further than robots do in the open. Beside a wall it keeps less from the other one, and is
    // turned as far as it takes.
    assert_eq!(turn(0.6), 32f64.to_radians());
    assert!((turn(-0.6) - (0.43f64 / 0.5).asin()).abs() < 1e-9, "{}", turn(-0.6));
}

#[test]
fn rounding_stops_no_robot_that_slides_along_a_wall() {
    for degrees in 0..360 {
        let angle = f64::from(degrees).to_radians();
        let wall = HalfPlane::below(Vector2::new(angle.cos(), angle.sin()), 0.0);
        let opposite = HalfPlane { direction: -wall.direction, ..wall };
        let along = Rotation2::new(angle) * Vector2::new(0.0, 0.7);
        assert_eq!(kept_share(&[wall, opposite], along), 1.0, "{degrees}");
        assert_eq!(kept_share(&[wall], along + Rotation2::new(angle) * Vector2::x() * 1e-9), 0.0, "{degrees}");
    }
}

/// A unicycle at the origin that heads along +x and wants to.
fn unicycle() -> PlanInput<'static> {
    PlanInput {
        kind: BodyKind::Unicycle,
        limits: Limits { speed_mps_max: 1.0, turn_radps_max: 0.3, ..LIMITS },
        ..input()
    }
}

fn turned(velocity: Vector2<f64>, wanted: Vector2<f64>, planes: &[HalfPlane]) -> (f64, f64) {
    let mut planner = Lanes::new(Params::default(), IDENTITY);
    planner.planes = planes.to_vec();
    let Drive::Twist { speed_mps, turn_radps } = planner.turn_towards(velocity, wanted, &unicycle()) else {
        panic!("a unicycle has a twist")
    };
    (speed_mps, turn_radps)
}

#[test]
fn a_body_that_has_to_turn_drives_on_meanwhile_as_far_as_all_allows() {
    let (ahead, back) = (Vector2::x(), Vector2::new(-0.1, 0.0));
    let slower = |most| [HalfPlane::below(Vector2::x(), most)];
    let (speed, turn) = turned(back, ahead, &slower(0.5));
    assert!(speed > 0.0 && speed < 0.5 && turn.abs() == 0.3, "{speed} {turn}");
    assert!(turned(back, ahead, &slower(0.2)).0 < speed);
    // Where nothing is to be had by it, it only turns.
    assert_eq!(turned(back, ahead, &slower(0.0)).0, 0.0);
    assert_eq!(turned(back, -ahead, &[]).0, 0.0);
    // Towards where it goes anyway nothing changes.
    assert_eq!(turned(ahead, ahead, &[]), (1.0, 0.0));
}

#[test]
fn what_a_body_needs_to_turn_is_no_loss_and_is_kept_clear() {
    let planned = |kind, turn_radps_max, neighbors: &[Neighbor], ticks: u64| {
        let mut planner = Lanes::new(Params::default(), IDENTITY);
        let limits = Limits { speed_mps_max: 1.0, turn_radps_max, ..LIMITS };
        let first = PlanInput { kind, limits, goal: Point2::new(-9.0, 0.0), ..input() };
        let plans = (0..ticks).map(|tick| planner.plan(&PlanInput { tick, neighbors, ..first }));
        let plan = plans.last().expect("there are some");
        (plan.intent.expect("it says what it is about").lag, plan.attractive + plan.repulsive)
    };
    // It stands and turns: for one that turns slowly that is less of a delay.
    let lag = |turn| planned(BodyKind::Unicycle, turn, &[], 20).0;
    assert!(lag(0.3) < 0.5 * lag(3.0) && lag(0.3) > 0.0, "{} {}", lag(0.3), lag(3.0));
    // One that has way is close and comes nearer on the same way: a unicycle keeps off farther than a point.
    let first = robot(1, [-0.02, 0.43], [-0.95, -0.1]);
    let first = Neighbor { intent: first.intent.map(|intent| Intent { left_m: 5.0, ..intent }), ..first };
    let aside = |kind| planned(kind, 1.0, &[first], 2).1.y;
    assert!(
        aside(BodyKind::Unicycle) < aside(BodyKind::Point) - 0.01,
        "{} {}",
        aside(BodyKind::Unicycle),
        aside(BodyKind::Point)
    );
}

#[test]
fn ranks_are_those_of_directions() {
    let planned_rank = |goal: [f64; 2]| {
        let mut planner = Lanes::new(Params::default(), IDENTITY);
        let plan = planner.plan(&PlanInput { kind: BodyKind::Point, goal: goal.into(), ..input() });
        plan.intent.expect("it says what it is about").rank
    };
    // Robots that set out in one direction have one rank, whatever the length of the way is.
    assert!((planned_rank([9.0, 0.3]) - planned_rank([2.0, 0.1])).abs() < 0.01);
    assert!(planned_rank([-9.0, 0.3]) > planned_rank([9.0, -0.3]) + 0.4);
}

#[test]
fn who_had_to_leave_its_goal_lets_others_go_first() {
    let said = |id, wish: [f64; 2], rank, lag| {
        let intent = Intent { wish: wish.into(), left_m: 5.0, rank, corner: None, slow: 0.0, lag, yields: false };
        Said { id, arrived: false, command: Vector2::zeros(), intent }
    };
    let (there, back) = ([1.0, 0.0], [-1.0, 0.0]);
    assert_eq!(has_way(&said(0, there, 0.3, 0.6), &said(1, back, 0.7, 0.6)), Some(false));
    assert_eq!(has_way(&said(0, there, 0.3, 0.6), &said(1, back, 0.7, 0.4)), None, "one of them gets on");
    // It has been at its goal: it waits as soon as the other one is stuck, and not before.
    assert_eq!(has_way(&said(0, there, 0.3, 0.6), &said(1, back, -0.3, 0.0)), Some(true));
    assert_eq!(has_way(&said(0, there, 0.3, 0.4), &said(1, back, -0.3, 0.9)), None);
}

#[test]
fn what_stands_at_its_goal_is_passed_on_the_shorter_side() {
    let parked = Neighbor { arrived: true, ..robot(1, [3.0, -0.2], [0.0, 0.0]) };
    let (velocity, _) = planned(&[parked], &[], &[]);
    assert!(velocity.y > 0.05, "{velocity}");
}

#[test]
fn who_has_arrived_makes_room() {
    let mut planner = Lanes::new(Params::default(), IDENTITY);
    let limits = Limits { speed_mps_max: 1.0, ..LIMITS };
    let goal = Point2::origin();
    let there = PlanInput { kind: BodyKind::Point, limits, goal, arrived: true, ..input() };
    planner.plan(&there);
    let comes = [robot(1, [-0.6, 0.0], [1.0, 0.0])];
    let plan = planner.plan(&PlanInput { tick: 1, neighbors: &comes, ..there });
    assert!(matches!(plan.drive, Drive::Velocity(velocity) if velocity.norm() > 0.1), "{plan:?}");
    let aside = [robot(1, [-0.6, 2.0], [1.0, 0.0])];
    let plan = planner.plan(&PlanInput { tick: 2, neighbors: &aside, ..there });
    assert_eq!(plan.drive, Drive::stop(BodyKind::Point));
}

#[test]
fn who_has_arrived_stays_for_who_passes() {
    // Its wish leads through this place, its course aside; it gets on, or it has been hindered.
    let passes = |lag: f32| {
        let course = Vector2::new(0.6, 0.8);
        let it = robot(1, [-0.6, 0.0], [1.0, 0.0]);
        let intent = Intent { lag, ..it.intent.expect("it tells") };
        Neighbor { position: it.next.expect("it tells") - course * 0.1, velocity: course, intent: Some(intent), ..it }
    };
    let stays = |lag: f32| {
        let mut planner = Lanes::new(Params::default(), IDENTITY);
        let limits = Limits { speed_mps_max: 1.0, ..LIMITS };
        let there = PlanInput { kind: BodyKind::Point, limits, goal: Point2::origin(), arrived: true, ..input() };
        planner.plan(&there);
        let comes = [passes(lag)];
        planner.plan(&PlanInput { tick: 1, neighbors: &comes, ..there }).drive == Drive::stop(BodyKind::Point)
    };
    assert!(stays(0.2));
    assert!(!stays(0.3));
}

#[test]
fn without_progress_it_goes_aside_for_a_while() {
    let mut planner = Lanes::new(Params::default(), IDENTITY);
    let limits = Limits { speed_mps_max: 1.0, ..LIMITS };
    // A wall that its map does not have.
    let wall = Capsule::segment([0.3, -9.0].into(), [0.3, 9.0].into());
    let obstacles = [Obstacle { id: 0, shape: wall, velocity: Vector2::zeros() }];
    let still = PlanInput { kind: BodyKind::Point, limits, obstacles: &obstacles, ..input() };
    let drives: Vec<Drive> = (0..100).map(|tick| planner.plan(&PlanInput { tick, ..still }).drive).collect();
    let other: Vec<usize> = (0..100).filter(|tick| drives[*tick] != drives[0]).collect();
    // 30 radii at full speed are 6 s, 8 radii are 1.6 s.
    assert_eq!(other, (61..77).collect::<Vec<_>>(), "{drives:?}");
}

fn said() -> impl Strategy<Value = Said> {
    let vector = || (-1.0..1.0f64, -1.0..1.0f64).prop_map(|(x, y)| Vector2::new(x, y));
    (vector(), vector(), 0u32..4, 0u32..4, any::<[bool; 2]>(), prop::array::uniform2(0.0..2.0f32)).prop_map(
        |(command, wish, left, rank, [arrived, yields], [slow, lag])| Said {
            id: 0,
            arrived,
            command,
            intent: Intent { wish, left_m: left.into(), rank: f64::from(rank) - 1.0, corner: None, slow, lag, yields },
        },
    )
}

proptest! {
    /// The rule is the same from both sides, ties included.
    #[test]
    fn one_has_way_and_the_other_has_not(a in said(), b in said()) {
        let (a, b) = (Said { id: 3, ..a }, Said { id: 5, ..b });
        prop_assert_eq!(has_way(&a, &b), has_way(&b, &a).map(|first| !first));
    }

    /// Whatever wish, walls and robots there are: it keeps to what the filter allows.
    #[test]
    fn it_plans_within_what_is_allowed(
        others in prop::collection::vec((0.45..1.5f64, 0.0..6.3f64, -1.0..1.0f64, -1.0..1.0f64), 0..8),
        walls in prop::collection::vec((0.25..0.6f64, 0.0..6.3f64), 0..3),
        bounds in prop::collection::vec((0.0..6.3f64, 0.0..1.0f64), 1..8)
    ) {
        let at = |(distance, angle): (f64, f64)| [distance * angle.cos(), distance * angle.sin()];
        let robots: Vec<Neighbor> = others.iter().enumerate()
            .map(|(id, (distance, angle, x, y))| robot(id as u32 + 1, at((*distance, *angle)), [*x, *y])).collect();
        let discs: Vec<Obstacle> = walls.iter().enumerate().map(|(id, place)| {
            Obstacle { id: id as u32, shape: Capsule::disc(at(*place).into(), 0.01), velocity: Vector2::zeros() }
        }).collect();
        let allowed: Vec<HalfPlane> = bounds.iter()
            .map(|(angle, bound)| HalfPlane::below(Vector2::new(angle.cos(), angle.sin()), *bound)).collect();
        let (velocity, _) = planned(&robots, &discs, &allowed);
        for plane in &allowed {
            prop_assert!(plane.excess(velocity) <= 4e-16, "{velocity} {plane:?} {}", plane.excess(velocity));
        }
    }

    /// Without a filter it still does not drive into what stands.
    #[test]
    fn it_drives_into_no_wall(walls in prop::collection::vec((0.25..0.6f64, 0.0..6.3f64), 1..4)) {
        let discs: Vec<Obstacle> = walls.iter().enumerate().map(|(id, (distance, angle))| {
            let at = Point2::new(distance * angle.cos(), distance * angle.sin());
            Obstacle { id: id as u32, shape: Capsule::disc(at, 0.01), velocity: Vector2::zeros() }
        }).collect();
        let (velocity, _) = planned(&[], &discs, &[]);
        for disc in &discs {
            prop_assert!(disc.shape.distance(Point2::from(velocity * 0.1)) >= 0.2 - 1e-9);
        }
    }
}
