//! Clock matrix: source and host clocks that are ahead, behind and step, with live, repeated,
//! stored and untimed samples, judged by an oracle that knows the truth at every instant.
//!
//! `BUSBAR_CLOCK_STEPS` sets the number of steps; `cargo xtask soak` takes a million and more.

use std::sync::Arc;
use std::time::Duration;

use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    MAX_CLOCK_AHEAD, PublishedSample, SampleIntake, SourcePolicy, TelemetryTag,
};
use busbar_plugin_sdk::testing::FaultGenerator;
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::{Quality, Value, ValueKind};

const MILLISECOND: i64 = 1_000_000;
const SECOND: i64 = 1000 * MILLISECOND;
const TAGS: usize = 6;
const STEPS_AN_EPISODE: u64 = 500;
const DEFAULT_STEPS: u64 = 1_000_000;
/// Freshness limits of the tags, seconds.
const LIMITS: [i64; 3] = [2, 60, 600];
/// Tags from here on seldom say what is new.
const QUIET_FROM: usize = 3;
/// Longest way of a live sample from source to host.
const MAX_DELAY: i64 = 200 * MILLISECOND;
/// Steps of clocks, seconds.
const CLOCK_STEPS: [i64; 4] = [2, 9, 45, 3600];
/// True time at which an episode begins, since 1970.
const START: i64 = 1_790_000_000 * SECOND;
const GOOD: u8 = abi::BUSBAR_QUALITY_GOOD;

/// Seeded random choices of the test.
struct Dice(FaultGenerator);

impl Dice {
    fn below(&mut self, bound: i64) -> i64 {
        self.0.below(bound as usize) as i64
    }

    fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.0.below(of.len())]
    }

    fn clock_step(&mut self) -> i64 {
        self.pick(&CLOCK_STEPS) * SECOND * self.pick(&[-1, 1])
    }
}

/// A sample that the source made: its value, its stamp, and the true time of it.
#[derive(Clone, Copy)]
struct Made {
    value: i64,
    stamp: i64,
    at: i64,
}

#[derive(Default)]
struct Tag {
    /// The value that is true now.
    value: i64,
    /// The true time at which each former value ended, by value.
    ended: Vec<i64>,
    /// Samples that the source made, the newest last.
    made: Vec<Made>,
    /// Tells whether the source said last that it is not good.
    is_bad: bool,
    /// Tells whether the value shown has a stamp that no clock can tell from a right one.
    is_untellable: bool,
    /// Stamp of the last live sample, and whether no clock could tell it then: the same
    /// again tells nothing new.
    last_stamp: (i64, bool),
}

struct World {
    dice: Dice,
    now: i64,
    host_offset: i64,
    source_offset: i64,
    /// Tells whether any clock of this episode was ever wrong.
    is_skewed: bool,
    tags: Vec<Tag>,
    intake: SampleIntake,
    table: TagTable,
    untellable: u64,
}

fn limit(tag: usize) -> i64 {
    LIMITS[tag % LIMITS.len()] * SECOND
}

impl World {
    fn new(seed: u64) -> Self {
        let spec = |tag: usize| TagSpec {
            id: format!("t{tag}"),
            name: String::new(),
            kind: ValueKind::I64,
            unit: String::new(),
            range: None,
            freshness: Duration::from_nanos(limit(tag) as u64),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let telemetry = |tag: usize| TelemetryTag {
            tag: TagHandle(tag as u32),
            kind: ValueKind::I64,
            freshness: Duration::from_nanos(limit(tag) as u64),
            id: format!("t{tag}"),
            address_json: String::new(),
            unit: String::new(),
        };
        let served: Vec<TelemetryTag> = (0..TAGS).map(telemetry).collect();
        let set =
            Arc::new(TagSet::new((0..TAGS).map(spec).collect()).expect("no tag rests on another"));
        let mut dice = Dice(FaultGenerator::new(seed));
        let is_skewed = dice.below(2) == 0;
        let source_offset = if is_skewed { dice.clock_step() } else { 0 };
        Self {
            dice,
            now: START,
            host_offset: 0,
            source_offset,
            is_skewed,
            tags: (0..TAGS).map(|_| Tag::default()).collect(),
            intake: SampleIntake::new(&served, SourcePolicy::default()),
            table: TagTable::new(set, Moment(START as u64)),
            untellable: 0,
        }
    }

    fn state(&self, tag: usize) -> busbar_tags::TagState {
        self.table.snapshot().state(TagHandle(tag as u32)).expect("it is there")
    }

    fn send(&mut self, tag: usize, made: Made, flags: u8, quality: u8) {
        let (received, wall) = (Moment(self.now as u64), SourceTime(self.now + self.host_offset));
        let is_timed = flags & abi::BUSBAR_SAMPLE_TIME_UNUSABLE == 0;
        let raw = PublishedSample {
            tag: tag as u32,
            kind: abi::BUSBAR_VALUE_KIND_I64,
            quality,
            reason: abi::BUSBAR_REASON_NONE,
            flags,
            bits: made.value as u64,
            source_time_unix_nanos: if is_timed { made.stamp } else { abi::BUSBAR_NO_TIME },
            text: None,
        };
        let Self { intake, table, .. } = self;
        intake.follow_clock(wall, received);
        let mut is_taken = false;
        intake.take(&raw, received, wall, &mut |sample: &Sample| {
            is_taken = table.apply(sample, |_| {});
        });
        // A stamp ahead by more than the host forgives, of a value so old that the stamp has
        // come by now, looks like a fresh one.
        let error = made.stamp.saturating_sub(made.at).saturating_sub(self.host_offset);
        let age = self.now - made.at;
        let is_shown = self.state(tag).value == Some(Value::I64(made.value));
        let of = &mut self.tags[tag];
        let (last_stamp, was_untellable) = of.last_stamp;
        let is_untellable = match made.stamp {
            abi::BUSBAR_NO_TIME => false,
            stamp if stamp == last_stamp => was_untellable,
            _ => error > MAX_CLOCK_AHEAD && age >= error - MAX_CLOCK_AHEAD,
        };
        if is_taken && is_shown {
            of.is_untellable = is_untellable;
        }
        if is_timed && flags & abi::BUSBAR_SAMPLE_BUFFERED == 0 {
            of.last_stamp = (made.stamp, is_untellable);
        }
        if is_taken {
            of.is_bad = quality != GOOD;
        }
    }

    fn make(&mut self, tag: usize) -> Made {
        let at = self.now - self.dice.below(MAX_DELAY);
        let of = &mut self.tags[tag];
        // The present value may have begun within the way.
        let at = at.max(of.ended.last().copied().unwrap_or(START));
        let made = Made { value: of.value, stamp: at + self.source_offset, at };
        of.made.push(made);
        made
    }

    fn step(&mut self) {
        let longest = match self.dice.below(100) {
            0 => 7200,
            1..3 => 90,
            _ => 1,
        };
        self.now += self.dice.below(longest * SECOND);
        let tag = self.dice.below(TAGS as i64) as usize;
        // The last tags say little that is new.
        let is_quiet = tag >= QUIET_FROM && self.dice.below(10) > 0;
        match self.dice.below(100) {
            25..70 if is_quiet => {}
            0..25 => {
                let (now, of) = (self.now, &mut self.tags[tag]);
                of.ended.push(now);
                of.value += 1;
            }
            25..70 => {
                let made = self.make(tag);
                self.send(tag, made, 0, GOOD);
            }
            // The device says the same again.
            70..76 => {
                if let Some(made) = self.tags[tag].made.last().copied() {
                    self.send(tag, made, 0, GOOD);
                }
            }
            // Out of a buffer, which holds what was made lately.
            76..84 => {
                let count = self.tags[tag].made.len() as i64;
                if count > 0 {
                    let back = self.dice.below(count.min(20));
                    let made = self.tags[tag].made[(count - 1 - back) as usize];
                    self.send(tag, made, abi::BUSBAR_SAMPLE_BUFFERED, GOOD);
                }
            }
            84..88 => {
                let made = self.make(tag);
                self.send(tag, Made { stamp: abi::BUSBAR_NO_TIME, ..made }, 0, GOOD);
            }
            88..91 => {
                if let Some(made) = self.tags[tag].made.first().copied() {
                    self.send(tag, made, abi::BUSBAR_SAMPLE_TIME_UNUSABLE, GOOD);
                    let quality = self.state(tag).quality;
                    assert!(!quality.is_good(), "a promised time that cannot be read");
                }
            }
            91..96 => {
                let qualities = [abi::BUSBAR_QUALITY_BAD, abi::BUSBAR_QUALITY_UNCERTAIN];
                let quality = self.dice.pick(&qualities);
                let flags = self.dice.pick(&[0, abi::BUSBAR_SAMPLE_BUFFERED]);
                let made = self.make(tag);
                let older = self.dice.below(100 * SECOND);
                self.send(tag, Made { stamp: made.stamp - older, ..made }, flags, quality);
                let quality = self.state(tag).quality;
                assert!(!quality.is_good(), "bad quality is never dropped as old");
            }
            96..98 => {
                self.source_offset += self.dice.clock_step();
                self.is_skewed = true;
            }
            98 => {
                self.host_offset += self.dice.clock_step();
                self.is_skewed = true;
            }
            _ => (self.source_offset, self.host_offset) = (0, 0),
        }
    }

    /// Checks that no value that is wrong or old is good.
    fn judge(&mut self, story: &str) {
        let now = Moment(self.now as u64);
        self.intake.follow_clock(SourceTime(self.now + self.host_offset), now);
        self.table.advance(now, |_| {});
        for tag in 0..TAGS {
            let state = self.state(tag);
            let (true, Some(Value::I64(value))) = (state.quality.is_good(), state.value) else {
                continue;
            };
            let of = &self.tags[tag];
            assert!(!of.is_bad, "{story}: t{tag} is good and its source said that it is not");
            if of.is_untellable {
                self.untellable += 1;
                continue;
            }
            let wrong_for = of.ended.get(value as usize).map_or(0, |ended| self.now - ended);
            let slack = if self.is_skewed { MAX_CLOCK_AHEAD } else { 0 } + MAX_DELAY;
            assert!(
                wrong_for <= limit(tag) + slack,
                "{story}: t{tag} shows {value} as good, which has been wrong for {} s",
                wrong_for / SECOND
            );
        }
    }

    /// Checks that with clocks that agree every tag is good and right after some samples.
    fn settle(&mut self, story: &str) {
        (self.source_offset, self.host_offset) = (0, 0);
        self.now += 7300 * SECOND;
        for _ in 0..3 {
            for tag in 0..TAGS {
                self.now += 100 * MILLISECOND;
                let made = self.make(tag);
                self.send(tag, made, 0, GOOD);
                self.judge(story);
            }
        }
        for tag in 0..TAGS {
            let state = self.state(tag);
            let right = Some(Value::I64(self.tags[tag].value));
            assert_eq!((state.quality, state.value), (Quality::Good, right), "{story}: t{tag}");
        }
    }
}

#[test]
fn no_wrong_or_old_value_is_good_whatever_the_clocks_do() {
    let steps = std::env::var("BUSBAR_CLOCK_STEPS").ok().and_then(|steps| steps.parse().ok());
    let steps: u64 = steps.unwrap_or(DEFAULT_STEPS);
    let mut untellable = 0;
    for seed in 0..steps.div_ceil(STEPS_AN_EPISODE) {
        let mut world = World::new(seed);
        for step in 0..STEPS_AN_EPISODE {
            world.step();
            world.judge(&format!("seed {seed}, step {step}"));
        }
        world.settle(&format!("seed {seed}, at the end"));
        untellable += world.untellable;
    }
    // Values whose stamps no clock can tell from right ones are few, and are not judged.
    let share = untellable as f64 / (steps * TAGS as u64) as f64;
    assert!(share < 0.05, "{share}");
}
