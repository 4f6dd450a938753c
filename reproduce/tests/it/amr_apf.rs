//! AMR-APF and its baseline: what the rows say about its claims, and that they bite: no other rule passes them.
//!
//! All of its rows are in `papers.rs`.

use planners::amr_apf::{Params, Preset, Side, Which};
use planners::dapf::Variant;
use shoal_reproduce::amr_apf::layouts::{case1, case2};
use shoal_reproduce::amr_apf::replay::{Method, Program, amr, dapf};
use shoal_reproduce::amr_apf::{PAPER, deterministic};
use shoal_reproduce::{Row, Rows};
use std::ops::ControlFlow;

/// Worked examples and step counts.
#[test]
fn rows_that_are_exact_hold_but_those_named() {
    let mut quiet = |_: &str| ControlFlow::Continue(());
    let mut rows = Rows::new(&PAPER, &mut quiet);
    assert!(deterministic(&mut rows).is_continue());
    let rows = rows.finish();
    let differ: Vec<&Row> = rows.iter().filter(|row| !row.holds()).collect();
    assert!(differ.iter().all(|row| row.named), "{differ:#?}");
    assert_eq!(differ.len(), 2, "{differ:#?}");
    assert_eq!(rows.len(), 250);
}

/// What the two headline numbers are made of: 35 % is the baseline's own slowness, not other robots.
#[test]
fn one_robot_alone_is_already_a_third_faster_than_the_linear_baseline() {
    let time_s = |program: Program| program.run(&case1(1)).time_s();
    let (ours, lin, constant) = (time_s(amr(Preset::C1)), time_s(dapf(Variant::Lin)), time_s(dapf(Variant::Const)));
    assert!((0.33..0.38).contains(&(1.0 - ours / lin)), "{ours} against {lin}");
    assert!((0.06..0.12).contains(&(1.0 - ours / constant)), "{ours} against {constant}");
}

/// A program with something changed.
fn changed(preset: Preset, change: impl Fn(&mut Params)) -> Program {
    let Method::Amr(mut params) = amr(preset).method else { unreachable!("AMR-APF was asked for") };
    change(&mut params);
    Program::amr(params)
}

type Change = (&'static str, fn(&mut Params));

/// Every rule of the programs, taken away or changed a little. The commands along a run of fifteen robots, or of eight in
/// a layout with parked robots, are then not those of the equations any more.
#[test]
fn no_other_rule_gives_the_same_commands() {
    let layouts = [case1(15), case2().swap_remove(3)];
    let agrees = |program: &Program| {
        let found = layouts.each_ref().map(|layout| program.clone().for_seconds(60.0).commands(layout));
        assert!(found.iter().all(|found| found.all > 1000));
        found.iter().all(|found| found.agree == found.all)
    };
    for preset in [Preset::C1, Preset::P] {
        assert!(agrees(&amr(preset)), "{preset:?} as it is");
    }
    let both: [Change; 16] = [
        ("attraction", |p| p.c_a = 3.9),
        ("doubled near the goal", |p| p.near_goal_m = 0.4),
        ("safety distance", |p| p.safety_m = 0.071),
        ("goal side of pillars", |p| p.phi_o_deg = 15.0),
        ("tangential force of pillars", |p| p.k_o += 0.1),
        ("tangential force of robots, far ring", |p| p.k_r_far = 2.1),
        ("tangential force of robots, near ring", |p| p.k_r_near = 3.9),
        ("cone of the front stop", |p| p.front_half_angle_deg *= 0.8),
        ("reach of crowds", |p| p.c_r *= 0.9),
        ("crowds near the goal", |p| p.c_g *= 0.9),
        ("links of crowds", |p| p.c_adj = 2.1),
        ("radius of crowds", |p| p.c_rad = 2.4),
        ("no crowds", |p| p.clusters = Which::Off),
        ("stopped is told for good", |p| p.sticky_stop = false),
        ("traps", |p| p.traps = planners::amr_apf::Traps::Off),
        ("creep", |p| p.creep *= 0.9),
    ];
    for (what, change) in both {
        for preset in [Preset::C1, Preset::P] {
            assert!(!agrees(&changed(preset, change)), "{preset:?}: {what}");
        }
    }
    let of_c1: [Change; 3] = [
        ("side by right of way", |p| p.side = Side::RightOfWay),
        ("one crowd only", |p| p.clusters = Which::Largest),
        ("no force of a robot that leaves", |p| p.yield_without_force = false),
    ];
    let of_p: [Change; 4] = [
        ("no right of way", |p| p.right_of_way = false),
        ("side by headings", |p| p.side = Side::Offsets),
        ("all crowds", |p| p.clusters = Which::All),
        ("no follow stop", |p| p.follow_stop = false),
    ];
    for (what, change) in of_c1 {
        assert!(!agrees(&changed(Preset::C1, change)), "C1: {what}");
    }
    for (what, change) in of_p {
        assert!(!agrees(&changed(Preset::P, change)), "P: {what}");
    }
}

/// The baseline too.
#[test]
fn no_other_baseline_gives_the_same_commands() {
    for variant in [Variant::Lin, Variant::Const, Variant::Max3, Variant::Max4] {
        let found = dapf(variant).for_seconds(60.0).commands(&case1(12));
        assert_eq!(found.agree, found.all, "{variant:?}: {:?}", found.first);
        let Method::Dapf(params) = dapf(variant).method else { unreachable!("the baseline was asked for") };
        let other = Program::dapf(planners::dapf::Params { safety_m: params.safety_m + 0.001, ..params.clone() });
        let found = other.for_seconds(60.0).commands(&case1(12));
        assert!(found.agree < found.all, "{variant:?}");
        let fair = Program::dapf(planners::dapf::Params { right_of_way: true, ..params });
        let found = fair.for_seconds(60.0).commands(&case1(12));
        assert!(found.agree < found.all, "{variant:?} with a right of way that works");
    }
}
