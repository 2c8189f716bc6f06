//! Progress of another process: CPU time, waiting for a CPU, and the state of its threads.
//!
//! A process that is slow and one that hangs are both silent. The kernel tells them apart:
//! `/proc/PID/task/TID/schedstat` has the time that each thread ran, and `stat` has its state
//! (proc_pid_stat(5)).

use std::fs::File;
use std::io::Read;
use std::time::{Duration, Instant};

/// Threads that one reading looks at.
const MAX_THREADS: usize = 256;
/// Bytes that are read of one file below `/proc`.
const MAX_BYTES: u64 = 4096;
/// The shortest time that two readings are compared over.
pub const PROGRESS_WINDOW: Duration = Duration::from_millis(200);
/// The share of one CPU from which a process makes progress: a heartbeat alone takes less.
const LEAST_SHARE: f64 = 0.01;

/// Activity of a process between two readings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// A thread used a CPU.
    Running,
    /// A thread is ready to run, and others have the CPUs.
    Starved,
    /// A thread waits for a disk or another device that cannot be interrupted (state D).
    Blocked,
    /// A signal or a debugger stopped it (states T and t).
    Stopped,
    /// All threads are asleep.
    Idle,
    /// The process has ended, or never existed (states Z and X).
    Gone,
}

impl Activity {
    /// Reports whether a process that does this is slow rather than hung.
    pub fn is_progress(self) -> bool {
        matches!(self, Self::Running | Self::Starved | Self::Blocked)
    }
}

/// Reading of a process at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Reading {
    /// CPU time of all threads, nanoseconds.
    cpu_nanos: u64,
    /// Time that threads waited for a CPU, nanoseconds.
    starved_nanos: u64,
    is_ready: bool,
    is_blocked: bool,
    is_stopped: bool,
    is_gone: bool,
}

/// Readings of one process over time.
#[derive(Debug)]
pub struct ProgressMeter {
    pid: u32,
    last: Option<(Instant, Reading)>,
    activity: Activity,
    starved_share: Option<f64>,
}

impl ProgressMeter {
    /// Creates a meter that has read nothing yet.
    pub fn new(pid: u32) -> Self {
        Self { pid, last: None, activity: Activity::Running, starved_share: None }
    }

    /// Reads the process where [`PROGRESS_WINDOW`] has passed since the last reading, and returns
    /// its activity. A process that was read once counts as running.
    pub fn observe(&mut self, now: Instant) -> Activity {
        if let Some((then, _)) = self.last
            && now.saturating_duration_since(then) < PROGRESS_WINDOW
        {
            return self.activity;
        }
        let reading = read(self.pid);
        let before = self.last.replace((now, reading));
        self.activity = match before {
            Some((then, before)) => {
                let window = now.saturating_duration_since(then);
                let starved = starved_between(&before, &reading, window);
                self.starved_share = Some(starved.as_secs_f64() / window.as_secs_f64());
                activity(&before, &reading, window)
            }
            // The states alone.
            None => activity(&Reading::default(), &reading, Duration::ZERO),
        };
        self.activity
    }

    /// Share of the time between the last two readings in which the process could not run for
    /// want of a CPU or a disk, 0 to 1; none before there are two.
    pub fn starved_share(&self) -> Option<f64> {
        self.starved_share
    }

    /// Forgets the last reading, so that the next comparison begins anew.
    pub fn reset(&mut self) {
        *self = Self::new(self.pid);
    }

    /// Reports whether a signal has stopped the process, by its state alone.
    pub fn is_stopped(&self) -> bool {
        stat_of(self.pid, None).is_some_and(|(state, _)| matches!(state, 'T' | 't'))
    }
}

/// Judges two readings that are `window` apart.
fn activity(before: &Reading, after: &Reading, window: Duration) -> Activity {
    let ran = after.cpu_nanos.saturating_sub(before.cpu_nanos) as f64;
    if after.is_gone {
        Activity::Gone
    } else if after.is_stopped {
        Activity::Stopped
    } else if ran > 0.0 && ran >= window.as_nanos() as f64 * LEAST_SHARE {
        Activity::Running
    } else if after.is_ready {
        Activity::Starved
    } else if after.is_blocked {
        Activity::Blocked
    } else {
        Activity::Idle
    }
}

/// Time of a window that threads spent ready to run, at most all of it.
fn starved_between(before: &Reading, after: &Reading, window: Duration) -> Duration {
    let waited = Duration::from_nanos(after.starved_nanos.saturating_sub(before.starved_nanos));
    let ran = Duration::from_nanos(after.cpu_nanos.saturating_sub(before.cpu_nanos));
    // A thread that waits at this moment is counted by the kernel once it runs.
    let is_waiting = after.is_ready && ran < window / 2 || after.is_blocked;
    if is_waiting { window.saturating_sub(ran) } else { waited.min(window) }
}

fn read(pid: u32) -> Reading {
    let Some((leader, _)) = stat_of(pid, None) else { return gone() };
    if matches!(leader, 'Z' | 'X' | 'x') {
        return gone();
    }
    let mut reading = Reading { is_stopped: matches!(leader, 'T' | 't'), ..Reading::default() };
    let Ok(tasks) = std::fs::read_dir(format!("/proc/{pid}/task")) else { return gone() };
    for task in tasks.flatten().take(MAX_THREADS) {
        let name = task.file_name();
        let Some(tid) = name.to_str() else { continue };
        let Some((state, ticks_nanos)) = stat_of(pid, Some(tid)) else { continue };
        reading.is_ready |= state == 'R';
        reading.is_blocked |= state == 'D';
        let (ran, waited) = schedstat_of(pid, tid).unwrap_or((ticks_nanos, 0));
        reading.cpu_nanos = reading.cpu_nanos.saturating_add(ran);
        reading.starved_nanos = reading.starved_nanos.saturating_add(waited);
    }
    reading
}

fn gone() -> Reading {
    Reading { is_gone: true, ..Reading::default() }
}

/// State and CPU time of a thread, or of the leader: nanoseconds, to the tick.
fn stat_of(pid: u32, tid: Option<&str>) -> Option<(char, u64)> {
    let text = match tid {
        Some(tid) => contents(&format!("/proc/{pid}/task/{tid}/stat")),
        None => contents(&format!("/proc/{pid}/stat")),
    }?;
    // The name before it may have any character in it.
    let mut fields = text.rsplit_once(')')?.1.split_ascii_whitespace();
    let state = fields.next()?.chars().next()?;
    // utime and stime are the fields 14 and 15; the state is the third.
    let user: u64 = fields.nth(10)?.parse().ok()?;
    let system: u64 = fields.next()?.parse().ok()?;
    let nanos_per_tick = 1_000_000_000 / rustix::param::clock_ticks_per_second().max(1);
    Some((state, user.saturating_add(system).saturating_mul(nanos_per_tick)))
}

/// Time on a CPU and time ready to run of a thread, nanoseconds; none without CONFIG_SCHED_INFO.
fn schedstat_of(pid: u32, tid: &str) -> Option<(u64, u64)> {
    let text = contents(&format!("/proc/{pid}/task/{tid}/schedstat"))?;
    let mut fields = text.split_ascii_whitespace().map(|field| field.parse().ok());
    Some((fields.next()??, fields.next()??))
}

fn contents(path: &str) -> Option<String> {
    let mut text = String::new();
    File::open(path).ok()?.take(MAX_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
}

#[cfg(test)]
#[path = "progress_tests.rs"]
mod tests;
