//! AMR-APF: worked examples, the programs' step counts to the last one, and the specification's replays of the paper's two
//! experiments.
//!
//! Where things are: [`layouts`] has the paper's maps and jobs, [`replay`] the authors' programs as runs of the stepper;
//! `claims` the headline claims; `vectors` the worked examples; `forces` the force maps; `late` the program of 2025 (preset `h`), whose step counts
//! are exact; `early` and `case2` those of 2023 (`c1`, `p`); `moved` medians over moved starts; `commands` compares every
//! command of a run with `reference`, the specification's equations written down a second time; `stored` has what the
//! authors' own runs say.
//!
//! Tolerances: worked examples 1e-5 (forces of clusters 1e-3), step counts exact, snapshots 1e-3, the specification's.
//! Times of 2023 are exact to the printed digit where nothing is left to rounding. With four robots and more, which of
//! three equally small rectangles stands around three robots is, and the time of a run follows from it: there every
//! command of the run is compared instead. Medians over moved starts, shares and means of reductions are compared by exact
//! tests and intervals with a stated confidence.

mod case2;
mod claims;
pub mod commands;
mod early;
mod forces;
mod late;
pub mod layouts;
mod moved;
mod oracle;
pub mod reference;
pub mod replay;
mod stored;
mod vectors;

use crate::row::{Form, Line, Paper, Rows, Series};
use crate::scene::Scene;
use crate::stepper::line;
use layouts::{case1, case2, demos, radii_m};
use planners::amr_apf::Preset;
use planners::dapf::Variant;
use replay::{Outcome, Program, amr, dapf};
use std::ops::ControlFlow;

/// The paper.
pub static PAPER: Paper = Paper {
    name: "amr-apf",
    citation: "AMR-APF: an artificial potential field for many mobile robots (in Persian), Modares Mechanical Engineering \
               24(7), 2024; cf. ECMR 2025, doi 10.1109/ECMR65884.2025.11163011",
    silence: "only percentages of the paper's text are legible; numbers are the specification's, which was checked against \
              the authors' programs",
    differs: DIFFERS,
    rows,
    steps: 124,
    series,
};

/// By as much as the paper rounds its percentages: its 50 % is 46.9 % in its authors' runs.
const PAPER_POINTS: f64 = 3.1;

/// All values are stored or printed with a limited number of digits, and the missing digits decide these runs.
const DIGITS: &str = "decided by digits that are not stored: layouts have 0.1 mm, and everything moved by half a millimetre \
                      gives the specification's time too";

const DIFFERS: &[(&str, &str)] = &[
    (
        "claim: fifteen robots, less time than DAPF-lin",
        "the paper compares its run with one of another series; within one series its authors' runs give 27.0 % and 35.5 %",
    ),
    ("claim: fifteen robots, time saved", "as for the percentage: two series are mixed"),
    (
        "K3, K4 H case 1, AMR_with_clusters, 14 robots: steps of the slowest",
        "two steps of 1160 are not found; the other 44 counts, the robots one by one at n = 5 and case 2 agree. Not the last \
         bit of any formula, which changes nothing, nor any other order of rounding, ties, limits and exceptions. The run is \
         a fragile one: starts moved by 1e-15 m give 1080 to 1241",
    ),
    (
        "K11 H case 2 layout 1, DAPF: steps of the slowest : robots arrived",
        "decided by digits that are not stored: everything moved by 0.05 mm gives 1594 to 1707",
    ),
    (
        "case 1, DAPF_linear, 12 robots: replay",
        "the only one of 45 baseline runs that rounding decides: everything moved by 0.05 mm gives 84.7 to 131.5 s. All of its \
         commands are those of the equations",
    ),
    (
        "K9 demonstration crossing, DAPF: the nearest of the moves",
        "two robots that meet at a right angle push each other for as long as symmetry lasts: the moves give 19.9 to 37.5 s",
    ),
    ("case 2 layout 10, DAPF_max3, period 0.1 s: time", DIGITS),
    ("case 2 layout 10, DAPF_max4, period 0.1 s: time", DIGITS),
    ("case 2 layout 12, DAPF_max4, period 0.1 s: time", DIGITS),
    ("case 2 layout 10, DAPF_max4, period 0.22 s: time", DIGITS),
    ("case 2 layout 11, DAPF_linear, period 0.22 s: time", DIGITS),
    (
        "case 2, period 0.1 s, C1_vs_max3: mean reduction",
        "in layout 10 the baseline takes 75.4 s in the specification's replay and 64.1 to 65 s in all of ours",
    ),
    (
        "extra layouts, C1 against DAPF-max3: mean reduction",
        "the authors do not say which baseline theirs was; with DAPF-lin the number comes out",
    ),
    (
        "case 1, C1 smallest enclosing circle, 5 robots, starts moved by 2 cm: median time",
        "a proposal of the specification, not the paper's: it does not say which circle stands around two robots",
    ),
    (
        "case 1 as processes, 2 robots: less time than DAPF linear",
        "centimetres of the second robot's start decide how long the baseline takes: 65 to 73 s",
    ),
    (
        "case 1 as processes, 15 robots: less time than DAPF linear",
        "as in one thread: the paper's 50 % mixes two series of its authors' runs",
    ),
    (
        "case 1 as processes: runs of C1 in which bodies touch",
        "the planner has no guard against contact, and these starts are not the nominal ones: 1 of 75 runs with 5 starts each",
    ),
];

fn rows(rows: &mut Rows<'_>) -> ControlFlow<()> {
    claims::rows(rows)?;
    deterministic(rows)?;
    late::jitter_rows(rows)?;
    early::case1_rows(rows)?;
    early::single_rows(rows)?;
    case2::rows(rows)?;
    case2::extra_rows(rows)?;
    moved::rows(rows)
}

/// The rows that are exact and quick: worked examples, and all of the program of 2025 from nominal starts.
pub fn deterministic(rows: &mut Rows<'_>) -> ControlFlow<()> {
    rows.begin("worked examples")?;
    vectors::rows(rows);
    rows.begin("force maps")?;
    forces::rows(rows);
    late::case1_rows(rows)?;
    late::case2_rows(rows)
}

fn series() -> Vec<Series> {
    let mut all = vec![late_chart()];
    all.extend(case1_charts().into_iter().chain(case2_charts()));
    for (name, method, program, robots) in [
        ("c1", "AMR-APF C1", amr(Preset::C1), 5),
        ("c1", "AMR-APF C1", amr(Preset::C1), 15),
        ("dapf-lin", "DAPF linear", dapf(Variant::Lin), 15),
    ] {
        all.push(paths(&format!("amr-apf-case1-{robots}-{name}"), method, &program, &case1(robots)));
    }
    for (name, method, program) in
        [("c1", "AMR-APF C1", amr(Preset::C1)), ("dapf-max3", "DAPF max3", dapf(Variant::Max3))]
    {
        all.push(paths(&format!("amr-apf-case2-01-{name}"), method, &program.for_seconds(150.0), &case2()[0]));
    }
    for (layout, figure) in demos().iter().zip(["single", "head-on", "crossing", "gate"]) {
        let layout = unsymmetrical(layout);
        for (name, method, program) in
            [("p", "AMR-APF P", amr(Preset::P)), ("dapf-max4", "DAPF max4", dapf(Variant::Max4))]
        {
            all.push(paths(&format!("amr-apf-demo-{figure}-{name}"), method, &program.for_seconds(100.0), &layout));
        }
    }
    all.extend(forces::series());
    all
}

/// A demonstration is exactly symmetrical as drawn; a hair off, the two sides differ.
fn unsymmetrical(layout: &Scene) -> Scene {
    let mut layout = layout.clone();
    layout.robot_mut().start.y += 0.007;
    layout.robot_mut().start_yaw_rad += 0.01;
    layout
}

/// Operation time and mean path over the number of robots: the paper's charts of case 1.
fn case1_charts() -> [Series; 2] {
    let mut lines: [Vec<Line>; 2] = Default::default();
    for (name, program, authors) in early::case1_methods() {
        let name = name.replace('_', " ");
        let outcomes: Vec<_> = (1..=15).map(|robots| program.run(&case1(robots))).collect();
        let of = |value: fn(&Outcome) -> f64| (1..).zip(&outcomes).map(|(n, run)| [f64::from(n), value(run)]).collect();
        lines[0].push((name.clone(), of(Outcome::time_s)));
        lines[1].push((name.clone(), of(Outcome::mean_path_m)));
        let Some(table) = authors else { continue };
        let stored = |i: usize| {
            let best = |robots: u32| oracle::authors_best(table, &robots.to_string()).map(|best| [best.0, best.1][i]);
            (1..=15).filter_map(|robots| best(robots).map(|value| [f64::from(robots), value])).collect()
        };
        (0..2).for_each(|i| lines[i].push((format!("{name} (authors, Gazebo)"), stored(i))));
    }
    time_and_path("case1", Form::Lines, "robots", "case 1: {} over the number of robots", lines)
}

/// Operation time and mean path per layout: the paper's charts of case 2. Layouts that a method does not finish have no bar.
fn case2_charts() -> [Series; 2] {
    let layouts = case2();
    let mut lines: [Vec<Line>; 2] = Default::default();
    for (name, program) in [("DAPF max3", dapf(Variant::Max3)), ("AMR C1", amr(Preset::C1))] {
        let program = program.for_seconds(150.0);
        let outcomes: Vec<_> = layouts.iter().map(|layout| program.run(layout)).collect();
        let of = |value: fn(&Outcome) -> f64| {
            let finished = (1..).zip(&outcomes).filter(|(_, outcome)| outcome.all_arrived());
            finished.map(|(layout, outcome)| [f64::from(layout), value(outcome)]).collect()
        };
        lines[0].push((name.to_owned(), of(Outcome::time_s)));
        lines[1].push((name.to_owned(), of(Outcome::mean_path_m)));
    }
    for (name, table) in [("DAPF (authors, Gazebo)", "case2_o15_DAPF"), ("AMR (authors, Gazebo)", "case2_o15_AMR")] {
        for (i, lines) in lines.iter_mut().enumerate() {
            let best = |layout: u32| oracle::authors_best(table, &layout.to_string()).map(|best| [best.0, best.1][i]);
            let points = (1..=12).filter_map(|layout| best(layout).map(|value| [f64::from(layout), value]));
            lines.push((name.to_owned(), points.collect()));
        }
    }
    time_and_path("case2", Form::Bars, "layout", "case 2: {} in twelve random layouts, 8 robots", lines)
}

/// The two charts of a case, from the lines of operation times, s, and of mean paths, m. `{}` in the title is what they show.
fn time_and_path(case: &str, form: Form, x: &str, title: &str, [times, paths]: [Vec<Line>; 2]) -> [Series; 2] {
    let chart = |name: &str, what: &str, unit: &str, lines: Vec<Line>| {
        let file = format!("amr-apf-{case}-{name}");
        Series::chart(form, file, title.replace("{}", what), [x, &format!("{what} ({unit})")], lines)
    };
    [chart("time", "operation time", "s", times), chart("path", "mean path", "m", paths)]
}

/// Control steps over the number of robots, program of 2025.
fn late_chart() -> Series {
    let line = |(name, program): (&str, Program)| {
        let runs = (1..=15).map(|robots| (robots, program.run(&case1(robots)).slowest()));
        let points = runs.filter_map(|(robots, steps)| steps.map(|steps| [robots as f64, steps as f64]));
        (name.replace('_', " "), points.collect())
    };
    Series::chart(
        Form::Lines,
        "amr-apf-case1-steps-2025",
        "case 1, program of 2025: control steps of the slowest robot",
        ["robots", "steps of 0.05 s"],
        late::methods().into_iter().map(line).collect(),
    )
}

fn paths(name: &str, method: &str, program: &Program, layout: &Scene) -> Series {
    let outcome = program.run(layout);
    let path = |robot: usize| {
        let start = layout.scenario.robots[robot].start;
        let poses = outcome.poses.iter().map(|bodies| bodies[robot].position);
        let path: Vec<_> = std::iter::once(start).chain(poses).collect();
        (format!("robot {}", robot + 1), line(&path))
    };
    let (robots, (_, pillar_m)) = (layout.scenario.robots.len(), radii_m(false));
    Series::paths(
        name.to_owned(),
        format!("{}, {method}: paths, {} of {} arrive", layout.name, outcome.arrived(), robots),
        (0..robots).map(path).collect(),
        layout.drawn().into_iter().map(|[x, y, _]| [x, y, pillar_m]).collect(),
    )
}

/// By how much less time than the baseline, %.
fn reduction_percent(ours: f64, base: f64) -> f64 {
    100.0 * (1.0 - ours / base)
}
