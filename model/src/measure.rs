//! Enums whose variants are the keys of arrays: what is measured, and why a period was late. A new variant is one line here;
//! statistics, reports, tables and the command line go through all of them.

use serde::de::{Deserialize, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde::ser::{Serialize, SerializeMap, Serializer};
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Index, IndexMut};

/// Declares such an enum and its array: `Variant = "its field in reports", "its words in tables";`. The doc comment is its
/// help. As a map the array has a field per key; a missing field is the default, an unknown one is passed over.
macro_rules! measures {
    (
        $(#[$about:meta])* enum $name:ident;
        $(#[$table_about:meta])* struct $table:ident;
        $( $(#[doc = $help:literal])+ $variant:ident = $field:literal, $word:literal; )+
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[repr(u32)]
        pub enum $name { $( $(#[doc = $help])+ $variant, )+ }

        impl $name {
            /// All of them, in the order of reports.
            pub const ALL: [$name; [$($field),+].len()] = [ $( $name::$variant ),+ ];

            /// Its field in reports.
            pub const fn field(self) -> &'static str {
                match self { $( $name::$variant => $field, )+ }
            }

            /// Its words in tables.
            pub const fn word(self) -> &'static str {
                match self { $( $name::$variant => $word, )+ }
            }

            /// What it is: the first sentence of its documentation.
            pub fn help(self) -> &'static str {
                let text = match self { $( $name::$variant => concat!($($help),+).trim(), )+ };
                text.split_once(". ").map_or(text.trim_end_matches('.'), |(first, _)| first)
            }
        }

        $(#[$table_about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $table<T>([T; $name::ALL.len()]);

        impl<T> $table<T> {
            /// With a value for every key.
            pub fn of(value: impl FnMut($name) -> T) -> $table<T> {
                $table($name::ALL.map(value))
            }

            /// Every key with its value, in order.
            pub fn iter(&self) -> impl DoubleEndedIterator<Item = ($name, &T)> {
                $name::ALL.into_iter().zip(&self.0)
            }
        }

        impl<T> Index<$name> for $table<T> {
            type Output = T;

            fn index(&self, key: $name) -> &T {
                &self.0[key as usize]
            }
        }

        impl<T> IndexMut<$name> for $table<T> {
            fn index_mut(&mut self, key: $name) -> &mut T {
                &mut self.0[key as usize]
            }
        }

        impl<T: Serialize> Serialize for $table<T> {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                let mut map = serializer.serialize_map(Some($name::ALL.len()))?;
                for (key, value) in self.iter() {
                    map.serialize_entry(key.field(), value)?;
                }
                map.end()
            }
        }

        impl<'de, T: Deserialize<'de> + Default> Deserialize<'de> for $table<T> {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Fields<T>(PhantomData<T>);
                impl<'de, T: Deserialize<'de> + Default> Visitor<'de> for Fields<T> {
                    type Value = $table<T>;

                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        let fields = $name::ALL.map($name::field);
                        write!(f, "a map with the fields {}", fields.join(", "))
                    }

                    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<$table<T>, A::Error> {
                        let mut table = $table::<T>::default();
                        while let Some(field) = map.next_key::<String>()? {
                            match $name::ALL.into_iter().find(|key| key.field() == field) {
                                Some(key) => table[key] = map.next_value()?,
                                None => _ = map.next_value::<IgnoredAny>()?,
                            }
                        }
                        Ok(table)
                    }
                }
                deserializer.deserialize_map(Fields(PhantomData))
            }
        }
    };
}

measures! {
    /// What is measured in the loop, in a histogram of its own.
    enum Metric;
    /// A value for each [`Metric`].
    struct PerMetric;

    /// Age of a neighbour's pose when the planner uses it.
    PoseAge = "pose_age_us", "pose age";
    /// Wake-up lateness of a process. It counts from the start of a period, as its clock has it, to the moment that the
    /// process woke for it. A period that was slept or worked through counts as well, until the moment at which the process
    /// was free again: what a loop did not do on time must not vanish from its statistics (coordinated omission).
    Wake = "wake_us", "wake-up";
    /// Time in the planner.
    Plan = "plan_us", "plan";
    /// Time from wake-up to the command.
    Step = "step_us", "step";
    /// Age of a command when it takes effect in the world.
    CommandAge = "command_age_us", "command age";
    /// Time from an odometry sample to the moment its command takes effect.
    Reaction = "reaction_us", "reaction";
}

impl Metric {
    /// Whether the world measures it, of every robot.
    pub fn is_of_world(self) -> bool {
        matches!(self, Metric::CommandAge | Metric::Reaction)
    }
}

measures! {
    /// Why a period was late.
    enum Cause;
    /// A value for each [`Cause`].
    struct PerCause;

    /// The process was ready and had no processor.
    Scheduler = "scheduler", "scheduler";
    /// The planner took longer than its share.
    Planner = "planner", "planner";
    /// The world's own tick took longer than its share.
    World = "world", "world";
    /// The odometry was old: the world was late.
    Input = "input", "input";
    /// None of these: time stolen from the whole machine, or a late timer.
    Neither = "neither", "neither";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_value_for_every_key() {
        let mut table = PerCause::of(|cause| cause as u32);
        table[Cause::World] += 10;
        assert_eq!(table.iter().map(|(_, n)| *n).collect::<Vec<_>>(), [0, 1, 12, 3, 4]);
        assert_eq!(table.iter().next_back(), Some((Cause::Neither, &4)));
        assert_eq!(Metric::Wake.help(), "Wake-up lateness of a process");
        assert_eq!(Metric::Plan.help(), "Time in the planner");
    }

    #[test]
    fn as_json_it_is_a_map_that_may_have_other_fields() {
        let table = PerMetric::of(|metric| (metric == Metric::Plan).then_some(3_u64));
        let text = serde_json::to_string(&table).unwrap();
        assert!(text.starts_with(r#"{"pose_age_us":null,"wake_us":null,"plan_us":3"#), "{text}");
        assert_eq!(serde_json::from_str::<PerMetric<Option<u64>>>(&text).unwrap(), table);
        let found: PerCause<u64> = serde_json::from_str(r#"{"late":7,"world":2}"#).unwrap();
        assert_eq!(found, PerCause::of(|cause| if cause == Cause::World { 2 } else { 0 }));
        assert!(serde_json::from_str::<PerCause<u64>>("[]").unwrap_err().to_string().contains("scheduler, planner"));
    }
}
