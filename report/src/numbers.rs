//! Numbers as they are shown: with the digits that are known, and no more.

use serde::Serialize;
use serde_json::{Number, Value};

/// Digits behind the point: micrometres, microseconds, picoseconds of microseconds.
const DECIMALS: usize = 6;
/// What is too small for them keeps so many digits: a touch of a nanometre is a touch.
const DIGITS_MIN: i32 = 4;

/// A number without the digits that only arithmetic put there: 21.400000000000002 is 21.4. No number becomes zero or
/// changes its sign, but there is no negative zero.
pub fn rounded(x: f64) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    if !x.is_finite() || x.abs() >= 1e9 {
        return x;
    }
    let leading_zeros = -x.abs().log10().floor() as i32;
    let decimals = DECIMALS.max(usize::try_from(leading_zeros + DIGITS_MIN - 1).unwrap_or(0));
    format!("{x:.decimals$}").parse().unwrap_or(x)
}

/// A value as JSON, with every number [`rounded`].
pub fn json(value: &impl Serialize) -> Value {
    let mut value = serde_json::to_value(value).expect("what is measured has string keys only");
    round_all(&mut value);
    value
}

fn round_all(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            if let Some(known) = number.as_f64().and_then(|x| Number::from_f64(rounded(x))) {
                *number = known;
            }
        }
        Value::Array(list) => list.iter_mut().for_each(round_all),
        Value::Object(fields) => fields.values_mut().for_each(round_all),
        _ => {}
    }
}

/// A number with so many digits behind the point, without a sign in front of nothing but zeros.
pub fn fixed(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|byte| matches!(byte, b'0' | b'.')) => digits.to_owned(),
        _ => text,
    }
}

/// A clearance in millimetres, as `0.123 m`. One that would be shown as zero keeps its sign: `-2e-7 m` is a touch.
pub fn clearance(x_m: f64) -> String {
    if x_m != 0.0 && x_m.abs() < 0.0005 { format!("{x_m:.0e} m") } else { format!("{} m", fixed(x_m, 3)) }
}

/// The ending of a noun that this number stands before.
pub fn plural(n: u64) -> &'static str {
    if n == 1 { "" } else { "s" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_is_known_stays_and_signs_do_too() {
        let cases: [(f64, f64); 9] = [
            (21.400_000_000_000_002, 21.4),
            (0.1 + 0.2, 0.3),
            (-0.0, 0.0),
            (388_106.123_456_7, 388_106.123_457),
            (-4.123_456e-8, -4.123e-8),
            (9.999_999e-7, 1e-6),
            (0.000_123_456_7, 0.000_123_5),
            (1e300, 1e300),
            (5e-324, 5e-324),
        ];
        for (x, expected) in cases {
            let found = rounded(x);
            assert_eq!((found, found.is_sign_negative()), (expected, expected.is_sign_negative()), "{x}");
            assert_eq!(rounded(found), found, "{x}");
        }
        assert!(rounded(f64::NAN).is_nan());
        let value = json!({ "n": 3, "list": [0.1 + 0.2, null], "id": "0.30000000000000004", "large": u64::MAX });
        let text = super::json(&value).to_string();
        assert_eq!(text, r#"{"n":3,"list":[0.3,null],"id":"0.30000000000000004","large":18446744073709551615}"#);
    }

    #[test]
    fn zeros_have_no_sign_and_touches_do() {
        for (x, expected) in [(-0.0001, "0.00"), (-0.0, "0.00"), (-0.006, "-0.01"), (1.0, "1.00")] {
            assert_eq!(fixed(x, 2), expected);
        }
        for (x, expected) in
            [(0.0, "0.000 m"), (-0.0, "0.000 m"), (-2e-7, "-2e-7 m"), (4e-4, "4e-4 m"), (-0.0216, "-0.022 m")]
        {
            assert_eq!(clearance(x), expected);
        }
    }
}
