//! Differential test: the tag of the SDK's test kit ([`ShownTag`]) against the host's own
//! intake and table, on the same seeded stream of samples.

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;
use busbar_plugin_host::{PublishedSample, SampleIntake, SourcePolicy, TelemetryTag};
use busbar_plugin_sdk as sdk;
use busbar_plugin_sdk::testing::{FaultGenerator, ShownTag, tag_spec};
use busbar_tags::{Moment, Sample, SourceTime, TagHandle, TagSet, TagSpec, TagTable};
use busbar_types::ValueKind;

const SECOND: u64 = 1_000_000_000;
/// Nanoseconds since 1970 at which a stream begins, and moments are from there on.
const START: u64 = 1_790_000_000 * SECOND;
const SEEDS: u64 = 400;
const STEPS: usize = 500;
/// Freshness limit of the test kit's tags.
const FRESHNESS: Duration = Duration::from_secs(5);
const KINDS: [ValueKind; 5] =
    [ValueKind::F64, ValueKind::I64, ValueKind::Bool, ValueKind::DoublePoint, ValueKind::Text];

/// A host of one tag.
struct Host {
    intake: SampleIntake,
    table: TagTable,
}

impl Host {
    fn new(kind: ValueKind) -> Self {
        let served = TelemetryTag {
            tag: TagHandle(0),
            kind,
            freshness: FRESHNESS,
            id: "t".into(),
            address_json: String::new(),
            unit: String::new(),
        };
        let spec = TagSpec {
            id: "t".into(),
            name: String::new(),
            kind,
            unit: String::new(),
            range: None,
            freshness: FRESHNESS,
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let set = Arc::new(TagSet::new(vec![spec]).expect("no tag rests on another"));
        Self {
            intake: SampleIntake::new(&[served], SourcePolicy::default()),
            table: TagTable::new(set, Moment(START)),
        }
    }

    fn take(&mut self, raw: &PublishedSample, now: u64) {
        let Self { intake, table, .. } = self;
        let (received, wall) = (Moment(now), SourceTime(now as i64));
        intake.follow_clock(wall, received);
        let mut sink = |sample: &Sample| _ = table.apply(sample, |_| {});
        assert!(intake.take(raw, received, wall, &mut sink));
    }

    /// Value and quality, in words.
    fn shown(&mut self, now: u64) -> (String, String) {
        self.table.advance(Moment(now), |_| {});
        let state = self.table.snapshot().state(TagHandle(0)).expect("it is there");
        (format!("{:?}", state.value), format!("{:?}", state.quality))
    }
}

fn value(random: &mut FaultGenerator, kind: ValueKind) -> sdk::Value {
    use sdk::DoublePoint::{BadState, Intermediate, Off, On};
    match kind {
        ValueKind::F64 => sdk::Value::F64(match random.below(12) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            number => number as f64 * 0.5,
        }),
        ValueKind::I64 => sdk::Value::I64(random.below(9) as i64 - 4),
        ValueKind::Bool => sdk::Value::Bool(random.one_in(2)),
        ValueKind::DoublePoint => {
            sdk::Value::DoublePoint([Off, On, Intermediate, BadState][random.below(4)])
        }
        ValueKind::Text => {
            let words = ["", "AUTO", "MANUAL", "gestört: Ölstand", "cut\0", "long text "];
            let word = words[random.below(words.len())];
            sdk::Value::Text(sdk::Text::cut(&word.repeat(1 + random.below(2) * 60)))
        }
    }
}

fn reason(random: &mut FaultGenerator) -> sdk::Reason {
    use sdk::Reason::{Communication, NotConnected, OutOfRange, Sensor, SourceTime, Unknown};
    [Communication, NotConnected, OutOfRange, Sensor, SourceTime, Unknown][random.below(6)]
}

/// A source time: present, repeated, old, of the future at either side of the limit, or none.
fn source_time(random: &mut FaultGenerator, now: u64, last: i64) -> i64 {
    let seconds = random.below(12) as u64;
    let fraction = random.below(SECOND as usize) as u64;
    match random.below(24) {
        0..=9 => (now - random.below(300_000_000) as u64) as i64,
        10..=12 => last,
        13..=15 => (now - seconds * SECOND - fraction) as i64,
        16 => (now - 3600 * SECOND) as i64,
        17 => (now + (4 + seconds) * SECOND) as i64,
        18 => (now + 10 * SECOND + random.below(2) as u64) as i64,
        19 => (now + 8 * 3600 * SECOND) as i64,
        20 => -(fraction as i64) - 1,
        21 => i64::MAX,
        22 => 0,
        _ => abi::BUSBAR_NO_TIME,
    }
}

/// The sample that both are given, once as the SDK and once as the ABI has it.
fn sample(
    random: &mut FaultGenerator,
    kind: ValueKind,
    time: i64,
) -> (sdk::Sample, PublishedSample) {
    use sdk::SampleFlags;
    let kind = if random.one_in(30) { KINDS[random.below(KINDS.len())] } else { kind };
    let value = (!random.one_in(8)).then(|| value(random, kind));
    let quality = match random.below(8) {
        0 => sdk::Quality::Bad(reason(random)),
        1 => sdk::Quality::Uncertain(reason(random)),
        _ => sdk::Quality::Good,
    };
    let mut flags = SampleFlags::LIVE;
    if random.one_in(4) {
        flags |= SampleFlags::BUFFERED;
    }
    if random.one_in(20) {
        flags |= SampleFlags::TIME_UNUSABLE;
    }
    let source_time = (time != abi::BUSBAR_NO_TIME).then(|| {
        let distance = Duration::from_nanos(time.unsigned_abs());
        if time < 0 { UNIX_EPOCH - distance } else { UNIX_EPOCH + distance }
    });
    let sample = sdk::Sample { tag: 0, value, quality, source_time, flags };
    // Over the C ABI, as a plugin sends it.
    let raw = raw(&sample, time);
    (sample, raw)
}

fn raw(sample: &sdk::Sample, time: i64) -> PublishedSample {
    use sdk::DoublePoint::{BadState, Intermediate, Off, On};
    let (mut text, said) = (None, sample.value.clone());
    let (kind, bits) = match said {
        None => (abi::BUSBAR_VALUE_KIND_NONE, 0),
        Some(sdk::Value::F64(value)) => (abi::BUSBAR_VALUE_KIND_F64, value.to_bits()),
        Some(sdk::Value::I64(value)) => (abi::BUSBAR_VALUE_KIND_I64, value.cast_unsigned()),
        Some(sdk::Value::Bool(value)) => (abi::BUSBAR_VALUE_KIND_BOOL, value.into()),
        Some(sdk::Value::Text(value)) => {
            text = Some(value);
            (abi::BUSBAR_VALUE_KIND_TEXT, 0)
        }
        Some(sdk::Value::DoublePoint(position)) => {
            let bits = match position {
                Intermediate => 0,
                Off => 1,
                On => 2,
                BadState => 3,
            };
            (abi::BUSBAR_VALUE_KIND_DOUBLE_POINT, bits)
        }
    };
    let reason_of = |reason| match reason {
        sdk::Reason::Communication => abi::BUSBAR_REASON_COMMUNICATION,
        sdk::Reason::NotConnected => abi::BUSBAR_REASON_NOT_CONNECTED,
        sdk::Reason::OutOfRange => abi::BUSBAR_REASON_OUT_OF_RANGE,
        sdk::Reason::Sensor => abi::BUSBAR_REASON_SENSOR,
        sdk::Reason::SourceTime => abi::BUSBAR_REASON_SOURCE_TIME,
        _ => abi::BUSBAR_REASON_NONE,
    };
    let (quality, reason) = match sample.quality {
        sdk::Quality::Good => (abi::BUSBAR_QUALITY_GOOD, abi::BUSBAR_REASON_NONE),
        sdk::Quality::Uncertain(reason) => (abi::BUSBAR_QUALITY_UNCERTAIN, reason_of(reason)),
        sdk::Quality::Bad(reason) => (abi::BUSBAR_QUALITY_BAD, reason_of(reason)),
    };
    PublishedSample {
        tag: 0,
        kind,
        quality,
        reason,
        flags: sample.flags.bits(),
        bits,
        source_time_unix_nanos: time,
        text,
    }
}

#[test]
fn a_quality_alone_takes_back_no_doubt_about_a_time() {
    let value = sdk::Sample::good(0, sdk::Value::Bool(true));
    let alone = sdk::Sample { value: None, ..value.clone() };
    let unusable = sdk::Sample { flags: sdk::SampleFlags::TIME_UNUSABLE, ..value.clone() };
    let hour = 3600 * SECOND as i64;
    let now = START as i64;
    let buffered = sdk::Sample { flags: sdk::SampleFlags::BUFFERED, ..value.clone() };
    let own_doubt =
        sdk::Sample { quality: sdk::Quality::Uncertain(sdk::Reason::SourceTime), ..value.clone() };
    for (sample, time) in [
        (unusable, abi::BUSBAR_NO_TIME),
        (value.clone(), now + hour),
        (value.clone(), -5),
        (buffered, now + hour),
        (own_doubt, now),
    ] {
        let mut host = Host::new(ValueKind::Bool);
        host.take(&raw(&sample, time), START);
        let doubted = host.shown(START).1;
        assert_eq!(doubted, "Uncertain(SourceTime)", "{sample:?}");
        for (seconds, time) in [(0, abi::BUSBAR_NO_TIME), (1, now), (2, now + 2 * SECOND as i64)] {
            host.take(&raw(&alone, time), START + seconds * SECOND);
            assert_eq!(host.shown(START + seconds * SECOND).1, doubted, "{sample:?}");
        }
        host.take(&raw(&value, abi::BUSBAR_NO_TIME), START + 3 * SECOND);
        assert_eq!(host.shown(START + 3 * SECOND).1, "Good", "the next value: {sample:?}");
    }
}

#[test]
fn the_test_kit_shows_what_the_host_shows() {
    let (mut good, mut other) = (0, 0);
    for seed in 0..SEEDS {
        let mut random = FaultGenerator::new(seed);
        let kind = KINDS[seed as usize % KINDS.len()];
        let mut shown = ShownTag::new(&tag_spec(0, "t", kind, "t".into()));
        let mut host = Host::new(kind);
        let (mut now, mut last, mut told) = (START, abi::BUSBAR_NO_TIME, Vec::new());
        for step in 0..STEPS {
            now += match random.below(40) {
                0 => 70 * SECOND,
                1..=3 => 6 * SECOND,
                _ => random.below(SECOND as usize) as u64,
            };
            let at: SystemTime = UNIX_EPOCH + Duration::from_nanos(now);
            if !random.one_in(5) {
                let time = source_time(&mut random, now, last);
                let (sample, raw) = sample(&mut random, kind, time);
                (last, _) = (time, told.push((now - START, sample.clone())));
                shown.take(&sample, at);
                host.take(&raw, now);
            }
            let kit = (format!("{:?}", shown.value()), format!("{:?}", shown.quality(at)));
            let own = host.shown(now);
            let story = &told[told.len().saturating_sub(6)..];
            assert_eq!(kit, own, "seed {seed}, step {step}, at {}: {story:#?}", now - START);
            let is_good = kit.1 == "Good";
            (good, other) = (good + u32::from(is_good), other + u32::from(!is_good));
        }
    }
    // Neither is rare.
    assert!(good > other / 8 && other > good / 8, "{good} good, {other} others");
}
