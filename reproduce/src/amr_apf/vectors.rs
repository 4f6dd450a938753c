//! The worked examples of section 5.1, all of the vector file, and those that only the text has.

use super::oracle::{VECTORS, flag, list, number, pair, text};
use crate::row::{Item, Rows};
use nalgebra::{Point2, Vector2};
use planners::amr_apf::clusters::{Crowd, Member, crowd, force};
use planners::amr_apf::field::{Other, Own, attraction, mu, obstacle, robot};
use planners::amr_apf::speed::Body;
use planners::amr_apf::{Params, PillarGaps, Preset, pillar_gap, trap};
use planners::dapf::{self, Variant};
use serde_json::Value;
use std::f64::consts::FRAC_PI_2;

/// K1: worked examples.
const WORKED: f64 = 1e-5;
/// K1: forces of clusters, which the reference rounds to three decimals.
const CLUSTERS: f64 = 1e-3;
/// The printed digits of clusters' circles.
const PRINTED: f64 = 0.5e-6;

fn own(value: &Value, goal: &Value) -> Own {
    Own {
        position: Point2::new(number(&value["x"]), number(&value["y"])),
        heading_rad: number(&value["h"]),
        goal: pair(goal).into(),
        sgn_zero: true,
    }
}

/// ρ of obstacles and of robots.
fn rho(params: &Params) -> (f64, f64) {
    let (robot, pillar) = super::layouts::radii_m(params.preset == Preset::H);
    (robot + pillar + params.safety_m, 2.0 * robot + params.safety_m)
}

fn presets() -> [(&'static str, Params); 2] {
    // The examples are unrounded; sgn(0) and the flags are as in the programs.
    let programs = |preset| Params { sgn_zero: true, ..Params::of(preset) };
    [("P", programs(Preset::P)), ("H", programs(Preset::H))]
}

pub(super) fn rows(rows: &mut Rows<'_>) {
    rows.about(
        "paper, equations 1 to 10, as far as legible; specification, section 5.1 and its file of vectors",
        "the functions of planner amr-apf (presets p and h) and dapf for the inputs of the example",
        "the specification's K1: 1e-5, forces of clusters 1e-3",
    );
    precaution_radii(rows);
    magnitudes(rows);
    attractions(rows);
    speeds(rows);
    obstacles(rows);
    robots(rows);
    virtual_obstacle(rows);
    clusters(rows);
}

fn precaution_radii(rows: &mut Rows<'_>) {
    for (name, params) in presets() {
        let (rho_o, rho_r) = rho(&params);
        let oracle = &VECTORS["profiles"][name];
        let oracle = [number(&oracle["rho_obst"]), number(&oracle["rho_robot"])];
        rows.vector(Item::new(format!("ρ_o and ρ_r, {name}")), oracle, [rho_o, rho_r], 1e-12, "m");
    }
}

/// One row for each d/ρ: the size depends on nothing else. Ours is the value that is furthest off among all ρ.
fn magnitudes(rows: &mut Rows<'_>) {
    let ratio = |case: &Value| (number(&case["d"]) / number(&case["rho"]) * 1e6).round() / 1e6;
    let mut cases: Vec<&Value> = list(&VECTORS["magnitude"]).iter().collect();
    cases.sort_by(|a, b| ratio(a).total_cmp(&ratio(b)));
    for cases in cases.chunk_by(|a, b| ratio(a) == ratio(b)) {
        let value = number(&cases[0]["value"]);
        let ours = cases.iter().map(|case| mu(4.0, number(&case["d"]), number(&case["rho"])));
        let ours = ours.max_by(|a, b| (a - value).abs().total_cmp(&(b - value).abs())).unwrap_or(f64::NAN);
        rows.number(Item::new(format!("M1 μ at d/ρ = {}", ratio(cases[0]))), value, ours, WORKED, "");
    }
}

fn attractions(rows: &mut Rows<'_>) {
    for (i, case) in list(&VECTORS["attraction"]).iter().enumerate() {
        let (goal, d) = (pair(&case["goal"]), number(&case["d"]));
        let own = Own { position: Point2::origin(), heading_rad: 0.0, goal: goal.into(), sgn_zero: true };
        let mut row = |name: &str, key: &str, ours: f64| {
            rows.number(Item::new(format!("A{} {name}, goal at {d} m", i + 1)), number(&case[key]), ours, WORKED, "");
        };
        let d = (own.goal - own.position).norm();
        row("AMR", "AMR_f", attraction(&Params::of(Preset::P), &own).norm());
        for (name, key, variant) in [
            ("DAPF-lin", "lin2023_f", Variant::Lin),
            ("DAPF-const", "const2023_f", Variant::Const),
            ("DAPF-max4", "may2023_f", Variant::Max4),
            ("DAPF-H", "H2025_f", Variant::H),
        ] {
            row(name, key, dapf::Params::of(variant).attraction(d));
        }
    }
}

fn speeds(rows: &mut Rows<'_>) {
    let laws = [
        ("H", Params::of(Preset::H).speed_law()),
        ("C1", Params::of(Preset::C1).speed_law()),
        ("DAPF-H", dapf::Params::of(Variant::H).speed_law()),
        ("DAPF-lin", dapf::Params::of(Variant::Lin).speed_law()),
    ];
    let body = Body { c_a: 4.0, speed_mps_max: 0.2, dt_s: 0.1, blocked: false, sgn_zero: true };
    for case in list(&VECTORS["velocity"]) {
        let [f_r, f_t] = pair(&case["F_body"]);
        for (name, law) in &laws {
            let twist = law.twist(Vector2::new(f_r, f_t), &body);
            let item = Item::new(format!("V {name}, force ({f_r}, {f_t})"));
            rows.vector(item, pair(&case[*name]), [twist.speed_mps, twist.turn_radps], WORKED, "m/s, rad/s");
        }
    }
}

fn obstacles(rows: &mut Rows<'_>) {
    for case in list(&VECTORS["obstacle_force"]) {
        let own = own(&case["robot"], &case["goal"]);
        let at = Point2::from(pair(&case["obstacle"]));
        let name = text(&case["name"]);
        for (preset, params) in presets() {
            let ours = obstacle(&params, &own, at, rho(&params).0, 0.0, false);
            let specified = pair(&case[format!("{preset}_body")]);
            rows.vector(Item::new(format!("{name}: {preset}")), specified, ours.into(), WORKED, "");
        }
    }
}

fn robots(rows: &mut Rows<'_>) {
    for case in list(&VECTORS["robot_force"]) {
        let own = own(&case["robot"], &case["goal"]);
        let name = text(&case["name"]);
        let it = &case["other"];
        let heading_rad = number(&it["h"]);
        for (preset, params) in presets() {
            let other = Other {
                position: Point2::new(number(&it["x"]), number(&it["y"])),
                // The file has six digits; R9 asks whether a quarter turn is less than a quarter turn.
                heading_rad: if (heading_rad - FRAC_PI_2).abs() < 1e-6 { FRAC_PI_2 } else { heading_rad },
                parked: flag(&it["stopped"]) || flag(&it["reached"]),
                right_of_way: flag(&it["has_right_of_way"]),
                rho_m: rho(&params).1,
                apart_rad: 0.0,
            };
            let ours = robot(&params, &own, &other);
            let oracle = pair(&case[format!("{preset}_body")]);
            rows.vector(Item::new(format!("{name}: {preset}")), oracle, ours.force.into(), WORKED, "");
            if preset == "P" {
                let flags = [flag(&case["P_front_stop"]), flag(&case["P_yield_stop"])];
                let words = |[front, yields]: [bool; 2]| format!("front stop {front}, yield or follow stop {yields}");
                let ours = [ours.front_stop, ours.yields];
                rows.exact(Item::new(format!("{name}: P, flags")), words(flags), words(ours));
            } else {
                rows.exact(Item::new(format!("{name}: H, stop flag")), flag(&case["H_stop"]), ours.yields);
            }
        }
    }
}

fn virtual_obstacle(rows: &mut Rows<'_>) {
    let case = &VECTORS["virtual_obstacle"];
    let (parked, pillar) = (Point2::from(pair(&case["parked_robot"])), Point2::from(pair(&case["obstacle"])));
    let item = |what: &str| Item::new(format!("virtual obstacle: {what}"));
    let apart = (pillar - parked).norm();
    for (name, params) in presets() {
        let (rho_o, rho_r) = rho(&params);
        let radius = super::layouts::radii_m(name == "H").0;
        let ours = trap(&params, parked, pillar, rho_r, rho_o, radius);
        let oracle = &case[name];
        // Without one, nothing is equal to what is expected.
        let rho_m = ours.as_ref().map_or(f64::NAN, |ours| ours.rho_m);
        let center = ours.map_or([f64::NAN; 2], |ours| ours.center.into());
        rows.number(item(&format!("{name} ρ")), number(&oracle["rho"]), rho_m, WORKED, "m");
        rows.vector(item(&format!("{name} centre")), pair(&case["centre"]), center, WORKED, "m");
    }
    let readings = &case["paper_eq9_readings"];
    let [(_, p), _] = presets();
    let (rho_o, rho_r) = rho(&p);
    // Eq. 9 as the paper most likely means it, for two zones of different size: the same formula with their mean.
    let cover = Params { pillar_gaps: PillarGaps::Cover, ..p };
    let mean = (rho_o + rho_r) / 2.0;
    let ours = pillar_gap(&cover, apart, mean).unwrap_or(f64::NAN);
    let note = "another reading of the equation, d/2 + (ρ_i + ρ_j)/4, would give 0.630613 m; no planner uses it";
    rows.number(item("Eq. 9, (d + ρ_i + ρ_j)/2").note(note), number(&readings["(d+rho_i+rho_j)/2"]), ours, WORKED, "m");
}

fn clusters(rows: &mut Rows<'_>) {
    for case in list(&VECTORS["clusters"]) {
        let own = own(&case["robot"], &case["goal"]);
        let at = |value: &Value| Member { position: Point2::from(pair(value)), arrived: false };
        let members: Vec<Member> = list(&case["members"]).iter().map(at).collect();
        for (name, params) in presets() {
            let item = |what: &str| Item::new(format!("cluster of {}, {name}: {what}", members.len()));
            let oracle = &case[name];
            let radius = super::layouts::radii_m(name == "H").0;
            let Crowd::Around { center, rho_m } = crowd(&params, &own, radius, &members) else {
                rows.exact(item("acts"), true, false);
                continue;
            };
            rows.vector(item("centre"), pair(&oracle["centre"]), center.into(), PRINTED * (1.0 + 1e-6), "m");
            rows.number(item("ρ"), number(&oracle["rho"]), rho_m, PRINTED * (1.0 + 1e-6), "m");
            let ours = force(&params, &own, center, rho_m, false);
            rows.vector(item("force"), pair(&oracle["force_body"]), ours.into(), CLUSTERS, "");
        }
    }
}
