//! What the processes of a fleet have counted, as the channel `/metrics` has it.

use crate::wire::{Message, Value, fields};
use model::{Cause, Metric, PerCause, PerMetric, RobotIndex};

/// Whose figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    /// All processes together.
    Fleet,
    /// The world.
    World,
    /// The process of a robot, all incarnations of it.
    Robot(RobotIndex),
}

/// A histogram in six numbers, us.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    /// How many values.
    pub n: u64,
    /// Half of all values are at most this.
    pub p50: f64,
    /// 90 %.
    pub p90: f64,
    /// 99 %.
    pub p99: f64,
    /// 99.9 %.
    pub p999: f64,
    /// The largest value.
    pub max: f64,
}

/// What was counted since the start of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figures {
    /// Periods of a `realtime` loop, or ticks answered.
    pub periods: u64,
    /// Periods that were over before their work was.
    pub deadline_misses: u64,
    /// What was measured; `None`: nothing of it.
    pub spreads: PerMetric<Option<Spread>>,
    /// Late periods by cause.
    pub late: PerCause<u64>,
    /// Share of the time in which it was ready and had no processor; `None` where that is not known.
    pub run_queue_wait: Option<f64>,
}

/// Appends the figures of a process to a `shoal.Metrics`.
pub(crate) fn put(out: &mut Message, process: &str, figures: &Figures) {
    out.message(2, |own| {
        own.text(1, process).uint(2, figures.periods).uint(3, figures.deadline_misses);
        for (metric, spread) in figures.spreads.iter() {
            let Some(Spread { n, p50, p90, p99, p999, max }) = *spread else { continue };
            own.message(4, |entry| {
                entry.text(1, metric.field().trim_end_matches("_us")).uint(2, n);
                entry.double(3, p50).double(4, p90).double(5, p99).double(6, p999).double(7, max);
            });
        }
        for (cause, periods) in figures.late.iter().filter(|(_, periods)| **periods > 0) {
            own.message(5, |entry| {
                entry.text(1, cause.field()).uint(2, *periods);
            });
        }
        own.double(6, figures.run_queue_wait.map_or(0.0, |share| share + 1.0));
    });
}

/// Reads a `shoal.Metrics`: its tick, and each process with its figures. Names that this shoal does not know are passed over.
pub(crate) fn read(bytes: &[u8]) -> Option<(u64, Vec<(String, Figures)>)> {
    let (mut tick, mut all) = (0, Vec::new());
    fields(bytes, |field, value| {
        match field {
            1 => tick = value.number()?,
            2 => all.push(process(value.bytes()?)?),
            _ => {}
        }
        Some(())
    })?;
    Some((tick, all))
}

fn process(bytes: &[u8]) -> Option<(String, Figures)> {
    let (mut name, mut figures) = (String::new(), Figures::default());
    fields(bytes, |field, value| {
        match field {
            1 => name = value.text()?.to_owned(),
            2 => figures.periods = value.number()?,
            3 => figures.deadline_misses = value.number()?,
            4 => {
                let (metric, spread) = spread(value.bytes()?)?;
                let known = Metric::ALL.into_iter().find(|known| known.field().trim_end_matches("_us") == metric);
                if let Some(known) = known {
                    figures.spreads[known] = Some(spread);
                }
            }
            5 => {
                let (cause, periods) = late(value.bytes()?)?;
                if let Some(known) = Cause::ALL.into_iter().find(|known| known.field() == cause) {
                    figures.late[known] = periods;
                }
            }
            6 => figures.run_queue_wait = value.double().map(|waited| waited - 1.0),
            _ => {}
        }
        Some(())
    })?;
    Some((name, figures))
}

fn spread(bytes: &[u8]) -> Option<(&str, Spread)> {
    let (mut metric, mut spread) = ("", Spread::default());
    fields(bytes, |field, value| {
        match (field, value) {
            (1, Value::Bytes(_)) => metric = value.text()?,
            (2, Value::Number(n)) => spread.n = n,
            (3, Value::Double(us)) => spread.p50 = us,
            (4, Value::Double(us)) => spread.p90 = us,
            (5, Value::Double(us)) => spread.p99 = us,
            (6, Value::Double(us)) => spread.p999 = us,
            (7, Value::Double(us)) => spread.max = us,
            _ => {}
        }
        Some(())
    })?;
    Some((metric, spread))
}

fn late(bytes: &[u8]) -> Option<(&str, u64)> {
    let (mut cause, mut periods) = ("", 0);
    fields(bytes, |field, value| {
        match (field, value) {
            (1, Value::Bytes(_)) => cause = value.text()?,
            (2, Value::Number(n)) => periods = n,
            _ => {}
        }
        Some(())
    })?;
    Some((cause, periods))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let mut figures = Figures { periods: 800, deadline_misses: 3, ..Figures::default() };
        figures.spreads[Metric::PoseAge] =
            Some(Spread { n: 9, p50: 10.5, p90: 11.0, p99: 12.0, p999: 13.0, max: 19.25 });
        figures.late[Cause::ALL[1]] = 3;
        figures.run_queue_wait = Some(0.25);
        let mut message = Message::default();
        message.uint(1, 50);
        put(&mut message, "fleet", &figures);
        put(&mut message, "r00", &Figures::default());
        let expected = vec![("fleet".to_owned(), figures), ("r00".to_owned(), Figures::default())];
        assert_eq!(read(message.bytes()), Some((50, expected)));
        assert_eq!(read(&message.bytes()[..20]), None);
    }
}
