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

shoal_tests::for_each_scenario!(each);
