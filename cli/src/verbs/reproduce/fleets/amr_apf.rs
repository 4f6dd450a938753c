//! The growing fleet (case 1) and the random layouts (case 2), every robot a process, from starts moved by up to two
//! centimetres: single runs say little here.
//!
//! Robots and pillars have the radii that the methods plan with. Bodies are smaller, so a contact of the paper's robots
//! is taken from the smallest distance of a run, not from what the world counts.

use super::{Ran, Rows, Series, Stop, begin, lockstep};
use crate::exit::Failure;
use model::{Outcome, ParamValue, ParamValues, Robot, Scenario};
use reproduce::amr_apf::layouts::{case1, case2, radii_m};
use reproduce::amr_apf::replay::jittered;
use reproduce::row::{Form, Item};
use reproduce::scene::Scene;
use reproduce::stats;
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
/// What a fleet drives by if nothing else is said: with brakes and detours, which the paper lacks.
const FLEET: Contestant = contestant("AMR fleet", "amr-apf", &[("preset", "fleet")]);
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
    /// Operation times by start, s; `None` where not all arrive, or the run does not count.
    by_start_s: Vec<Option<f64>>,
    /// Those of the runs in which all arrived, s.
    times_s: Vec<f64>,
    /// Mean ways of the same runs, m.
    ways_m: Vec<f64>,
    failures: usize,
    /// Runs in which bodies touch each other or a pillar.
    touching: usize,
    /// Why runs are not evidence: starved or impaired. Such runs are excluded from all counts.
    unusable: Vec<String>,
}

impl Batch {
    fn add_run(&mut self, ran: Ran) {
        match ran.unusable {
            Some(because) => {
                self.unusable.push(because);
                self.by_start_s.push(None);
            }
            None => self.add(&ran.outcome),
        }
    }

    /// Runs that count.
    fn runs(&self) -> usize {
        self.times_s.len() + self.failures
    }

    fn add(&mut self, outcome: &Outcome) {
        let times: Option<Vec<f64>> = outcome.robots.iter().map(|robot| robot.time_s).collect();
        match times {
            Some(times) => {
                let slowest_s = times.into_iter().fold(0.0, f64::max);
                self.by_start_s.push(Some(slowest_s));
                self.times_s.push(slowest_s);
                let way_m: f64 = outcome.robots.iter().map(|robot| robot.path_length_m).sum();
                self.ways_m.push(way_m / outcome.robots.len() as f64);
            }
            None => {
                self.by_start_s.push(None);
                self.failures += 1;
            }
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
const OF_BASE: usize = 2;
/// Of fewer starts a median of one fleet says nothing.
const STARTS_MIN: usize = 5;
/// By as much as the paper rounds its percentages.
const POINTS: f64 = 3.1;

/// How many fleets there are for each start.
pub(super) fn fleets() -> usize {
    experiments().iter().map(|experiment| experiment.layouts.len() * experiment.contestants.len()).sum()
}

fn experiments() -> [Experiment; 2] {
    let first = Experiment {
        name: "case 1",
        place: "robots",
        contestants: &[C1, FLEET, LINEAR, CONSTANT],
        layouts: (1..=15).map(case1).collect(),
        duration_s: 250.0,
    };
    let second = Experiment {
        name: "case 2",
        place: "layout",
        contestants: &[C1, FLEET, MAX3],
        layouts: case2(),
        duration_s: 150.0,
    };
    [first, second]
}

pub(super) fn run(runs: u32, rows: &mut Rows<'_>, series: &mut Vec<Series>) -> Result<(), Stop> {
    let [first, second] = experiments();
    let found = first.run(runs, rows)?;
    first.about(rows, runs);
    case1_rows(rows, &found);
    first.failures(rows, &found);
    series.extend(first.charts(&found));
    let found = second.run(runs, rows)?;
    second.about(rows, runs);
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
                batch.add_run(lockstep(who.scenario(&layout, self.duration_s)?)?);
            }
            Ok(batch)
        };
        let mut batches = |layout| self.contestants.iter().map(|who| batch(layout, who)).collect();
        self.layouts.iter().map(&mut batches).collect()
    }

    fn about(&self, rows: &mut Rows<'_>, runs: u32) {
        rows.about(
            "paper, evaluation; specification, sections 4.1, 4.2 and 5.3",
            format!(
                "{}: every robot a process, lockstep at 10 Hz, poses one tick old; C1 is planner amr-apf with preset c1, the \
                 baselines are planner dapf; {runs} sets of starts moved by up to 2 cm",
                self.name
            ),
            format!("{POINTS} percentage points, by as much as the paper rounds; counts over all fleets"),
        );
    }

    /// How often not all arrive, against the baseline; and whether bodies touch.
    fn failures(&self, rows: &mut Rows<'_>, found: &Found) {
        let name = self.contestants[OF_BASE].name;
        let item = Item::new(format!("{} {MODE}: failures of C1 against {name}", self.name));
        let count = |who: usize| found.iter().map(|batches| batches[who].failures).sum::<usize>();
        let [ours, base] = [OF_C1, OF_BASE].map(count);
        let text = format!("{ours} against {base}");
        judged(rows, item, found, &[OF_C1, OF_BASE], |rows, item| {
            rows.push(item, Some("no more".to_owned()), text, "no more in all".to_owned(), ours <= base);
        });
        let touching: usize = found.iter().map(|batches| batches[OF_C1].touching).sum();
        let runs: usize = found.iter().map(|batches| batches[OF_C1].runs()).sum();
        let item = Item::new(format!("{} {MODE}: runs of C1 in which bodies touch", self.name))
            .why("the specification's nominal runs have no contact (K13); the planner has no guard against it");
        judged(rows, item, found, &[OF_C1], |rows, item| {
            rows.exact(item.note(format!("{touching} of {runs} runs")), 0, touching);
        });
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

/// Adds a row unless too many runs of these contestants are not evidence: all runs of one scene.
fn judged(rows: &mut Rows<'_>, item: Item, found: &Found, who: &[usize], row: impl FnOnce(&mut Rows<'_>, Item)) {
    let batches = || found.iter().flat_map(|batches| who.iter().map(|who| &batches[*who]));
    let unusable: Vec<&String> = batches().flat_map(|batch| &batch.unusable).collect();
    let Some(first) = unusable.first() else { return row(rows, item) };
    let because = format!("{} runs do not count, the first because {first}", unusable.len());
    if batches().any(|batch| batch.runs() == 0) {
        rows.no_evidence(item, None, &because, false);
    } else {
        row(rows, item.note(because));
    }
}

/// The headline of case 1: how much less time than the baseline. The paper's text has 35 % for two robots and 50 % for
/// fifteen.
fn case1_rows(rows: &mut Rows<'_>, found: &Found) {
    let reductions: Vec<f64> = found.iter().flat_map(|batches| each_reduced(batches)).collect();
    let faster = reductions.iter().filter(|reduction| **reduction > 0.0).count();
    let (n, p) = (reductions.len(), stats::sign(faster as u32, reductions.len() as u32));
    let item = Item::new(format!("case 1 {MODE}: less time than DAPF linear"))
        .against_paper("less time with every number of robots", "sign test, 1 %", p < stats::LEVEL && 2 * faster > n)
        .why("a sign test at 1 % over the fleets that both bring home, one start of one number of robots each")
        .headline(format!(
            "With every robot a process the fleet is faster than the linear baseline in {faster} of {n} runs that both finish."
        ));
    let text = format!("faster in {faster} of {n} runs");
    judged(rows, item, found, &[OF_C1, OF_BASE], |rows, item| rows.claim(item, text));
    for (robots, printed) in [(2, 35.0), (15, 50.0)] {
        let batches = &found[robots - 1];
        let (ours, reduction) = reduced([OF_C1, OF_BASE].map(|who| batches[who].time_s()));
        let holds = reduction.is_some_and(|reduction| (reduction - printed).abs() <= POINTS);
        let item = Item::new(format!("case 1 {MODE}, {robots} robots: less time than DAPF linear"))
            .against_paper(format!("{printed} %"), format!("± {POINTS} percentage points"), holds)
            .note("medians over moved starts of the runs in which all arrive");
        enough(rows, item, std::slice::from_ref(batches), |rows, item| rows.claim(item, ours));
    }
}

/// Adds a row about medians over the starts of each of these fleets, if there are enough starts.
fn enough(rows: &mut Rows<'_>, item: Item, found: &[Vec<Batch>], row: impl FnOnce(&mut Rows<'_>, Item)) {
    let batches = || found.iter().flat_map(|batches| [OF_C1, OF_BASE].map(|who| &batches[who]));
    let least = batches().map(Batch::runs).min().unwrap_or(0);
    if least >= STARTS_MIN {
        return row(rows, item);
    }
    let unusable: Vec<&String> = batches().flat_map(|batch| &batch.unusable).collect();
    let because = match unusable.first() {
        None => format!("starts: {least}; a median needs {STARTS_MIN} (`--runs {STARTS_MIN}`)"),
        Some(first) => format!(
            "starts: {least}; a median needs {STARTS_MIN}, and {} runs do not count, the first because {first}",
            unusable.len()
        ),
    };
    rows.no_evidence(item, None, &because, unusable.is_empty());
}

/// By how much less time the proposed method takes, %, start by start.
fn each_reduced(batches: &[Batch]) -> Vec<f64> {
    let [ours, base] = [OF_C1, OF_BASE].map(|who| &batches[who].by_start_s);
    ours.iter().zip(base).filter_map(|(ours, base)| ours.zip(*base)).map(|(ours, base)| percent(ours, base)).collect()
}

/// The mean reduction of case 2, over the layouts that both finish.
fn case2_rows(rows: &mut Rows<'_>, found: &Found) {
    let medians = |batches: &Vec<Batch>| reduced([OF_C1, OF_BASE].map(|who| batches[who].time_s())).1;
    let reductions: Vec<f64> = found.iter().filter_map(medians).collect();
    let mean = stats::mean(&reductions);
    let holds = (mean - 27.0).abs() <= POINTS;
    let item = Item::new(format!("case 2 {MODE}: mean reduction of C1 against DAPF max3"))
        .against_paper("about 27 %", format!("± {POINTS} percentage points"), holds)
        .note("over the layouts that both finish, at 10 Hz; the authors' simulator ran at 4.5 Hz");
    let ours = format!("{mean:.1} % in {} layouts", reductions.len());
    let ok = (mean - 24.2).abs() <= POINTS;
    enough(rows, item, found, |rows, item| {
        rows.push(item, Some("24.2 %".to_owned()), ours, format!("± {POINTS} points"), ok);
    });
}

/// By how much the first time is less, %.
fn percent(ours: f64, base: f64) -> f64 {
    100.0 * (1.0 - ours / base)
}

/// By how much the first time is less than the second, %, and both in words.
fn reduced([ours, base]: [Option<f64>; 2]) -> (String, Option<f64>) {
    let text = |time: Option<f64>| time.map_or("not finished".to_owned(), |time| format!("{time:.1} s"));
    let reduction = ours.zip(base).map(|(ours, base)| percent(ours, base));
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
            for who in [C1, FLEET, LINEAR, CONSTANT, MAX3] {
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

    /// A starved run counts for nothing, and rows that rest on nothing else say so.
    #[test]
    fn starved_runs_are_no_evidence() {
        let robot = RobotOutcome { time_s: Some(40.0), path_length_m: 4.0, ..RobotOutcome::default() };
        let outcome = Outcome { robots: vec![robot; 2], ..Outcome::default() };
        let ran = |unusable: Option<&str>| Ran { outcome: outcome.clone(), unusable: unusable.map(str::to_owned) };
        let batches = |starved: usize| -> Vec<Batch> {
            let mut batches = [(); 3].map(|()| Batch::default());
            for batch in &mut batches {
                (0..5).for_each(|i| batch.add_run(ran((i < starved).then_some("the run was starved: a straggler"))));
            }
            batches.into()
        };
        let judged = |found: Found| {
            let mut quiet = |_: &str| std::ops::ControlFlow::Continue(());
            let mut rows = Rows::new(&reproduce::amr_apf::PAPER, &mut quiet);
            let experiment = Experiment {
                name: "case 1",
                place: "robots",
                contestants: &[C1, FLEET, LINEAR],
                layouts: Vec::new(),
                duration_s: 1.0,
            };
            case1_rows(&mut rows, &found);
            experiment.failures(&mut rows, &found);
            rows.finish()
        };
        let all = |starved: usize| judged((0..15).map(|_| batches(starved)).collect());
        let none = |row: &reproduce::Row| row.verdict == reproduce::Verdict::NoEvidence;
        assert!(!all(0).iter().any(none));
        let some = all(1);
        let (medians, counts): (Vec<_>, Vec<_>) =
            some.iter().partition(|row| row.item.contains(", 2 robots") || row.item.contains(", 15 robots"));
        assert!(medians.iter().all(|row| none(row) && !row.named), "{medians:#?}");
        assert!(counts.iter().all(|row| !none(row) && row.note.contains("do not count")), "{counts:#?}");
        let starved = all(5);
        assert!(starved.iter().all(|row| none(row) && row.note.contains("starved")), "{starved:#?}");
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
