//! Simulator detection: connections of one instance to simulators of this machine.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use busbar_plugin_host::LinkState;
use busbar_tags::Moment;
use busbar_types::Origin;

use crate::simulator_registry::registered_simulators;
use crate::socket_table::{SocketOwner, SocketScan};

/// Time between two checks, besides those before the first samples of a link.
const CHECK_PERIOD: Duration = Duration::from_secs(1);

/// State of the watch. A simulator that was found counts for as long as the instance runs.
#[derive(Debug)]
pub(crate) struct SimulatorDetector {
    last_check: Option<Instant>,
    /// True until samples of the current link were seen.
    is_new_link: bool,
    link: LinkState,
    is_simulated: bool,
}

/// Check for simulators that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SimulatorCheck {
    /// Reception of the first sample of a new link, which waits for the check.
    pub(crate) first_sample: Option<Moment>,
}

impl Default for SimulatorDetector {
    fn default() -> Self {
        Self {
            last_check: None,
            is_new_link: true,
            link: LinkState::default(),
            is_simulated: false,
        }
    }
}

impl SimulatorDetector {
    /// Records that the link was replaced.
    pub(crate) fn note_new_link(&mut self) {
        self.is_new_link = true;
    }

    /// Follows the state of the link: in another state it counts as another one.
    pub(crate) fn follow_link(&mut self, state: LinkState) {
        self.is_new_link |= state != self.link;
        self.link = state;
    }

    /// Origin of all samples of the instance, by what was found.
    pub(crate) fn origin(&self) -> Origin {
        if self.is_simulated { Origin::SIMULATED } else { Origin::LIVE }
    }

    /// Reports whether the next samples are the first of their link, so that a check comes first.
    pub(crate) fn awaits_samples(&self) -> bool {
        self.is_new_link && !self.is_simulated
    }

    /// Reports whether a check is due; `has_samples`: some of a new link are there, unseen.
    pub(crate) fn is_due(&self, has_samples: bool) -> bool {
        let is_over = || self.last_check.is_none_or(|last| last.elapsed() >= CHECK_PERIOD);
        !self.is_simulated && (self.is_new_link && has_samples || is_over())
    }

    /// Records the result of a check; `has_samples` is true where samples of the link were there
    /// before it.
    pub(crate) fn note_check(&mut self, is_simulated: bool, has_samples: bool) {
        self.last_check = Some(Instant::now());
        self.is_simulated |= is_simulated;
        self.is_new_link &= !has_samples;
    }
}

/// Longest age of a shared socket scan for a check that no sample waits for. Sharing keeps the
/// cost of many instances low.
const MAX_SCAN_AGE: Duration = Duration::from_millis(250);

/// Last scan of sockets, shared by all instances.
static LAST_SCAN: Mutex<Option<Arc<TimedScan>>> = Mutex::new(None);

struct TimedScan {
    taken: Moment,
    simulators: Vec<u32>,
    sockets: SocketScan,
}

/// Reports whether a process is connected to a simulator of this machine. Costs next to nothing
/// where none is registered.
pub(crate) fn is_connected_to_simulator(process: SocketOwner, check: SimulatorCheck) -> bool {
    let simulators = registered_simulators();
    if simulators.is_empty() {
        return false;
    }
    let mut last = LAST_SCAN.lock().unwrap_or_else(PoisonError::into_inner);
    // A connection was there before its first sample was.
    let is_current = |scan: &&Arc<TimedScan>| match check.first_sample {
        Some(received) => scan.taken > received,
        None => Moment::now().since(scan.taken) < MAX_SCAN_AGE,
    };
    let current = last.as_ref().filter(|scan| scan.simulators == simulators).filter(is_current);
    let scan = match current {
        Some(scan) => Arc::clone(scan),
        None => {
            let taken = Moment::now();
            let sockets = SocketScan::scan(&simulators);
            Arc::clone(last.insert(Arc::new(TimedScan { taken, simulators, sockets })))
        }
    };
    drop(last);
    scan.sockets.is_connected(process)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_samples_of_a_link_wait_for_a_check() {
        let mut watch = SimulatorDetector::default();
        assert!(watch.awaits_samples() && watch.is_due(true));
        watch.note_check(false, false);
        assert!(watch.awaits_samples() && watch.is_due(true), "none had come");
        assert!(!watch.is_due(false), "less than a second ago");
        watch.note_check(false, true);
        assert!(!watch.awaits_samples() && !watch.is_due(true));
        watch.follow_link(LinkState::Up);
        assert!(watch.awaits_samples() && watch.is_due(true));
        watch.note_check(true, true);
        watch.note_new_link();
        assert!(!watch.awaits_samples() && !watch.is_due(true), "once is for good");
    }
}
