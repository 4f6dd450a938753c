//! Scenarios in a line, and a fleet whose agents head straight for their goals.

use model::*;
use model::{BodyKind, Drive, Dynamics, Limits, RobotIndex, RobotInstance};
use nalgebra::{Point2, Vector2};
use planners::steering::steer;
use protocol::world_to_daemon::Notice;
use shoal_world_sim::World;

/// Ten ticks per second: looking ahead is five ticks.
pub(crate) const HZ: f64 = 10.0;

pub(crate) fn robot(slot: usize, start: [f64; 2], goal: [f64; 2]) -> Robot {
    Robot {
        id: format!("r{slot}"),
        kind: BodyKind::Point,
        limits: Limits {
            speed_mps_max: 1.0,
            reverse_mps_max: 0.0,
            turning_radius_m_min: 0.0,
            turn_radps_max: 2.0,
            accel_mps2_max: f64::INFINITY,
            turn_accel_radps2_max: f64::INFINITY,
        },
        arm: None,
        wheels: None,
        dynamics: Dynamics::default(),
        radius_m: 0.25,
        start: start.into(),
        start_yaw_rad: 0.0,
        goals: vec![goal.into()],
        goal_yaw_rad: None,
        goal_yaw_tolerance_rad: 0.1,
        rounds: Some(1),
        goal_motion: None,
        goal_tolerance_m: 0.05,
        planner: "straight".to_owned(),
        params: Default::default(),
        filter: model::FilterKind::None,
        sensor_range_m: 3.0,
        radio_range_m: 5.0,
        radio_hysteresis_m: 0.5,
        sees_robots: true,
        knows_map: false,
        restart: Restart::NEVER,
        agent: None,
    }
}

pub(crate) fn scenario(robots: Vec<Robot>) -> Scenario {
    let bounds = Bounds { x_m: [-10.0, 10.0], y_m: [-10.0, 10.0] };
    Scenario {
        physics: Physics::Kinematic,
        name: "test".to_owned(),
        description: String::new(),
        bounds,
        clock: Clock { mode: Mode::Single, tick_hz: HZ, seed: 1, ticks_max: 1000, stop: Stop::Arrived },
        fleet: Fleet {
            max_robots: robots.len() + 4,
            straggler: StragglerPolicy::Hold,
            straggler_limit_s: 1.0,
            stuck_limit_s: 60.0,
            command_timeout_s: 0.5,
            start_limit_s: 5.0,
        },
        processes: Processes::default(),
        radio: Radio::PERFECT,
        obstacles: Vec::new(),
        template: robot(0, [0.0, 0.0], [0.0, 0.0]),
        map: None,
        templates_of_others: Vec::new(),
        robots,
        events: Vec::new(),
        warnings: Vec::new(),
        expect: Expect::default(),
    }
}

/// A world, its agents, and what it said.
pub(crate) struct Driver {
    pub world: World,
    pub kinds: Vec<(BodyKind, Limits)>,
    /// With the tick at which they were taken.
    pub notices: Vec<(u64, Notice)>,
    /// Instances that are not ready when asked.
    pub unready: Vec<RobotInstance>,
    /// Who took part, by tick.
    pub took_part: Vec<Vec<RobotInstance>>,
}

impl Driver {
    pub(crate) fn new(scenario: &Scenario) -> Driver {
        let kinds = scenario.robots.iter().map(|robot| (robot.kind, robot.limits)).collect();
        let mut driver = Driver {
            world: World::new(scenario),
            kinds,
            notices: Vec::new(),
            unready: Vec::new(),
            took_part: Vec::new(),
        };
        driver.hear();
        driver
    }

    pub(crate) fn open(&mut self) {
        let unready = &self.unready;
        self.world.open(&mut |instance| !unready.contains(&instance));
        self.took_part.push(self.world.participants().to_vec());
        self.hear();
    }

    pub(crate) fn close(&mut self) {
        let drives: Vec<(RobotInstance, Drive)> =
            self.world.participants().iter().map(|instance| (*instance, self.straight(instance.index.at()))).collect();
        self.world.close(&mut |instance| drives.iter().find(|(who, _)| *who == instance).map(|(_, drive)| *drive));
        self.hear();
    }

    pub(crate) fn tick(&mut self) {
        self.open();
        self.close();
    }

    pub(crate) fn run(&mut self) -> model::Outcome {
        while !self.world.finished() {
            self.tick();
        }
        self.world.outcome()
    }

    /// Opens and closes until this tick is about to be opened.
    pub(crate) fn until(&mut self, tick: u64) {
        while self.world.tick() < tick {
            self.tick();
        }
    }

    pub(crate) fn position(&self, slot: usize) -> Point2<f64> {
        let odometry = self.world.odometry(slot);
        Point2::new(odometry.x_m, odometry.y_m)
    }

    /// As fast as possible, but not past the goal.
    fn straight(&self, slot: usize) -> Drive {
        let odometry = self.world.odometry(slot);
        let way = Vector2::new(odometry.goal_x_m - odometry.x_m, odometry.goal_y_m - odometry.y_m);
        let (kind, limits) = self.kinds.get(slot).copied().unwrap_or(self.kinds[0]);
        let velocity = (way * HZ).cap_magnitude(limits.speed_mps_max);
        match kind {
            BodyKind::Point => Drive::Velocity(velocity),
            BodyKind::Unicycle | BodyKind::DiffDrive => steer(velocity, odometry.yaw_rad, 4.0, &limits),
            BodyKind::TwoLinkArm => Drive::stop(kind),
        }
    }

    fn hear(&mut self) {
        let tick = self.world.tick();
        self.notices.extend(self.world.take_notices().into_iter().map(|notice| (tick, notice)));
    }

    /// Ticks in which a slot took part, with its incarnation, as runs: (first, last, incarnation).
    pub(crate) fn stints(&self, slot: u32) -> Vec<(u64, u64, u32)> {
        let mut stints: Vec<(u64, u64, u32)> = Vec::new();
        for (tick, instances) in self.took_part.iter().enumerate() {
            let tick = tick as u64;
            let Some(instance) = instances.iter().find(|instance| instance.index.0 == slot) else { continue };
            match stints.last_mut() {
                Some((_, last, incarnation)) if *last + 1 == tick && *incarnation == instance.incarnation => {
                    *last = tick;
                }
                _ => stints.push((tick, tick, instance.incarnation)),
            }
        }
        stints
    }

    /// What was said of a slot, log entries as `kind`, the rest as `Name.incarnation`, each with its tick.
    pub(crate) fn story(&self, slot: u32) -> String {
        let line = |(tick, notice): &(u64, Notice)| {
            let (name, instance) = match notice {
                Notice::Expect { instance, tick: at } => (format!("Expect@{at}"), *instance),
                Notice::Entered { instance, .. } => ("Entered".to_owned(), *instance),
                Notice::Kill { instance } => ("Kill".to_owned(), *instance),
                Notice::Pause { instance } => ("Pause".to_owned(), *instance),
                Notice::Resume { instance } => ("Resume".to_owned(), *instance),
                Notice::Left { instance } => ("Left".to_owned(), *instance),
                Notice::RestartLimit { instance } => ("RestartLimit".to_owned(), *instance),
                Notice::Answer { .. } | Notice::Task { .. } | Notice::Log(_) => return None,
                Notice::Standings(_) | Notice::Pace(_) => return None,
            };
            (instance.index.0 == slot).then(|| format!("{tick}:{name}.{}", instance.incarnation))
        };
        self.notices.iter().filter_map(line).collect::<Vec<_>>().join(" ")
    }

    /// Ticks of the log entries of a kind about a slot.
    pub(crate) fn logged(&self, kind: EventName, slot: u32) -> Vec<u64> {
        let events = self.world.outcome().events;
        events
            .iter()
            .filter(|e| e.kind.name() == kind && e.robot == Some(RobotIndex(slot)))
            .map(|event| event.tick)
            .collect()
    }
}

pub(crate) fn instance(slot: u32, incarnation: u32) -> RobotInstance {
    RobotInstance { index: RobotIndex(slot), incarnation }
}

pub(crate) fn at(tick: u64, what: TimelineAction) -> TimelineEvent {
    TimelineEvent { tick, what }
}
