//! Findings of the checks of `busbar doctor`.

use serde::Serialize;

/// State of a checked item.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum State {
    Ok,
    /// Item that works, and may not be as intended.
    Warning,
    /// Item that does not work.
    Fault,
}

/// Finding of one check.
#[derive(Debug, Serialize)]
pub(crate) struct Finding {
    /// Name of the check.
    pub(crate) check: &'static str,
    pub(crate) state: State,
    /// Result of the check, in words.
    pub(crate) cause: String,
    /// Remedy; empty where all is well.
    pub(crate) remedy: String,
}

impl Finding {
    pub(crate) fn ok(check: &'static str, cause: impl Into<String>) -> Self {
        Self { check, state: State::Ok, cause: cause.into(), remedy: String::new() }
    }

    pub(crate) fn warning(
        check: &'static str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { check, state: State::Warning, cause: cause.into(), remedy: remedy.into() }
    }

    pub(crate) fn fault(
        check: &'static str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { check, state: State::Fault, cause: cause.into(), remedy: remedy.into() }
    }
}
