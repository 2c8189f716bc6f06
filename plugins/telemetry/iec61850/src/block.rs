//! The setting `reports`: report control blocks to enable.

use std::time::Duration;

use busbar_link::SettingsFaults;
use iec61850_rs::{Fc, ObjectReference};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::service::Name;

/// Report control blocks of one server.
const MAX_BLOCKS: usize = 64;
/// Longest integrity period and buffer time: an hour.
const MAX_PERIOD_MILLIS: u64 = 3_600_000;
const MIN_INTEGRITY_MILLIS: u64 = 100;

/// A report control block (IEC 61850-7-2, 17.2).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawReport {
    /// Reference of the block, such as `IED1LD0/LLN0.BR.brcbA01`, or `IED1LD0/LLN0.brcbA01` with
    /// `buffered`.
    #[schemars(length(min = 1, max = 129))]
    rcb: String,
    /// Declares the block buffered or not; needed where `rcb` has no `BR` or `RP`.
    #[serde(default)]
    buffered: Option<bool>,
    /// Period of integrity reports, seconds. Without it the block keeps its own.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["integrity_millis"]))]
    integrity_seconds: Option<f64>,
    /// Buffer time in which changes are gathered into one report, seconds. Without it the
    /// block keeps its own.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 3600.0))]
    #[schemars(extend("x-busbar-formerly" = ["buffer_millis"]))]
    buffer_seconds: Option<f64>,
    /// Data set that the block shall report, such as `IED1LD0/LLN0.dsA`. Without it the
    /// block keeps its own.
    #[serde(default)]
    #[schemars(length(min = 1, max = 129))]
    data_set: Option<String>,
}

/// A block to enable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ReportBlock {
    /// Name of the block, `LD` and `LLN0$BR$name`.
    pub(crate) name: Name,
    pub(crate) is_buffered: bool,
    pub(crate) integrity: Option<Duration>,
    pub(crate) buffer_time: Option<Duration>,
    pub(crate) data_set: Option<Name>,
}

/// Checks the setting `reports`.
pub(crate) fn report_blocks(raw: &[RawReport], faults: &mut SettingsFaults) -> Vec<ReportBlock> {
    if raw.len() > MAX_BLOCKS {
        faults.add(format!("reports: {} blocks; at most {MAX_BLOCKS} are allowed", raw.len()));
    }
    let mut blocks: Vec<ReportBlock> = Vec::new();
    for (index, raw) in raw.iter().enumerate() {
        let place = format!("reports[{index}]");
        match parse_one(raw, &place, faults) {
            Ok(block) if blocks.iter().any(|other| other.name == block.name) => {
                faults.add(format!("{place}.rcb: {} is named twice", block.name));
            }
            Ok(block) => blocks.push(block),
            Err(fault) => faults.add(format!("{place}.{fault}")),
        }
    }
    blocks
}

fn parse_one(
    raw: &RawReport,
    place: &str,
    faults: &mut SettingsFaults,
) -> Result<ReportBlock, String> {
    let (name, is_buffered) =
        block_name(&raw.rcb, raw.buffered).map_err(|what| format!("rcb: '{}' {what}", raw.rcb))?;
    let data_set = raw.data_set.as_deref().map(data_set_name).transpose()?;
    let mut seconds = |field: &str, value: Option<f64>, min: u64| {
        let name = format!("{place}.{field}");
        value.map(|value| faults.seconds(&name, value, min..=MAX_PERIOD_MILLIS))
    };
    let integrity = seconds("integrity_seconds", raw.integrity_seconds, MIN_INTEGRITY_MILLIS);
    let buffer_time = seconds("buffer_seconds", raw.buffer_seconds, 0);
    Ok(ReportBlock { name, is_buffered, integrity, buffer_time, data_set })
}

/// `LD/LN.BR.name`, `LD/LN$BR$name` or `LD/LN.name` -> the block, and whether it is
/// buffered.
fn block_name(text: &str, buffered: Option<bool>) -> Result<(Name, bool), String> {
    let form = "is no report control block: write it as \"IED1LD0/LLN0.BR.brcbA01\" (buffered) \
                or \"IED1LD0/LLN0.RP.urcbA01\"";
    let dotted = text.replace('$', ".");
    let reference = ObjectReference::parse(&dotted).map_err(|_| form.to_owned())?;
    let path = names_of(&reference);
    let (by_name, block) = match path[..] {
        ["BR", block] => (Some(true), block),
        ["RP", block] => (Some(false), block),
        [block] => (None, block),
        _ => return Err(form.into()),
    };
    let is_buffered = match (by_name, buffered) {
        (Some(named), Some(set)) if named != set => {
            return Err("contradicts \"buffered\": BR is buffered, RP is not".into());
        }
        (Some(is_buffered), _) | (None, Some(is_buffered)) => is_buffered,
        (None, None) => return Err("says not whether it is buffered: add \"buffered\"".into()),
    };
    let constraint = if is_buffered { Fc::BR } else { Fc::RP };
    let item = format!("{}${constraint}${block}", reference.ln);
    Ok((Name { domain: reference.ld.into(), item }, is_buffered))
}

/// Parses `LD/LN.name` or `LD/LN$name`.
fn data_set_name(text: &str) -> Result<Name, String> {
    let fault = || format!("data_set: '{text}' is no data set: write it as \"IED1LD0/LLN0.dsA\"");
    let dotted = text.replace('$', ".");
    let reference = ObjectReference::parse(&dotted).map_err(|_| fault())?;
    let path = names_of(&reference);
    let [set] = path[..] else { return Err(fault()) };
    Ok(Name { domain: reference.ld.into(), item: format!("{}${set}", reference.ln) })
}

/// Returns the names after the logical node; nothing where there is an index, which no name here
/// has.
fn names_of<'r>(reference: &ObjectReference<'r>) -> Vec<&'r str> {
    let is_plain = reference.selection().is_empty();
    reference.path().filter(|_| is_plain).collect()
}

impl ReportBlock {
    /// The block's name by IEC 61850-8-1, which is its RptID where that is empty.
    pub(crate) fn reference(&self) -> String {
        self.name.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str, buffered: Option<bool>) -> Result<(String, bool), String> {
        block_name(text, buffered).map(|(name, is_buffered)| (name.to_string(), is_buffered))
    }

    #[test]
    fn blocks_are_named_in_each_usual_form() {
        for text in ["L/LLN0.BR.b01", "L/LLN0$BR$b01"] {
            assert_eq!(name(text, None), Ok(("L/LLN0$BR$b01".into(), true)));
        }
        assert_eq!(name("L/LLN0.u01", Some(false)), Ok(("L/LLN0$RP$u01".into(), false)));
        assert!(name("L/LLN0.b01", None).unwrap_err().contains("add \"buffered\""));
        assert!(name("L/LLN0.BR.b01", Some(false)).unwrap_err().contains("contradicts"));
        for text in ["b01", "L/LLN0", "L/LLN0.ST.Mod.stVal", "L/LLN0.BR.b(1)", ""] {
            assert!(name(text, Some(true)).is_err(), "{text}");
        }
        assert_eq!(data_set_name("L/LLN0$ds").unwrap().to_string(), "L/LLN0$ds");
        assert!(data_set_name("L/LLN0").is_err());
    }
}
