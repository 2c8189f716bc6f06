//! Cases of instances: creation, use from other threads, destruction and leaks.

use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use super::{
    alarms, chart, command, leaks, notify, optimizer, overlay, records, simulator, telemetry,
};
use crate::finding::{Outcome, Stop};
use crate::probe::{Probe, Subject};
use crate::text;

pub(crate) fn create(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let instance = subject.make(probe)?;
    for id in &subject.capabilities {
        match id.as_str() {
            abi::TELEMETRY_ID => {
                let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
                required(table.start, "start")?;
                required(table.stop, "stop")?;
            }
            abi::MESH_OPTIMIZER_ID => {
                let table: &abi::BusbarMeshOptimizer =
                    instance.capability(abi::MESH_OPTIMIZER_ID)?;
                required(table.optimize, "optimize")?;
            }
            abi::OVERLAY_ID => {
                let table: &abi::BusbarOverlay = instance.capability(abi::OVERLAY_ID)?;
                required(table.configure, "configure")?;
                required(table.draw, "draw")?;
            }
            abi::SIMULATOR_ID => {
                let table: &abi::BusbarSimulator = instance.capability(abi::SIMULATOR_ID)?;
                required(table.start, "start")?;
                required(table.stop, "stop")?;
                required(table.status, "status")?;
            }
            abi::COMMAND_ID => {
                let table: &abi::BusbarCommand = instance.capability(abi::COMMAND_ID)?;
                required(table.count, "count")?;
                required(table.describe, "describe")?;
                required(table.run, "run")?;
            }
            abi::CHART_ID => {
                let table: &abi::BusbarChart = instance.capability(abi::CHART_ID)?;
                required(table.describe, "describe")?;
                required(table.read, "read")?;
                required(table.explain, "explain")?;
            }
            abi::RECORDS_ID => {
                let table: &abi::BusbarRecords = instance.capability(abi::RECORDS_ID)?;
                required(table.describe, "describe")?;
                required(table.read, "read")?;
            }
            abi::ALARMS_ID => {
                let table: &abi::BusbarAlarms = instance.capability(abi::ALARMS_ID)?;
                required(table.read, "read")?;
            }
            _ => {}
        }
    }
    for known in abi::CAPABILITIES.iter().map(|capability| capability.id) {
        if !subject.capabilities.iter().any(|id| id == known) {
            let hidden = !instance.ask(abi::BusbarStr::from_static(known)).is_null();
            let fault = format!("it gives {known}, which its descriptor does not list");
            probe.expect(!hidden, fault, "list every capability, or return null");
        }
    }
    let longer = "busbar.telemetry/2-draft-of-something-else";
    for (what, id) in [
        ("an unknown capability", abi::BusbarStr::from_static(longer)),
        ("an empty id", abi::BusbarStr { ptr: std::ptr::null(), len: 0 }),
        ("an id that is not UTF-8", text::of_bytes(&[0xc3, 0x28])),
    ] {
        let fault = format!("`get_capability` gives something for {what}");
        let remedy = "compare the whole id, and return null otherwise";
        probe.expect(instance.ask(id).is_null(), fault, remedy);
    }
    instance.destroy()
}

pub(crate) fn two(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let first = subject.make(probe)?;
    let second = subject.make(probe)?;
    let fault = "two instances have the same address";
    probe.expect(first.as_ptr() != second.as_ptr(), fault, "allocate each instance");
    use_briefly(probe, &subject, &first)?;
    first.destroy()?;
    use_briefly(probe, &subject, &second)?;
    second.destroy()?;
    // After the library was ended and started once more.
    let entry = probe.entry()?;
    if let Some(deinit) = entry.deinit {
        probe.deinit(deinit);
    }
    let subject = probe.subject()?;
    let third = subject.make(probe)?;
    use_briefly(probe, &subject, &third)?;
    third.destroy()
}

/// Calls each capability once, on little input.
fn use_briefly(probe: &Probe, subject: &Subject, instance: &Instance<'_>) -> Outcome {
    for id in &subject.capabilities {
        match id.as_str() {
            abi::TELEMETRY_ID => telemetry::use_briefly(probe, instance)?,
            abi::MESH_OPTIMIZER_ID => optimizer::use_briefly(probe, instance)?,
            abi::OVERLAY_ID => overlay::use_briefly(probe, instance)?,
            abi::SIMULATOR_ID => simulator::use_briefly(probe, instance)?,
            abi::COMMAND_ID => command::use_briefly(probe, instance)?,
            abi::CHART_ID => chart::use_briefly(probe, instance)?,
            abi::RECORDS_ID => records::use_briefly(probe, instance)?,
            abi::ALARMS_ID => alarms::use_briefly(probe, instance)?,
            abi::NOTIFY_ID => notify::use_briefly(probe, instance)?,
            _ => {}
        }
    }
    Ok(())
}

pub(crate) fn threads(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let elsewhere = |work: &(dyn Fn() -> Outcome + Sync)| -> Outcome {
        let done = std::thread::scope(|scope| scope.spawn(work).join());
        done.unwrap_or_else(|_| Err(Stop::Skip("the checker itself failed".into())))
    };
    let made = std::thread::scope(|scope| scope.spawn(|| subject.make(probe)).join());
    let instance = made.unwrap_or_else(|_| Err(Stop::Skip("the checker itself failed".into())))?;
    elsewhere(&|| use_briefly(probe, &subject, &instance))?;
    elsewhere(&|| use_briefly(probe, &subject, &instance))?;
    let done = std::thread::scope(|scope| scope.spawn(move || instance.destroy()).join());
    done.unwrap_or_else(|_| Err(Stop::Skip("the checker itself failed".into())))
}

pub(crate) fn left_behind(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    leaks::threads(probe, &|| cycle(probe, &subject))
}

pub(crate) fn leaks(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    leaks::memory(probe, &|| cycle(probe, &subject))
}

fn cycle(probe: &Probe, subject: &Subject) -> Outcome {
    let instance = subject.make(probe)?;
    use_briefly(probe, subject, &instance)?;
    instance.destroy()
}
