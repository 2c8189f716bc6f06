//! Checks of a configuration with its plugins.

use std::path::Path;
use std::time::Duration;

use busbar_commands::{CheckedLink, check_links};
use busbar_config::Severity;
use busbar_plugin_host::LinkState;
use busbar_scene_loader::{LoadedScene, plugin_catalog};

use super::finding::Finding;

/// Faults of a configuration that are listed one by one; `busbar check` lists all.
const MAX_TOLD: usize = 20;

pub(super) fn check(config: &Path) -> Vec<Finding> {
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

/// Connects to the sources of tags: checks their links, and their clocks against this machine's.
pub(super) fn listen(config: &Path, seconds: u64) -> Vec<Finding> {
    if seconds == 0 {
        return Vec::new();
    }
    // A configuration that cannot be used is told by `look`.
    let links = check_links(config, Duration::from_secs(seconds)).unwrap_or_default();
    links.iter().flat_map(link).collect()
}

fn link(checked: &CheckedLink) -> Vec<Finding> {
    const LINK: &str = "link";
    const CLOCK: &str = "clock of a source";
    let CheckedLink { name, link, quality } = checked;
    let counts =
        format!("{} good, {} uncertain, {} bad", quality.good, quality.uncertain, quality.bad);
    let said = if link.message.is_empty() { link.state.name() } else { &link.message };
    let cause = format!("{name}: {said} ({counts})");
    let state = match link.state {
        LinkState::Up if quality.uncertain + quality.bad == 0 => Finding::ok(LINK, cause),
        LinkState::Up => {
            Finding::warning(LINK, cause, "see `busbar render --stats` for each tag's reason")
        }
        // A device that is off is no fault of this machine.
        _ => Finding::warning(LINK, cause, "start the device, or correct the instance's settings"),
    };
    // A remark is cause and remedy, parted by a colon.
    let remarks = link.clock.remarks();
    let clock = remarks.iter().map(|remark| {
        let (cause, remedy) = remark.split_once(": ").unwrap_or((remark, ""));
        Finding::warning(CLOCK, format!("{name}: {cause}"), remedy)
    });
    [state].into_iter().chain(clock).collect()
}
