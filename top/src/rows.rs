//! The table of robots: a row for each, sorted and chosen.

use model::ProcessState;
use protocol::operator_to_daemon::RobotStatus;
use std::cmp::Ordering;
use watch::{Load, Vitals};

/// The column by which robots are sorted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Sort {
    /// By their order in the scenario.
    #[default]
    Robot,
    /// By state.
    State,
    /// The oldest poses first.
    Age,
    /// Most missed periods first.
    Misses,
    /// Most processor time first.
    Cpu,
    /// Most memory first.
    Memory,
}

impl Sort {
    /// All of them, in the order of the key that changes it.
    pub(crate) const ALL: [Sort; 6] = [Sort::Robot, Sort::State, Sort::Age, Sort::Misses, Sort::Cpu, Sort::Memory];

    /// The one after it.
    pub(crate) fn next(self) -> Sort {
        let at = Sort::ALL.iter().position(|sort| *sort == self).unwrap_or_default();
        Sort::ALL[(at + 1) % Sort::ALL.len()]
    }
}

/// A robot in the table.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Row {
    /// Its index.
    pub(crate) index: u32,
    /// Its name.
    pub(crate) id: String,
    /// Where its process is.
    pub(crate) process: ProcessState,
    /// It runs and is at its last goal.
    pub(crate) arrived: bool,
    /// Its incarnation.
    pub(crate) incarnation: u32,
    /// Its goal, m.
    pub(crate) goal_m: Option<[f64; 2]>,
    /// Goals after the present one.
    pub(crate) goals_left: u32,
    /// Age of the poses that it used, 99 %, us.
    pub(crate) age_us: Option<f64>,
    /// Periods that it has missed.
    pub(crate) missed: u64,
    /// Share of a processor.
    pub(crate) cpu: Option<f64>,
    /// Memory, bytes.
    pub(crate) resident_bytes: Option<u64>,
}

impl Row {
    fn of(robot: &RobotStatus, load: Option<&Load>) -> Row {
        Row {
            index: robot.index.0,
            id: robot.id.clone(),
            process: robot.state,
            arrived: robot.arrived && robot.state == ProcessState::Running,
            incarnation: robot.incarnation,
            goal_m: robot.goal_m,
            goals_left: robot.goals_left,
            age_us: load.and_then(|load| load.pose_age_us).map(|[_, p99]| p99),
            missed: load.map_or(0, |load| load.missed_ever),
            cpu: load.and_then(|load| load.cpu),
            resident_bytes: load.and_then(|load| load.resident_bytes),
        }
    }

    /// Its state in a word.
    pub(crate) fn state(&self) -> &'static str {
        if self.arrived { "arrived" } else { self.process.word() }
    }

    /// What it is doing: where it heads for, and how many goals come then.
    pub(crate) fn goal(&self) -> String {
        let Some([x_m, y_m]) = self.goal_m.filter(|goal| goal.iter().all(|m| m.is_finite())) else {
            return "-".to_owned();
        };
        let more = match self.goals_left.saturating_sub(u32::from(!self.arrived)) {
            0 => String::new(),
            more => format!(" +{more}"),
        };
        format!("{x_m:.1},{y_m:.1}{more}")
    }
}

/// The robots with this in their names, in this order.
pub(crate) fn rows(vitals: &Vitals, sort: Sort, reversed: bool, filter: &str) -> Vec<Row> {
    let robots = vitals.status.robots.iter().filter(|robot| robot.id.contains(filter));
    let mut rows: Vec<Row> = robots.map(|robot| Row::of(robot, vitals.pulse.robots.get(&robot.index))).collect();
    let most = |a: Option<f64>, b: Option<f64>| b.unwrap_or(-1.0).total_cmp(&a.unwrap_or(-1.0));
    rows.sort_by(|a, b| {
        let order = match sort {
            Sort::Robot => Ordering::Equal,
            Sort::State => a.state().cmp(b.state()),
            Sort::Age => most(a.age_us, b.age_us),
            Sort::Misses => b.missed.cmp(&a.missed),
            Sort::Cpu => most(a.cpu, b.cpu),
            Sort::Memory => b.resident_bytes.cmp(&a.resident_bytes),
        };
        order.then(a.index.cmp(&b.index))
    });
    if reversed {
        rows.reverse();
    }
    rows
}
