//! Subcommand `busbar config upgrade`: present names of settings, in place.

use std::path::Path;
use std::process::ExitCode;

use busbar_scene_loader::upgraded_text;

use crate::output;

/// Rewrites a configuration or scenario, and prints what was renamed.
pub(crate) fn run(file: &Path, dry_run: bool) -> anyhow::Result<ExitCode> {
    let upgraded = upgraded_text(file)?;
    for setting in &upgraded.renamed {
        output::result(&format!("{} -> {}", setting.former, setting.present));
    }
    let path = file.display();
    let done = match (upgraded.renamed.len(), dry_run) {
        (0, _) => format!("{path}: all names are the present ones"),
        (count, true) => format!("{path}: {count} settings would be renamed"),
        (count, false) => {
            // A link stays a link: the file that it leads to is rewritten.
            output::write_file(&file.canonicalize()?, upgraded.text.as_bytes())?;
            format!("{path}: {count} settings renamed")
        }
    };
    output::result(&done);
    Ok(ExitCode::SUCCESS)
}
