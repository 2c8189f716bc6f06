//! Benchmark of tags and alarms in a frame: 5,400 points that change every second, each with an
//! alarm, at 60 frames a second. A burst makes 1,000 changes within one frame, each of which is
//! an alarm. `cargo run --release --example frame_cost`.
#![allow(clippy::print_stdout, reason = "figures are its output")]

use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_alarms::{
    AlarmHandle, AlarmSet, AlarmSource, AlarmSpec, AlarmTable, Condition, TagCondition,
};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{AlarmAction, AlarmState, Limit, Priority, Quality, Value, ValueKind};

const POINTS: u32 = 5_400;
const FRAMES_PER_SECOND: u32 = 60;
const SECONDS: u32 = 60;
const BURST: u32 = 1_000;
const BURSTS: u32 = 50;

struct Site {
    tags: TagTable,
    alarms: AlarmTable,
    now: Moment,
    records: usize,
}

fn site() -> Site {
    let tag = |index| TagSpec {
        id: format!("point {index}"),
        name: String::new(),
        kind: ValueKind::F64,
        unit: "A".into(),
        range: None,
        freshness: Duration::from_secs(3),
        scale: None,
        dead_band: 0.0,
        expression: None,
    };
    let alarm = |index: u32| AlarmSpec {
        id: format!("alarm {index}"),
        message: "Current high".into(),
        consequence: String::new(),
        response: String::new(),
        equipment: None,
        priority: Priority::ALL[index as usize % 4],
        latched: index.is_multiple_of(7),
        group: index.is_multiple_of(5).then(|| format!("{}", index % 100)),
        source: AlarmSource::Tag {
            trigger: TagCondition {
                tag: TagHandle(index),
                condition: Condition::Limit { limit: Limit::High, at: 1_000.0, deadband: 20.0 },
            },
            on_delay: Duration::from_millis(if index.is_multiple_of(2) { 0 } else { 500 }),
            off_delay: Duration::from_secs(5),
            suppressed_by: None,
        },
    };
    let tags = Arc::new(TagSet::new((0..POINTS).map(tag).collect()).expect("they can be"));
    let alarms = AlarmSet::new((0..POINTS).map(alarm).collect(), &tags).expect("they can be");
    let now = Moment(1 << 60);
    let alarms = AlarmTable::new(Arc::new(alarms), Duration::from_secs(3600), now);
    Site { tags: TagTable::new(tags, now), alarms, now, records: 0 }
}

impl Site {
    fn apply(&mut self, tag: u32, value: f64) {
        let value = Some(Value::F64(value));
        let sample = Sample::live(TagHandle(tag), value, Quality::Good, self.now);
        let Self { tags, alarms, .. } = self;
        tags.apply(&sample, |change| alarms.note(change));
    }

    /// A frame in which these points come; how long it took.
    fn frame(&mut self, points: impl Iterator<Item = (u32, f64)>) -> Duration {
        self.now = self.now.after(Duration::from_secs(1) / FRAMES_PER_SECOND);
        let points: Vec<_> = points.collect();
        let start = Instant::now();
        for (tag, value) in points {
            self.apply(tag, value);
        }
        let Self { tags, alarms, now, records } = self;
        tags.advance(*now, |change| alarms.note(change));
        let wall_clock = SourceTime(now.0 as i64);
        alarms.step(tags.snapshot(), *now, wall_clock, |_| *records += 1);
        start.elapsed()
    }
}

fn main() {
    let mut site = site();
    let per_frame = POINTS / FRAMES_PER_SECOND;
    let points_of = |frame: u32, burst: u32| {
        let first = frame * per_frame % POINTS;
        let steady = (first..first + per_frame)
            .map(move |tag| (tag, 500.0 + f64::from(frame % 400) + f64::from(tag % 10)));
        steady.chain((0..burst).map(move |tag| (POINTS - 1 - tag * 2, 1_500.0 + f64::from(frame))))
    };
    for frame in 0..FRAMES_PER_SECOND * 2 {
        site.frame(points_of(frame, 0));
    }
    let frames = FRAMES_PER_SECOND * 2..FRAMES_PER_SECOND * (SECONDS + 2);
    print("steady, 90 points a frame", frames.map(|f| site.frame(points_of(f, 0))).collect());
    let (mut bursts, mut occurred) = (Vec::new(), 0);
    for burst in 0..BURSTS {
        let before = site.records;
        bursts.push(site.frame(points_of(burst, BURST)));
        // Those with a delay come later.
        for frame in 0..FRAMES_PER_SECOND * 8 {
            site.frame(points_of(frame, 0));
        }
        occurred += site.records - before;
        for alarm in (0..POINTS).map(AlarmHandle) {
            let state = site.alarms.status(alarm).map_or(AlarmState::Normal, |status| status.state);
            if state.is_unacknowledged() {
                site.alarms.perform(alarm, AlarmAction::Acknowledge, "bench").expect("it is legal");
            }
            if site
                .alarms
                .status(alarm)
                .is_some_and(|status| status.state == AlarmState::LatchedAcknowledged)
            {
                site.alarms.perform(alarm, AlarmAction::Reset, "bench").expect("it is legal");
            }
        }
    }
    print("a burst of 1,000 besides", bursts);
    println!("{occurred} records of {BURSTS} bursts");
}

fn print(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let at = |share: f64| {
        let rank = (share * (times.len() - 1) as f64).round() as usize;
        times[rank].as_secs_f64() * 1e3
    };
    let [median, p99, most] = [0.5, 0.99, 1.0].map(at);
    println!("{what}: median {median:.3} ms, p99 {p99:.3} ms, most {most:.3} ms a frame");
}
