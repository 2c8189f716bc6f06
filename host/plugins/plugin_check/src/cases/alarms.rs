//! Alarms of another system: their report keeps its rules, and its revision.

use busbar_alarms::SourceReport;
use busbar_plugin_abi as abi;

use super::arguments::{MisalignedCopy, short};
use super::plugin_instance::{Instance, required};
use super::text_buffer::{TextBuffer, ask, check_required_size};
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::Probe;

const ARGUMENT: abi::BusbarStatusNumber = abi::BUSBAR_INVALID_ARGUMENT;
const RULES: &str = "keep the rules of the header, and of `plugins/sdk/sdk/src/alarms.rs`";

/// Reads the alarms newer than a known revision; none where the plugin reports an error.
fn read(probe: &Probe, instance: &Instance<'_>, known: u64) -> Result<Option<SourceReport>, Stop> {
    let table: &abi::BusbarAlarms = instance.capability(abi::ALARMS_ID)?;
    let read = required(table.read, "read")?;
    let (plugin, limit) = (instance.as_ptr(), abi::BUSBAR_MAX_ALARM_REPORT);
    let told: Option<SourceReport> = ask(probe, "read_alarms", limit, |output, error| {
        probe.read_alarms(read, plugin, known, output, error)
    })?;
    if let Some(Err(fault)) = told.as_ref().map(|report| report.check(known)) {
        return Err(Finding::new(format!("`read_alarms`: {fault}"), RULES).into());
    }
    Ok(told)
}

pub(crate) fn reads(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::ALARMS_ID)?;
    let instance = subject.make(probe)?;
    if let Some(first) = read(probe, &instance, 0)? {
        let later = read(probe, &instance, first.revision)?;
        let revision = later.map_or(first.revision, |later| later.revision);
        let fault = format!("the revision went from {} back to {revision}", first.revision);
        probe.expect(revision >= first.revision, fault, RULES);
        let table: &abi::BusbarAlarms = instance.capability(abi::ALARMS_ID)?;
        let (read, plugin) = (required(table.read, "read")?, instance.as_ptr());
        check_required_size(probe, "read_alarms", |output, error| {
            probe.read_alarms(read, plugin, first.revision, output, error)
        });
    }
    instance.destroy()
}

pub(crate) fn refused(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::ALARMS_ID)?;
    let instance = subject.make(probe)?;
    let table: &abi::BusbarAlarms = instance.capability(abi::ALARMS_ID)?;
    let read = required(table.read, "read")?;
    let plugin = instance.as_ptr();
    // SAFETY: the instance lives.
    let mut odd_plugin = MisalignedCopy::from_value(unsafe { &*plugin });
    let odd_plugin = odd_plugin.as_mut_ptr::<abi::BusbarPlugin>().cast_const();
    let mut room = TextBuffer::with_capacity(1 << 16);
    let mut odd = MisalignedCopy::from_value(&room.output);
    let mut small = short(&room.output, 8);
    let output = &raw mut room.output;
    for (what, plugin, output) in [
        ("a plugin that is null", std::ptr::null(), output),
        ("a plugin that is misaligned", odd_plugin, output),
        ("an output that is null", plugin, std::ptr::null_mut()),
        ("an output that is misaligned", plugin, odd.as_mut_ptr()),
        ("an output that is too small", plugin, &raw mut small),
    ] {
        let mut error = abi::BusbarError::empty();
        let code = probe.read_alarms(read, plugin, 0, output, &mut error);
        let codes = [ARGUMENT, abi::BUSBAR_FAILED];
        // What cannot be told at all may be said before the output is looked at.
        let codes = if plugin == instance.as_ptr() { &codes[..] } else { &codes[..1] };
        probe.expect_refused(&format!("read_alarms with {what}"), code, &error, codes);
    }
    instance.destroy()
}

/// Calls every function once.
pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    read(probe, instance, 0).map(drop)
}
