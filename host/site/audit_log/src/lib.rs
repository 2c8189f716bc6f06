//! The audit log of alarms.
//!
//! A line a [`AlarmRecord`](busbar_alarms::AlarmRecord): its XXH3 in hexadecimal, a mark, its JSON with
//! a version and a chain value. Lines are only ever appended. A thread of its own writes what
//! a frame brings and syncs it (`fdatasync`) before it tells that it is durable; a frame never
//! waits for the disk. An operator's action counts as done once [`AuditLog::durable`] has
//! reached its record.
//!
//! **No byte is destroyed.** A line that a crash cut short, a damaged one, or one of a newer
//! release stays where it is: the file ends, is renamed, and a new one goes on. Damaged files
//! are called `quarantine` and are never removed. At [`AuditLogOptions::max_file_bytes`] a new file
//! begins too; of full ones [`AuditLogOptions::max_files`] are kept. Each file begins with a header
//! and the last record of every alarm that is not normal: so the newest file alone tells how
//! all alarms stand, however old that is. Where its beginning is damaged, those before tell.
//!
//! **Removal, reordering and forging are found** by [`verify()`]. The chain value of a line is
//! the HMAC-SHA-256 of the value before, the line's mark and its text, under a key. The header
//! of a file has the number of the newest record before it, and a manifest: name, size and
//! SHA-256 of every file that is kept. An anchor in another folder has number and chain value
//! of the newest record; it is written within [`ANCHOR_INTERVAL`] of its record, and when the
//! log is closed. Limits: whoever reads the key can forge; whoever writes log and anchor can
//! take both back to an earlier state; without key the chain finds accidents alone.
//!
//! Lines of releases before the chain are read as ever; the chain begins with a new file.
//!
//! Invariant: nothing that is read is trusted, and nothing here decides on alarms.
#![doc = include_str!("../DESIGN.md")]

mod anchor;
mod chain;
mod chain_check;
mod file_header;
mod file_names;
mod line;
mod log;
mod log_writer;
mod options;
pub mod probe;
mod recovery;
mod storage;
mod verification;

pub use chain::{MAX_KEY_BYTES, MIN_KEY_BYTES};
pub use line::VERSION;
pub use log::{ANCHOR_INTERVAL, AuditLog, MAX_WAITING_RECORDS};
pub use options::{AuditLogOptions, inspect};
pub use recovery::RecoveredLog;
pub use verification::{MAX_FINDINGS, Verification, verify};

use std::path::PathBuf;

/// The longest line of a record, in bytes.
pub const MAX_LINE_BYTES: usize = 16 * 1024;
/// The longest header of a file, in bytes: its manifest grows with the files that are kept.
pub const MAX_HEADER_BYTES: usize = 512 * 1024;
/// The largest part of a file that is read, in bytes.
pub const MAX_FILE_BYTES: u64 = 64 * 1024 * 1024;
/// Records that are handed over when a log is opened, the newest.
pub const MAX_TAIL: usize = 1_000;

/// Causes for which a log cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The folder or a file in it cannot be made, read or written.
    #[error("cannot use the alarm log '{}': {source}; name a folder that may be written", .path.display())]
    Unusable {
        /// The folder or file.
        path: PathBuf,
        /// Reason from the system.
        source: std::io::Error,
    },
    /// Another viewer writes the log.
    #[error(
        "the alarm log in '{}' is in use: close the other viewer, or name another folder",
        .directory.display()
    )]
    InUse {
        /// Path of the folder.
        directory: PathBuf,
    },
    /// The key of the chain cannot be read.
    #[error(
        "cannot read the key of the alarm log '{}': {source}; name a file of 16 to 4096 bytes, \
         such as `openssl rand -hex 32` writes, that the viewer may read",
        .path.display()
    )]
    Key {
        /// Path of the file.
        path: PathBuf,
        /// Reason from the system.
        source: std::io::Error,
    },
    /// The anchor cannot be written.
    #[error(
        "cannot write the anchor of the alarm log '{}': {source}; name a file in a folder that \
         the viewer may write",
        .path.display()
    )]
    Anchor {
        /// Path of the file.
        path: PathBuf,
        /// Reason from the system.
        source: std::io::Error,
    },
    /// Key or anchor lie in the folder of the log.
    #[error(
        "'{}' lies in the folder of the alarm log, where it proves nothing; move it to a folder \
         of another owner",
        .path.display()
    )]
    Misplaced {
        /// The key or anchor.
        path: PathBuf,
    },
    /// The folder has no log.
    #[error("there is no alarm log in '{}'; name its folder", .directory.display())]
    Absent {
        /// Path of the folder.
        directory: PathBuf,
    },
}

#[cfg(test)]
mod damage_tests;
#[cfg(test)]
mod memory_storage;
#[cfg(test)]
mod power_cut_tests;
