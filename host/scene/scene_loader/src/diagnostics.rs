//! Faults of a configuration: collected with their places, so that loading continues.

use std::fmt;
use std::path::PathBuf;

use busbar_config::{Config, Diagnostic, RenamedSettings, Severity};
use busbar_plugin_host::PluginError;

/// A configuration that cannot be loaded: every fault found.
#[derive(Debug)]
pub struct LoadError {
    /// Path of the configuration file.
    pub file: PathBuf,
    /// Faults in order of place, warnings among them.
    pub diagnostics: Vec<Diagnostic>,
}

/// Collector of diagnostics, so that loading continues as far as possible.
pub struct DiagnosticsCollector<'a> {
    config: &'a Config,
    /// Faults and warnings in the order of their discovery.
    pub found: Vec<Diagnostic>,
    /// Failures of plugins, which do not prevent the scene from being shown.
    pub(crate) plugin_failures: Vec<Diagnostic>,
}

impl<'a> DiagnosticsCollector<'a> {
    /// Creates a collector of faults at places of a configuration.
    pub fn new(config: &'a Config) -> Self {
        Self { config, found: Vec::new(), plugin_failures: Vec::new() }
    }

    /// Reports whether anything was found that is more than a warning.
    pub fn has_errors(&self) -> bool {
        self.found.iter().any(|one| one.severity == Severity::Error)
    }

    /// Adds a plugin's error. An error that the plugin alone caused does not prevent the scene from
    /// being shown.
    pub(crate) fn add_plugin_error(&mut self, pointer: &str, error: &PluginError) {
        if error.is_reported_by_plugin() {
            self.add_plugin_failure(pointer, error.to_string(), error.remedy());
        } else {
            self.add(pointer, error.to_string(), error.remedy());
        }
    }

    pub(crate) fn add_plugin_failure(&mut self, pointer: &str, cause: String, remedy: &str) {
        self.plugin_failures.push(self.config.positions.diagnostic(pointer, cause, remedy));
    }

    /// Adds warnings of settings with former names, and errors of those given twice.
    pub(crate) fn add_renamed(&mut self, renamed: &RenamedSettings) {
        let positions = &self.config.positions;
        self.found.extend(renamed.conflict_errors(positions));
        self.found.extend(renamed.warnings(positions));
    }

    /// Adds a fault of the value at a JSON pointer.
    pub fn add(&mut self, pointer: &str, cause: impl Into<String>, remedy: impl Into<String>) {
        self.found.push(self.config.positions.diagnostic(pointer, cause, remedy));
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display().to_string();
        for (index, diagnostic) in self.diagnostics.iter().enumerate() {
            if index > 0 {
                writeln!(f)?;
            }
            f.write_str(&diagnostic.render(&file))?;
        }
        Ok(())
    }
}

impl std::error::Error for LoadError {}
