//! Events that repeat: told one by one up to a point, and then summed up. A starved machine holds robots and lets them
//! go on hundreds of times a minute, and a reader learns nothing from the second dozen. The report has all of
//! them. Pure.

use daemon::coordinator::News;
use std::collections::BTreeMap;
use std::time::Duration;

/// Events of one kind that are told one after the other.
const AT_ONCE: u32 = 10;
/// One more of a kind may be told each time that this has passed; and what was not told is summed up as often.
const EVERY: Duration = Duration::from_secs(5);

/// What has been told, and what has not.
#[derive(Debug, Default)]
pub struct Repeats {
    kinds: BTreeMap<News, Kind>,
    summed_at: Duration,
}

#[derive(Debug)]
struct Kind {
    left: u32,
    since: Duration,
    untold: u64,
}

impl Repeats {
    /// Whether to tell an event of this kind now; if not, it is counted.
    pub fn tell(&mut self, kind: News, now: Duration) -> bool {
        let kind = self.kinds.entry(kind).or_insert(Kind { left: AT_ONCE, since: now, untold: 0 });
        let gained = u32::try_from(now.saturating_sub(kind.since).as_nanos() / EVERY.as_nanos()).unwrap_or(u32::MAX);
        if gained > 0 {
            kind.left = kind.left.saturating_add(gained).min(AT_ONCE);
            kind.since = now;
        }
        if kind.left == 0 {
            kind.untold += 1;
            return false;
        }
        kind.left -= 1;
        true
    }

    /// What has not been told, in one line, if there is any and it is time to.
    pub fn sum(&mut self, now: Duration) -> Option<String> {
        if now.saturating_sub(self.summed_at) < EVERY {
            return None;
        }
        self.rest().inspect(|_| self.summed_at = now)
    }

    /// The same at the end.
    pub fn rest(&mut self) -> Option<String> {
        let untold: Vec<String> = (self.kinds.iter_mut())
            .map(|(name, kind)| (name, std::mem::take(&mut kind.untold)))
            .filter(|(_, untold)| *untold > 0)
            .map(|(name, untold)| format!("{name} {untold}"))
            .collect();
        (!untold.is_empty()).then(|| format!("and more of the same: {}", untold.join(", ")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use model::EventName;

    /// Lines that are told of `seconds` in which each kind happens this often a second.
    fn lines(seconds: u64, per_second: u64, kinds: &[News]) -> (u64, Vec<String>) {
        let (mut repeats, mut told, mut sums) = (Repeats::default(), 0, Vec::new());
        for step in 0..seconds * per_second {
            let now = Duration::from_secs(100) + Duration::from_nanos(step * 1_000_000_000 / per_second);
            told += kinds.iter().filter(|kind| repeats.tell(**kind, now)).count() as u64;
            sums.extend(repeats.sum(now));
        }
        sums.extend(repeats.rest());
        (told, sums)
    }

    #[test]
    fn what_is_rare_is_told_and_what_repeats_is_summed_up() {
        assert_eq!(lines(600, 1, &[]), (0, Vec::new()));
        let (mut repeats, mut at) = (Repeats::default(), Duration::ZERO);
        for _ in 0..1000 {
            assert!(repeats.tell(News::Event(EventName::Died), at));
            assert_eq!(repeats.sum(at), None);
            at += EVERY;
        }
        let (told, sums) = lines(30, 100, &[EventName::Held, EventName::Resumed].map(News::Event));
        assert!(told <= 2 * (10 + 6) && sums.len() <= 7, "{told} {sums:?}");
        let counted: u64 =
            (sums.iter().flat_map(|sum| sum.split([' ', ',']))).filter_map(|word| word.parse::<u64>().ok()).sum();
        assert_eq!(told + counted, 2 * 3000, "each is told or counted: {sums:?}");
    }
}
