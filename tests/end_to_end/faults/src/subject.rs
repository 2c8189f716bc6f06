//! Faulty plugin of a live view, stepped with each frame: a fault strikes, its outcome is recorded,
//! and after recovery the next fault follows.

use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Result, bail, ensure};
use busbar_viewer::PluginStats;
use fault_injector::{CallSite, Fault};
use rustix::process::{Pid, Signal, kill_process};

use crate::injection::{Outcome, Record, class_of, is_sudden, must_die, needs_restart};
use crate::scene::{FRESHNESS_MILLIS, Installed};

/// Longest time of an injection from arming to correct data.
pub(crate) const MAX_INJECTION: Duration = Duration::from_secs(30);
/// Observation time of a plugin that continues after a fault; its values would be stale by then.
const WATCHED: Duration = Duration::from_millis(2 * FRESHNESS_MILLIS);

/// Plugin under test with its queue of faults.
pub(crate) struct Subject {
    pub(crate) plugin: Installed,
    pub(crate) queue: VecDeque<Fault>,
    current: Option<Injection>,
}

/// Observation of a plugin in one frame.
pub(crate) struct PluginObservation<'a> {
    /// State before the frame: a plugin that is dead here cannot look alive in the frame.
    pub(crate) before: &'a PluginStats,
    /// Presence of the plugin's correct data in the frame.
    pub(crate) is_good: bool,
    /// Instant of the frame's end.
    pub(crate) now: Instant,
}

struct Injection {
    fault: Fault,
    armed: Instant,
    /// Number of deaths before the injection, and of those that it causes itself.
    deaths: u64,
    /// Instant of the kill that lets the fault strike the next process.
    killed: Option<Instant>,
    struck: Option<Instant>,
    bad: Option<Instant>,
    died: Option<(Instant, String)>,
    /// Instant of the end of a plugin that continued in spite of its fault.
    ended: Option<Instant>,
}

impl Subject {
    pub(crate) fn new(plugin: Installed) -> Self {
        Self { plugin, queue: VecDeque::new(), current: None }
    }

    /// Reports whether all injections are done.
    pub(crate) fn is_done(&self) -> bool {
        self.current.is_none() && self.queue.is_empty()
    }

    /// Evaluates a frame; returns the record of an injection that is over.
    pub(crate) fn step(&mut self, seen: &PluginObservation<'_>) -> Result<Option<Record>> {
        let Some(injection) = &mut self.current else {
            if seen.is_well() {
                self.begin(seen)?;
            }
            return Ok(None);
        };
        let (name, fault) = (&self.plugin.name, injection.fault);
        ensure!(
            injection.armed.elapsed() < MAX_INJECTION,
            "{name}: {fault:?} is not over after {MAX_INJECTION:?}: {:?}, good: {}, struck: {}",
            seen.before,
            seen.is_good,
            injection.struck.is_some(),
        );
        if injection.struck.is_none() {
            injection.struck = self.plugin.struck().map(instant_of);
        }
        injection.observe(seen)?;
        if !injection.is_over(seen) {
            return Ok(None);
        }
        let record = injection.record(seen.now);
        let died = matches!(record.outcome, Outcome::Died(_));
        ensure!(died || !must_die(fault), "{name}: {fault:?} ended as {:?}", record.outcome);
        self.current = None;
        Ok(Some(record))
    }

    fn begin(&mut self, seen: &PluginObservation<'_>) -> Result<()> {
        let Some(fault) = self.queue.pop_front() else { return Ok(()) };
        self.plugin.arm(fault)?;
        let mut injection = Injection {
            fault,
            armed: seen.now,
            deaths: seen.before.deaths,
            killed: None,
            struck: None,
            bad: None,
            died: None,
            ended: None,
        };
        if needs_restart(fault) {
            injection.killed = Some(kill(seen.before)?);
            injection.deaths += 1;
        }
        self.current = Some(injection);
        Ok(())
    }
}

impl Injection {
    fn observe(&mut self, seen: &PluginObservation<'_>) -> Result<()> {
        let begun = self.killed.or(self.struck);
        if begun.is_some() && self.ended.is_none() && !seen.is_good && self.bad.is_none() {
            self.bad = Some(seen.now);
        }
        let Some(struck) = self.struck else { return Ok(()) };
        if self.died.is_none() && self.ended.is_none() && seen.before.deaths > self.deaths {
            let reason = seen.before.last_death.clone().unwrap_or_default();
            self.died = Some((seen.now, reason));
        }
        let watched = self.bad.is_some() || struck.elapsed() > WATCHED;
        if self.is_recurrent() && self.died.is_none() && self.ended.is_none() && watched {
            // It may die of its fault at this very moment.
            if must_die(self.fault) {
                return Ok(());
            }
            if let Ok(ended) = kill(seen.before) {
                self.ended = Some(ended);
                self.deaths += 1;
            }
        }
        Ok(())
    }

    /// Reports whether the fault strikes repeatedly while the process lives.
    fn is_recurrent(&self) -> bool {
        matches!(self.fault.at, CallSite::Publish | CallSite::Draw) && !needs_restart(self.fault)
    }

    fn is_over(&self, seen: &PluginObservation<'_>) -> bool {
        let met = self.died.is_some() || self.ended.is_some() || !self.is_recurrent();
        self.struck.is_some() && met && seen.is_well() && seen.before.deaths >= self.deaths
    }

    fn record(&self, now: Instant) -> Record {
        let millis =
            |from: Instant, to: Instant| to.saturating_duration_since(from).as_secs_f64() * 1e3;
        let outcome = match &self.died {
            Some((_, reason)) => Outcome::Died(class_of(reason)),
            None if self.is_recurrent() && self.bad.is_some() => Outcome::Bad,
            None => Outcome::Harmless,
        };
        let begun = self.killed.or(self.struck);
        // A sudden death comes with the strike, others when they are noticed.
        let lost = match &self.died {
            Some(_) if is_sudden(self.fault.kind) => self.struck,
            Some((noticed, _)) => Some(*noticed),
            None => self.ended,
        };
        Record {
            kind: self.fault.kind,
            at: self.fault.at,
            outcome,
            to_bad_millis: begun.zip(self.bad).map(|(from, to)| millis(from, to)),
            to_good_millis: lost.map(|from| millis(from, now)),
        }
    }
}

impl PluginObservation<'_> {
    pub(crate) fn is_well(&self) -> bool {
        self.is_good && self.before.state == "running"
    }
}

fn kill(plugin: &PluginStats) -> Result<Instant> {
    let pid = plugin.pid.and_then(|pid| Pid::from_raw(pid as i32));
    let Some(pid) = pid else { bail!("{} has no process", plugin.name) };
    let now = Instant::now();
    kill_process(pid, Signal::KILL)?;
    Ok(now)
}

/// Converts a time of the wall clock to an instant, never later than now.
fn instant_of(unix_nanos: u128) -> Instant {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    let age = Duration::from_nanos(now.saturating_sub(unix_nanos) as u64);
    let instant = Instant::now();
    instant.checked_sub(age).unwrap_or(instant)
}
