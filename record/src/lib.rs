//! Records of runs: MCAP files. `docs/records.md` describes what stands in them.
//!
//! ```text
//! moment     what is recorded            header     what a record says of itself
//! frame      bodies as few bytes         scene      what viewers look at
//! wire       protocol buffers            schema     how other programs decode them
//! writer     from moments to messages    sink       the thread and the file that it writes
//! reader     records, from any tick      source     the bytes of a record
//! walk       where the parts of a file are
//! export     records as other formats    ros2       as ROS 2 has them
//! palette    colours and sizes           figures    what processes have counted
//! container  MCAP: the one file that names the library
//! identity   which build of shoal this is
//! ```
//!
//! A [`Sink`] takes [`Moment`]s, a [`Record`] gives them back. Only `sink`, `source` and `identity` touch files.

mod container;
mod error;
mod export;
mod figures;
mod frame;
mod header;
mod identity;
mod moment;
mod palette;
mod reader;
mod ros2;
mod scene;
mod schema;
mod sink;
mod source;
#[cfg(test)]
mod tests;
mod walk;
mod wire;
mod writer;

#[doc(hidden)]
pub use container::unpacked;
pub use error::{Cut, RecordError};
pub use export::{ExportError, ExportFormat, export};
pub use figures::{Counted, Figures, Spread};
pub use frame::Body;
pub use header::{About, Ending, FORMAT, time_ns};
pub use identity::build;
pub use moment::{Added, InputSource, Moment};
pub use reader::{Frame, Frames, Input, Inputs, Newest, Record};
pub use sink::{Count, Sink};
