//! The whole core of an agent: one `Agent::step`, from what boards hold to what is written.

use crate::route::{Cell, MEASURED, Route, WARM_UP};
use divan::Bencher;
use model::{Radio, RobotIndex, RobotInstance};
use planners::PlanInput;
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::SharedPose;
use protocol::world_to_robot::{NeighborRef, Odometry, Piece};
use robot_agent::agent::{Agent, AgentInputs, Time};
use scenarios::Draft;
use std::hint::black_box;

/// Rows are named `method neighbours+obstacles`.
#[divan::bench(
    args = Cell::all(|method| ["straight", "decentralized-apf"].contains(&method.name)),
    sample_size = 16,
    sample_count = MEASURED as u32 / 16
)]
fn step(bencher: Bencher<'_, '_>, cell: &Cell) {
    let route = Route::new(cell);
    let scenario = Draft::new()
        .with("clock.mode", "lockstep")
        .with("layout.kind", "circle-swap")
        .with("layout.robots", 2_usize)
        .with("layout.radius_m", 5.0)
        .with("defaults.planner", cell.method.name)
        .scenario("micro")
        .unwrap();
    let instance = RobotInstance { index: RobotIndex(0), incarnation: 0 };
    let mut agent = Agent::new(AgentSpec::new(&scenario, &scenario.robots[0], instance)).unwrap();
    let pieces: Vec<Piece> = route.input(0).obstacles.iter().map(piece).collect();
    let told: Vec<_> =
        (0..WARM_UP + MEASURED).map(|tick| route.input(tick)).map(|input| (odometry(&input), heard(&input))).collect();
    let mut run = |tick: usize| {
        let (odometry, heard) = black_box(&told[tick]);
        let mut pose = SharedPose::default();
        let outputs = agent.step(
            &AgentInputs { odometry, heard, borders: &[], radio: Radio::PERFECT, pieces: &pieces, time: Time::Ticks },
            &mut pose,
        );
        (outputs, pose)
    };
    (0..WARM_UP).for_each(|tick| _ = run(tick));
    let mut ticks = (WARM_UP..WARM_UP + MEASURED).cycle();
    bencher.with_inputs(|| ticks.next().expect("it goes round")).bench_local_values(run);
}

fn piece(obstacle: &planners::Obstacle) -> Piece {
    let geometry::Capsule { a, b, radius } = obstacle.shape;
    let (ax_m, ay_m, bx_m, by_m) = (a.x, a.y, b.x, b.y);
    Piece { ax_m, ay_m, bx_m, by_m, radius_m: radius, obstacle: obstacle.id, ..Piece::default() }
}

fn odometry(input: &PlanInput<'_>) -> Odometry {
    Odometry {
        tick: input.tick,
        x_m: input.position.x,
        y_m: input.position.y,
        yaw_rad: input.yaw_rad,
        vx_mps: input.velocity.x,
        vy_mps: input.velocity.y,
        goal_x_m: input.goal.x,
        goal_y_m: input.goal.y,
        goals_left: 1,
        flags: Odometry::FLAG_PRESENT,
        ..Odometry::default()
    }
}

/// What the boards of the neighbours give: their poses of the tick before.
fn heard(input: &PlanInput<'_>) -> Vec<(NeighborRef, SharedPose)> {
    let spoken = |neighbor: &planners::Neighbor| {
        let arrived = if neighbor.arrived { SharedPose::FLAG_ARRIVED } else { 0 };
        let newest = SharedPose {
            tick: input.tick.saturating_sub(1),
            x_m: neighbor.position.x,
            y_m: neighbor.position.y,
            yaw_rad: neighbor.yaw_rad,
            vx_mps: neighbor.velocity.x,
            vy_mps: neighbor.velocity.y,
            radius_m: neighbor.radius_m,
            remaining_m: neighbor.remaining_m,
            flags: SharedPose::FLAG_SPOKEN | arrived,
            ..SharedPose::default()
        };
        let who = NeighborRef { index: neighbor.id, incarnation: 0 };
        (who, newest)
    };
    input.neighbors.iter().map(spoken).collect()
}
