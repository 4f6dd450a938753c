//! Dates as logs and databases have them: UTC, to the millisecond.
#![expect(clippy::disallowed_methods, reason = "logs and databases are dated by the clock on the wall")]

use std::time::{SystemTime, UNIX_EPOCH};

const DAY_MS: u64 = 86_400_000;

/// The clock on the wall, ms since 1970.
pub fn wall_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}

/// A date (ms since 1970) as `2026-11-28T22:31:12.123Z`.
pub fn written(at_ms: u64) -> String {
    let (days, ms) = (at_ms / DAY_MS, at_ms % DAY_MS);
    // Counted in years that begin in March, so that the leap day is the last one (Howard Hinnant, "chrono-compatible
    // low-level date algorithms").
    let shifted = days + 719_468;
    let (era, day_of_era) = (shifted / 146_097, shifted % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let (hours, minutes, seconds) = (ms / 3_600_000, ms / 60_000 % 60, ms / 1000 % 60);
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}.{:03}Z", ms % 1000)
}

/// The date (ms since 1970) that [`written`] has written, also without a fraction of a second or without a time of day.
pub fn parse_time(text: &str) -> Option<u64> {
    let text = text.strip_suffix('Z').unwrap_or(text);
    let (date, time) = text.split_once(['T', ' ']).unwrap_or((text, "00:00:00"));
    let numbers = |text: &str, by: char| -> Option<Vec<u64>> {
        let part = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit()).then(|| part.parse().ok())?;
        text.split(by).map(part).collect()
    };
    let [year, month, day] = numbers(date, '-')?[..] else { return None };
    let (clock, fraction) = time.split_once('.').unwrap_or((time, "0"));
    let [hours, minutes, seconds] = numbers(clock, ':')?[..] else { return None };
    let ms: u64 = format!("{fraction:0<3}").get(..3)?.parse().ok()?;
    if !((1970..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day)) {
        return None;
    }
    if hours > 23 || minutes > 59 || seconds > 60 {
        return None;
    }
    let year = if month <= 2 { year - 1 } else { year };
    let shifted_month = (month + 9) % 12;
    let day_of_year = (153 * shifted_month + 2) / 5 + day - 1;
    let (era, year_of_era) = (year / 400, year % 400);
    let days = era * 146_097 + year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
    Some((days.checked_sub(719_468)? * 86_400 + hours * 3600 + minutes * 60 + seconds) * 1000 + ms)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_written_and_read() {
        // `date -u -d @SECONDS +%FT%T` agrees.
        for (at_ms, text) in [
            (0, "1970-01-01T00:00:00.000Z"),
            (951_782_399_999, "2000-02-28T23:59:59.999Z"),
            (951_782_400_000, "2000-02-29T00:00:00.000Z"),
            (1_709_164_800_001, "2024-02-29T00:00:00.001Z"),
            (1_796_250_672_123, "2026-12-02T22:31:12.123Z"),
            (4_107_542_400_000, "2100-03-01T00:00:00.000Z"),
        ] {
            assert_eq!((written(at_ms).as_str(), parse_time(text)), (text, Some(at_ms)));
        }
        for day in 0..60_000 {
            let at_ms = day * DAY_MS + day * 1013 % DAY_MS;
            assert_eq!(parse_time(&written(at_ms)), Some(at_ms));
        }
        assert_eq!(parse_time("2026-11-28 10:00:00"), parse_time("2026-11-28T10:00:00.0Z"));
        assert_eq!(parse_time("2026-11-28"), parse_time("2026-11-28T00:00:00.000Z"));
        for wrong in
            ["", "now", "2026", "2026-13-01", "2026-01-01T25:00:00", "2026-01-01T10:00", "-1-01-01", "2026-01-+1"]
        {
            assert_eq!(parse_time(wrong), None, "{wrong}");
        }
    }
}
