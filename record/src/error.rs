//! Why a file is not a record that can be read.

use crate::header::FORMAT;
use protocol::codec::CodecError;
use std::io;

/// Why there is no record.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// It is something else.
    #[error("it is not a record")]
    Foreign,
    /// It is an MCAP file, and this is what wrote it.
    #[error("it is an MCAP file that `{0}` wrote, and not a record of shoal")]
    Library(String),
    /// It is a record of the format before MCAP.
    #[error("it is a record of an older shoal, from before records were MCAP files")]
    Old,
    /// It is a record of another version.
    #[error("it is a record of format version {0}, and this shoal reads version {FORMAT}")]
    Version(u32),
    /// Its beginning is missing or damaged, so that nothing of it can be read.
    #[error("nothing of it can be read: {0}")]
    Beginning(Cut),
    /// A chunk was changed, at this place.
    #[error("it is damaged: the checksum of the chunk at byte {0} does not fit")]
    Damaged(u64),
    /// The checksums fit, but the content does not.
    #[error("it holds what no run writes")]
    Impossible,
    /// The map of its scenario is missing, or damaged.
    #[error("the map in it cannot be used: {0}")]
    Map(model::MapProblem),
    /// It cannot be read at all.
    #[error("cannot read: {0}")]
    Io(#[from] io::Error),
    /// Its parts are not what this binary writes.
    #[error("it is a record that another build of shoal wrote: {0}")]
    Codec(#[from] CodecError),
}

/// Why a record ends before its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cut {
    /// The file ends here, bytes from its beginning: the run was killed, the disk was full, or it is a part of a copy. Or it
    /// is still being written.
    Ends(u64),
    /// What stands here is not what a record has, bytes from its beginning.
    Damaged(u64),
}

impl std::fmt::Display for Cut {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Cut::Ends(at) => write!(f, "it is cut off after {at} bytes"),
            Cut::Damaged(at) => write!(f, "it is damaged from byte {at} on"),
        }
    }
}
