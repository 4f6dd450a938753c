//! Keys: what readers ask with, and the macros that declare them.

use crate::field::Field;
use crate::kind::Spec;
use crate::params::ParamValues;
use crate::value::Value;
use std::marker::PhantomData;

/// A key with a default: who asks gets a `T`. Only declarations make keys, so a wrong name does not compile.
#[derive(Debug)]
pub struct Key<T> {
    name: &'static str,
    default: fn() -> T,
}

/// A key without a default value: who asks gets `Option<T>`.
#[derive(Debug)]
pub struct OptionalKey<T> {
    name: &'static str,
    ty: PhantomData<fn() -> T>,
}

/// A key of any type, for its name and its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeyName(&'static str);

impl KeyName {
    /// Whether this is that key.
    pub fn is(self, key: impl Named) -> bool {
        self.0 == key.name()
    }
}

/// Something that names a key.
pub trait Named: Copy {
    /// The name of the key in a scenario.
    fn name(self) -> &'static str;

    /// The key without its type.
    fn any(self) -> KeyName {
        KeyName(self.name())
    }
}

/// A key that can be asked for its value.
pub trait Asked: Named {
    /// The type of its value.
    type Value: Field;
    /// What the answer is.
    type Answer;

    /// The answer where this value was given.
    fn answer(self, given: Option<&Value>) -> Self::Answer;
}

impl<T> Key<T> {
    /// For [`keys!`](crate::keys!).
    #[doc(hidden)]
    pub const fn declared(name: &'static str, default: fn() -> T) -> Key<T> {
        Key { name, default }
    }

    /// Its default.
    pub fn default(self) -> T {
        (self.default)()
    }
}

impl<T: Field> Key<T> {
    /// Its value among those of a planner, if they have one of a fitting type.
    pub fn given(self, values: &ParamValues) -> Option<T> {
        values.get(self.name).and_then(|value| T::from_value(&value.into()))
    }
}

impl<T> OptionalKey<T> {
    /// For [`keys!`](crate::keys!).
    #[doc(hidden)]
    pub const fn declared(name: &'static str) -> OptionalKey<T> {
        OptionalKey { name, ty: PhantomData }
    }
}

impl<T> Clone for Key<T> {
    fn clone(&self) -> Key<T> {
        *self
    }
}

impl<T> Copy for Key<T> {}

impl<T> Clone for OptionalKey<T> {
    fn clone(&self) -> OptionalKey<T> {
        *self
    }
}

impl<T> Copy for OptionalKey<T> {}

impl<T> Named for Key<T> {
    fn name(self) -> &'static str {
        self.name
    }
}

impl<T> Named for OptionalKey<T> {
    fn name(self) -> &'static str {
        self.name
    }
}

impl Named for KeyName {
    fn name(self) -> &'static str {
        self.0
    }
}

impl Named for &'static Spec {
    fn name(self) -> &'static str {
        self.name
    }
}

impl<T: Field> Asked for Key<T> {
    type Value = T;
    type Answer = T;

    fn answer(self, given: Option<&Value>) -> T {
        given.and_then(T::from_value).unwrap_or_else(self.default)
    }
}

impl<T: Field> Asked for OptionalKey<T> {
    type Value = T;
    type Answer = Option<T>;

    fn answer(self, given: Option<&Value>) -> Option<T> {
        given.and_then(T::from_value)
    }
}

/// Declares keys, one line each: `name: type = default, "unit", bounds;`. The doc comment is the help. Bounds are
/// optional. Instead of `= default` there may be `=> required`, `=> optional`, or `=> "words"` for a default that depends
/// on the rest of the file. `#[only(words)]` gives the words of the section's tag that the key goes with, and
/// `#[name("other-name")]` the name in a scenario where it differs.
///
/// `keys Group { ... }` makes a type with an associated constant of each name, a [`Key`] or an [`OptionalKey`], and
/// `KEYS`, the table of all.
///
/// `struct Group { ... }`, where all lines have defaults, is also a struct with these fields and `Default`,
/// `specs() -> Vec<Spec>`, and `with(self, &ParamValues) -> Self`. Lines `..field: Struct;` before the others take over
/// the keys of another such struct.
///
/// ```
/// use shoal_model::key::{Asked, Named};
/// use shoal_model::value::Value;
///
/// shoal_model::keys! {
///     /// Keys of a lamp.
///     keys Lamp {
///         /// How bright it is.
///         level: f64 = 0.5, "", 0.0..=1.0;
///         /// Where it stands.
///         at_m: [f64; 2] => required, "m";
///     }
/// }
/// assert_eq!(Lamp::level.answer(None), 0.5);
/// assert_eq!(Lamp::at_m.answer(None), None);
/// assert_eq!(Lamp::level.answer(Some(&Value::Int(1))), 1.0);
/// assert_eq!((Lamp::at_m.name(), Lamp::KEYS[1].unit, Lamp::KEYS[1].help), ("at_m", "m", "Where it stands."));
/// ```
///
/// A reader that asks for another name does not compile, and neither does one that expects another type:
///
/// ```compile_fail,E0599
/// shoal_model::keys! {
///     /// Keys of a lamp.
///     keys Lamp {
///         /// How bright it is.
///         level: f64 = 0.5, "", 0.0..=1.0;
///     }
/// }
/// let level = Lamp::brightness;
/// ```
///
/// ```compile_fail,E0308
/// use shoal_model::key::Asked;
/// shoal_model::keys! {
///     /// Keys of a lamp.
///     keys Lamp {
///         /// How bright it is.
///         level: f64 = 0.5, "", 0.0..=1.0;
///     }
/// }
/// let level: bool = Lamp::level.answer(None);
/// ```
#[macro_export]
macro_rules! keys {
    (
        $(#[$about:meta])*
        $visibility:vis struct $group:ident {
            $( ..$shared:ident: $shared_type:ty; )*
            $(
                $(#[doc = $help:literal])+
                $field:ident: $type:ty = $default:expr, $unit:literal $(, $bounds:expr)?;
            )*
        }
    ) => {
        $(#[$about])*
        #[derive(Clone, Debug, PartialEq)]
        $visibility struct $group {
            $( #[doc = "Keys that others have too."] pub $shared: $shared_type, )*
            $( $(#[doc = $help])+ pub $field: $type, )*
        }

        #[allow(dead_code, reason = "most are read as fields")]
        impl $group {
            $crate::keys! { @lines [pub] $(
                $(#[doc = $help])+
                $field: $type = $default, $unit $(, $bounds)?;
            )* }

            /// The table of the keys.
            pub fn specs() -> Vec<$crate::kind::Spec> {
                let shared: Vec<Vec<$crate::kind::Spec>> = vec![ $( <$shared_type>::specs() ),* ];
                shared.into_iter().flatten().chain(Self::KEYS.iter().copied()).collect()
            }

            /// These values with some of them replaced; what does not fit its field is passed over.
            pub fn with(self, values: &$crate::params::ParamValues) -> Self {
                let mut own = self;
                $( own.$shared = own.$shared.with(values); )*
                $( if let Some(value) = Self::$field.given(values) {
                    own.$field = value;
                } )*
                own
            }
        }

        impl Default for $group {
            fn default() -> Self {
                $group { $( $shared: Default::default(), )* $( $field: $default, )* }
            }
        }
    };

    (
        $(#[$about:meta])*
        $visibility:vis keys $group:ident { $($lines:tt)* }
    ) => {
        $(#[$about])*
        $visibility struct $group;

        impl $group {
            $crate::keys! { @lines [$visibility] $($lines)* }
        }
    };

    (
        @lines [$visibility:vis] $(
            $(#[doc = $help:literal])+
            $(#[only($($word:expr),+ $(,)?)])?
            $(#[name($name:literal)])?
            $field:ident: $type:ty $(= $default:expr)? $(=> $meaning:tt)?, $unit:literal $(, $bounds:expr)?;
        )*
    ) => {
        $(
            $(#[doc = $help])+
            #[allow(non_upper_case_globals, reason = "it is called as a scenario calls it")]
            $visibility const $field: $crate::keys!(@type $type $(, $default)?) =
                $crate::keys!(@declared ($crate::keys!(@name $field $($name)?)) $(, $default)?);
        )*

        /// The table of the keys.
        $visibility const KEYS: &'static [$crate::kind::Spec] = &[ $( $crate::kind::Spec {
            name: $crate::keys!(@name $field $($name)?),
            unit: $unit,
            kind: || <$type as $crate::field::Typed>::KIND$(.within($bounds))?,
            preset: $crate::keys!(@preset [$type] $(= $default)? $(=> $meaning)?),
            help: concat!($($help),+).trim_ascii(),
            only: &[ $($($word.word()),+)? ],
        }, )* ];
    };

    (@type $type:ty, $default:expr) => { $crate::key::Key<$type> };
    (@type $type:ty) => { $crate::key::OptionalKey<$type> };
    (@declared ($name:expr), $default:expr) => { $crate::key::Key::declared($name, || $default) };
    (@declared ($name:expr)) => { $crate::key::OptionalKey::declared($name) };
    (@name $field:ident $name:literal) => { $name };
    (@name $field:ident) => { stringify!($field) };
    (@preset [$type:ty] => required) => { $crate::kind::Preset::Required };
    (@preset [$type:ty] => optional) => { $crate::kind::Preset::Absent };
    (@preset [$type:ty] => $words:literal) => { $crate::kind::Preset::Computed($words) };
    (@preset [$type:ty] = $default:expr) => {
        $crate::kind::Preset::Value(|| <$type as $crate::field::Field>::to_value(&$default))
    };
}

/// Declares a choice: an enum whose variants have the words by which scenarios name them. It can be the type of a key.
///
/// `for path::to::Enum { Variant = "word", }` gives the words to an enum of another crate.
#[macro_export]
macro_rules! choice {
    (
        $(#[$about:meta])*
        $visibility:vis enum $name:ident { $( $(#[$help:meta])* $variant:ident = $word:literal, )+ }
    ) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        $visibility enum $name { $( $(#[$help])* $variant, )+ }

        #[allow(dead_code, reason = "not every choice needs all")]
        impl $name {
            /// All, in the order of the help.
            $visibility const ALL: &'static [$name] = &[$($name::$variant),+];

            /// Its word in scenarios and messages.
            #[inline]
            $visibility const fn word(self) -> &'static str {
                match self { $( $name::$variant => $word, )+ }
            }
        }

        $crate::choice! { for $name { $($variant = $word,)+ } }
    };

    (for $name:path { $( $variant:ident = $word:literal, )+ }) => {
        impl $crate::field::Typed for $name {
            const KIND: $crate::kind::Kind = $crate::kind::Kind::Choice(&[$($word),+]);
        }

        impl $crate::field::Field for $name {
            fn from_value(value: &$crate::value::Value) -> Option<Self> {
                match value {
                    $crate::value::Value::Text(word) => match word.as_str() {
                        $( $word => Some(Self::$variant), )+
                        _ => None,
                    },
                    _ => None,
                }
            }

            fn to_value(&self) -> $crate::value::Value {
                $crate::value::Value::Text(match self { $( Self::$variant => $word, )+ }.to_owned())
            }
        }
    };
}

choice! { for geometry::Elbow { Up = "up", Down = "down", } }
