//! Gathers the faults of one text.

use crate::former_names::RenamedSettings;
use crate::{Diagnostic, MAX_DIAGNOSTICS, Positions, Severity};

/// The diagnostics found so far.
pub(crate) struct Report<'a> {
    positions: &'a Positions,
    diagnostics: Vec<Diagnostic>,
    errors: usize,
    /// Number of faults beyond [`MAX_DIAGNOSTICS`].
    more: usize,
}

impl<'a> Report<'a> {
    pub(crate) fn new(positions: &'a Positions) -> Self {
        Self { positions, diagnostics: Vec::new(), errors: 0, more: 0 }
    }

    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }

    pub(crate) fn positions(&self) -> &'a Positions {
        self.positions
    }

    pub(crate) fn extend(&mut self, diagnostics: Vec<Diagnostic>) {
        for diagnostic in diagnostics {
            self.add(diagnostic.severity, || diagnostic);
        }
    }

    /// Counts errors for which there is no room: the report must be full.
    pub(crate) fn count_more(&mut self, errors: usize) {
        debug_assert!(errors == 0 || self.diagnostics.len() >= MAX_DIAGNOSTICS);
        self.errors += errors;
        self.more += errors;
    }

    /// An error at a value.
    pub(crate) fn error(
        &mut self,
        pointer: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.error_with(pointer, || (cause.into(), remedy.into()));
    }

    /// An error at a value, whose cause and remedy take time to find: they
    /// are only asked for while there is room.
    pub(crate) fn error_with(&mut self, pointer: &str, texts: impl FnOnce() -> (String, String)) {
        let positions = self.positions;
        self.add(Severity::Error, || {
            let (cause, remedy) = texts();
            positions.diagnostic(pointer, cause, remedy)
        });
    }

    /// An error at the key in front of a value.
    pub(crate) fn key_error(
        &mut self,
        pointer: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.at_key(Severity::Error, pointer, cause.into(), remedy.into());
    }

    /// A warning at the key in front of a value.
    pub(crate) fn key_warning(
        &mut self,
        pointer: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) {
        self.at_key(Severity::Warning, pointer, cause.into(), remedy.into());
    }

    /// Tells settings with former names, each pair of names once, and those given twice.
    pub(crate) fn add_renamed(&mut self, names: &RenamedSettings) {
        self.extend(names.conflict_errors(self.positions));
        self.extend(names.warnings(self.positions));
    }

    /// Returns all diagnostics in the order of the text.
    pub(crate) fn into_diagnostics(mut self) -> Vec<Diagnostic> {
        self.diagnostics.sort_by_key(|d| (d.line, d.column, d.severity));
        if self.more > 0 {
            let severity = if self.errors > 0 { Severity::Error } else { Severity::Warning };
            let cause = format!("and {} more faults", self.more);
            let remedy = "mend those above, then check again".to_owned();
            self.diagnostics.push(self.positions.at_offset(
                severity,
                0,
                String::new(),
                cause,
                remedy,
            ));
        }
        self.diagnostics
    }

    fn at_key(&mut self, severity: Severity, pointer: &str, cause: String, remedy: String) {
        let positions = self.positions;
        self.add(severity, || positions.at_key(severity, pointer, cause, remedy));
    }

    fn add(&mut self, severity: Severity, diagnostic: impl FnOnce() -> Diagnostic) {
        self.errors += usize::from(severity == Severity::Error);
        if self.diagnostics.len() >= MAX_DIAGNOSTICS {
            self.more += 1;
        } else {
            self.diagnostics.push(diagnostic());
        }
    }
}
