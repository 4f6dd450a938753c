//! Which process is just making the root of a fleet, and whether it lives: no clock says how long that may take.

use crate::process::start_of;
use std::fmt;
use std::path::Path;
use std::str::FromStr;

/// A symbolic link in a root that has no lease yet; its target is the maker.
pub(crate) const MAKER: &str = "maker";

/// One process, not only its number: written `pid-start-namespace`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Maker {
    pid: u32,
    /// When it was started, in ticks of the kernel since the boot.
    start: u64,
    /// The pid namespace in which it has that number.
    namespace: u64,
}

impl Maker {
    /// This process.
    pub(crate) fn this() -> Maker {
        let pid = std::process::id();
        Maker { pid, start: start_of(pid).unwrap_or(0), namespace: namespace() }
    }

    /// The process that made this root, if it says so.
    pub(crate) fn of(root: &Path) -> Option<Maker> {
        std::fs::read_link(root.join(MAKER)).ok()?.to_str()?.parse().ok()
    }

    /// Its number.
    pub(crate) fn pid(self) -> u32 {
        self.pid
    }

    /// Whether it may be alive. Of another namespace's processes this one cannot tell.
    pub(crate) fn may_live(self) -> bool {
        self.namespace != namespace() || start_of(self.pid) == Some(self.start)
    }
}

impl fmt::Display for Maker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{}-{}", self.pid, self.start, self.namespace)
    }
}

impl FromStr for Maker {
    type Err = ();

    fn from_str(text: &str) -> Result<Maker, ()> {
        let mut numbers = text.split('-').map(|number| number.parse::<u64>().map_err(drop));
        let mut next = || numbers.next().unwrap_or(Err(()));
        let maker = Maker { pid: next()?.try_into().map_err(drop)?, start: next()?, namespace: next()? };
        if numbers.next().is_none() { Ok(maker) } else { Err(()) }
    }
}

/// The pid namespace of this process.
fn namespace() -> u64 {
    let link = std::fs::read_link("/proc/self/ns/pid").ok();
    let number = |link: &Path| link.to_str()?.strip_prefix("pid:[")?.strip_suffix(']')?.parse().ok();
    link.and_then(|link| number(&link)).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_maker_is_known_by_more_than_its_number() {
        let this = Maker::this();
        assert!(this.start > 0 && this.namespace > 0, "{this}");
        assert_eq!(this.to_string().parse(), Ok(this));
        assert!(this.may_live());
        assert!(!Maker { start: this.start + 1, ..this }.may_live(), "another process of that number");
        assert!(!Maker { pid: u32::MAX, ..this }.may_live());
        assert!(Maker { pid: u32::MAX, namespace: 1, ..this }.may_live(), "nobody here can tell");
        for text in ["", "1-2", "1-2-3-4", "-1-2-3", "x-2-3", "5000000000-2-3"] {
            assert!(text.parse::<Maker>().is_err(), "{text}");
        }
    }
}
