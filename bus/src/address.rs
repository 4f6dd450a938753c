//! Where a fleet lives: a directory on tmpfs that only its owner may enter, and that holds everything that it shares.

use crate::maker::{MAKER, Maker};
use crate::{BusError, Result};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use rustix::process::geteuid;
use std::io::ErrorKind;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};

/// Where POSIX shared memory lives on Linux.
pub const SHM: &str = "/dev/shm";
/// Characters of an id: no `l`, `o`, `0`, `1`, which look alike.
const ALPHABET: &[u8; 32] = b"abcdefghijkmnpqrstuvwxyz23456789";
const ID_LEN: usize = 7;
/// `statfs` magic of tmpfs.
const TMPFS_MAGIC: u64 = 0x0102_1994;

/// Where one fleet lives. Two fleets never meet: each has a root of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    root: PathBuf,
    id: String,
}

impl Address {
    /// A new address with a random id; its root directory is made, for this user only.
    ///
    /// # Errors
    /// When `/dev/shm` is missing, is not a tmpfs, is full, or is not accessible.
    pub fn create() -> Result<Address> {
        check_shm()?;
        let mut bytes = [0_u8; ID_LEN];
        // 2^35 ids: a second try is for the case that will not come, the bound for the one that must not.
        for _ in 0..16 {
            rustix::rand::getrandom(&mut bytes, rustix::rand::GetRandomFlags::empty())
                .map_err(|e| BusError::io(Path::new("getrandom"), "make a random id", e))?;
            let id: String = bytes.iter().map(|b| char::from(ALPHABET[usize::from(b % 32)])).collect();
            let address = Address { root: root_of(&id), id };
            match address.make() {
                Ok(()) => return Ok(address),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
                Err(e) => return Err(BusError::io(&address.root, "make the fleet's directory", e)),
            }
        }
        Err(BusError::new(
            format!("`{SHM}`"),
            "find a free name for a fleet",
            "16 random names are taken",
            "`shoal clean`",
        ))
    }

    /// Makes the root, which says from its first moment who makes it.
    fn make(&self) -> std::io::Result<()> {
        let maker = Maker::this().to_string();
        let draft = self.root.with_extension(&maker);
        std::fs::DirBuilder::new().mode(0o700).create(&draft)?;
        let made = std::os::unix::fs::symlink(&maker, draft.join(MAKER))
            .and_then(|()| Ok(renameat_with(CWD, &draft, CWD, &self.root, RenameFlags::NOREPLACE)?));
        if made.is_err() {
            let _ = std::fs::remove_dir_all(&draft);
        }
        made
    }

    /// The address with this root, which exists.
    ///
    /// # Errors
    /// When it does not exist, is not ours, or has not the form of a fleet's root.
    pub fn at(root: &Path) -> Result<Address> {
        let address = Address::parse(root).ok_or_else(|| {
            BusError::new(
                format!("`{}`", root.display()),
                "use it as a fleet's root",
                "its name has not the form of this user's fleets",
                format!("roots look like `{}`: see `shoal ps`", root_of("abcd234").display()),
            )
        })?;
        let meta = std::fs::symlink_metadata(root).map_err(|e| BusError::io(root, "open the fleet's directory", e))?;
        if !meta.is_dir() || meta.uid() != geteuid().as_raw() {
            return Err(BusError::new(
                format!("`{}`", root.display()),
                "use it as a fleet's root",
                "it is not a directory of this user",
                "a fleet belongs to the user who started it",
            ));
        }
        Ok(address)
    }

    /// The root directory.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The random part of the name.
    pub fn id(&self) -> &str {
        &self.id
    }

    /// A file in the root.
    pub fn file(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// The address that was to get a root, and did not, because whoever made it died: what is at this path.
    pub(crate) fn unborn(path: &Path) -> Option<Address> {
        let maker: Maker = path.extension()?.to_str()?.parse().ok()?;
        let address = Address::parse(&path.with_extension(""))?;
        let meta = std::fs::symlink_metadata(path).ok()?;
        (meta.is_dir() && meta.uid() == geteuid().as_raw() && !maker.may_live()).then_some(address)
    }

    /// The address whose root has this path, by its form alone.
    pub(crate) fn parse(root: &Path) -> Option<Address> {
        let name = root.file_name()?.to_str()?;
        let id = name.strip_prefix(&format!("shoal-{}-", geteuid().as_raw()))?;
        let formed = id.len() == ID_LEN && id.bytes().all(|b| ALPHABET.contains(&b));
        (formed && root.parent() == Some(Path::new(SHM))).then(|| Address { root: root.to_path_buf(), id: id.into() })
    }
}

fn root_of(id: &str) -> PathBuf {
    Path::new(SHM).join(format!("shoal-{}-{id}", geteuid().as_raw()))
}

fn check_shm() -> Result<()> {
    let shm = Path::new(SHM);
    let stat = rustix::fs::statfs(shm).map_err(|e| {
        BusError::new(
            format!("`{SHM}`"),
            "use it for shared memory",
            std::io::Error::from(e).to_string(),
            "mount a tmpfs there: `mount -t tmpfs -o size=50% tmpfs /dev/shm`",
        )
    })?;
    if stat.f_type as u64 & 0xFFFF_FFFF == TMPFS_MAGIC {
        Ok(())
    } else {
        Err(BusError::new(
            format!("`{SHM}`"),
            "use it for shared memory",
            "it is not a tmpfs, so every message would go to a disk",
            "mount a tmpfs there: `mount -t tmpfs -o size=50% tmpfs /dev/shm`",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_found_again_by_its_root() {
        let address = Address::create().unwrap();
        assert_eq!(Address::at(address.root()).unwrap(), address);
        assert_eq!(address.file("gate"), address.root().join("gate"));
        let mode = std::fs::metadata(address.root()).unwrap().mode();
        std::fs::remove_dir_all(address.root()).unwrap();
        assert_eq!(mode & 0o777, 0o700);
        assert!(Address::at(address.root()).unwrap_err().is_missing());
    }

    #[test]
    fn a_root_whose_maker_died_half_way_is_known() {
        let address = Address::create().unwrap();
        let draft = |maker: &str| address.root().with_extension(maker);
        let this = Maker::this().to_string();
        let dead = this.replacen(&std::process::id().to_string(), "4194305", 1);
        let check = |maker: &str, expected: bool| {
            std::fs::create_dir(draft(maker)).unwrap();
            // Any shoal command on this machine removes it, if it is one.
            let found = Address::unborn(&draft(maker)) == Some(address.clone()) || !draft(maker).exists();
            let _ = std::fs::remove_dir(draft(maker));
            assert_eq!(found, expected, "{maker}");
        };
        check(&dead, true);
        check(&this, false);
        check("record", false);
        std::fs::remove_dir_all(address.root()).unwrap();
    }

    #[test]
    fn other_paths_are_refused() {
        let uid = geteuid().as_raw();
        for path in [
            "/tmp".into(),
            "/dev/shm".into(),
            format!("/dev/shm/shoal-{uid}-abc"),
            format!("/dev/shm/shoal-{uid}-abcd234x"),
            format!("/dev/shm/shoal-{uid}-abcd23."),
            format!("/dev/shm/shoal-{}-abcd234", uid + 1),
            format!("/tmp/shoal-{uid}-abcd234"),
        ] {
            let error = Address::at(Path::new(&path)).unwrap_err();
            assert!(error.to_string().contains(&path), "{error}");
            assert!(error.hint().is_some());
        }
    }
}
