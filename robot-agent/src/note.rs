//! What an agent notes of a step for a replay: check sums over what it was told, and over what it said.
//!
//! A check sum leaves out stamps, which a replay does not compute, and what follows from the rest: it is made in every step of
//! a run that is recorded.

use crate::agent::{AgentInputs, AgentOutputs};
use crate::radio::Time;
use bus::Address;
use bus::notes::NoteWriter;
use model::{Drive, Radio};
use protocol::daemon_to_robot::AgentSpec;
use protocol::inputs::{AgentNote, BetweenTicks, HeardNote, StepNote};
use protocol::robot_to_robot::{SharedBorder, SharedPose};
use protocol::robot_to_world::Command;
use protocol::world_to_robot::{Odometry, Piece};

/// Whoever notes the steps of an agent.
pub(crate) struct Notes {
    writer: NoteWriter,
    step: AgentNote,
}

impl Notes {
    /// Of the agent with this spec; `is_own`: its executable is not shoal's. Without room for notes there are none, and it says
    /// so: the robot goes on.
    #[expect(clippy::print_stderr, reason = "standard error of an agent is a file that the daemon reads")]
    pub(crate) fn begin(address: &Address, spec: &AgentSpec, is_own: bool) -> Option<Notes> {
        match NoteWriter::create(address, spec.instance, spec.max_robots) {
            Ok(mut writer) => {
                writer.note(&AgentNote::Began { is_own });
                Some(Notes { writer, step: AgentNote::Step(StepNote::default()) })
            }
            Err(error) => {
                eprintln!("record: the steps of this robot are not in it: {error}");
                None
            }
        }
    }

    /// Notes a step that is about to be published. `world_tick` is the tick that the world had begun when everything was read.
    pub(crate) fn step(
        &mut self,
        inputs: &AgentInputs<'_>,
        pose: &SharedPose,
        outputs: &AgentOutputs,
        world_tick: u64,
    ) {
        if let AgentNote::Step(step) = &mut self.step {
            note_step(step, inputs, pose, outputs, world_tick);
        }
        self.writer.note(&self.step);
    }
}

/// Makes `note` that of a step in which an agent had these inputs and came to this pose, with its stamp. `world_tick`: the world
/// was that far when everything had been read.
pub fn note_step(
    note: &mut StepNote,
    inputs: &AgentInputs<'_>,
    pose: &SharedPose,
    outputs: &AgentOutputs,
    world_tick: u64,
) {
    note.tick = inputs.odometry.tick;
    note.now_ns = match inputs.time {
        Time::Stamps { now_ns } => Some(now_ns),
        Time::Ticks => None,
    };
    note.stamp_ns = pose.stamp_ns;
    note.heard.clear();
    note.heard.extend(inputs.heard.iter().enumerate().map(|(place, (who, heard))| HeardNote {
        who: *who,
        stamp_ns: if heard.has(SharedPose::FLAG_SPOKEN) { heard.stamp_ns } else { 0 },
        border_sum: inputs.borders.get(place).and_then(sum_of_said),
    }));
    // What it saw may be of this tick or of a later one, a part of each.
    note.between =
        (world_tick != note.tick).then(|| BetweenTicks { radio: inputs.radio, pieces: inputs.pieces.to_vec() });
    note.inputs_sum = sum_of_inputs(inputs);
    note.outputs_sum = sum_of_outputs(pose, outputs);
}

/// Check sum over the values of all inputs of a step.
pub fn sum_of_inputs(inputs: &AgentInputs<'_>) -> u64 {
    let Odometry { tick, x_m, y_m, yaw_rad, vx_mps, vy_mps, turn_radps, joints_rad: [base, elbow], .. } =
        *inputs.odometry;
    let Odometry { goal_x_m, goal_y_m, goal_yaw_rad, flags, .. } = *inputs.odometry;
    let mut sum = Sum(tick ^ u64::from(flags) << 32);
    sum.floats([x_m, y_m, yaw_rad, vx_mps, vy_mps, turn_radps, base, elbow, goal_x_m, goal_y_m, goal_yaw_rad]);
    let Radio { delay_ticks, drop, noise_m } = inputs.radio;
    sum.word(delay_ticks.into());
    sum.floats([drop, noise_m]);
    for (who, pose) in inputs.heard {
        sum.word(u64::from(who.index) << 32 | u64::from(who.incarnation));
        sum.word(pose.tick << 8 ^ u64::from(pose.flags));
        let SharedPose { x_m, y_m, next_x_m, next_y_m, far_x_m, far_y_m, remaining_m, .. } = *pose;
        sum.floats([x_m, y_m, next_x_m, next_y_m, far_x_m, far_y_m, remaining_m]);
    }
    for border in inputs.borders {
        sum.word(sum_of_border(border));
    }
    for piece in inputs.pieces {
        let Piece { ax_m, ay_m, bx_m, by_m, vx_mps, vy_mps, obstacle, robot, .. } = *piece;
        sum.word(u64::from(obstacle) << 32 | u64::from(robot));
        sum.floats([ax_m, ay_m, bx_m, by_m, vx_mps, vy_mps]);
    }
    sum.0
}

/// Check sum over what an agent said and asked for in a step.
pub fn sum_of_outputs(pose: &SharedPose, outputs: &AgentOutputs) -> u64 {
    let SharedPose { x_m, y_m, yaw_rad, next_x_m, next_y_m, far_x_m, far_y_m, remaining_m, intent, .. } = *pose;
    let mut sum = Sum(pose.tick << 8 ^ u64::from(pose.flags));
    sum.floats([x_m, y_m, yaw_rad, next_x_m, next_y_m, far_x_m, far_y_m, remaining_m, f64::from(pose.spare_m)]);
    sum.floats([intent.wish_x_mps, intent.wish_y_mps, intent.left_m, intent.rank]);
    sum.floats([intent.corner_x_m, intent.corner_y_m, f64::from(intent.slow), f64::from(intent.lag)]);
    let mut command = Command::default();
    command.set_drive(outputs.drive);
    command.set_plan(outputs.plan);
    sum.word(u64::from(command.form) << 32 | u64::from(command.plan) << 16 | u64::from(outputs.hold_ticks));
    sum.floats([command.first, command.second, f64::from(outputs.filtered)]);
    sum.0
}

/// Check sum over what one robot says to another one about their border; `None` if it says nothing.
pub fn sum_of_said(border: &SharedBorder) -> Option<u16> {
    (border.form != SharedBorder::FORM_NONE).then(|| (sum_of_border(border) >> 48) as u16)
}

fn sum_of_border(border: &SharedBorder) -> u64 {
    let SharedBorder { number, normal_x, normal_y, offset_m, form, .. } = *border;
    let mut sum = Sum(number << 8 ^ u64::from(form));
    sum.floats([normal_x, normal_y, offset_m]);
    sum.0
}

/// Whether two drives are the same, bit by bit.
pub fn are_same(one: Option<Drive>, other: Option<Drive>) -> bool {
    let bits = |drive: Drive| {
        let mut command = Command::default();
        command.set_drive(drive);
        (command.form, command.first.to_bits(), command.second.to_bits())
    };
    one.map(bits) == other.map(bits)
}

/// Words stirred into one, in their order.
struct Sum(u64);

impl Sum {
    fn word(&mut self, word: u64) {
        self.0 = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn floats<const N: usize>(&mut self, values: [f64; N]) {
        for value in values {
            self.word(value.to_bits());
        }
    }
}
