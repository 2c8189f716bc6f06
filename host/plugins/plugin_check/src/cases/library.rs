//! Cases of libraries: loading and initialisation.

use busbar_plugin_abi as abi;

use crate::finding::Outcome;
use crate::probe::Probe;

/// Rounds of init and deinit.
const ROUNDS: usize = 3;

pub(crate) fn load(probe: &Probe) -> Outcome {
    let entry = probe.entry()?;
    probe.expect(
        entry.get_factory.is_some(),
        "the entry has no `get_factory`",
        "set it: without it there is no plugin",
    );
    Ok(())
}

pub(crate) fn init(probe: &Probe) -> Outcome {
    let entry = probe.entry()?;
    for round in 0..ROUNDS {
        if let Some(init) = entry.init {
            let mut error = abi::BusbarError::empty();
            // The second time without a place for the reason.
            let place = if round == 1 { std::ptr::null_mut() } else { &raw mut error };
            let status = probe.init(init, place);
            probe.expect_ok("init", status, &error)?;
        }
        probe.factory()?;
        if let Some(deinit) = entry.deinit {
            probe.deinit(deinit);
        }
    }
    Ok(())
}

pub(crate) fn order(probe: &Probe) -> Outcome {
    let entry = probe.entry()?;
    if let Some(deinit) = entry.deinit {
        probe.deinit(deinit);
    }
    if let Some(init) = entry.init {
        for _ in 0..2 {
            let mut error = abi::BusbarError::empty();
            let status = probe.init(init, &mut error);
            let allowed = [abi::BUSBAR_OK, abi::BUSBAR_INVALID_ARGUMENT];
            probe.expect_refused("init after init", status, &error, &allowed);
        }
    }
    for _ in 0..3 {
        if let Some(deinit) = entry.deinit {
            probe.deinit(deinit);
        }
    }
    // All that is made good by a proper start.
    probe.initialised()?;
    Ok(())
}
