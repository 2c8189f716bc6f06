//! Errors of configuration files of recordings.

use thiserror::Error;

/// A configuration that cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("line {line}: {what}")]
pub struct CfgError {
    /// Number of the line, the first being 1.
    pub line: usize,
    /// Description of the fault.
    pub what: String,
}
