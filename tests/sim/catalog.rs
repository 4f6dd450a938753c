//! Every scenario of the catalog does what it says, not for one lucky seed only.

use shoal_tests::{Recording, build, catalog, seeds};

fn check(name: &str) {
    let own = catalog(name, &Default::default()).clock.seed;
    seeds(std::iter::once(own).chain(101..=109), |seed| {
        let report = Recording::of(&catalog(name, &build::seed(seed))).report();
        assert_eq!(report.exit_code, 0, "{name}, seed {seed}: {:#?}\n{:#?}", report.unmet, report.outcome);
        assert!(report.unmet.is_empty());
    });
}

macro_rules! each {
    ($($test:ident: $name:literal),* $(,)?) => {
        $(#[test] fn $test() { check($name); })*

        #[test]
        fn none_is_forgotten() {
            assert_eq!(shoal_tests::catalog_names().collect::<Vec<_>>(), [$($name),*]);
        }
    };
}

each! {
    demo_15: "demo-15",
    ring_15: "ring-15",
    head_on: "head-on",
    corridor_swap: "corridor-swap",
    late_join: "late-join",
    tasks: "tasks",
    moving_obstacles: "moving-obstacles",
    unicycle_15: "unicycle-15",
    scale_64: "scale-64",
    liquid_gap: "liquid-gap",
    liquid_near_goal: "liquid-near-goal",
    liquid_corridor_tight: "liquid-corridor-tight",
    liquid_u_trap: "liquid-u-trap",
    liquid_u_resonance: "liquid-u-resonance",
    liquid_ring_side: "liquid-ring-side",
    rpoa_static: "rpoa-static",
    rpoa_moved4: "rpoa-moved4",
    rpoa_moving6: "rpoa-moving6",
    rpoa_orbiter: "rpoa-orbiter",
    rpoa_moving_target: "rpoa-moving-target",
    rpoa_u_trap: "rpoa-u-trap",
    pso_mass_point_1: "pso-mass-point-1",
    pso_mass_point_2: "pso-mass-point-2",
    amr_case1: "amr-case1",
    amr_case2_01: "amr-case2-01",
    amr_case2_02: "amr-case2-02",
    amr_case2_03: "amr-case2-03",
    amr_case2_04: "amr-case2-04",
    amr_case2_05: "amr-case2-05",
    amr_case2_06: "amr-case2-06",
    amr_case2_07: "amr-case2-07",
    amr_case2_08: "amr-case2-08",
    amr_case2_09: "amr-case2-09",
    amr_case2_10: "amr-case2-10",
    amr_case2_11: "amr-case2-11",
    amr_case2_12: "amr-case2-12",
    arm_1: "arm-1",
    arm_elbow_flip: "arm-elbow-flip",
    mixed: "mixed",
}
