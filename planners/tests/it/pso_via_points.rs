//! Via points by swarm: plans in pieces, and what a robot does around its plan.

use crate::inputs::{IDENTITY, LIMITS, Scene, disc, robot};
use geometry::spline::length;
use geometry::{ArmState, Capsule, Elbow};
use model::random::Stream;
use model::{BodyKind, Drive};
use nalgebra::{Point2, Vector2};
use shoal_planners::pso_via_points::field::Variant;
use shoal_planners::pso_via_points::planning::{Origin, Planning, Query};
use shoal_planners::pso_via_points::{Params, PsoViaPoints};
use shoal_planners::{Obstacle, Plan, PlanInput, Planner};

const DT_S: f64 = 0.05;

fn planner() -> PsoViaPoints {
    PsoViaPoints::new(Params::default(), Params::arm(), IDENTITY)
}

/// The five discs of the paper's first environment, as the specification has it.
fn five_discs() -> Vec<Obstacle> {
    let discs = [[2.6, 2.2, 0.5], [4.2, 4.8, 0.6], [5.6, 3.4, 0.5], [6.4, 6.6, 0.6], [3.0, 6.0, 0.5]];
    (0..).zip(discs).map(|(id, [x, y, radius])| disc(id, [x, y], radius)).collect()
}

fn query(obstacles: &[Obstacle]) -> Query<'_> {
    Query { start: [0.5, 0.5].into(), goal: [8.5, 8.0].into(), obstacles, radius_m: 0.0, arm: None }
}

/// Drives a scene until the robot is at its goal, or time is up; `change` sees every tick before it is planned.
fn drive(planner: &mut PsoViaPoints, scene: &mut Scene, ticks: u64, mut change: impl FnMut(u64, &mut Scene)) -> Run {
    let mut run = Run { arrived: None, clearance_m: f64::INFINITY, path: vec![scene.position] };
    for tick in 0..ticks {
        change(tick, scene);
        // Without a map: what is known is what is sensed.
        let Plan { drive, .. } = planner.plan(&PlanInput { map: &[], ..scene.input(tick, DT_S) });
        let Drive::Velocity(velocity) = drive.within(&LIMITS) else { panic!("a point gets a velocity: {drive:?}") };
        scene.position += velocity * DT_S;
        scene.velocity = velocity;
        run.path.push(scene.position);
        let obstacles = scene.obstacles.iter().map(|obstacle| obstacle.shape.distance(scene.position));
        let robots = scene.neighbors.iter().map(|other| (other.position - scene.position).norm() - other.radius_m);
        run.clearance_m = obstacles.chain(robots).map(|gap| gap - scene.radius_m).fold(run.clearance_m, f64::min);
        if (scene.goal - scene.position).norm() <= 0.1 {
            run.arrived = Some(tick);
            break;
        }
    }
    run
}

struct Run {
    arrived: Option<u64>,
    clearance_m: f64,
    path: Vec<Point2<f64>>,
}

#[test]
fn a_plan_in_pieces_is_the_plan() {
    let obstacles = five_discs();
    let query = query(&obstacles);
    let recipe = Params::default().recipe(0.1);
    let plan = |budget: i64| {
        let (mut planning, mut stream) = (Planning::default(), Stream::new(3, 0, 0, "pso"));
        planning.begin(&query);
        let mut pieces = 0;
        let mut overdrawn = 0;
        while planning.busy() {
            let mut left = budget;
            planning.advance(&recipe, &query, &mut stream, &mut left);
            overdrawn = overdrawn.min(left);
            pieces += 1;
        }
        let (path, origin) = planning.best().expect("there is a way");
        (path.to_vec(), origin, pieces, overdrawn)
    };
    let (whole, origin, pieces, _) = plan(1 << 60);
    assert_eq!((origin, pieces), (Origin::Swarm(Variant::Plain), 1));
    for budget in [2000, 100_000] {
        let (path, _, pieces, overdrawn) = plan(budget);
        assert_eq!(path, whole, "{budget}");
        assert!(pieces > 30, "{budget}: {pieces}");
        // What is begun is ended: one particle, and the check of one path.
        assert!(overdrawn >= -(200 * 7 + 1000 * 6), "{budget}: {overdrawn}");
    }
    assert!(length(&whole) < 11.2 && whole[0] == query.start && whole[whole.len() - 1] == query.goal);
}

#[test]
fn memory_is_kept_between_plans() {
    let obstacles = five_discs();
    let (recipe, query) = (Params::default().recipe(0.1), query(&obstacles));
    let mut planning = Planning::default();
    let mut paths = Vec::new();
    for _ in 0..2 {
        let (mut stream, mut budget) = (Stream::new(3, 0, 0, "pso"), i64::MAX);
        planning.begin(&query);
        planning.advance(&recipe, &query, &mut stream, &mut budget);
        paths.push(planning.best().expect("there is a way").0.to_vec());
    }
    assert_eq!(paths[0], paths[1]);
}

/// Potential fields come to rest before a wall; this method goes round it.
#[test]
fn a_wall_that_traps_the_field_is_passed() {
    let mut scene = Scene::new([0.0, 0.0], [6.0, 0.0]);
    let wall = Capsule::segment([3.0, -1.5].into(), [3.0, 1.5].into());
    scene.obstacles = vec![Obstacle { id: 0, shape: wall, velocity: Vector2::zeros() }];
    let run = drive(&mut planner(), &mut scene, 600, |_, _| {});
    assert!(run.arrived.is_some(), "ends at {}", scene.position);
    assert!(run.clearance_m > 0.03, "{}", run.clearance_m);
}

/// Nothing on the map, and a disc that shows up in the middle of the path: the robot goes round it.
#[test]
fn what_shows_up_on_the_path_is_avoided() {
    for kind in [0, 1] {
        let mut scene = Scene::new([0.0, 0.0], [8.0, 0.0]);
        let run = drive(&mut planner(), &mut scene, 600, |tick, scene| {
            if tick == 60 {
                let ahead = [scene.position.x + 1.5, 0.05];
                if kind == 0 {
                    scene.obstacles = vec![disc(7, ahead, 0.5)];
                } else {
                    scene.neighbors = vec![robot(7, ahead)];
                    scene.neighbors[0].arrived = true;
                }
            }
        });
        assert!(run.arrived.is_some_and(|tick| tick < 240), "{kind}: {:?} at {}", run.arrived, scene.position);
        assert!(run.clearance_m > 0.03, "{kind}: {}", run.clearance_m);
    }
}

/// A robot that stands in a gap without having said that it stays is taken for a disc after a while.
#[test]
fn a_silent_blocker_is_passed_after_a_while() {
    let mut scene = Scene::new([0.0, 0.0], [6.0, 0.0]);
    // A neighbour that stands in the middle of a corridor which is wide enough to pass at the margin, not for the
    // push of a robot that may move.
    let wall = |id, y: f64| Obstacle {
        id,
        shape: Capsule::segment([2.0, y].into(), [4.0, y].into()),
        velocity: Vector2::zeros(),
    };
    scene.obstacles = vec![wall(0, -0.85), wall(1, 0.85)];
    scene.neighbors = vec![robot(3, [3.0, -0.3])];
    let run = drive(&mut planner(), &mut scene, 1200, |_, _| {});
    assert!(run.arrived.is_some(), "ends at {}", scene.position);
    assert!(run.clearance_m > 0.0, "{}", run.clearance_m);
}

#[test]
fn a_goal_that_moves_is_followed() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.obstacles = vec![disc(0, [2.0, 0.1], 0.4)];
    let run = drive(&mut planner(), &mut scene, 600, |tick, scene| {
        if tick == 50 {
            scene.goal = [0.0, 4.0].into();
        } else if tick > 50 && tick < 100 {
            scene.goal.x += 0.01;
        }
    });
    assert!(run.arrived.is_some() && run.clearance_m > 0.03, "{:?} {}", run.arrived, run.clearance_m);
}

#[test]
fn an_arrived_robot_stays() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.arrived = true;
    scene.neighbors = vec![robot(1, [0.3, 0.0])];
    for kind in [BodyKind::Point, BodyKind::Unicycle, BodyKind::TwoLinkArm] {
        scene.kind = kind;
        let plan = planner().plan(&scene.input(0, DT_S));
        assert!(plan.stopped && plan.drive == Drive::stop(kind));
    }
}

/// A start in contact, as after a push, and a goal nearer to a wall than the margin.
#[test]
fn ends_that_are_too_near_are_no_reason_to_stand() {
    let mut scene = Scene::new([0.0, 0.0], [4.0, 0.0]);
    scene.obstacles = vec![disc(0, [-0.3, 0.0], 0.15), disc(1, [4.0, 0.55], 0.3), disc(2, [2.0, 0.0], 0.3)];
    let mut contact = f64::NEG_INFINITY;
    let run = drive(&mut planner(), &mut scene, 400, |tick, scene| {
        if tick > 10 {
            let gaps = scene.obstacles.iter().map(|disc| scene.radius_m - disc.shape.distance(scene.position));
            contact = gaps.fold(contact, f64::max);
        }
    });
    assert!(run.arrived.is_some() && contact < 0.0, "{:?} {contact}", run.arrived);
    let every: Vec<_> = run.path.iter().step_by(10).map(|p| format!("({:.2}, {:.2})", p.x, p.y)).collect();
    assert!(length(&run.path) < 5.0, "{every:?}");
}

fn arm_scene(elbow: Elbow, discs: &[[f64; 3]]) -> (Scene, ArmState) {
    let mut scene = Scene::new([6.0, 0.5], [-3.5, 5.0]);
    scene.kind = BodyKind::TwoLinkArm;
    scene.radius_m = 0.0;
    scene.obstacles = (0..).zip(discs).map(|(id, [x, y, radius])| disc(id, [*x, *y], *radius)).collect();
    let geometry = crate::arm::papers();
    let joints_rad = geometry.inverse(scene.position, elbow).expect("in reach");
    (scene, ArmState { geometry, joints_rad })
}

fn drive_arm(
    scene: &mut Scene,
    mut arm: ArmState,
    ticks: u64,
    mut change: impl FnMut(u64, &mut Scene),
) -> (ArmState, f64) {
    let mut planner = planner();
    let mut clearance = f64::INFINITY;
    let elbow = arm.elbow();
    for tick in 0..ticks {
        change(tick, scene);
        scene.position = arm.tip();
        let mut input = scene.input(tick, DT_S);
        input.arm = Some(arm);
        let Drive::Joints { rate_radps } = planner.plan(&input).drive else { panic!("an arm gets joint rates") };
        assert!(arm.tip_velocity(rate_radps).norm() <= LIMITS.speed_mps_max * (1.0 + 1e-9));
        arm = arm.moved(rate_radps, DT_S);
        assert!(arm.geometry.within_limits(arm.joints_rad, 0.0) && arm.elbow() == elbow, "{:?}", arm.joints_rad);
        clearance = clearance.min(arm.geometry.clearance(arm.joints_rad, scene.obstacles.iter().map(|o| o.shape)));
        if (arm.tip() - scene.goal).norm() <= 0.1 {
            break;
        }
    }
    (arm, clearance)
}

/// The way of the first sheet is free in it; in the second the stop of joint 1 lies on it, and the arm goes the other
/// way round.
#[test]
fn an_arm_keeps_its_sheet_and_its_stops() {
    for (elbow, ticks) in [(Elbow::Up, 400), (Elbow::Down, 1000)] {
        let (mut scene, arm) = arm_scene(elbow, &[[4.8, 3.9, 0.4], [-0.5, 6.2, 0.4]]);
        let (end, clearance) = drive_arm(&mut scene, arm, ticks, |_, _| {});
        assert!((end.tip() - scene.goal).norm() <= 0.1, "{elbow:?} ends at {}", end.tip());
        assert!(clearance > 0.0, "{elbow:?}: {clearance}");
    }
}

/// Where the sheet has no way that the joints can go, the arm stays where it is.
#[test]
fn an_arm_without_a_way_stays() {
    let (mut scene, arm) = arm_scene(Elbow::Up, &[[5.4, 3.8, 0.3], [1.0, 5.0, 0.3], [-2.2, 6.0, 0.3]]);
    let (end, _) = drive_arm(&mut scene, arm, 300, |_, _| {});
    assert_eq!(end.joints_rad, arm.joints_rad);
}

/// A body in the way of the links stops the arm before it touches; when it has gone, the arm goes on.
#[test]
fn an_arm_waits_for_what_moves() {
    let (mut scene, arm) = arm_scene(Elbow::Up, &[]);
    let blocker = Capsule::disc([2.6, 4.5].into(), 0.2);
    let mut nearest = f64::INFINITY;
    let mut last = None;
    let (end, _) = drive_arm(&mut scene, arm, 800, |tick, scene| {
        if tick == 0 {
            let mut other = robot(1, [2.6, 4.5]);
            other.velocity = Vector2::new(0.3, 0.0);
            scene.neighbors = vec![other];
        } else if tick == 300 {
            scene.neighbors.clear();
        }
        if tick < 300 {
            nearest = nearest.min(blocker.distance(scene.position));
            last = Some(scene.position);
        }
    });
    assert!(nearest > 0.0 && last.is_some_and(|tip: Point2<f64>| tip.x > 0.0), "{nearest} {last:?}");
    assert!((end.tip() - scene.goal).norm() <= 0.1, "ends at {}", end.tip());
}
