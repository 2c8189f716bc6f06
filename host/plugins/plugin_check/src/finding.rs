//! Findings of a case.

use serde::{Deserialize, Serialize};

/// A fault of a plugin, and what its author can do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finding {
    /// Description of the fault, with its place.
    pub fault: String,
    /// Remedy for the plugin's author.
    pub remedy: String,
}

/// Reasons to stop a case early.
pub(crate) enum Stop {
    /// Case does not apply, with the reason.
    Skip(String),
    /// Finding after which the rest of the case makes no sense.
    Fail(Finding),
}

/// Result of a case; findings that did not stop it are with the probe.
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
