//! `busbar plugin`.

use std::path::Path;
use std::process::ExitCode;

use crate::output;

pub(crate) fn list(config: &Path) -> anyhow::Result<ExitCode> {
    let catalog = busbar_viewer::plugin_catalog(config)?;
    for plugin in catalog.plugins() {
        output::result(&format!(
            "{} {}  [{}]  {}\n    {}",
            plugin.id,
            plugin.version,
            plugin.capabilities.join(", "),
            plugin.path.display(),
            plugin.description,
        ));
    }
    for refused in catalog.refused() {
        output::result(&format!("refused {}: {}", refused.path.display(), refused.reason));
    }
    Ok(ExitCode::SUCCESS)
}
