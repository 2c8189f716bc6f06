//! `busbar log verify`: verification of the audit log of alarms.

use std::path::Path;
use std::process::ExitCode;

use busbar_audit_log::{Verification, verify as verify_audit_log};

use crate::exit_codes::EXIT_INPUT;
use crate::output;

/// Verifies the log of a folder, and prints every fault and what was looked at.
pub(crate) fn verify(
    folder: &Path,
    key: Option<&Path>,
    anchor: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    let verification = verify_audit_log(folder, key, anchor)?;
    let Verification { faults, notes, files, records, newest } = &verification;
    faults.iter().for_each(|fault| output::result(&format!("FAULT   {fault}")));
    notes.iter().for_each(|note| output::result(&format!("note    {note}")));
    let found = match faults.len() {
        0 => "no faults".to_owned(),
        1 => "1 fault".to_owned(),
        count => format!("{count} faults"),
    };
    output::result(&format!(
        "{}: {records} records in {files} files, the newest is number {newest}; {found}",
        folder.display()
    ));
    Ok(if faults.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(EXIT_INPUT) })
}
