//! What a running fleet stands on: its root, and the files that its daemon made there. Processes that have them open go on
//! when the names are removed, but none can join, be restarted, or be found any more.

use crate::{Address, BusError, Result};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Files and objects that stay for as long as their fleet runs, as they were when the fleet was made.
#[derive(Debug)]
pub struct Footing(Vec<(PathBuf, (u64, u64))>);

impl Footing {
    /// Notes what is there. To be called when the fleet's services have been made, and nothing else runs yet.
    ///
    /// # Errors
    /// When something of it is missing already.
    pub fn survey(address: &Address) -> Result<Footing> {
        Footing::of(address, &|_| true)
    }

    /// The same for a fleet that runs: without the files of iceoryx2, which may be those of robots that come and go, or of a
    /// world that another one has replaced.
    ///
    /// # Errors
    /// When the root is gone.
    pub fn survey_running(address: &Address) -> Result<Footing> {
        let stays = ["gate", "lease", "orders", "notices", "notices.bell"];
        Footing::of(address, &|name| stays.contains(&name))
    }

    fn of(address: &Address, stays: &dyn Fn(&str) -> bool) -> Result<Footing> {
        let root = address.root();
        let entries = std::fs::read_dir(root).map_err(|e| BusError::io(root, "read the directory", e))?;
        let files = entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| !kind.is_dir()));
        let files = files.filter(|entry| entry.file_name().to_str().is_some_and(stays));
        let noted = std::iter::once(root.to_path_buf()).chain(files.map(|entry| entry.path())).map(|path| {
            let identity = identity(&path).map_err(|e| BusError::io(&path, "find it again", e))?;
            Ok((path, identity))
        });
        noted.collect::<Result<Vec<_>>>().map(Footing)
    }

    /// What is missing, or something else by now. A look costs a system call for each (about twenty).
    pub fn missing(&self) -> Option<&Path> {
        let gone = |(path, noted): &&(PathBuf, (u64, u64))| match identity(path) {
            Ok(identity) => identity != *noted,
            // Whatever else keeps this process from looking does not mean that the file has gone.
            Err(error) => error.kind() == std::io::ErrorKind::NotFound,
        };
        self.0.iter().find(gone).map(|(path, _)| path.as_path())
    }
}

fn identity(path: &Path) -> std::io::Result<(u64, u64)> {
    std::fs::symlink_metadata(path).map(|meta| (meta.dev(), meta.ino()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Gate, Node, Services, Sizes, clean};

    #[test]
    fn every_part_that_is_removed_is_missed() {
        let address = Address::create().unwrap();
        let node = Node::new(&address, "test").unwrap();
        let services = Services::create(&node, Sizes { max_robots: 2, shape_pieces: 0 }).unwrap();
        let gate = Gate::create(&address, 2).unwrap();
        let footing = Footing::survey(&address).unwrap();
        assert_eq!(footing.missing(), None);
        assert!(footing.0.len() > 4, "{footing:?}");
        for (path, _) in footing.0.iter().skip(1) {
            let aside = address.file("aside");
            std::fs::rename(path, &aside).unwrap();
            assert_eq!(footing.missing(), Some(path.as_path()));
            std::fs::File::create_new(path).unwrap();
            assert_eq!(footing.missing(), Some(path.as_path()), "another file of that name");
            std::fs::rename(&aside, path).unwrap();
            assert_eq!(footing.missing(), None);
        }
        drop((gate, services, node));
        clean::sweep(&address);
        assert_eq!(footing.missing(), Some(address.root()));
    }
}
