//! The harness of the tests.
//!
//! ```text
//! recording   a whole fleet in one thread, every tick of it kept
//! tape        what a record holds of a run, in memory, and its replay
//! truth       what a run came to, recomputed from those ticks by other means than the world's
//! build       scenarios from short texts and from the catalog; sweeps over seeds
//! process     shoal as a real process, that ends with the test
//! prometheus  a strict reader of what `shoal metrics` prints
//! ```

pub mod build;
pub mod process;
pub mod prometheus;
pub mod recording;
pub mod tape;
pub mod truth;

pub use build::{catalog, catalog_names, scenario, seeds};
pub use recording::{Frame, Recording};
pub use tape::Tape;

/// Hands the name of a test and the name of a scenario, for all of the catalog, to the macro `$each`: tests of their own run
/// side by side. Whoever uses it checks that the list is that of [`catalog_names`].
#[macro_export]
macro_rules! for_each_scenario {
    ($each:ident) => {
        $each! {
            demo_15: "demo-15",
            ring_15: "ring-15",
            head_on: "head-on",
            corridor_swap: "corridor-swap",
            late_join: "late-join",
            tasks: "tasks",
            moving_obstacles: "moving-obstacles",
            unicycle_15: "unicycle-15",
            scale_64: "scale-64",
            rvo2_circle: "rvo2-circle",
            rvo2_blocks: "rvo2-blocks",
            rvo2_roadmap: "rvo2-roadmap",
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
    };
}
