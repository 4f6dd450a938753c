//! The bytes of a record, wherever they are: read at any place, by any number of readers.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

/// A file, or memory.
#[derive(Clone, Debug)]
pub(crate) enum Source {
    File(Arc<File>, u64),
    Memory(Arc<Vec<u8>>),
}

impl Source {
    /// The file as long as it is now: one that is still being written grows.
    pub(crate) fn open(path: &Path) -> io::Result<Source> {
        #[expect(clippy::disallowed_methods, reason = "the shell of records reads them")]
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Source::File(Arc::new(file), length))
    }

    pub(crate) fn length(&self) -> u64 {
        match self {
            Source::File(_, length) => *length,
            Source::Memory(bytes) => bytes.len() as u64,
        }
    }

    /// Reads exactly so many bytes.
    pub(crate) fn read(&self, at: u64, into: &mut [u8]) -> io::Result<()> {
        match self {
            Source::File(file, _) => file.read_exact_at(into, at),
            Source::Memory(bytes) => {
                let at = usize::try_from(at).map_err(|_| io::ErrorKind::UnexpectedEof)?;
                let found = at.checked_add(into.len()).and_then(|end| bytes.get(at..end));
                into.copy_from_slice(found.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
        }
    }
}
