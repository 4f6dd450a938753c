//! How large a fleet can become, and what that takes.
#![expect(clippy::disallowed_methods, reason = "the sizes of a fleet are a file in its root")]

use crate::{Address, BusError, Result, control, frames, notes, stats};
use protocol::world_to_robot::{Impairment, NeighborList, Odometry, Piece, SensedList};
use std::path::Path;

/// Everything that shared memory is made for, once, when the fleet starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// How many robots the fleet can hold, late joiners included.
    pub max_robots: u32,
    /// How many pieces the obstacles of the world have.
    pub shape_pieces: u32,
}

/// With less than this free, bytes, a process that died of SIGBUS may well have found shared memory full.
const NEARLY_FULL: u64 = 1 << 20;

/// Whether shared memory is full, or nearly.
pub fn nearly_full() -> bool {
    rustix::fs::statvfs(crate::address::SHM)
        .is_ok_and(|stat| stat.f_bavail.saturating_mul(stat.f_frsize) < NEARLY_FULL && stat.f_blocks > 0)
}

/// The size of the huge page, bytes, that every file in `/dev/shm` takes at least, if it is mounted like that.
fn huge_page() -> Option<u64> {
    let setting = |name: &str| std::fs::read_to_string(format!("/sys/kernel/mm/transparent_hugepage/{name}")).ok();
    let mounts = std::fs::read_to_string("/proc/self/mountinfo").ok()?;
    if is_huge(&mounts, &setting("shmem_enabled").unwrap_or_default()) {
        setting("hpage_pmd_size")?.trim().parse().ok()
    } else {
        None
    }
}

/// Whether the mount of `/dev/shm`, or the machine's setting that overrules it, gives every file huge pages.
fn is_huge(mounts: &str, setting: &str) -> bool {
    // The fifth word of a line is where it is mounted, the options of the file system are the last; later mounts hide
    // earlier ones.
    let ours = mounts.lines().rfind(|line| line.split(' ').nth(4) == Some(crate::address::SHM));
    let options = ours.and_then(|line| line.rsplit(' ').next()).unwrap_or_default();
    let always = options.split(',').any(|option| option == "huge=always");
    (always || setting.contains("[force]")) && !setting.contains("[deny]")
}

/// Places for the world, the daemon, observers and operators.
const SPARE: usize = 32;
const FILE: &str = "sizes";
const KIB: u64 = 1024;

impl Sizes {
    /// How many processes may take part in a service at once: twice the fleet, because a dead one keeps its place until
    /// the janitor comes, and some.
    pub fn participants_max(&self) -> usize {
        2 * self.max_robots as usize + SPARE
    }

    /// How many pieces there are: those of the obstacles, then one per robot.
    pub fn pieces(&self) -> u32 {
        self.shape_pieces + self.max_robots
    }

    /// How many bodies a frame can hold: the robots, and the moving obstacles, each of which has a piece at least.
    pub fn frame_bodies_max(&self) -> usize {
        self.pieces() as usize
    }

    /// The shared memory that the whole fleet needs, bytes: what its parts take with all their pages touched, and a
    /// quarter more. `tests/scale.rs` holds it against what is really used.
    pub fn bytes_needed(&self) -> u64 {
        let robots = u64::from(self.max_robots);
        let participants = self.participants_max() as u64;
        let entry = |size: usize| 16 + 2 * size as u64;
        // iceoryx2 describes an entry in some 400 bytes.
        let per_slot = entry(size_of::<Odometry>())
            + entry(size_of::<NeighborList>())
            + entry(size_of::<SensedList>())
            + entry(size_of::<Impairment>());
        let world = robots * (per_slot + 4 * 400)
            + u64::from(self.pieces()) * (entry(size_of::<Piece>()) + 400)
            + participants * 200;
        // Three objects and a file per board, a few pages of which are used, and some room per participant. Half as many
        // again for the boards of earlier lives that neighbours still have open.
        let boards = robots * 3 / 2 * (24 * KIB + participants * 96);
        let nodes = participants * 12 * KIB;
        let specs = robots * (8 * KIB + 64 * u64::from(self.shape_pieces));
        let gate = 12 * KIB + robots * 64;
        let stats = stats::bytes_needed(robots);
        let control = control::BYTES_NEEDED;
        (world + boards + nodes + specs + gate + stats + control + frames::bytes_needed(self.frame_bodies_max())) * 5
            / 4
    }

    /// The same on this machine, where `/dev/shm` may give every file a huge page at least.
    pub fn bytes_needed_here(&self) -> u64 {
        self.bytes_needed() + huge_page().unwrap_or(0) * self.files_max()
    }

    /// How many files a fleet has at most.
    fn files_max(&self) -> u64 {
        64 + 40 * u64::from(self.max_robots)
    }

    /// Refuses a fleet that does not fit. Writing to a full tmpfs is not an error but a SIGBUS, so this comes first.
    ///
    /// # Errors
    /// When less is free than the fleet needs.
    pub fn check_space(&self, address: &Address) -> Result<()> {
        let stat = rustix::fs::statvfs(address.root())
            .map_err(|e| BusError::io(address.root(), "ask for the free space", e))?;
        let notes = if notes::is_recorded(address) { notes::bytes_needed(self.max_robots) } else { 0 };
        let (needed, free) = (self.bytes_needed_here() + notes, stat.f_bavail.saturating_mul(stat.f_frsize));
        if free < needed {
            let text = format!("{} robots need {needed} bytes of shared memory, {free} are free", self.max_robots);
            if needed > self.bytes_needed() + notes {
                return Err(BusError::new(
                    format!("`{}`", crate::address::SHM),
                    "hold the fleet",
                    format!("{text}: it is mounted with `huge=always`, so that every file takes a huge page"),
                    "`mount -o remount,huge=never /dev/shm`, or enlarge it",
                ));
            }
            return Err(BusError::new(
                format!("`{}`", crate::address::SHM),
                "hold the fleet",
                text,
                "enlarge it (`mount -o remount,size=2G /dev/shm`, or `--shm-size` of a container), remove what dead \
                 fleets left (`shoal clean`), or lower max_robots",
            ));
        }
        // Every file takes an inode; a tmpfs can be out of those too. Zero in all: no limit.
        let files = self.files_max();
        if stat.f_files > 0 && stat.f_favail < files {
            return Err(BusError::new(
                format!("`{}`", crate::address::SHM),
                "hold the fleet",
                format!("{} robots need {files} files, {} are free", self.max_robots, stat.f_favail),
                "`mount -o remount,nr_inodes=0 /dev/shm`, or lower max_robots",
            ));
        }
        Ok(())
    }

    pub(crate) fn store(&self, address: &Address) -> Result<()> {
        let path = address.file(FILE);
        let draft = address.file(".sizes");
        let failed = |e| BusError::io(&path, "write the sizes", e);
        std::fs::write(&draft, format!("{} {}\n", self.max_robots, self.shape_pieces)).map_err(failed)?;
        std::fs::rename(&draft, &path).map_err(failed)
    }

    /// The sizes that a fleet was made for.
    ///
    /// # Errors
    /// When the fleet is gone, or not made yet.
    pub fn of(address: &Address) -> Result<Sizes> {
        let path = address.file(FILE);
        let text = std::fs::read_to_string(&path).map_err(|e| BusError::io(&path, "read the sizes", e))?;
        Sizes::parse(&text).ok_or_else(|| damaged(&path))
    }

    fn parse(text: &str) -> Option<Sizes> {
        let mut words = text.split_ascii_whitespace().map(str::parse);
        Some(Sizes { max_robots: words.next()?.ok()?, shape_pieces: words.next()?.ok()? })
    }
}

fn damaged(path: &Path) -> BusError {
    BusError::new(
        format!("`{}`", path.display()),
        "read the sizes",
        "it does not hold two numbers",
        "all processes of a fleet must come from the same build",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_that_does_not_fit_is_refused_with_both_numbers() {
        let address = Address::create().unwrap();
        let huge = Sizes { max_robots: 50_000_000, shape_pieces: 0 };
        let error = huge.check_space(&address).unwrap_err();
        crate::clean::sweep(&address);
        assert!(error.to_string().contains(&huge.bytes_needed().to_string()), "{error}");
        assert!(error.hint().unwrap().contains("/dev/shm"));
    }

    #[test]
    fn a_recorded_fleet_needs_room_for_notes() {
        let address = Address::create().unwrap();
        let huge = Sizes { max_robots: 50_000_000, shape_pieces: 0 };
        let bare = huge.check_space(&address).unwrap_err().to_string();
        std::fs::write(address.file(notes::RECORD_FILE), "run.mcap").unwrap();
        let recorded = huge.check_space(&address).unwrap_err().to_string();
        crate::clean::sweep(&address);
        let needed = huge.bytes_needed_here() + notes::bytes_needed(huge.max_robots);
        assert!(recorded.contains(&needed.to_string()) && !bare.contains(&needed.to_string()), "{bare}, {recorded}");
    }

    #[test]
    fn huge_pages_of_the_mount_are_noticed() {
        const SETTING: &str = "always within_size advise [never] deny force";
        let mount = |options: &str| {
            format!(
                "29 27 0:25 / /dev/shm rw,nosuid shared:4 - tmpfs tmpfs {options}\n30 27 0:26 / /run rw - tmpfs x rw,huge=always\n"
            )
        };
        assert!(is_huge(&mount("rw,size=4g,huge=always"), SETTING));
        assert!(!is_huge(&mount("rw,size=4g"), SETTING));
        assert!(!is_huge(&mount("rw,huge=within_size"), SETTING));
        assert!(!is_huge(&(mount("rw,huge=always") + &mount("rw")), SETTING), "the later mount hides the earlier one");
        assert!(is_huge(&mount("rw"), "always within_size advise never deny [force]"));
        assert!(!is_huge(&mount("rw,huge=always"), "always within_size advise never [deny] force"));
        assert!(!is_huge("", ""));
    }

    #[test]
    fn sizes_are_found_again() {
        let address = Address::create().unwrap();
        let sizes = Sizes { max_robots: 15, shape_pieces: 8 };
        sizes.store(&address).unwrap();
        let found = Sizes::of(&address);
        crate::clean::sweep(&address);
        assert_eq!(found, Ok(sizes));
        assert!(Sizes::of(&address).unwrap_err().is_missing());
        assert_eq!(Sizes::parse("15"), None);
    }
}
