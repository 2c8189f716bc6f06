//! Instances: made, used from other threads, ended, and what is left of them.

use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

use super::Instance;
use super::{optimizer, overlay, telemetry};
use crate::environment;
use crate::finding::{Finding, Outcome, Stop};
use crate::probe::{Probe, Subject};
use crate::text;

/// Instances made before memory is first looked at, and most made between the looks.
const WARM_UP_CYCLES: usize = 20;
const MAX_CYCLES: usize = 200;
/// Fewer say nothing.
const MIN_CYCLES: usize = 20;
/// How long the cycles may take.
const MAX_CYCLING: Duration = Duration::from_secs(4);
/// Heap that a cycle may keep, bytes: rounding of the allocator.
const MAX_HEAP_A_CYCLE: usize = 128;
/// RAM that all cycles may keep, bytes: heaps of threads, and pages of the allocator.
const MAX_RESIDENT_GROWTH: usize = 8 << 20;

pub(crate) fn create(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let instance = subject.make(probe)?;
    for id in &subject.capabilities {
        match id.as_str() {
            abi::TELEMETRY_ID => {
                let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
                super::required(table.start, "start")?;
                super::required(table.stop, "stop")?;
            }
            abi::MESH_OPTIMIZER_ID => {
                let table: &abi::BusbarMeshOptimizer =
                    instance.capability(abi::MESH_OPTIMIZER_ID)?;
                super::required(table.optimize, "optimize")?;
            }
            abi::OVERLAY_ID => {
                let table: &abi::BusbarOverlay = instance.capability(abi::OVERLAY_ID)?;
                super::required(table.configure, "configure")?;
                super::required(table.draw, "draw")?;
            }
            _ => {}
        }
    }
    for known in [abi::TELEMETRY_ID, abi::MESH_OPTIMIZER_ID, abi::OVERLAY_ID] {
        if !subject.capabilities.iter().any(|id| id == known) {
            let hidden = !instance.ask(abi::BusbarStr::from_static(known)).is_null();
            let fault = format!("it gives {known}, which its descriptor does not list");
            probe.expect(!hidden, fault, "list every capability, or return null");
        }
    }
    let longer = "busbar.telemetry/1-draft-of-something-else";
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

/// Each capability once, on little.
fn use_briefly(probe: &Probe, subject: &Subject, instance: &Instance<'_>) -> Outcome {
    for id in &subject.capabilities {
        match id.as_str() {
            abi::TELEMETRY_ID => telemetry::use_briefly(probe, instance)?,
            abi::MESH_OPTIMIZER_ID => optimizer::use_briefly(probe, instance)?,
            abi::OVERLAY_ID => overlay::use_briefly(probe, instance)?,
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
    // Once before, so that what a library keeps for ever is there.
    let subject = probe.subject()?;
    cycle(probe, &subject)?;
    environment::settle(|| environment::threads().len() == 1);
    let (threads, descriptors) = (environment::threads(), environment::descriptors());
    for _ in 0..3 {
        cycle(probe, &subject)?;
    }
    let gone = || environment::threads().is_subset(&threads);
    if !environment::settle(gone) {
        let left: Vec<_> = environment::threads()
            .difference(&threads)
            .map(|&id| environment::thread_name(id))
            .collect();
        probe.find(Finding::new(
            format!("{} threads outlive the instance: {}", left.len(), left.join(", ")),
            "end and join every thread in `stop` or `destroy`",
        ));
    }
    let after = environment::descriptors();
    let fault = format!("{descriptors} descriptors were open before, {after} are after");
    probe.expect(after <= descriptors, fault, "close what was opened in `stop` or `destroy`");
    Ok(())
}

fn cycle(probe: &Probe, subject: &Subject) -> Outcome {
    let instance = subject.make(probe)?;
    use_briefly(probe, subject, &instance)?;
    instance.destroy()
}

pub(crate) fn leaks(probe: &Probe) -> Outcome {
    let subject = probe.subject()?;
    let until = Instant::now() + probe.time_left().min(MAX_CYCLING);
    for _ in 0..WARM_UP_CYCLES {
        cycle(probe, &subject)?;
    }
    let state = || {
        let (heap, resident) = (environment::heap_bytes(), environment::resident_bytes());
        (heap, resident, environment::descriptors())
    };
    let before = state();
    let mut cycles = 0;
    while cycles < MAX_CYCLES && (cycles < MIN_CYCLES || Instant::now() < until) {
        cycle(probe, &subject)?;
        cycles += 1;
    }
    environment::settle(|| environment::heap_bytes() <= before.0 + MAX_HEAP_A_CYCLE * cycles);
    let after = state();
    let heap = after.0.saturating_sub(before.0) / cycles;
    let fault = format!("each of {cycles} instances left {heap} bytes of heap");
    let remedy = "free in `destroy` what `create` and the capabilities allocated";
    probe.expect(heap <= MAX_HEAP_A_CYCLE, fault, remedy);
    let resident = after.1.saturating_sub(before.1);
    let fault = format!("{cycles} instances left {} KiB in RAM", resident >> 10);
    probe.expect(resident <= MAX_RESIDENT_GROWTH, fault, remedy);
    let fault = format!("descriptors grew from {} to {} in {cycles} instances", before.2, after.2);
    let remedy = "close in `destroy` what `create` and the capabilities opened";
    probe.expect(after.2 <= before.2, fault, remedy);
    Ok(())
}
