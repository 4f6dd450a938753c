//! What moved a robot along a run: the forces of every plan.

use crate::stepper::{Run, Stepper, planner};
use nalgebra::{Point2, Rotation2, Vector2};
use planners::{Plan, PlanInput, Planner};

/// The forces of one plan, in the world frame.
#[derive(Clone, Copy, Debug)]
pub struct Forces {
    /// Where the robot is, m.
    pub position: Point2<f64>,
    /// Its heading, rad.
    pub yaw_rad: f64,
    /// The pull of the goal.
    pub goal: Vector2<f64>,
    /// The push of all obstacles.
    pub obstacles: Vector2<f64>,
    /// The push of all robots.
    pub robots: Vector2<f64>,
}

impl Forces {
    /// Their sum.
    pub fn sum(&self) -> Vector2<f64> {
        self.goal + self.obstacles + self.robots
    }

    /// Their sum along the heading and to the left of it.
    pub fn in_body_frame(&self) -> Vector2<f64> {
        Rotation2::new(-self.yaw_rad) * self.sum()
    }
}

/// A planner that remembers the forces of its plans. What robots push is what is missing without them: for that it has a
/// twin, which hears no robots.
pub struct Remembering {
    planner: Box<dyn Planner>,
    twin: Box<dyn Planner>,
    /// Those of every plan so far.
    pub forces: Vec<Forces>,
}

impl Remembering {
    /// From two planners of the same kind.
    pub fn new(planner: Box<dyn Planner>, twin: Box<dyn Planner>) -> Remembering {
        Remembering { planner, twin, forces: Vec::new() }
    }
}

impl Planner for Remembering {
    fn plan(&mut self, input: &PlanInput<'_>) -> Plan {
        let plan = self.planner.plan(input);
        let alone = self.twin.plan(&PlanInput { neighbors: &[], ..*input });
        self.forces.push(Forces {
            position: input.position,
            yaw_rad: input.yaw_rad,
            goal: plan.attractive,
            obstacles: alone.repulsive,
            robots: plan.repulsive - alone.repulsive,
        });
        plan
    }
}

impl Run {
    /// Runs like [`Run::run`], and remembers the forces.
    pub fn remembering(&self) -> Stepper<Remembering> {
        let planners = (0..).zip(&self.scenario.robots).map(|(slot, robot)| {
            let one = || planner(self.scenario.clock.seed, slot, robot);
            Remembering::new(one(), one())
        });
        let mut stepper = Stepper::with_planners(&self.scenario, self.rules, planners.collect());
        stepper.run(self.ticks());
        stepper
    }
}
