//! Fault schedules: outages, reloads, clock jumps and link faults, drawn from a seed.

use std::time::Duration;

use busbar_plugin_sdk::simulation::{FaultKind, FaultPlan};
use fastrand::Rng;
use tokio::time::Instant;

/// Period within which the device's link has one fault.
const FAULT_PERIOD: Duration = Duration::from_secs(6 * 3600);
/// Longest fault of the device's link.
const MAX_FAULT: Duration = Duration::from_secs(30 * 60);
/// Range of the length of an outage, seconds.
const OUTAGE_SECONDS: std::ops::Range<u64> = 5..1200;
/// Probability of an outage in one step: once a day on average, as steps take some ten minutes.
const CHANCE_OF_OUTAGE: f64 = 1.0 / 130.0;
const CHANCE_OF_RELOAD: f64 = 1.0 / 130.0;
const CHANCE_OF_CLOCK_JUMP: f64 = 1.0 / 130.0;
/// Clock jump in seconds to 1970 or before: a machine whose battery is empty.
const EMPTY_BATTERY: i64 = -60 * 365 * 86_400;

/// Schedule of faults during a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultSchedule {
    /// Schedule without any fault.
    Empty,
    /// Schedule with each kind of fault, some times a day.
    Daily,
}

/// Single fault event between two steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    /// Outage of the device for this time. A silent one ignores dial attempts, another refuses
    /// them.
    Outage { length: Duration, is_silent: bool },
    /// Reload of the configuration.
    Reload,
    /// Jump of the adapter's clock to so many seconds ahead.
    ClockJump(i64),
}

impl FaultSchedule {
    pub(crate) fn faults(self, random: &mut Rng) -> FaultPlan {
        match self {
            Self::Empty => FaultPlan::none(),
            Self::Daily => FaultPlan::new(random.u64(..), &FaultKind::ALL, FAULT_PERIOD, MAX_FAULT)
                .expect("faults are shorter than their period"),
        }
    }

    pub(crate) fn event(self, random: &mut Rng) -> Option<Event> {
        if self == Self::Empty {
            return None;
        }
        let drawn = random.f64();
        let reloads = CHANCE_OF_OUTAGE + CHANCE_OF_RELOAD;
        Some(if drawn < CHANCE_OF_OUTAGE {
            let length = Duration::from_secs(random.u64(OUTAGE_SECONDS));
            Event::Outage { length, is_silent: random.bool() }
        } else if drawn < reloads {
            Event::Reload
        } else if drawn < reloads + CHANCE_OF_CLOCK_JUMP {
            Event::ClockJump(match random.u8(..8) {
                0 => EMPTY_BATTERY,
                // As where somebody sets it for summer time by hand.
                1 | 2 => 3600,
                3 | 4 => -3600,
                5 => 0,
                _ => random.i64(-86_400..86_400),
            })
        } else {
            return None;
        })
    }
}

/// State of the current disturbance and its start.
#[derive(Debug)]
pub(crate) struct DisturbanceState {
    /// Start of the time since which no data gets through.
    total_since: Option<Instant>,
    is_disturbed: bool,
    /// Instant of the last disturbance, or of the adapter's last start.
    last: Instant,
}

impl DisturbanceState {
    pub(crate) fn new() -> Self {
        Self { total_since: None, is_disturbed: false, last: Instant::now() }
    }

    /// Records the state at this instant: the device is gone, or its link has a fault.
    pub(crate) fn record(&mut self, is_gone: bool, fault: Option<FaultKind>) {
        use FaultKind::{ClockJump, Garbage, HalfOpen, Late, LinkLoss, Reset, Slow};
        let now = Instant::now();
        let (is_total, is_disturbed) = match fault {
            _ if is_gone => (true, true),
            Some(LinkLoss | HalfOpen | Garbage | Late) => (true, true),
            // Connections come and go.
            Some(Reset) => (false, true),
            Some(Slow | ClockJump) | None => (false, false),
        };
        self.total_since = is_total.then(|| self.total_since.unwrap_or(now));
        if is_disturbed || self.is_disturbed {
            self.last = now;
        }
        self.is_disturbed = is_disturbed;
    }

    /// Restarts the observation, since a new adapter knows of no fault yet.
    pub(crate) fn restart(&mut self) {
        self.last = Instant::now();
        self.total_since = self.total_since.map(|_| self.last);
    }

    /// Reports whether no data has got through for at least this time.
    pub(crate) fn is_cut_off_for(&self, time: Duration) -> bool {
        self.total_since.is_some_and(|since| since.elapsed() >= time)
    }

    /// Reports whether no disturbance has occurred for at least this time.
    pub(crate) fn is_quiet_for(&self, time: Duration) -> bool {
        !self.is_disturbed && self.last.elapsed() >= time
    }
}
