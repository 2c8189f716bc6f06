//! The thread that plays: opens the recording, keeps the pace, publishes.

use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::{
    Host, LinkState, LogLevel, Reason, Sample, SampleFlags, SampleSink, StopToken,
};

use crate::address::Points;
use crate::instant::{SECOND, in_words, system_time, unix_nanos};
use crate::open_recording::open_recording;
use crate::player::{MAX_UPDATES_AT_ONCE, Player, Progress};
use crate::recording::{Fault, Update};
use crate::remarks::Remarks;
use crate::settings::{Config, Moment, Times};

/// Time between two batches.
const TICK: Duration = Duration::from_millis(10);
/// Greatest lag of playing before it continues from where it is.
const MAX_BEHIND: Duration = Duration::from_secs(1);
/// Shortest and longest delay between tries to open a recording.
const MIN_RETRY: Duration = Duration::from_secs(1);
const MAX_RETRY: Duration = Duration::from_secs(30);

/// State of the playing thread.
pub(crate) struct Session {
    pub(crate) config: Config,
    pub(crate) points: Points,
    pub(crate) sink: SampleSink,
    pub(crate) host: Host,
}

impl Session {
    /// Plays until the recording ends or the plugin stops. What cannot be opened is
    /// tried again.
    pub(crate) fn run(&self, running: &StopToken) {
        self.publish_all(Reason::NotConnected);
        self.sink.report_link(LinkState::Connecting, &format!("'{}': opening", self.file()));
        let mut delay = MIN_RETRY;
        while running.is_running() {
            let fault = match self.play(running) {
                Ok(()) if !running.is_running() => return,
                Ok(()) => {
                    let text = format!(
                        "'{}': the recording has ended; load the scene again to play it again",
                        self.file()
                    );
                    self.sink.report_link(LinkState::Down, &text);
                    self.host.log(LogLevel::Info, &text);
                    self.publish_all(Reason::Communication);
                    return;
                }
                Err(fault) => fault,
            };
            let text = format!("{fault}; next try in {} s", delay.as_secs());
            self.sink.report_link(LinkState::Down, &text);
            self.publish_all(if fault.is_of_tags {
                Reason::Configuration
            } else {
                Reason::Communication
            });
            running.wait(delay);
            delay = (delay * 2).min(MAX_RETRY);
        }
    }

    fn file(&self) -> String {
        self.config.file.display().to_string()
    }

    fn publish_all(&self, reason: Reason) {
        self.sink.publish_bad(self.points.0.iter().map(|point| point.tag), reason);
    }

    /// Plays the recording to its end.
    fn play(&self, running: &StopToken) -> Result<(), Fault> {
        let mut remarks = Remarks::new(self.host.clone(), self.file());
        let recording = open_recording(&self.config, &self.points, &mut remarks)?;
        let origin = recording.origin();
        let [start, end] = self.bounds(origin)?;
        let is_discrete = self.points.0.iter().map(|point| point.is_discrete()).collect();
        let mut player = Player::new(recording, is_discrete, self.interval(), start, end)?;
        let clock = Clock {
            speed: self.config.speed,
            times: self.config.times,
            origin: origin.and_then(|o| o.checked_add(start)),
            scene_origin: origin
                .and_then(|o| o.checked_add(start))
                .unwrap_or_else(|| unix_nanos(SystemTime::now())),
        };
        self.report_playing(origin);
        let mut batch = Vec::new();
        let mut anchor = Instant::now();
        loop {
            let head = clock.head(anchor.elapsed());
            let progress = player.advance(head, &mut batch, &mut remarks)?;
            if matches!(progress, Progress::More(_)) && batch.len() < MAX_UPDATES_AT_ONCE {
                if !running.is_running() {
                    return Ok(());
                }
                continue;
            }
            self.publish(&mut batch, head, &clock);
            match progress {
                Progress::Waiting => {}
                Progress::More(since) => {
                    anchor = self.catch_up(anchor, since, &clock, &mut remarks)
                }
                Progress::Ended(length) => {
                    remarks.close();
                    let is_again = self.config.is_loop && player.has_played();
                    if !is_again {
                        return if player.has_played() { Ok(()) } else { Err(self.nothing()) };
                    }
                    // A pass takes a tick at least, however short the recording.
                    anchor += clock.duration(length).max(TICK);
                    player.rewind(&mut batch)?;
                    anchor = anchor.max(Instant::now().checked_sub(MAX_BEHIND).unwrap_or(anchor));
                }
            }
            if !running.wait(TICK) {
                return Ok(());
            }
        }
    }

    fn nothing(&self) -> Fault {
        Fault::new(&self.config.file, "there is nothing to play between start and end: set others")
    }

    /// Returns the bounds of playing, from the recording's origin.
    fn bounds(&self, origin: Option<i64>) -> Result<[i64; 2], Fault> {
        let fault = |what: &str| Fault::new(&self.config.file, what);
        let place = |moment: Moment| match moment {
            Moment::Offset(nanos) => Ok(nanos),
            Moment::Unix(nanos) => origin
                .map(|origin| nanos.saturating_sub(origin))
                .ok_or_else(|| fault("it has no dates: give start and end as seconds")),
        };
        let start = self.config.start.map_or(Ok(0), place)?.max(0);
        let end = self.config.end.map_or(Ok(i64::MAX), place)?;
        if end < start {
            return Err(self.nothing());
        }
        if self.config.times == Times::Original {
            let first = origin.ok_or_else(|| fault("it has no dates: set times to now"))?;
            // No clock of a host shows these, and without them values would look new.
            if first < 0 || first > unix_nanos(SystemTime::now()) {
                let date = in_words(first);
                return Err(fault(&format!(
                    "it starts at {date}, before 1970 or in the future: set times to now"
                )));
            }
        }
        Ok([start, end])
    }

    /// Nanoseconds of the recording between two updates of a tag.
    fn interval(&self) -> Option<i64> {
        let most = self.config.max_updates_per_second?;
        Some((self.config.speed.unwrap_or(1.0) * SECOND as f64 / most) as i64)
    }

    fn report_playing(&self, origin: Option<i64>) {
        let of = origin.map_or_else(String::new, |origin| format!(" of {}", in_words(origin)));
        let speed = self
            .config
            .speed
            .map_or_else(|| "as fast as possible".into(), |speed| format!("at {speed} x"));
        let times = match self.config.times {
            Times::Now => "times are shifted to now",
            Times::Original => "times are those of the recording",
        };
        let again = if self.config.is_loop { ", again and again" } else { "" };
        let text = format!("REPLAY, not live: '{}'{of}, {speed}{again}; {times}", self.file());
        self.sink.report_link(LinkState::Up, &text);
        self.host.log(LogLevel::Info, &text);
    }

    fn publish(&self, batch: &mut Vec<Update>, head: i64, clock: &Clock) {
        // Overlays calculate by the recording's time, which runs at its speed.
        let newest = batch.iter().map(|update| update.nanos).max();
        let reached = if clock.speed.is_some() { Some(head) } else { newest };
        if let Some(nanos) = reached {
            self.sink.report_scene_time(Some(clock.scene_origin.saturating_add(nanos)));
        }
        if batch.is_empty() {
            return;
        }
        let now = SystemTime::now();
        let samples: Vec<Sample> = batch
            .drain(..)
            .filter_map(|update| {
                let tag = self.points.0.get(update.point)?.tag;
                let Some(source_time) = clock.source_time(update.nanos, head, now) else {
                    return Some(Sample::bad(tag, Reason::Unknown));
                };
                Some(Sample {
                    tag,
                    value: update.value,
                    quality: update.quality,
                    source_time: Some(source_time),
                    flags: SampleFlags::LIVE,
                })
            })
            .collect();
        self.sink.publish(&samples);
    }

    /// Goes on from `since` where playing is too far behind: a machine that was
    /// asleep, or a speed that is beyond it.
    fn catch_up(
        &self,
        anchor: Instant,
        since: i64,
        clock: &Clock,
        remarks: &mut Remarks,
    ) -> Instant {
        if clock.speed.is_none() {
            return anchor;
        }
        let due = anchor + clock.duration(since);
        let now = Instant::now();
        if now.saturating_duration_since(due) <= MAX_BEHIND {
            return anchor;
        }
        remarks.add(format!(
            "playing was more than {} s behind and goes on from where it is: lower speed or max_updates_per_second",
            MAX_BEHIND.as_secs()
        ));
        anchor + (now - due)
    }
}

/// From the recording's time to that of playing.
struct Clock {
    /// Nothing is as fast as possible.
    speed: Option<f64>,
    times: Times,
    /// Origin of playing, nanoseconds from 1970.
    origin: Option<i64>,
    /// The same for the scene clock; of a recording without dates it is the instant at
    /// which playing started.
    scene_origin: i64,
}

impl Clock {
    /// Nanoseconds from the start that are due after this time.
    fn head(&self, elapsed: Duration) -> i64 {
        // Saturates, after centuries.
        self.speed.map_or(i64::MAX, |speed| (elapsed.as_nanos() as f64 * speed) as i64)
    }

    /// Returns the real time of so many nanoseconds of the recording.
    fn duration(&self, nanos: i64) -> Duration {
        let nanos = nanos.max(0) as f64 / self.speed.unwrap_or(f64::INFINITY);
        Duration::from_nanos(nanos as u64)
    }

    /// The source time of an update; nothing where there is none that is honest.
    fn source_time(&self, nanos: i64, head: i64, now: SystemTime) -> Option<SystemTime> {
        match self.times {
            Times::Original => {
                let time = system_time(self.origin?.checked_add(nanos)?)?;
                (time <= now).then_some(time)
            }
            // What is due later than now, by its skew, is of now.
            Times::Now if self.speed.is_none() => Some(now),
            Times::Now => now.checked_sub(self.duration(head.saturating_sub(nanos))),
        }
    }
}
