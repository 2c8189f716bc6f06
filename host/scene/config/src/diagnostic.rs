//! One fault of a configuration: where, why, and what to do about it.

use std::fmt;

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The configuration cannot be used.
    Error,
    /// The configuration can be used, but something in it has no effect.
    Warning,
}

/// A fault, its place, its cause and its remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Severity of the diagnostic.
    pub severity: Severity,
    /// Line number, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// JSON pointer (RFC 6901) of the value or key at fault.
    pub pointer: String,
    /// Cause of the diagnostic.
    pub cause: String,
    /// Remedy for the user.
    pub remedy: String,
}

impl Diagnostic {
    /// The diagnostic as lines for people, led by the name of the file:
    /// `file:line:column: error: cause (at /pointer)`, then the remedy.
    pub fn render(&self, file: &str) -> String {
        format!("{file}:{self}")
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Error => "error",
            Self::Warning => "warning",
        })
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { severity, line, column, pointer, cause, remedy } = self;
        write!(f, "{line}:{column}: {severity}: {cause}")?;
        if !pointer.is_empty() {
            write!(f, " (at {pointer})")?;
        }
        write!(f, "\n  remedy: {remedy}")
    }
}

impl std::error::Error for Diagnostic {}
