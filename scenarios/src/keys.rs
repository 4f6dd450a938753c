//! What a key of a scenario file is: the types of the key table, and ways to look into it.

/// No length, speed or time in a scenario is larger: larger values are almost certainly mistakes.
pub(crate) const LARGE: f64 = 1e6;

/// No place is farther from the origin, m: northings of UTM fit, and positions are exact to two nanometres there.
pub(crate) const FAR_M: f64 = 1e7;

/// What a number may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    /// Smallest value.
    pub(crate) min: f64,
    /// Whether `min` itself is allowed.
    pub(crate) min_included: bool,
    /// Largest value, allowed.
    pub(crate) max: f64,
    /// Whether `inf` is allowed beyond that.
    pub(crate) infinite: bool,
}

/// Any number that is no mistake.
pub(crate) const ANY: Range = Range { min: -LARGE, min_included: true, max: LARGE, infinite: false };

/// A coordinate.
pub(crate) const COORDINATE: Range = Range { min: -FAR_M, min_included: true, max: FAR_M, infinite: false };

/// What the value of a key must be.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Type {
    /// A string of at most so many bytes.
    Text(usize),
    /// The name of a robot; at most so many characters.
    Id(usize),
    /// `true` or `false`.
    Bool,
    /// A real number.
    Float(Range),
    /// A whole number.
    Int {
        /// Smallest value.
        min: i128,
        /// Largest value.
        max: i128,
    },
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A pair of numbers `[x, y]`.
    Pair,
    /// `[x, y]`, or `[x, y, yaw]`.
    Pose,
    /// A number for each joint or link of an arm, the one at the base first.
    Joints(Range),
    /// A list of pairs.
    Pairs {
        /// Fewest pairs.
        min: usize,
        /// Most pairs.
        max: usize,
    },
    /// A list of whole numbers from 0 to this one, at least one of them, each once.
    Numbers(u16),
    /// A list of at most this many numbers.
    Floats(usize),
    /// `[low, high]` with `low` below `high`.
    Interval,
    /// `"all"` or a whole number.
    AllOrCount,
    /// `"forever"` or a whole number above 0.
    ForeverOrCount,
    /// The name of a method.
    Planner,
    /// A table of parameters of one method.
    Params,
    /// A table of such tables, by method.
    Methods,
    /// A table.
    Table(&'static Section),
    /// A list of tables, at most so many.
    Tables(&'static Section, usize),
}

/// What a key means when a file does not give it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Preset {
    /// The key must be given.
    Required,
    /// Nothing.
    Absent,
    /// This value, as TOML.
    Value(&'static str),
    /// A value that depends on the rest of the file, in words.
    Computed(&'static str),
}

/// One row of the table.
#[derive(Debug)]
pub(crate) struct Key {
    /// Its name; it carries the unit.
    pub(crate) name: &'static str,
    /// What its value must be.
    pub(crate) ty: Type,
    /// Default.
    pub(crate) preset: Preset,
    /// What it does.
    pub(crate) help: &'static str,
    /// In a section with a tag: the words of the tag that go with this key; empty is all.
    pub(crate) only: &'static [&'static str],
}

impl Key {
    /// The same key, for these words of the tag only.
    pub(crate) const fn only(self, words: &'static [&'static str]) -> Key {
        Key { only: words, ..self }
    }

    /// Whether the key goes with this word of the section's tag.
    pub(crate) fn goes_with(&self, tag: Option<&str>) -> bool {
        self.only.is_empty() || tag.is_none_or(|tag| self.only.contains(&tag))
    }

    /// The unit in its name, "" for none.
    pub(crate) fn unit(&self) -> &'static str {
        let name = self.name.trim_end_matches("_max").trim_end_matches("_min");
        const UNITS: &[(&str, &str)] = &[
            ("_radps2", "rad/s²"),
            ("_radps", "rad/s"),
            ("_rad", "rad"),
            ("_mps2", "m/s²"),
            ("_mps", "m/s"),
            ("_m", "m"),
            ("_s", "s"),
            ("_hz", "Hz"),
            ("_ticks", "ticks"),
        ];
        UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("", |(_, unit)| unit)
    }
}

/// A table of keys.
#[derive(Debug)]
pub(crate) struct Section {
    /// How a file writes it, as in `[clock]`.
    pub(crate) title: &'static str,
    /// What it is about.
    pub(crate) help: &'static str,
    /// The key that decides which other keys there are.
    pub(crate) tag: Option<&'static str>,
    /// Its keys, in groups so that sections can share them.
    pub(crate) groups: &'static [&'static [Key]],
}

impl Section {
    /// Its keys, in order.
    pub(crate) fn keys(&self) -> impl Iterator<Item = &'static Key> + use<> {
        self.groups.iter().flat_map(|group| group.iter())
    }

    /// The key of that name, rather the one that goes with the tag if there are two.
    pub(crate) fn key(&self, name: &str, tag: Option<&str>) -> Option<&'static Key> {
        let mut named = self.keys().filter(|key| key.name == name).peekable();
        let first = named.peek().copied();
        named.find(|key| key.goes_with(tag)).or(first)
    }

    /// The words that its tag may be.
    pub(crate) fn words(&self) -> &'static [&'static str] {
        match self.tag.and_then(|tag| self.key(tag, None)).map(|key| key.ty) {
            Some(Type::Choice(words)) => words,
            _ => &[],
        }
    }
}

/// The preset of a key as text without quotes; "" if it has none.
pub(crate) fn preset_text(section: &Section, name: &str) -> &'static str {
    match section.key(name, None).map(|key| key.preset) {
        Some(Preset::Value(text)) => text.trim_matches('"'),
        _ => "",
    }
}

/// A key that must be given.
pub(crate) const fn required(name: &'static str, ty: Type, help: &'static str) -> Key {
    Key { name, ty, preset: Preset::Required, help, only: &[] }
}

/// A key without a default.
pub(crate) const fn optional(name: &'static str, ty: Type, help: &'static str) -> Key {
    Key { name, ty, preset: Preset::Absent, help, only: &[] }
}

/// A key with a default, as TOML.
pub(crate) const fn preset(name: &'static str, ty: Type, value: &'static str, help: &'static str) -> Key {
    Key { name, ty, preset: Preset::Value(value), help, only: &[] }
}

/// A key with a default in words, which depends on the rest of the file.
pub(crate) const fn computed(name: &'static str, ty: Type, value: &'static str, help: &'static str) -> Key {
    Key { name, ty, preset: Preset::Computed(value), help, only: &[] }
}
