//! `single`: the cores of a whole fleet in one thread.
//!
//! The same cores, the same order of things as in `lockstep`, without a process, a clock or shared memory. It is
//! the fast way to try a method over many seeds, and the oracle that `lockstep` is held against.

use model::{Outcome, RobotInstance, Scenario};
use protocol::daemon_to_robot::AgentSpec;
use protocol::robot_to_robot::{PosePair, SharedBorder, SharedBorders, SharedPose};
use protocol::world_to_daemon::Notice;
use protocol::world_to_robot::{NeighborRef, Piece};
use robot_agent::agent::AgentError;
use robot_agent::{Agent, AgentInputs, AgentOutputs, Time};
use std::ops::ControlFlow;
use world_sim::World;

/// One robot's process, were it one.
struct Cell {
    instance: RobotInstance,
    agent: Agent,
    board: PosePair,
    /// What goes with the two poses, if it talks about borders: the newer one last.
    borders: Option<Box<[SharedBorders; 2]>>,
}

/// Runs the scenario to its end, or until `watch` breaks it off. `watch` sees the world after every tick, and what
/// happened in it.
///
/// # Errors
/// When a robot's method cannot be built.
pub fn run(
    scenario: &Scenario,
    watch: &mut dyn FnMut(&World, &[Notice]) -> ControlFlow<()>,
) -> Result<Outcome, AgentError> {
    run_shown(scenario, World::new(scenario), &mut |_| {}, watch)
}

/// The same with this world of the scenario, before its first tick; `show` sees what observers of a real fleet see: the world
/// when a tick has been opened, and once more at the end.
///
/// # Errors
/// When a robot's method cannot be built.
pub fn run_shown(
    scenario: &Scenario,
    world: World,
    show: &mut dyn FnMut(&mut World),
    watch: &mut dyn FnMut(&World, &[Notice]) -> ControlFlow<()>,
) -> Result<Outcome, AgentError> {
    run_with(scenario, world, &mut Agent::new, show, watch)
}

/// What makes the agent of a robot instance from what it may know.
pub type Build<'a> = dyn FnMut(AgentSpec) -> Result<Agent, AgentError> + 'a;

/// The same with agents that `build` makes: planners that shoal does not have.
///
/// # Errors
/// When `build` fails.
pub fn run_with(
    scenario: &Scenario,
    mut world: World,
    build: &mut Build<'_>,
    show: &mut dyn FnMut(&mut World),
    watch: &mut dyn FnMut(&World, &[Notice]) -> ControlFlow<()>,
) -> Result<Outcome, AgentError> {
    let mut cells: Vec<Option<Cell>> = scenario.robots.iter().map(|_| None).collect();
    let mut heard: Vec<(NeighborRef, SharedPose)> = Vec::new();
    let mut borders: Vec<SharedBorder> = Vec::new();
    let mut pieces: Vec<Piece> = Vec::new();
    let mut answers: Vec<(RobotInstance, AgentOutputs)> = Vec::new();

    while !world.finished() {
        world.open(&mut |_| true);
        show(&mut world);
        answers.clear();
        for instance in world.participants().to_vec() {
            enter(&mut cells, scenario, instance, build)?;
        }
        for &instance in world.participants() {
            let slot = instance.index.at();
            heard.clear();
            let tick = world.tick();
            heard.extend(world.neighbors(slot).iter().filter_map(|who| Some((*who, pose_of(&cells, *who, tick)?))));
            borders.clear();
            if cells[slot].as_ref().is_some_and(|cell| cell.borders.is_some()) {
                borders.extend(heard.iter().map(|(who, _)| border_of(&cells, *who, instance, tick)));
            }
            pieces.clear();
            pieces.extend(world.sensed(slot).iter().map(|index| world.piece(usize::from(*index))));
            let cell = cells[slot].as_mut().expect("every participant has entered");
            let (odometry, mut pose) = (world.odometry(slot), SharedPose::default());
            let (radio, time) = (world.impairment(slot).radio(), Time::Ticks);
            let inputs =
                AgentInputs { odometry: &odometry, heard: &heard, borders: &borders, radio, pieces: &pieces, time };
            let outputs = cell.agent.step(&inputs, &mut pose);
            cell.board.push(pose);
            if let Some(borders) = &mut cell.borders {
                borders.rotate_left(1);
                cell.agent.tell_borders(tick, &mut borders[1]);
            }
            answers.push((instance, outputs));
        }
        for (instance, outputs) in &answers {
            world.planned(*instance, outputs.plan, outputs.filtered.into());
        }
        world.close(&mut |instance| {
            let index = answers.binary_search_by_key(&instance.index, |(who, _)| who.index).ok()?;
            Some(answers[index].1.drive)
        });
        let notices = world.take_notices();
        if watch(&world, &notices).is_break() {
            break;
        }
    }
    show(&mut world);
    Ok(world.outcome())
}

/// Starts the agent of a robot instance, unless it runs already. A new incarnation starts with an empty board.
fn enter(
    cells: &mut [Option<Cell>],
    scenario: &Scenario,
    instance: RobotInstance,
    build: &mut Build<'_>,
) -> Result<(), AgentError> {
    let slot = instance.index.at();
    if cells[slot].as_ref().is_none_or(|cell| cell.instance != instance) {
        let agent = build(AgentSpec::new(scenario, &scenario.robots[slot], instance))?;
        let borders = agent.has_borders().then(Box::default);
        cells[slot] = Some(Cell { instance, agent, board: PosePair::default(), borders });
    }
    Ok(())
}

/// The pose of a robot that counts at this tick, if its board has one.
fn pose_of(cells: &[Option<Cell>], who: NeighborRef, tick: u64) -> Option<SharedPose> {
    let cell = cells.get(who.index as usize)?.as_ref()?;
    (cell.instance.incarnation == who.incarnation).then(|| cell.board.before(tick).copied().unwrap_or_default())
}

/// What a robot said to another one about the border between the two, before this tick.
fn border_of(cells: &[Option<Cell>], who: NeighborRef, to: RobotInstance, tick: u64) -> SharedBorder {
    let cell = cells.get(who.index as usize).and_then(Option::as_ref);
    let borders =
        cell.filter(|cell| cell.instance.incarnation == who.incarnation).and_then(|cell| cell.borders.as_ref());
    let newest = borders.and_then(|borders| borders.iter().rev().find(|borders| borders.tick < tick));
    newest.map(|borders| borders.to(to.index.0, to.incarnation)).unwrap_or_default()
}
