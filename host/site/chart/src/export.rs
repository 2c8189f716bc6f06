//! CSV export of records.

use std::fmt::Write;

use crate::{Description, Records};

/// Records that one export takes.
const MAX_EXPORTED: usize = 100_000;

/// Writes the brushed records with a header (RFC 4180); times are nanoseconds since 1970-01-01
/// UTC. Beyond `MAX_EXPORTED` (100,000) a last line reports the omission.
pub(crate) fn csv(
    description: &Description,
    records: &Records,
    is_brushed: impl Fn(usize) -> bool,
) -> String {
    let mut text = String::from("equipment,unix_nanos,state");
    for axis in &description.axes {
        text.push(',');
        let unit = if axis.unit.is_empty() { String::new() } else { format!(" [{}]", axis.unit) };
        quoted(&mut text, &format!("{}{unit}", axis.name));
    }
    text.push_str("\r\n");
    let mut meant = (0..records.len()).filter(|&record| is_brushed(record));
    for index in meant.by_ref().take(MAX_EXPORTED) {
        let record = records.all()[index];
        quoted(&mut text, &description.equipment[record.equipment as usize]);
        // Writing into a string does not fail.
        let _ = write!(text, ",{},", record.unix_nanos);
        quoted(&mut text, &description.legend[record.state as usize].name);
        for value in records.row(index) {
            text.push(',');
            if !value.is_nan() {
                let _ = write!(text, "{value}");
            }
        }
        text.push_str("\r\n");
    }
    let left = meant.count();
    if left > 0 {
        let _ = write!(text, "\"{left} more records are left out\"\r\n");
    }
    text
}

fn quoted(into: &mut String, cell: &str) {
    match cell.contains([',', '"', '\r', '\n']) {
        false => into.push_str(cell),
        true => {
            let _ = write!(into, "\"{}\"", cell.replace('"', "\"\""));
        }
    }
}
