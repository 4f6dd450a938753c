//! Parameters: the table, typed values, and what is said about values that do not fit.

use crate::inputs::{IDENTITY, values};
use model::kind::{Kind, Spec};
use model::value::Value;
use model::{ParamValue, ParamValues};
use shoal_planners::decentralized_apf::{Distance, Params};
use shoal_planners::params::nearest;
use shoal_planners::{METHODS, ParamError, find};

shoal_planners::choice! {
    enum Side { Left = "left", Right = "right", }
}

shoal_planners::params! {
    /// One field of every type.
    struct Every {
        /// A real number.
        real: f64 = 0.5, "m", 0.0..=1.0;
        /// A real number without bounds,
        /// explained on two lines.
        free: f64 = 0.0, "";
        /// A whole number.
        whole: i64 = -1, "", -5..=5;
        /// A count.
        count: u32 = 3, "", 1..=10;
        /// A switch.
        switch: bool = false, "";
        /// A word.
        side: Side = Side::Left, "";
    }
}

shoal_planners::params! {
    /// The same, and one more.
    struct Taken {
        ..every: Every;
        /// One's own.
        own: f64 = 2.0, "s", 0.0..=5.0;
    }
}

fn given(text: &str) -> ParamValues {
    values(&text.parse().expect("TOML"))
}

#[test]
fn values_arrive_in_their_fields() {
    let all = given("real = 1\nfree = -1e9\nwhole = 5\ncount = 10\nswitch = true\nside = \"right\"");
    let expected = Every { real: 1.0, free: -1e9, whole: 5, count: 10, switch: true, side: Side::Right };
    assert_eq!(Every::from_values(&all), Ok(expected));
    assert_eq!(Every::from_values(&ParamValues::new()), Ok(Every::default()));
}

#[test]
fn values_that_do_not_fit_say_what_would() {
    for (text, expected) in [
        ("real = 1.5", "`real`: 1.5 is not a number from 0 to 1"),
        ("real = 2", "`real`: 2 is not a number from 0 to 1"),
        ("real = nan", "`real`: NaN is not a number from 0 to 1"),
        ("real = true", "`real`: true is not a number from 0 to 1"),
        ("whole = 6", "`whole`: 6 is not a whole number from -5 to 5"),
        ("whole = 1.0", "`whole`: 1.0 is not a whole number from -5 to 5"),
        ("count = -1", "`count`: -1 is not a whole number from 1 to 10"),
        ("switch = 1", "`switch`: 1 is not true or false"),
        ("side = \"up\"", "`side`: \"up\" is not one of \"left\", \"right\""),
    ] {
        let error = Every::from_values(&given(text)).expect_err(text);
        assert_eq!(error.to_string(), expected);
        assert_eq!(error.name(), text.split(' ').next().unwrap());
    }
    assert!(Every::from_values(&given("free = inf")).is_err());
}

#[test]
fn the_table_says_what_the_struct_says() {
    let specs = Every::specs();
    let names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
    assert_eq!(names, ["real", "free", "whole", "count", "switch", "side"]);
    assert_eq!(specs[0].unit, "m");
    assert_eq!(specs[1].help, "A real number without bounds, explained on two lines.");
    assert_eq!(specs[2].kind(), Kind::Int { min: -5, max: 5 });
    assert_eq!(specs[3].default(), Some(Value::Int(3)));
    assert_eq!(specs[5].kind(), Kind::Choice(&["left", "right"]));
    assert_eq!(specs[5].default(), Some(Value::Text("left".to_owned())));
}

#[test]
fn parameters_are_taken_over_from_another_struct() {
    let names: Vec<&str> = Taken::specs().iter().map(|spec| spec.name).collect();
    assert_eq!(names, ["real", "free", "whole", "count", "switch", "side", "own"]);
    let every = Every { count: 7, ..Every::default() };
    assert_eq!(Taken::from_values(&given("own = 1\ncount = 7")), Ok(Taken { every, own: 1.0 }));
    let far = Taken { own: 5.0, ..Taken::default() };
    assert_eq!(far.clone().with(&given("side = \"right\"")).every.side, Side::Right);
    assert_eq!(far.with(&given("side = \"right\"")).own, 5.0);
    assert!(Taken::from_values(&given("count = 11")).is_err() && Taken::from_values(&given("own = 6")).is_err());
}

#[test]
fn a_method_reports_every_problem_at_once() {
    let method = find("decentralized-apf").expect("exists");
    let wrong = given("p_q = 1.0\nxi = -1.0\ndistance = \"center\"\neta = 0.2");
    let problems = method.check(&wrong);
    assert_eq!(problems.len(), 3);
    assert!(problems.iter().any(|problem| problem.to_string().contains("\"surface\", \"centre\"")));
    let unknown = problems.iter().find(|problem| problem.name() == "p_q").expect("reported");
    let ParamError::Unknown { nearest, known, .. } = unknown else { panic!("{unknown:?}") };
    assert!(nearest.is_some_and(|name| ["p_o", "p_r"].contains(&name)));
    assert_eq!(known.len(), Params::specs().len());
    assert_eq!((method.build)(&wrong, IDENTITY).err().as_ref(), problems.first());
    assert_eq!(Params::from_values(&given("distance = \"centre\"")).unwrap().distance, Distance::Centre);
}

#[test]
fn suggestions_are_near_or_absent() {
    let known = ["straight", "apf", "decentralized-apf"];
    assert_eq!(nearest("apff", known), Some("apf"));
    assert_eq!(nearest("strait", known), Some("straight"));
    assert_eq!(nearest("zzz", known), None);
}

fn default(spec: &Spec) -> Option<ParamValue> {
    spec.default()?.to_param()
}

#[test]
fn every_method_describes_its_parameters() {
    for method in METHODS {
        let specs = (method.params)();
        for (i, spec) in specs.iter().enumerate() {
            let default = default(spec).unwrap_or_else(|| panic!("{}: {} has no default", method.name, spec.name));
            assert!(spec.kind().check(&default).is_ok(), "{}: {}", method.name, spec.name);
            assert!(!spec.help.is_empty(), "{}: {}", method.name, spec.name);
            assert!(specs[..i].iter().all(|other| other.name != spec.name), "{}: {}", method.name, spec.name);
        }
        let defaults = specs.iter().filter_map(|spec| Some((spec.name.to_owned(), default(spec)?))).collect();
        assert_eq!(method.check(&defaults), []);
        assert!((method.build)(&defaults, IDENTITY).is_ok());
    }
}
