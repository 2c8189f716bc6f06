//! Schedule of a simulated device's faults.

use std::time::Duration;

use busbar_types::FaultKind;

use super::{draw, mix, unit};
use crate::Error;

/// Range of the share of a period's healthy time before its fault. There is time before the fault,
/// and more after it for lost connections to recover.
const HEALTHY_BEFORE: std::ops::Range<f64> = 0.25..0.5;
/// Range of a clock error, seconds, ahead or behind.
const CLOCK_JUMP_SECONDS: std::ops::Range<i64> = 600..7200;

/// Returns the kinds of a sum of the ABI; none where it has bits that no kind has.
pub(crate) fn fault_kinds(sum: u32) -> Option<Vec<FaultKind>> {
    let known: u32 = FaultKind::ALL.iter().map(|kind| kind.bit()).sum();
    let is_in = |kind: &FaultKind| sum & kind.bit() != 0;
    (sum & !known == 0).then(|| FaultKind::ALL.into_iter().filter(is_in).collect())
}

/// Fault of the link in a scenario.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkFault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Begin of the fault, since the scenario began.
    pub begins: Duration,
    /// End of the fault, since the scenario began.
    pub ends: Duration,
}

/// Plan of faults: those of a scenario, and one in each period, with the kinds in turn.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultPlan {
    told: Vec<ActiveFault>,
    key: u64,
    kinds: Vec<FaultKind>,
    period: Duration,
    longest: Duration,
}

/// Fault that holds. Times are since the start of the simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActiveFault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Begin of the fault.
    pub begins: Duration,
    /// End of the fault.
    pub ends: Duration,
    /// Seconds by which the device's clock is ahead; 0 for all but
    /// [`FaultKind::ClockJump`].
    pub clock_ahead_seconds: i64,
}

impl FaultPlan {
    /// Creates the plan of a device that never fails.
    pub fn none() -> Self {
        Self {
            told: Vec::new(),
            key: 0,
            kinds: Vec::new(),
            period: Duration::MAX,
            longest: Duration::ZERO,
        }
    }

    /// Creates a plan with one fault in each `period`, of a random length up to `longest`, at a
    /// random time; the kinds come in turn. A quarter to half of the healthy time is before it.
    ///
    /// # Errors
    /// [`Error::settings`] when a period has no time without a fault.
    pub fn new(
        seed: u64,
        kinds: &[FaultKind],
        period: Duration,
        longest: Duration,
    ) -> Result<Self, Error> {
        if longest.is_zero() || longest >= period {
            return Err(Error::settings(format!(
                "faults of up to {longest:?} in every {period:?}: give them a length, shorter \
                 than the period"
            )));
        }
        Ok(Self { told: Vec::new(), key: mix(seed), kinds: kinds.to_vec(), period, longest })
    }

    /// Returns the plan with the faults of a scenario that began so long before the simulation;
    /// they precede all others.
    pub fn with_link_faults(mut self, under_way: Duration, faults: Vec<LinkFault>) -> Self {
        let told = faults.into_iter().map(|fault| ActiveFault {
            kind: fault.kind,
            begins: fault.begins.saturating_sub(under_way),
            ends: fault.ends.saturating_sub(under_way),
            clock_ahead_seconds: match fault.kind {
                FaultKind::ClockJump => jump(mix(self.key)),
                _ => 0,
            },
        });
        self.told = told.collect();
        self
    }

    /// Returns the fault that holds at a time since the start.
    pub fn at(&self, since_start: Duration) -> Option<ActiveFault> {
        let holds = |fault: &ActiveFault| (fault.begins..fault.ends).contains(&since_start);
        let told = self.told.iter().copied().find(holds);
        told.or_else(|| self.fault_of(self.number_at(since_start)).filter(holds))
    }

    /// Returns the time of the next begin or end of a fault after a time since the start.
    pub fn next_change(&self, since_start: Duration) -> Option<Duration> {
        let number = self.number_at(since_start);
        let changes = [number, number + 1].into_iter().filter_map(|n| self.fault_of(n));
        let all = self.told.iter().copied().chain(changes);
        let changes = all.flat_map(|fault| [fault.begins, fault.ends]);
        changes.filter(|&change| change > since_start).min()
    }

    fn number_at(&self, since_start: Duration) -> u64 {
        u64::try_from(since_start.as_nanos() / self.period.as_nanos()).unwrap_or_default()
    }

    fn fault_of(&self, number: u64) -> Option<ActiveFault> {
        let count = self.kinds.len() as u64;
        if count == 0 {
            return None;
        }
        let turn = (self.key % count + number % count) % count;
        let kind = self.kinds[usize::try_from(turn).unwrap_or_default()];
        let [length, place, clock] = [0, 1, 2].map(|i| draw(self.key, 3 * number + i));
        let length = self.longest.mul_f64(0.5 + 0.5 * unit(length));
        let rest = self.period.saturating_sub(length);
        let std::ops::Range { start: least, end: most } = HEALTHY_BEFORE;
        let healthy = least + (most - least) * unit(place);
        let start = u32::try_from(number).map_or(Duration::MAX, |n| self.period.saturating_mul(n));
        let begins = start.saturating_add(rest.mul_f64(healthy));
        Some(ActiveFault {
            kind,
            begins,
            ends: begins.saturating_add(length),
            clock_ahead_seconds: if kind == FaultKind::ClockJump { jump(clock) } else { 0 },
        })
    }
}

fn jump(number: u64) -> i64 {
    let span = (CLOCK_JUMP_SECONDS.end - CLOCK_JUMP_SECONDS.start) as f64;
    let seconds = CLOCK_JUMP_SECONDS.start + (span * unit(number)) as i64;
    if number & 1 == 0 { seconds } else { -seconds }
}

#[cfg(test)]
#[path = "fault_tests.rs"]
mod tests;
