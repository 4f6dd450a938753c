//! What tests of messages share.

use std::fmt::Write;

/// What is told of a good file with `before` replaced by `after`, row by row.
pub(crate) fn mistakes(good: &str, rows: &[(&str, &str)], told: impl Fn(&str) -> String) -> String {
    let mut result = String::new();
    for (before, after) in rows {
        assert!(good.contains(before), "`{before}` is in the file");
        let text = good.replacen(before, after, 1);
        let change = after.lines().find(|line| !before.contains(*line)).unwrap_or(after);
        writeln!(result, "# {change}\n{}\n", told(&text)).unwrap();
    }
    result
}
