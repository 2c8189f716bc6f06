//! Leaks of memory, threads and descriptors, measured over many rounds.

use std::time::{Duration, Instant};

use crate::environment;
use crate::finding::{Finding, Outcome};
use crate::probe::Probe;

/// Rounds before memory is first measured, and most between two measurements.
const WARM_UP_CYCLES: usize = 20;
const MAX_CYCLES: usize = 200;
/// Least number of rounds that gives a result.
const MIN_CYCLES: usize = 20;
/// Rounds between two measurements of memory.
const PART_CYCLES: usize = 10;
/// Longest duration of the rounds.
const MAX_CYCLING: Duration = Duration::from_secs(4);
/// Heap that a round may keep, bytes: rounding of the allocator, and what its caches of
/// threads hold. On a busy machine it counts up to 191 of a plugin all of whose allocations
/// are freed.
const MAX_HEAP_A_CYCLE: usize = 256;
/// RAM that all rounds may keep, bytes: heaps of threads, and pages of the allocator.
const MAX_RESIDENT_GROWTH: usize = 8 << 20;

/// Starting and ending a library leaves nothing.
pub(crate) fn check_library(probe: &Probe) -> Outcome {
    let cycle = || {
        let factory = probe.initialised()?;
        if let Some(count) = factory.count {
            probe.count(count);
        }
        if let Some(descriptor) = factory.descriptor {
            probe.descriptor(descriptor, 0);
        }
        if let Some(deinit) = probe.entry()?.deinit {
            probe.deinit(deinit);
        }
        Ok(())
    };
    threads(probe, &cycle)?;
    memory(probe, &cycle)
}

/// Checks that no thread and no descriptor outlives a round.
pub(crate) fn threads(probe: &Probe, cycle: &dyn Fn() -> Outcome) -> Outcome {
    // Once before, so that what a library keeps for ever is there.
    cycle()?;
    environment::settle(|| environment::threads().len() == 1);
    let (threads, descriptors) = (environment::threads(), environment::descriptors());
    for _ in 0..3 {
        cycle()?;
    }
    if !environment::settle(|| environment::threads().is_subset(&threads)) {
        let left: Vec<_> = environment::threads()
            .difference(&threads)
            .map(|&id| environment::thread_name(id))
            .collect();
        probe.find(Finding::new(
            format!("{} threads are left behind: {}", left.len(), left.join(", ")),
            "end and join every thread in `stop`, `destroy` or `deinit`",
        ));
    }
    let after = environment::descriptors();
    let fault = format!("{descriptors} descriptors were open before, {after} are after");
    probe.expect(after <= descriptors, fault, "close what was opened");
    Ok(())
}

/// Memory and descriptors do not grow.
pub(crate) fn memory(probe: &Probe, cycle: &dyn Fn() -> Outcome) -> Outcome {
    let until = Instant::now() + probe.time_left().min(MAX_CYCLING);
    for _ in 0..WARM_UP_CYCLES {
        cycle()?;
    }
    let resident_before = environment::resident_bytes();
    let open = environment::descriptors();
    let (mut cycles, mut heap) = (0, usize::MAX);
    while cycles < MAX_CYCLES && (cycles < MIN_CYCLES || Instant::now() < until) {
        let part_before = environment::heap_bytes();
        for _ in 0..PART_CYCLES {
            cycle()?;
        }
        cycles += PART_CYCLES;
        let limit = part_before + MAX_HEAP_A_CYCLE * PART_CYCLES;
        environment::settle(|| environment::heap_bytes() <= limit);
        // A leak shows in every part; what a library allocates once shows in one.
        let part = environment::heap_bytes().saturating_sub(part_before) / PART_CYCLES;
        heap = heap.min(part);
    }
    let fault = format!("each of {cycles} rounds left {heap} bytes of heap");
    let remedy = "free at the end what was allocated at the start and in between";
    probe.expect(heap <= MAX_HEAP_A_CYCLE, fault, remedy);
    let resident = environment::resident_bytes().saturating_sub(resident_before);
    let fault = format!("{cycles} rounds left {} KiB in RAM", resident >> 10);
    probe.expect(resident <= MAX_RESIDENT_GROWTH, fault, remedy);
    let after = environment::descriptors();
    let fault = format!("descriptors grew from {open} to {after} in {cycles} rounds");
    probe.expect(after <= open, fault, "close what was opened");
    Ok(())
}
