//! The stepper does what its rules say, in that order.

use model::{BodyKind, Drive, Scenario};
use nalgebra::{Point2, Vector2};
use planners::{Neighbor, Obstacle, Plan, PlanInput, Planner};
use scenarios::Draft;
use shoal_reproduce::stepper::{Arrival, Rules, Stepper};
use std::f64::consts::FRAC_PI_2;

const DT_S: f64 = 0.5;

/// A planner that always asks for the same, and remembers what it was given.
struct Steady {
    drive: Drive,
    heard: Vec<Vec<Neighbor>>,
    seen: Vec<Vec<Obstacle>>,
    arrived: Vec<bool>,
}

impl Planner for Steady {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        self.heard.push(input.neighbors.to_vec());
        self.seen.push(input.obstacles.to_vec());
        self.arrived.push(input.arrived);
        Plan::only(self.drive)
    }
}

fn steady(drive: Drive) -> Steady {
    Steady { drive, heard: Vec::new(), seen: Vec::new(), arrived: Vec::new() }
}

fn ahead(speed_mps: f64) -> Drive {
    Drive::Velocity(Vector2::new(speed_mps, 0.0))
}

/// Robots that start one above the other, and go to x = 2 m.
fn scenario(robots: usize, obstacles: Vec<Draft>) -> Scenario {
    let robot = |i: usize| {
        let y_m = i as f64;
        Draft::new().with("id", format!("r{i}")).with("start_m", [0.0, y_m]).with("goal_m", [2.0, y_m])
    };
    let robots: Vec<Draft> = (0..robots).map(robot).collect();
    Draft::new().with("robot", robots).with("obstacle", obstacles).scenario("stepper").unwrap()
}

fn run(scenario: &Scenario, rules: Rules, drives: &[Drive], ticks: usize) -> Stepper<Steady> {
    let mut stepper = Stepper::with_planners(scenario, rules, drives.iter().copied().map(steady).collect());
    (0..ticks).for_each(|_| stepper.step());
    stepper
}

/// Where the second robot hears that the first one is, tick by tick, and how old it takes that for.
fn heard(rules: Rules) -> Vec<(f64, f64)> {
    let stepper = run(&scenario(2, Vec::new()), rules, &[ahead(1.0), ahead(0.0)], 4);
    stepper.planners[1].heard.iter().map(|heard| (heard[0].position.x, heard[0].age_s)).collect()
}

#[test]
fn robots_hear_where_others_are_now_or_have_just_moved_to_or_were() {
    let snapshot = Rules::snapshot(DT_S);
    let fresh = |positions: [f64; 4]| positions.map(|x| (x, 0.0)).to_vec();
    assert_eq!(heard(snapshot), fresh([0.0, 0.5, 1.0, 1.5]));
    assert_eq!(heard(Rules { in_turn: true, ..snapshot }), fresh([0.5, 1.0, 1.5, 2.0]));
    assert_eq!(heard(Rules { delay_ticks: 2, ..snapshot }), fresh([0.0, 0.0, 0.0, 0.5]));
    assert_eq!(heard(Rules::as_in_a_fleet(DT_S)), [0.0, 0.0, 0.5, 1.0].map(|x| (x, DT_S)));
}

#[test]
fn velocities_are_told_only_where_they_are_known() {
    for (velocities, expected) in [(true, 1.0), (false, 0.0)] {
        let rules = Rules { velocities, ..Rules::snapshot(DT_S) };
        let stepper = run(&scenario(2, Vec::new()), rules, &[ahead(1.0), ahead(0.0)], 2);
        assert_eq!(stepper.planners[1].heard[1][0].velocity.x, expected);
    }
}

/// A quarter turn and a metre in one tick: along the new heading, along the old one, or half of each.
#[test]
fn a_unicycle_turns_before_or_after_it_drives() {
    let mut scenario = scenario(1, Vec::new());
    scenario.robots[0].kind = BodyKind::Unicycle;
    let turn = [Drive::Twist { speed_mps: 1.0 / DT_S, turn_radps: FRAC_PI_2 / DT_S }];
    let end = |turns_first: bool, substeps: u32| {
        let rules = Rules { turns_first, substeps, ..Rules::snapshot(DT_S) };
        let body = run(&scenario, rules, &turn, 1).bodies()[0];
        assert!((body.yaw_rad - FRAC_PI_2).abs() < 1e-12);
        body.position
    };
    let near = |a: Point2<f64>, [x, y]: [f64; 2]| assert!((a - Point2::new(x, y)).norm() < 1e-12, "{a}");
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    near(end(true, 1), [0.0, 1.0]);
    near(end(false, 1), [1.0, 0.0]);
    near(end(true, 2), [0.5 * diagonal, 0.5 * diagonal + 0.5]);
    near(end(false, 2), [0.5 * diagonal + 0.5, 0.5 * diagonal]);
}

/// It is within 0.1 m of x = 2 m after four ticks.
#[test]
fn arrivals_are_seen_at_once_or_noticed_a_tick_late() {
    let scenario = scenario(1, Vec::new());
    let under = |arrival: Arrival| {
        let rules = Rules { arrival, ..Rules::snapshot(DT_S) };
        run(&scenario, rules, &[ahead(1.0)], 6)
    };
    let seen = under(Arrival::Within { speed_mps: f64::INFINITY });
    assert_eq!((seen.arrival_ticks[0], seen.arrival_s(0)), (Some(4), Some(2.0)));
    assert_eq!(seen.planners[0].arrived, [false, false, false, false, true, true], "it goes on planning");
    assert_eq!(seen.end(0).x, 3.0);

    let too_fast = under(Arrival::Within { speed_mps: 0.5 });
    assert_eq!(too_fast.arrival_ticks[0], None);

    let noticed = under(Arrival::Noticed);
    assert_eq!(noticed.arrival_ticks[0], Some(6), "the tick that began there is the fifth");
    assert_eq!(noticed.planners[0].arrived.len(), 5, "it is not asked any more");
    assert!(noticed.bodies()[0].stopped && noticed.end(0).x == 2.5);
}

#[test]
fn obstacles_move_by_the_velocity_that_they_are_seen_with() {
    let motion = Draft::new().with("kind", "orbit").with("center_m", [5.0, 5.0]).with("omega_radps", 0.4);
    let disc = Draft::new().with("shape", "disc").with("center_m", [6.0, 5.0]).with("radius_m", 0.3);
    let scenario = scenario(1, vec![disc.with("motion", motion)]);
    let stepper = run(&scenario, Rules::snapshot(DT_S), &[ahead(0.0)], 5);
    let seen: Vec<Obstacle> = stepper.planners[0].seen.iter().map(|seen| seen[0]).collect();
    assert_eq!(seen[0].shape.a, Point2::new(6.0, 5.0));
    for pair in seen.windows(2) {
        let next = pair[0].shape.a + pair[0].velocity * DT_S;
        assert!((next - pair[1].shape.a).norm() < 1e-12 && pair[0].velocity.norm() > 0.3);
    }
}

#[test]
fn the_least_distances_are_those_after_a_move() {
    let disc = Draft::new().with("shape", "disc").with("center_m", [1.5, -0.6]).with("radius_m", 0.2);
    let stepper = run(&scenario(2, vec![disc]), Rules::snapshot(DT_S), &[ahead(1.0), ahead(1.0)], 4);
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    near(stepper.robots.centres_m, 1.0);
    near(stepper.robots.clearance_m, 0.6);
    near(stepper.obstacles.centres_m, 0.6);
    near(stepper.obstacles.clearance_m, 0.2);
    near(stepper.clearance_m(), 0.2);
    near(stepper.path_length(0), 2.0);
    assert!(stepper.all_arrived() && stepper.distance_to_goal(0) < 1e-12);
}
