//! The audit log of alarms.
//!
//! A line a [`Record`](busbar_alarms::Record): its XXH3 in hexadecimal, a space, its JSON.
//! Lines are only ever appended. A thread of its own writes what a frame brings and syncs
//! it (`fdatasync`) before it tells that it is durable; a frame never waits for the disk.
//! An operator's action counts as done once [`AlarmLog::durable`] has reached its record.
//!
//! A line that a crash cut short is cut off when the log is opened; one that is damaged in
//! the middle is passed over and told. At [`LogRules::max_file_bytes`] a new file begins,
//! with the last record of every alarm that is not normal: so the newest file alone tells
//! how all alarms stand, however old that is.
//!
//! Invariant: nothing that is read is trusted, and nothing here decides on alarms.

mod journal;
mod line;
mod log;
pub mod probe;
mod recovery;

pub use journal::LogRules;
pub use log::{AlarmLog, MAX_WAITING_RECORDS};
pub use recovery::Recovered;

use std::path::PathBuf;

/// The longest line, in bytes.
pub const MAX_LINE_BYTES: usize = 16 * 1024;
/// The largest file that is read, in bytes.
pub const MAX_FILE_BYTES: u64 = 64 * 1024 * 1024;
/// Records that are handed over when a log is opened, the newest.
pub const MAX_TAIL: usize = 1_000;

/// Why a log cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// Its folder or a file in it cannot be made, read or written.
    #[error("cannot use the alarm log '{}': {source}; name a folder that may be written", .path.display())]
    Unusable {
        /// The folder or file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Another viewer writes it.
    #[error(
        "the alarm log in '{}' is in use: close the other viewer, or name another folder",
        .directory.display()
    )]
    InUse {
        /// The folder.
        directory: PathBuf,
    },
}
