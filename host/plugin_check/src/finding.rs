//! What a case found.

use serde::{Deserialize, Serialize};

/// A fault of a plugin, and what its author can do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// What is wrong, and where.
    pub fault: String,
    /// What to do.
    pub remedy: String,
}

/// Why a case ended before its end.
pub(crate) enum Stop {
    /// It does not apply, and why.
    Skip(String),
    /// What follows makes no sense after this finding.
    Fail(Finding),
}

/// What a case gives; findings that did not stop it are with the probe.
pub(crate) type Outcome = Result<(), Stop>;

impl Finding {
    pub(crate) fn new(fault: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { fault: fault.into(), remedy: remedy.into() }
    }
}

impl From<Finding> for Stop {
    fn from(finding: Finding) -> Self {
        Self::Fail(finding)
    }
}

/// Ends a case that does not apply.
pub(crate) fn skip<T>(why: impl Into<String>) -> Result<T, Stop> {
    Err(Stop::Skip(why.into()))
}
