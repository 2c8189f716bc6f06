//! A configuration with its plugins.

use std::path::Path;

use busbar_viewer::{LoadedScene, Severity, plugin_catalog};

use super::Finding;

/// Faults of a configuration that are told one by one; `busbar check` tells all.
const MAX_TOLD: usize = 20;

pub(super) fn look(config: &Path) -> Vec<Finding> {
    let mut findings = plugins(config);
    const CHECK: &str = "configuration";
    match LoadedScene::check(config, &|_, _, _| {}) {
        Ok(_) => findings.push(Finding::ok(CHECK, format!("{}: no errors", config.display()))),
        Err(error) => {
            let faults = error.diagnostics.iter().filter(|d| d.severity == Severity::Error);
            findings.extend(faults.take(MAX_TOLD).map(|fault| {
                let place = format!("{}:{}:{}", config.display(), fault.line, fault.column);
                Finding::fault(CHECK, format!("{place}: {}", fault.cause), fault.remedy.clone())
            }));
        }
    }
    findings
}

fn plugins(config: &Path) -> Vec<Finding> {
    const CHECK: &str = "plugins";
    // A configuration that cannot be read is told as such.
    let Ok(catalog) = plugin_catalog(config) else { return Vec::new() };
    let refused = catalog.refused().iter().map(|refused| {
        Finding::fault(
            CHECK,
            format!("'{}' is not used: {}", refused.path.display(), refused.reason),
            "correct its owner and rights, or remove it from the plugin directory",
        )
    });
    let mut findings: Vec<Finding> = refused.collect();
    let count = catalog.plugins().count();
    if findings.is_empty() {
        findings.push(Finding::ok(CHECK, format!("{count} can be used")));
    }
    findings
}
