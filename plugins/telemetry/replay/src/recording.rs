//! Common interface of all kinds of recordings for the player.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use busbar_plugin_sdk::{Quality, Reason, Value};
use thiserror::Error;

use crate::remarks::Remarks;

/// Fault of a recording that cannot be played, or not any further.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("'{}': {what}", file.display())]
pub(crate) struct Fault {
    pub(crate) file: PathBuf,
    /// Fault, place and remedy.
    pub(crate) what: String,
    /// Marks a fault of a tag's address, which does not fit the file.
    pub(crate) is_of_tags: bool,
}

impl Fault {
    pub(crate) fn new(file: &Path, what: impl std::fmt::Display) -> Self {
        Self { file: file.to_owned(), what: what.to_string(), is_of_tags: false }
    }

    /// Tags whose addresses do not fit.
    pub(crate) fn of_tags(file: &Path, faults: &[String]) -> Self {
        Self { file: file.to_owned(), what: faults.join("; "), is_of_tags: true }
    }
}

/// Value and quality of a tag from an instant on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Update {
    /// Place of the tag in [`Points`](crate::address::Points).
    pub(crate) point: usize,
    /// Nanoseconds from the recording's origin.
    pub(crate) nanos: i64,
    /// Nothing where the recording has none.
    pub(crate) value: Option<Value>,
    pub(crate) quality: Quality,
}

impl Update {
    pub(crate) fn missing(point: usize, nanos: i64, reason: Reason) -> Self {
        Self { point, nanos, value: None, quality: Quality::Bad(reason) }
    }
}

/// A recording: instants in order, each with updates of tags.
pub(crate) trait Recording: Send {
    /// Nanoseconds from 1970-01-01T00:00:00Z of the instant that times are counted
    /// from, where the recording says it.
    fn origin(&self) -> Option<i64>;

    /// Reads the next instant: its time, its updates appended; nothing at the end.
    /// Times never decrease.
    ///
    /// # Errors
    /// What ends the recording before its end. Lesser faults are remarks.
    fn read(
        &mut self,
        updates: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) -> Result<Option<i64>, Fault>;

    /// Goes on at or before this time, where that is quicker than to read. No
    /// update that the time needs is passed over.
    ///
    /// # Errors
    /// I/O errors of the file.
    fn skip_to(&mut self, nanos: i64) -> Result<(), Fault>;

    /// Goes back to where [`Recording::read`] was when `mark` was called.
    ///
    /// # Errors
    /// I/O errors of the file.
    fn rewind(&mut self) -> Result<(), Fault>;

    /// Remembers what comes next, for [`Recording::rewind`].
    fn mark(&mut self);
}

/// Opens a file for reading; nothing else, which could block.
pub(crate) fn open_file(path: &Path) -> Result<File, Fault> {
    let fault = |error: io::Error| {
        let remedy = match error.kind() {
            io::ErrorKind::NotFound => "there is no such file: is the path right?".to_owned(),
            io::ErrorKind::PermissionDenied => "it may not be read by this user".to_owned(),
            _ => error.to_string(),
        };
        Fault::new(path, remedy)
    };
    if !std::fs::metadata(path).map_err(fault)?.is_file() {
        return Err(Fault::new(path, "it is no file"));
    }
    File::open(path).map_err(fault)
}
