//! Commands along a run: at every state that the robots of a run come to, the planner's command against that of the
//! specification's equations. A run that chaos decides cannot be compared as a whole; each of its steps can.

use super::reference::Program as Reference;
use super::replay::{Method, Program};
use crate::scene::Scene;
use model::Drive;
use planners::amr_apf::Preset;
use planners::{Plan, PlanInput, Planner};

/// How far a speed or a yaw rate may be off, m/s, rad/s: rounding, amplified by steep forces.
pub const TOLERANCE: f64 = 1e-9;

/// What came of the comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Commands that agree.
    pub agree: usize,
    /// Commands in all.
    pub all: usize,
    /// The first that does not agree, in words.
    pub first: Option<String>,
}

impl Agreement {
    /// Those of another run too.
    pub fn add(&mut self, other: Agreement) {
        (self.agree, self.all) = (self.agree + other.agree, self.all + other.all);
        self.first = self.first.take().or(other.first);
    }
}

/// A planner whose every plan is compared.
struct Checked {
    planner: Box<dyn Planner>,
    reference: Reference,
    agreement: Agreement,
    stopped: bool,
}

impl Planner for Checked {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let plan = self.planner.plan(input);
        let answer = self.reference.answer(input);
        let Drive::Twist { speed_mps, turn_radps } = plan.drive else { panic!("a unicycle is asked for a twist") };
        let near = |[v, w]: &[f64; 2]| (v - speed_mps).abs() <= TOLERANCE && (w - turn_radps).abs() <= TOLERANCE;
        // Once told it stays told.
        let told = if plan.stopped { answer.stops || self.stopped } else { answer.drives && !self.stopped };
        self.stopped |= plan.stopped;
        self.agreement.all += 1;
        if answer.commands.iter().any(near) && told {
            self.agreement.agree += 1;
        } else if self.agreement.first.is_none() {
            self.agreement.first = Some(format!(
                "cycle {}: ({speed_mps:.6}, {turn_radps:.6}), stopped {}; the equations give {:.6?}, stops {}",
                input.tick, plan.stopped, answer.commands, answer.stops
            ));
        }
        plan
    }
}

impl Program {
    /// Runs a layout, and compares every command.
    pub fn commands(&self, layout: &Scene) -> Agreement {
        let reference = match &self.method {
            Method::Amr(params) if params.preset == Preset::C1 => Reference::C1,
            Method::Amr(_) => Reference::P,
            Method::Dapf(params) => Reference::Dapf(params.variant),
        };
        let checked = |robot: u32| Checked {
            planner: self.planner(robot),
            reference,
            agreement: Agreement::default(),
            stopped: false,
        };
        let mut stepper = self.stepper(layout, checked);
        stepper.run(self.steps_max);
        let mut sum = Agreement::default();
        for (robot, checked) in stepper.planners.into_iter().enumerate() {
            let first = checked.agreement.first.map(|text| format!("robot {}, {text}", robot + 1));
            sum.add(Agreement { first, ..checked.agreement });
        }
        sum
    }
}
