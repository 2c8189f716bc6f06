//! Simulation of the year: its steps, and the checks of all that must hold.

use std::sync::Arc;
use std::time::{Duration, SystemTime};

use allocation_counter::AllocationInfo;
use busbar_plugin_sdk::simulation::{ActiveFault, FaultPlan, Signal};
use busbar_plugin_sdk::testing::{MAX_RECORDED, Recorder};
use busbar_plugin_sdk::{LinkState, Quality, Reason, Sample, Value};
use device_server::FaultyLink;
use fastrand::Rng;
use tokio::runtime::{Handle, Runtime};
use tokio::task::{JoinHandle, LocalSet, spawn_local};
use tokio::time::{Instant, sleep_until};

use crate::Rig;
use crate::fault_schedule::{DisturbanceState, Event, FaultSchedule};
use crate::network::MemoryNetwork;
use crate::tally::Tally;
use crate::time::{SimulatedTime, shift};

const DAY: Duration = Duration::from_secs(86_400);
/// Number of days until buffers have their lasting size.
const WARM_UP_DAYS: u32 = 7;
/// Range of the time between two checks, seconds.
const STEP_SECONDS: std::ops::Range<u64> = 60..1200;
/// Tolerance for rounding of a number on the wire.
const PRECISION: f64 = 1e-3;
/// Sampling step for values that jump.
const SCAN_STEP: Duration = Duration::from_secs(1);

/// Runs a number of days on a runtime of one thread whose clock is paused.
///
/// # Panics
/// When a check fails.
pub fn run<R: Rig>(
    rig: R,
    seed: u64,
    days: u32,
    fault_schedule: FaultSchedule,
    runtime: &Runtime,
) -> Tally {
    // Of the delays between tries, and of whatever else the adapter draws.
    fastrand::seed(seed);
    let tasks = LocalSet::new();
    let mut year = tasks.block_on(runtime, Year::begin(rig, seed, fault_schedule));
    for day in 0..days {
        let info = allocation_counter::measure(|| tasks.block_on(runtime, year.run_day()));
        year.note_heap(day, info);
    }
    tasks.block_on(runtime, year.end())
}

struct Year<R> {
    rig: R,
    fault_schedule: FaultSchedule,
    random: Rng,
    network: MemoryNetwork,
    recorder: Recorder,
    began: Instant,
    adapter: JoinHandle<()>,
    device: Option<Device>,
    device_back_at: Option<Instant>,
    disturbance: DisturbanceState,
    link: LinkState,
    /// Newest sample of each tag.
    newest: Vec<Option<Sample>>,
    /// Seconds by which the device's clock was ahead at the last check.
    ahead_before: i64,
    had_fault: bool,
    tally: Tally,
}

struct Device {
    task: JoinHandle<()>,
    faults: FaultPlan,
    started: Instant,
}

impl Device {
    fn fault(&self) -> Option<ActiveFault> {
        self.faults.at(self.started.elapsed())
    }

    fn next_change(&self) -> Option<Instant> {
        Some(self.started + self.faults.next_change(self.started.elapsed())?)
    }
}

impl<R: Rig> Year<R> {
    async fn begin(rig: R, seed: u64, fault_schedule: FaultSchedule) -> Self {
        SimulatedTime::begin();
        let (network, recorder) = (MemoryNetwork::default(), Recorder::new());
        let adapter = start_adapter(&rig, &recorder, &network);
        let newest = vec![None; rig.tags().len()];
        let mut year = Self {
            rig,
            fault_schedule,
            random: Rng::with_seed(seed),
            network,
            recorder,
            began: Instant::now(),
            adapter,
            device: None,
            device_back_at: None,
            disturbance: DisturbanceState::new(),
            link: LinkState::Connecting,
            newest,
            ahead_before: 0,
            had_fault: false,
            tally: Tally::default(),
        };
        year.start_device();
        year
    }

    /// Simulates a day, and then steps until no disturbance is left.
    async fn run_day(&mut self) {
        let end = Instant::now() + DAY;
        while Instant::now() < end {
            self.step().await;
            if let Some(event) = self.fault_schedule.event(&mut self.random) {
                self.apply_event(event).await;
            }
        }
        while !self.is_quiet() {
            self.step().await;
        }
    }

    /// Advances to the next point, and checks all tags.
    async fn step(&mut self) {
        let from = Instant::now();
        let some = from + Duration::from_secs(self.random.u64(STEP_SECONDS));
        let change = self.device.as_ref().and_then(Device::next_change);
        let until = [self.device_back_at, change].into_iter().flatten().fold(some, Instant::min);
        sleep_until(until).await;
        self.record_disturbance();
        self.take_samples(from.elapsed());
        self.judge();
        if self.device_back_at.is_some_and(|back_at| back_at <= Instant::now()) {
            self.device_back_at = None;
            self.start_device();
        }
    }

    async fn apply_event(&mut self, event: Event) {
        match event {
            Event::Outage { length, is_silent } => {
                let Some(device) = self.device.take() else { return };
                device.task.abort();
                if is_silent {
                    self.network.ignore_dials()
                } else {
                    self.network.refuse_dials()
                }
                self.device_back_at = Some(Instant::now() + length);
                self.tally.outages += 1;
                self.record_disturbance();
            }
            Event::Reload => {
                self.adapter.abort();
                let ended = (&mut self.adapter).await;
                self.check(ended.is_err_and(|error| error.is_cancelled()), "the adapter ran", &"");
                self.recorder.clear();
                self.newest.fill(None);
                self.link = LinkState::Connecting;
                self.network.forget_dials();
                self.disturbance.restart();
                self.adapter = start_adapter(&self.rig, &self.recorder, &self.network);
                self.tally.reloads += 1;
            }
            Event::ClockJump(seconds) => {
                SimulatedTime::set_adapter_ahead(seconds);
                self.tally.clock_jumps += 1;
            }
        }
    }

    /// Starts the device as a new one.
    fn start_device(&mut self) {
        let faults = self.fault_schedule.faults(&mut self.random);
        let clock = SimulatedTime::of_device;
        let link = FaultyLink::with_clock(faults.clone(), self.random.u64(..), R::DEADLINE, clock);
        let task = spawn_local(self.rig.run_device(self.network.listen(), link));
        self.device = Some(Device { task, faults, started: Instant::now() });
        self.record_disturbance();
    }

    fn record_disturbance(&mut self) {
        let fault = self.device.as_ref().and_then(Device::fault);
        self.disturbance.record(self.device.is_none(), fault.map(|fault| fault.kind));
        let has_fault = fault.is_some();
        self.tally.faults += u64::from(has_fault && !self.had_fault);
        self.had_fault = has_fault;
    }

    fn is_quiet(&self) -> bool {
        self.disturbance.is_quiet_for(R::WELL_AFTER)
    }

    /// Applies the samples of this period.
    fn take_samples(&mut self, time: Duration) {
        let recording = self.recorder.recording();
        self.recorder.clear();
        self.check(recording.samples.len() < MAX_RECORDED, "no sample is lost", &"");
        let at = self.began.elapsed();
        for report in recording.links {
            self.tally.note_report(at, &report);
            self.link = report.0;
        }
        let fault = self.device.as_ref().and_then(Device::fault);
        let ahead = fault.map_or(0, |fault| fault.clock_ahead_seconds);
        let before = std::mem::replace(&mut self.ahead_before, ahead);
        for sample in recording.samples {
            self.tally.note_sample(at, &sample);
            self.check_time(&sample, time, [before, ahead]);
            let newest = usize::try_from(sample.tag).ok().and_then(|i| self.newest.get_mut(i));
            match newest {
                Some(newest) => *newest = Some(sample),
                None => self.check(false, "samples are of tags", &sample),
            }
        }
    }

    /// Checks that a sample with a time has the value that the device had then, by its own clock.
    fn check_time(&mut self, sample: &Sample, time: Duration, aheads: [i64; 2]) {
        let (Some(value), Some(said_time)) = (&sample.value, sample.source_time) else {
            self.tally.untimed_samples += 1;
            return;
        };
        self.tally.timed_samples += 1;
        let (now, signal) = (SimulatedTime::of_device(), self.signal(sample.tag));
        let is_right = aheads.into_iter().any(|ahead| {
            let true_time = shift(said_time, -ahead);
            let age = now.duration_since(true_time);
            // Late answers queue up until the adapter has noticed.
            age.is_ok_and(|age| age <= time + R::NOTICED_AFTER)
                && is_equal(&signal.at(true_time), value, PRECISION)
        });
        self.check(is_right, "values are those of their time", sample);
    }

    fn judge(&mut self) {
        self.check(!self.adapter.is_finished(), "the adapter runs", &"");
        let has_died = self.device.as_ref().is_some_and(|device| device.task.is_finished());
        self.check(!has_died, "the device runs", &"");
        if self.link != LinkState::Up {
            self.check_all("tags are bad without a link", |_, sample| {
                sample.is_none_or(|sample| matches!(sample.quality, Quality::Bad(_)))
            });
        }
        if self.disturbance.is_cut_off_for(R::NOTICED_AFTER) {
            self.tally.dead_points += 1;
            self.check(self.link != LinkState::Up, "a dead link is not up", &self.link);
            let communication = Quality::Bad(Reason::Communication);
            self.check_all("tags of a dead link are bad for that", |_, sample| {
                sample.is_some_and(|sample| sample.quality == communication)
            });
        }
        if self.is_quiet() {
            self.tally.quiet_points += 1;
            self.check(self.link == LinkState::Up, "the link is up", &self.link);
            let now = SimulatedTime::of_device();
            self.check_all("tags are good and as they are", |signal, sample| {
                let value = sample.filter(|s| s.quality.is_good()).and_then(|s| s.value.as_ref());
                value.is_some_and(|value| is_current::<R>(signal, value, now))
            });
            let tasks = Handle::current().metrics().num_alive_tasks();
            self.check(tasks == R::TASKS, "no task is left over", &tasks);
        }
    }

    fn check_all(&self, what: &str, holds: impl Fn(&Signal, Option<&Sample>) -> bool) {
        for (tag, newest) in self.rig.tags().iter().zip(&self.newest) {
            let is_right = holds(&tag.signal, newest.as_ref());
            self.check(is_right, what, &(&tag.spec.id, newest, self.link));
        }
    }

    #[track_caller]
    fn check(&self, holds: bool, what: &str, found: &dyn std::fmt::Debug) {
        if !holds {
            let days = self.began.elapsed().as_secs_f64() / DAY.as_secs_f64();
            let fault = self.device.as_ref().and_then(Device::fault);
            let disturbance = &self.disturbance;
            panic!("not so on day {days:.5}: {what}: {found:?}; {fault:?}; {disturbance:?}");
        }
    }

    fn signal(&self, tag: u32) -> Signal {
        self.rig.tags()[tag as usize].signal.clone()
    }

    fn note_heap(&mut self, day: u32, info: AllocationInfo) {
        if day >= WARM_UP_DAYS {
            self.tally.heap_growth += info.bytes_current;
        }
        self.tally.heap_peak = self.tally.heap_peak.max(info.bytes_max);
    }

    async fn end(mut self) -> Tally {
        self.tally.duration = self.began.elapsed();
        (self.tally.dials, self.tally.shortest_gap) = self.network.dials();
        self.adapter.abort();
        // By cancelling; how it went was looked at before.
        let _ = (&mut self.adapter).await;
        self.tally
    }
}

fn start_adapter<R: Rig>(rig: &R, recorder: &Recorder, network: &MemoryNetwork) -> JoinHandle<()> {
    spawn_local(rig.run_adapter(recorder.sink(), Arc::new(network.clone())))
}

/// Reports whether a value is one that the signal had within the greatest age.
fn is_current<R: Rig>(signal: &Signal, value: &Value, now: SystemTime) -> bool {
    if let Some(slope) = signal.max_slope() {
        return is_equal(&signal.at(now), value, slope * R::MAX_AGE.as_secs_f64() + PRECISION);
    }
    let steps = 0..=u32::try_from(R::MAX_AGE.as_secs()).unwrap_or(u32::MAX);
    let mut times = steps.map(|step| now - step * SCAN_STEP);
    times.any(|time| is_equal(&signal.at(time), value, PRECISION))
}

fn is_equal(expected: &Value, found: &Value, tolerance: f64) -> bool {
    match (expected, found) {
        (Value::F64(expected), Value::F64(found)) => (expected - found).abs() <= tolerance,
        _ => expected == found,
    }
}
