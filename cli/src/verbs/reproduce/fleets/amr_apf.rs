//! The growing fleet (case 1) and the random layouts (case 2), every robot a process, from starts moved by up to two
//! centimetres: single runs say little here.
//!
//! Robots and pillars have the radii that the methods plan with. Bodies are smaller, so a contact of the paper's robots
//! is taken from the smallest distance of a run, not from what the world counts.

use super::{Rows, Series, Stop, begin, lockstep};
use crate::exit::Failure;
use model::{Outcome, ParamValue, ParamValues, Robot, Scenario};
use reproduce::amr_apf::layouts::{case1, case2, radii_m};
use reproduce::amr_apf::replay::jittered;
use reproduce::row::{Form, Item};
use reproduce::scene::Scene;
use scenarios::Draft;

const TICK_HZ: f64 = 10.0;
const JITTER_M: f64 = 0.02;
/// Centres nearer than this are contacts, m: of two bodies side by side, of body and pillar.
const BODIES_M: f64 = 0.266;
const BODY_PILLAR_M: f64 = 0.233;

/// A method with its parameters.
struct Contestant {
    name: &'static str,
    method: &'static str,
    params: &'static [(&'static str, &'static str)],
    right_of_way: bool,
}

const C1: Contestant = contestant("AMR C1", "amr-apf", &[("preset", "c1")]);
const DEFAULT: Contestant = contestant("AMR default", "amr-apf", &[]);
const LINEAR: Contestant = contestant("DAPF linear", "dapf", &[("variant", "lin")]);
/// The fair one: as fast near its goal as far from it, and its rule of the right of way works.
const CONSTANT: Contestant =
    Contestant { right_of_way: true, ..contestant("DAPF constant, right of way", "dapf", &[("variant", "const")]) };
const MAX3: Contestant = contestant("DAPF max3", "dapf", &[("variant", "max3")]);

const fn contestant(
    name: &'static str,
    method: &'static str,
    params: &'static [(&'static str, &'static str)],
) -> Contestant {
    Contestant { name, method, params, right_of_way: false }
}

impl Contestant {
    fn params(&self) -> ParamValues {
        let words = self.params.iter().map(|(key, word)| ((*key).to_owned(), ParamValue::Choice((*word).to_owned())));
        let right_of_way = self.right_of_way.then(|| ("right_of_way".to_owned(), ParamValue::Bool(true)));
        words.chain(right_of_way).collect()
    }

    /// A layout in which the robots use this method, in a world where only starts, goals and pillars matter.
    fn scenario(&self, layout: &Scene, duration_s: f64) -> Result<Scenario, Failure> {
        let (robot_m, pillar_m) = radii_m(false);
        let robot = |robot: &Robot| {
            Draft::new()
                .with("id", robot.id.clone())
                .with("start_m", robot.start)
                .with("start_yaw_rad", robot.start_yaw_rad)
                .with("goal_m", robot.goals[0])
        };
        let disc = |at| Draft::new().with("shape", "disc").with("center_m", at).with("radius_m", pillar_m);
        let pillars = layout.scenario.obstacles.iter().map(|pillar| pillar.shape.reference());
        let discs = pillars.chain(layout.paper.added_discs.iter().copied());
        Draft::new()
            .with("clock.tick_hz", TICK_HZ)
            .with("clock.duration_s", duration_s)
            .with("expect.contacts_max", 1_000_000_u64)
            .with("defaults.sensor_range_m", 50.0)
            .with("defaults.radio_range_m", 50.0)
            .with("defaults.kind", "unicycle")
            .with("defaults.radius_m", robot_m)
            .with("defaults.speed_mps_max", 0.2)
            .with("defaults.turn_radps_max", 1.0)
            .with("defaults.goal_tolerance_m", 0.07)
            .with("defaults.planner", self.method)
            .with("defaults.params", &self.params())
            .with("robot", layout.scenario.robots.iter().map(robot).collect::<Vec<_>>())
            .with("obstacle", discs.map(disc).collect::<Vec<_>>())
            .scenario(&layout.name)
            .map_err(|problems| crate::source::failure(&problems))
    }
}

/// What came of one contestant's runs from several starts.
#[derive(Debug, Default)]
struct Batch {
    /// Operation times of the runs in which all arrived, s.
    times_s: Vec<f64>,
    /// Mean ways of the same runs, m.
    ways_m: Vec<f64>,
    failures: usize,
    /// Runs in which bodies touch each other or a pillar.
    touching: usize,
}

impl Batch {
    fn add(&mut self, outcome: &Outcome) {
        let times: Option<Vec<f64>> = outcome.robots.iter().map(|robot| robot.time_s).collect();
        match times {
            Some(times) => {
                self.times_s.push(times.into_iter().fold(0.0, f64::max));
                let way_m: f64 = outcome.robots.iter().map(|robot| robot.path_length_m).sum();
                self.ways_m.push(way_m / outcome.robots.len() as f64);
            }
            None => self.failures += 1,
        }
        let (robot_m, pillar_m) = radii_m(false);
        let near =
            |clearance: Option<f64>, radii_m: f64, limit_m: f64| clearance.is_some_and(|c| c + radii_m < limit_m);
        let touches = near(outcome.min_clearance_m, 2.0 * robot_m, BODIES_M)
            || near(outcome.min_obstacle_clearance_m, robot_m + pillar_m, BODY_PILLAR_M);
        self.touching += usize::from(touches);
    }

    /// The median time, if all arrive in more than half of the runs.
    fn time_s(&self) -> Option<f64> {
        median(&self.times_s).filter(|_| self.times_s.len() > self.failures)
    }
}

/// One of the paper's experiments.
struct Experiment {
    name: &'static str,
    /// What its x axis counts.
    place: &'static str,
    contestants: &'static [Contestant],
    layouts: Vec<Scene>,
    duration_s: f64,
}

/// What came of an experiment: by layout, then by contestant.
type Found = Vec<Vec<Batch>>;

/// Indices of contestants.
const OF_C1: usize = 0;
const OF_DEFAULT: usize = 1;
const OF_BASE: usize = 2;
const OF_FAIR: usize = 3;

pub(super) fn run(runs: u32, rows: &mut Rows<'_>, series: &mut Vec<Series>) -> Result<(), Stop> {
    let first = Experiment {
        name: "case 1",
        place: "robots",
        contestants: &[C1, DEFAULT, LINEAR, CONSTANT],
        layouts: (1..=15).map(case1).collect(),
        duration_s: 250.0,
    };
    let second = Experiment {
        name: "case 2",
        place: "layout",
        contestants: &[C1, DEFAULT, MAX3],
        layouts: case2(),
        duration_s: 150.0,
    };
    let found = first.run(runs, rows)?;
    case1_rows(rows, &found);
    first.failures(rows, &found);
    series.extend(first.charts(&found));
    let found = second.run(runs, rows)?;
    case2_rows(rows, &found);
    second.failures(rows, &found);
    series.extend(second.charts(&found));
    Ok(())
}

impl Experiment {
    fn run(&self, runs: u32, rows: &mut Rows<'_>) -> Result<Found, Stop> {
        let all = self.layouts.len() * self.contestants.len() * runs as usize;
        let mut made = 0;
        let mut batch = |layout: &Scene, who: &Contestant| {
            let mut batch = Batch::default();
            for seed in 1..=runs {
                made += 1;
                let robots = layout.scenario.robots.len();
                begin(rows, &format!("{}, {robots} robots, {}: run {made} of {all}", layout.name, who.name))?;
                let layout = jittered(layout, seed.into(), JITTER_M);
                batch.add(&lockstep(who.scenario(&layout, self.duration_s)?)?.outcome);
            }
            Ok(batch)
        };
        let mut batches = |layout| self.contestants.iter().map(|who| batch(layout, who)).collect();
        self.layouts.iter().map(&mut batches).collect()
    }

    /// How often not all arrive, against the baseline; and whether bodies touch.
    fn failures(&self, rows: &mut Rows<'_>, found: &Found) {
        for who in [OF_C1, OF_DEFAULT] {
            let [ours, base] = [who, OF_BASE].map(|who| &self.contestants[who].name);
            let item = Item::new(format!("{} {MODE}: failures of {ours} against {base}", self.name));
            let count = |who: usize| found.iter().map(|batches| batches[who].failures).sum::<usize>();
            let more: Vec<String> = (found.iter().zip(1..))
                .filter(|(batches, _)| batches[who].failures > batches[OF_BASE].failures)
                .map(|(_, place)| format!("{place}"))
                .collect();
            // The specification asks it of C1; of our default only in all.
            let (tolerance, ok) = match who {
                OF_C1 => ("nowhere more", more.is_empty()),
                _ => ("no more in all", count(who) <= count(OF_BASE)),
            };
            let more = match more.is_empty() {
                true => String::new(),
                false => format!("; more with {} {}", self.place, more.join(", ")),
            };
            let ours = format!("{} against {}{more}", count(who), count(OF_BASE));
            rows.push(item, None, ours, tolerance.to_owned(), ok);
            let touching = |who: usize| found.iter().map(|batches| batches[who].touching).sum::<usize>();
            let item = Item::new(format!(
                "{} {MODE}: runs of {} in which bodies touch",
                self.name, self.contestants[who].name
            ));
            rows.exact(item.note("the method has no guard against it"), 0, touching(who));
        }
    }

    /// Times, ways, failures and touches, as CSV and pictures.
    fn charts(&self, found: &Found) -> Vec<Series> {
        let chart = |what: &str, y: &str, form: Form, value: &dyn Fn(&Batch) -> Option<f64>| {
            let line = |(i, who): (usize, &Contestant)| {
                let points = found.iter().zip(1..).map(|(batches, place)| (f64::from(place), value(&batches[i])));
                (who.name.to_owned(), points.filter_map(|(x, y)| Some([x, y?])).collect())
            };
            Series::chart(
                form,
                format!("amr-apf-{}-processes-{what}", self.name.replace(' ', "")),
                format!("{} {MODE}: {y}", self.name),
                [self.place, y],
                self.contestants.iter().enumerate().map(line).collect(),
            )
        };
        // Layouts have no order.
        let form = if self.place == "robots" { Form::Lines } else { Form::Bars };
        let count = |n: usize| Some(n as f64);
        vec![
            chart("time", "median operation time (s)", form, &Batch::time_s),
            chart("way", "median of the mean way (m)", form, &|batch| median(&batch.ways_m)),
            chart("failures", "runs in which not all arrive", Form::Bars, &|batch| count(batch.failures)),
            chart("touches", "runs in which bodies touch", Form::Bars, &|batch| count(batch.touching)),
        ]
    }
}

const MODE: &str = "as processes";

/// The headline of case 1: how much less time than the baselines. The paper's text has 35 % for two robots and 50 % for
/// fifteen; the specification passes 30 to 42 % and 20 to 50 %.
fn case1_rows(rows: &mut Rows<'_>, found: &Found) {
    for (batches, robots) in found.iter().zip(1..) {
        let (paper, oracle, range) = match robots {
            2 => (Some("35 %"), Some("37.3 %"), Some((30.0, 42.0))),
            15 => (Some("50 %"), Some("35.4 %"), Some((20.0, 50.0))),
            _ => (None, None, None),
        };
        let mut row = |who: usize, base: usize, oracle: Option<&str>, range: Option<(f64, f64)>| {
            let names = [who, base].map(|who| ["C1", "default", "DAPF linear", "DAPF constant with right of way"][who]);
            let item = Item::new(format!("case 1 {MODE}, {robots} robots: {} against {}", names[0], names[1]))
                .note("medians over moved starts of the runs in which all arrive");
            let item = Item { paper_value: paper.map(str::to_owned), ..item };
            let times = [&batches[who], &batches[base]].map(Batch::time_s);
            let (ours, reduction) = reduced(times);
            let (tolerance, ok) = match range {
                Some((least, most)) => {
                    (format!("{least} to {most} %"), reduction.is_some_and(|r| (least..=most).contains(&r)))
                }
                None => ("less time".to_owned(), times[0].is_some() && reduction.is_none_or(|r| r > 0.0)),
            };
            rows.push(item, oracle.map(str::to_owned), ours, tolerance, ok);
        };
        row(OF_C1, OF_BASE, oracle, range);
        if range.is_some() {
            row(OF_DEFAULT, OF_BASE, None, None);
            row(OF_C1, OF_FAIR, None, None);
        }
    }
}

/// The mean reduction of case 2, over the layouts that both finish.
fn case2_rows(rows: &mut Rows<'_>, found: &Found) {
    for (who, name) in [(OF_C1, "C1"), (OF_DEFAULT, "default")] {
        let reductions: Vec<f64> = (found.iter())
            .filter_map(|batches| reduced([&batches[who], &batches[OF_BASE]].map(Batch::time_s)).1)
            .collect();
        let mean = reductions.iter().sum::<f64>() / reductions.len() as f64;
        let item = Item::new(format!("case 2 {MODE}: mean reduction of {name} against DAPF max3"))
            .note("over the layouts that both finish; medians over moved starts");
        let ours = format!("{mean:.1} % in {} layouts", reductions.len());
        let (oracle, tolerance, ok) = match who {
            OF_C1 => (Some("24.2 %".to_owned()), "18 to 35 %", (18.0..=35.0).contains(&mean)),
            _ => (None, "less time", mean > 0.0),
        };
        rows.push(Item { paper_value: Some("about 27 %".to_owned()), ..item }, oracle, ours, tolerance.to_owned(), ok);
    }
}

/// By how much the first time is less than the second, %, and both in words.
fn reduced([ours, base]: [Option<f64>; 2]) -> (String, Option<f64>) {
    let text = |time: Option<f64>| time.map_or("not finished".to_owned(), |time| format!("{time:.1} s"));
    let reduction = ours.zip(base).map(|(ours, base)| 100.0 * (1.0 - ours / base));
    let percent = reduction.map_or("-".to_owned(), |reduction| format!("{reduction:.1} %"));
    (format!("{percent} ({} to {})", text(base), text(ours)), reduction)
}

/// The middle one.
fn median(values: &[f64]) -> Option<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| if n % 2 == 1 { values[n / 2] } else { 0.5 * (values[n / 2 - 1] + values[n / 2]) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::RobotOutcome;

    #[test]
    fn every_fleet_is_a_scenario() {
        for layout in case2().into_iter().chain([case1(1), case1(15)]) {
            for who in [C1, DEFAULT, LINEAR, CONSTANT, MAX3] {
                let scenario = who.scenario(&jittered(&layout, 7, JITTER_M), 1.0).ok();
                let scenario = scenario.unwrap_or_else(|| panic!("{}, {}", layout.name, who.name));
                assert_eq!(scenario.robots.len(), layout.scenario.robots.len());
                assert_eq!(scenario.obstacles.len(), layout.scenario.obstacles.len() + layout.paper.added_discs.len());
                assert_eq!(scenario.robots[0].params, who.params(), "{}", who.name);
            }
        }
    }

    #[test]
    fn batches_count_what_the_paper_counts() {
        let run = |times_s: [Option<f64>; 2], robots_m: f64, pillar_m: f64| Outcome {
            robots: times_s.map(|time_s| RobotOutcome { time_s, path_length_m: 4.0, ..RobotOutcome::default() }).into(),
            min_clearance_m: Some(robots_m - 0.44),
            min_obstacle_clearance_m: Some(pillar_m - 0.33),
            ..Outcome::default()
        };
        let mut batch = Batch::default();
        batch.add(&run([Some(40.0), Some(50.0)], 0.5, 0.3));
        batch.add(&run([Some(60.0), Some(42.0)], 0.27, 0.234));
        assert_eq!((batch.time_s(), batch.touching), (Some(55.0), 0));
        batch.add(&run([Some(41.0), None], 0.26, 0.3));
        batch.add(&run([None, None], 0.5, 0.23));
        assert_eq!((batch.time_s(), batch.failures, batch.touching), (None, 2, 2), "half of the runs are no median");
    }

    #[test]
    fn reductions_need_both_times() {
        assert_eq!(reduced([Some(30.0), Some(40.0)]), ("25.0 % (40.0 s to 30.0 s)".to_owned(), Some(25.0)));
        assert_eq!(reduced([Some(30.0), None]).1, None);
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0]), Some(2.5));
        assert_eq!(median(&[]), None);
    }
}
