//! The liquid methods: where they arrive, and what is ours: fleets and other bodies.

use model::BodyKind;
use shoal_reproduce::liquid::PAPER;
use shoal_reproduce::scene::scene;
use shoal_reproduce::stepper::{Run, Stepper};

#[test]
fn it_arrives_where_the_field_stops_and_not_everywhere() {
    let rows = PAPER.all_rows();
    let own = |item: &str| rows.iter().find(|row| row.item == item);
    // What arrives has a time, or a number of steps; what does not says so.
    let ours = |item: String| match own(&item) {
        Some(row) => row.ours.as_str(),
        None => {
            let method = item.strip_suffix(": arrives").expect("it asks for arrivals");
            let listed = ["time", "motion steps"].map(|key| own(&format!("{method}: {key}")));
            assert!(listed.iter().flatten().any(|row| row.holds()), "{item}");
            "true"
        }
    };

    // Khatib's field stops, before a local minimum or before a goal near an obstacle, where thinking first arrives.
    for name in ["two_obstacles", "gap", "near_goal", "ring_side", "u_shallow", "u_trap", "u_resonance"] {
        for khatib in ["khatib-second-order", "khatib-first-order"] {
            assert_eq!(ours(format!("liquid_{name} {khatib}: arrives")), "false", "{name}");
        }
        assert_eq!(ours(format!("liquid_{name} liquid-offline: arrives")), "true", "{name}");
    }
    // Its oscillation in narrow passages comes with the coarse tick.
    for name in ["corridor", "corridor_tight", "ring_front", "clogged"] {
        assert_eq!(ours(format!("liquid_{name} khatib-second-order: arrives")), "true", "{name}");
        assert_eq!(ours(format!("liquid_{name} khatib-first-order: arrives")), "false", "{name}");
    }
    // Neither variant is complete, and neither is better than the other everywhere.
    assert_eq!(ours("liquid_clogged liquid-offline: arrives".into()), "false");
    assert_eq!(ours("liquid_clogged liquid-online: arrives".into()), "true");
    assert_eq!(ours("liquid_u_resonance liquid-offline: arrives".into()), "true");
    assert_eq!(ours("liquid_u_resonance liquid-online: arrives".into()), "false");
}

fn run(name: &str, planner: &str, kind: BodyKind) -> Stepper {
    Run::as_in_a_fleet(scene(name), planner, kind).run()
}

/// With default parameters and poses one tick old, as in the runtime: the fleets of the decentralised potential field.
#[test]
fn fleets_arrive_without_contact() {
    for name in ["apf_antipodal8", "apf_cross4", "apf_dynamic", "apf_headon", "apf_headon_offset", "apf_close_goals_15"]
    {
        for method in ["liquid", "liquid-online"] {
            for kind in [BodyKind::Point, BodyKind::Unicycle] {
                let outcome = run(name, method, kind);
                let clearance = outcome.clearance_m();
                assert!(outcome.all_arrived(), "{name} {method} {kind:?}: {:?}", outcome.arrival_ticks);
                assert!(clearance > 0.15, "{name} {method} {kind:?}: {clearance:.3}");
            }
        }
    }
}

/// Alone among what stands and what moves.
#[test]
fn single_robots_arrive_without_contact() {
    let everywhere =
        ["rpoa_static", "rpoa_u_trap", "rpoa_moving6", "rpoa_orbiter", "pso_mass_point_1", "pso_mass_point_2"];
    for name in everywhere {
        for method in ["liquid", "liquid-online"] {
            for kind in [BodyKind::Point, BodyKind::Unicycle] {
                let outcome = run(name, method, kind);
                assert!(outcome.all_arrived(), "{name} {method} {kind:?}");
                assert!(
                    outcome.obstacles.clearance_m > 0.05,
                    "{name} {method} {kind:?}: {:.3}",
                    outcome.obstacles.clearance_m
                );
            }
        }
    }
    // The paper's own maps, for a unicycle that thinks first.
    for name in ["two_obstacles", "gap", "near_goal", "corridor", "ring_side", "u_shallow", "u_trap", "u_resonance"] {
        let outcome = run(&format!("liquid_{name}"), "liquid", BodyKind::Unicycle);
        assert!(
            outcome.all_arrived() && outcome.obstacles.clearance_m > 0.0,
            "{name}: {:.3}",
            outcome.obstacles.clearance_m
        );
    }
}
