use std::time::Duration;

use busbar_types::{Text, ValueKind};
use proptest::prelude::*;

use super::*;

const SECOND: i64 = 1_000_000_000;
const NOW: i64 = 1_790_000_000 * SECOND;
const RECEIVED: Moment = Moment(1 << 62);
const DOUBT: Quality = Quality::Uncertain(Reason::SourceTime);

fn telemetry_tag() -> TelemetryTag {
    TelemetryTag {
        tag: TagHandle(1),
        kind: ValueKind::F64,
        freshness: Duration::from_secs(1),
        id: String::new(),
        address_json: String::new(),
        unit: String::new(),
    }
}

fn intake(policy: SourcePolicy) -> SampleIntake {
    SampleIntake::new(&[telemetry_tag()], policy)
}

/// A good measurement with a time so many seconds after now.
fn raw(ahead: f64) -> PublishedSample {
    PublishedSample {
        tag: 1,
        kind: abi::BUSBAR_VALUE_KIND_F64,
        quality: abi::BUSBAR_QUALITY_GOOD,
        reason: abi::BUSBAR_REASON_NONE,
        flags: 0,
        bits: 1.5_f64.to_bits(),
        source_time_unix_nanos: NOW + (ahead * 1e9) as i64,
        text: None,
    }
}

fn take(intake: &mut SampleIntake, raw: PublishedSample, after: i64) -> Option<Sample> {
    let mut taken = None;
    let received = Moment(RECEIVED.0 + (after * SECOND) as u64);
    let mut sink = |sample: &Sample| taken = Some(sample.clone());
    let passes = intake.take(&raw, received, SourceTime(NOW + after * SECOND), &mut sink);
    assert_eq!(passes, taken.is_some());
    taken
}

fn age(sample: &Sample) -> f64 {
    sample.received.since(sample.valid_from).as_secs_f64()
}

#[test]
fn a_time_of_the_future_makes_no_value_fresh() {
    let mut intake = intake(SourcePolicy::default());
    for (ahead, quality) in [(9.9, Quality::Good), (10.1, DOUBT), (3600.0, DOUBT), (9e8, DOUBT)] {
        let sample = take(&mut intake, raw(ahead), 0).unwrap();
        assert_eq!(sample.quality, quality, "{ahead} s ahead");
    }
    assert_eq!(intake.clock_report().future_times, 3);
}

#[test]
fn a_clock_that_catches_up_makes_the_same_value_no_better() {
    let mut intake = intake(SourcePolicy::default());
    for after in [0, 3595, 3600, 3605] {
        let sample = take(&mut intake, raw(3600.0), after).unwrap();
        assert_eq!(sample.quality, DOUBT, "after {after} s");
    }
    let next = PublishedSample { source_time_unix_nanos: NOW + 3610 * SECOND, ..raw(0.0) };
    assert_eq!(take(&mut intake, next, 3610).unwrap().quality, Quality::Good, "a time that fits");
}

#[test]
fn an_old_value_gets_no_younger_by_a_clock_that_is_set_back() {
    let mut intake = intake(SourcePolicy::default());
    let at = |intake: &mut SampleIntake, wall_after: i64, after: u64, ahead: f64| {
        let received = RECEIVED.after(Duration::from_secs(after));
        let wall = SourceTime(NOW + wall_after * SECOND);
        intake.follow_clock(wall, received);
        let mut taken = Vec::new();
        intake.take(&raw(ahead), received, wall, &mut |sample: &Sample| taken.push(sample.clone()));
        taken.pop().unwrap()
    };
    assert_eq!(at(&mut intake, 0, 0, -0.1).quality, Quality::Good);
    assert_eq!(at(&mut intake, 0, 1, 0.0).quality, Quality::Good);
    assert_eq!(age(&at(&mut intake, 1800, 1800, 0.0)), 1800.0, "the same again");
    let again = at(&mut intake, 0, 1801, 0.0);
    assert!(age(&again) >= 1800.0 && again.quality == DOUBT, "the host's clock was set back");
    let old = at(&mut intake, 1, 1802, 0.5);
    assert_eq!(old.quality, Quality::Good, "another possible time proves it");
}

#[test]
fn a_first_old_value_is_doubted_once_another_tag_shows_that_the_clocks_differ() {
    let own = |tag| TelemetryTag {
        tag: TagHandle(tag),
        kind: ValueKind::F64,
        freshness: Duration::from_secs(60),
        id: String::new(),
        address_json: String::new(),
        unit: String::new(),
    };
    let mut intake = SampleIntake::new(&[own(0), own(1), own(2)], SourcePolicy::default());
    let of = |intake: &mut SampleIntake, tag, ahead| {
        let mut taken = Vec::new();
        let raw = PublishedSample { tag, ..raw(ahead) };
        let mut sink = |sample: &Sample| taken.push((sample.tag.0, sample.quality));
        intake.take(&raw, RECEIVED, SourceTime(NOW), &mut sink);
        taken
    };
    // An hour old where this machine's clock is an hour slow: of now, as it seems.
    assert_eq!(of(&mut intake, 0, -1.0), [(0, Quality::Good)]);
    let told = of(&mut intake, 1, 3600.0);
    assert_eq!(told, [(0, DOUBT), (1, DOUBT)], "what came before is doubted as well");
    assert_eq!(of(&mut intake, 2, -2.0), [(2, DOUBT)], "and what comes first from then on");
    assert_eq!(of(&mut intake, 2, -1.0), [(2, Quality::Good)], "until its time goes on");
}

#[test]
fn a_stored_value_is_doubted_as_well_once_the_clocks_are_known_to_differ() {
    let own = |tag| TelemetryTag { tag: TagHandle(tag), ..telemetry_tag() };
    let mut intake = SampleIntake::new(&[own(0), own(1), own(2)], SourcePolicy::default());
    let mut told = Vec::new();
    let stored = PublishedSample { flags: abi::BUSBAR_SAMPLE_BUFFERED, tag: 0, ..raw(-1.0) };
    let without = PublishedSample { source_time_unix_nanos: abi::BUSBAR_NO_TIME, ..stored.clone() };
    let without = PublishedSample { tag: 2, ..without };
    for raw in [stored, without, PublishedSample { tag: 1, ..raw(3600.0) }] {
        let mut sink = |sample: &Sample| told.push((sample.tag.0, sample.quality, sample.doubt));
        intake.take(&raw, RECEIVED, SourceTime(NOW), &mut sink);
    }
    let good = Quality::Good;
    // No time was promised of the third tag.
    assert_eq!(told, [(0, good, good), (2, good, good), (0, DOUBT, DOUBT), (1, DOUBT, DOUBT)]);
}

#[test]
fn a_doubt_about_a_time_is_told_apart_from_what_the_source_says() {
    let mut intake = intake(SourcePolicy::default());
    let bad = PublishedSample { quality: abi::BUSBAR_QUALITY_BAD, ..raw(3600.0) };
    let sample = take(&mut intake, bad, 0).unwrap();
    assert_eq!((sample.quality, sample.doubt), (Quality::Bad(Reason::Unknown), DOUBT));
    let own_doubt = PublishedSample {
        quality: abi::BUSBAR_QUALITY_UNCERTAIN,
        reason: abi::BUSBAR_REASON_SOURCE_TIME,
        ..raw(0.0)
    };
    let sample = take(&mut intake, own_doubt.clone(), 0).unwrap();
    assert_eq!((sample.quality, sample.doubt), (DOUBT, DOUBT), "the plugin's own");
    let alone = PublishedSample { kind: abi::BUSBAR_VALUE_KIND_NONE, ..own_doubt.clone() };
    let sample = take(&mut intake, alone, 0).unwrap();
    assert_eq!((sample.quality, sample.doubt), (DOUBT, Quality::Good), "of no value");
}

#[test]
fn a_text_is_a_value_and_no_text_is_none() {
    let said =
        |text| PublishedSample { kind: abi::BUSBAR_VALUE_KIND_TEXT, bits: 0, text, ..raw(0.0) };
    for text in [Text::cut("AUTO"), Text::cut(""), Text::cut(&"x".repeat(300))] {
        let sample = take(&mut intake(SourcePolicy::default()), said(Some(text.clone())), 0);
        assert_eq!(sample.unwrap().value, Some(Value::Text(text)));
    }
    assert_eq!(take(&mut intake(SourcePolicy::default()), said(None), 0), None);
}

#[test]
fn promised_times_that_cannot_be_used_are_doubted_and_counted() {
    let flagged = PublishedSample {
        flags: abi::BUSBAR_SAMPLE_TIME_UNUSABLE,
        source_time_unix_nanos: abi::BUSBAR_NO_TIME,
        ..raw(0.0)
    };
    let negative = PublishedSample { source_time_unix_nanos: -5, ..raw(0.0) };
    let no_time = PublishedSample { source_time_unix_nanos: abi::BUSBAR_NO_TIME, ..raw(0.0) };
    let mut intake = intake(SourcePolicy::default());
    for doubtful in [flagged.clone(), negative] {
        let sample = take(&mut intake, doubtful, 0).unwrap();
        assert_eq!((sample.quality, sample.source_time), (DOUBT, None));
    }
    let bad = PublishedSample { quality: abi::BUSBAR_QUALITY_BAD, ..flagged };
    assert_eq!(take(&mut intake, bad, 0).unwrap().quality, Quality::Bad(Reason::Unknown));
    assert_eq!(take(&mut intake, no_time, 0).unwrap().quality, Quality::Good, "none is promised");
    assert_eq!(intake.clock_report().unusable_times, 3);
}

#[test]
fn a_step_back_is_counted_and_its_values_pass() {
    let mut intake = intake(SourcePolicy::default());
    take(&mut intake, raw(0.0), 0);
    let sample = take(&mut intake, raw(-2.0), 0).unwrap();
    assert_eq!((sample.quality, sample.is_buffered, age(&sample)), (Quality::Good, false, 2.0));
    assert_eq!(intake.clock_report().steps, 1);
}

#[test]
fn buffered_samples_are_marked_and_say_nothing_of_the_clock() {
    let mut intake = intake(SourcePolicy::default());
    take(&mut intake, raw(0.0), 0);
    let stored = PublishedSample { flags: abi::BUSBAR_SAMPLE_BUFFERED, ..raw(-50.0) };
    let sample = take(&mut intake, stored, 0).unwrap();
    assert_eq!((sample.is_buffered, age(&sample)), (true, 50.0));
    assert_eq!(intake.clock_report(), ClockReport::default());
}

#[test]
fn ages_count_from_reception_where_the_configuration_says_so() {
    let policy = SourcePolicy { basis: FreshnessBasis::Reception, ..SourcePolicy::default() };
    let mut intake = intake(policy);
    for ahead in [-3600.0, 0.0, 3600.0] {
        let sample = take(&mut intake, raw(ahead), 0).unwrap();
        assert_eq!((sample.quality, age(&sample)), (Quality::Good, 0.0), "{ahead}");
    }
    let stored = PublishedSample { flags: abi::BUSBAR_SAMPLE_BUFFERED, ..raw(-50.0) };
    assert_eq!(age(&take(&mut intake, stored, 0).unwrap()), 50.0);
}

#[test]
fn origins_of_configuration_plugin_and_sample_add_up() {
    let policy = SourcePolicy { origin: Origin::SIMULATED, ..SourcePolicy::default() };
    let mut intake = intake(policy);
    assert_eq!(take(&mut intake, raw(0.0), 0).unwrap().origin, Origin::SIMULATED);
    let test = PublishedSample { flags: abi::BUSBAR_ORIGIN_TEST, ..raw(0.0) };
    let origin = take(&mut intake, test, 0).unwrap().origin;
    assert_eq!(origin, Origin::SIMULATED | Origin::TEST);
    let unknown = PublishedSample { flags: 1 << 7, ..raw(0.0) };
    assert_eq!(take(&mut intake, unknown, 0), None, "flags of another version");
}

proptest! {
    #[test]
    fn the_short_way_ends_where_the_long_one_does(
        samples in prop::collection::vec(
            (
                0..3_u32,
                prop_oneof![3 => Just(1), 1 => 0..6_u8],
                prop_oneof![3 => Just(0), 1 => 0..4_u8],
                prop_oneof![3 => Just(0), 1 => 0..10_u8],
                prop_oneof![3 => Just(0), 1 => any::<u8>()],
                any::<u64>(),
                prop_oneof![
                    NOW - 9..NOW + 9,
                    NOW + MAX_CLOCK_AHEAD - 9..NOW + MAX_CLOCK_AHEAD + 9,
                    any::<i64>(),
                    Just(abi::BUSBAR_NO_TIME),
                    Just(0),
                ],
            ),
            1..8,
        ),
        received in 0..2_000_000_000_000_u64,
    ) {
        let mut intake = intake(SourcePolicy::default());
        let mut long_way = intake.clone();
        for (tag, kind, quality, reason, flags, bits, source_time_unix_nanos) in samples {
            let text = (bits & 8 == 0).then(|| Text::from_utf8_lossy(&bits.to_le_bytes()));
            let raw = PublishedSample {
                tag, kind, quality, reason, flags, bits, source_time_unix_nanos, text,
            };
            let (received, wall_clock) = (Moment(received), SourceTime(NOW));
            let mut taken = Vec::new();
            let mut sink = |sample: &Sample| taken.push(format!("{sample:?}"));
            let passes = intake.take(&raw, received, wall_clock, &mut sink);
            let mut expected = Vec::new();
            let mut sink = |sample: &Sample| expected.push(format!("{sample:?}"));
            let passes_too = long_way.take_other(&raw, received, wall_clock, &mut sink);
            prop_assert_eq!(passes, passes_too);
            prop_assert_eq!(taken, expected);
            prop_assert_eq!(&intake.tags, &long_way.tags);
            prop_assert_eq!(intake.clock_report(), long_way.clock_report());
        }
    }
}
