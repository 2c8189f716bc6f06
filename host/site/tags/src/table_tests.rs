use std::time::Duration;

use busbar_types::{DoublePoint, Quality, Reason, Text, Value, ValueKind};
use proptest::prelude::*;

use super::*;
use crate::{Scale, TagSpec};

const TAG: TagHandle = TagHandle(0);
const START: Moment = Moment(1 << 40);

fn seconds(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

fn at(after: f64) -> Moment {
    START.after(seconds(after))
}

fn spec() -> TagSpec {
    TagSpec {
        id: "T1.TopOil".into(),
        name: "Top oil".into(),
        kind: ValueKind::F64,
        unit: "°C".into(),
        range: Some(-40.0..=150.0),
        freshness: seconds(3.0),
        scale: None,
        dead_band: 0.0,
        expression: None,
    }
}

fn table() -> TagTable {
    table_of(vec![spec()])
}

fn table_of(specs: Vec<TagSpec>) -> TagTable {
    TagTable::new(Arc::new(TagSet::new(specs).unwrap()), START)
}

fn sample(value: f64, received: Moment) -> Sample {
    Sample::live(TAG, Some(Value::F64(value)), Quality::Good, received)
}

fn put(table: &mut TagTable, sample: Sample) -> Vec<Change> {
    let mut changes = Vec::new();
    table.apply(&sample, |change| changes.push(change.clone()));
    changes
}

fn state_at(table: &mut TagTable, now: Moment) -> TagState {
    table.advance(now, |_| {});
    table.snapshot().state(TAG).unwrap()
}

fn quality_at(table: &mut TagTable, now: Moment) -> Quality {
    state_at(table, now).quality
}

#[test]
fn a_tag_without_a_value_is_not_connected() {
    assert_eq!(quality_at(&mut table(), START), Quality::Bad(Reason::NotConnected));
}

#[test]
fn a_value_past_its_limit_is_stale_whatever_its_source_says() {
    let mut table = table();
    put(&mut table, sample(60.0, START));
    assert_eq!(quality_at(&mut table, at(3.0)), Quality::Good);
    let state = state_at(&mut table, at(3.001));
    assert_eq!(state.quality, Quality::Bad(Reason::Stale));
    assert_eq!(state.value, Some(Value::F64(60.0)), "the last value stays, marked");
    assert_eq!(state.age, Some(Duration::from_millis(3001)));
    assert_eq!(table.snapshot().changed(), [TAG], "becoming stale is a change");
}

#[test]
fn a_quality_without_a_value_does_not_make_the_value_fresh() {
    let mut table = table();
    put(&mut table, sample(60.0, START));
    let bad = Quality::Bad(Reason::Communication);
    put(&mut table, Sample { value: None, quality: bad, ..sample(0.0, at(2.0)) });
    assert_eq!(quality_at(&mut table, at(2.0)), bad);
    put(&mut table, Sample { value: None, ..sample(0.0, at(2.0)) });
    assert_eq!(quality_at(&mut table, at(4.0)), Quality::Bad(Reason::Stale));
}

#[test]
fn a_good_quality_without_a_value_does_not_launder_a_bad_value() {
    for value in [Value::F64(f64::NAN), Value::F64(151.0), Value::Bool(true)] {
        let mut table = table();
        put(&mut table, Sample { value: Some(value.clone()), ..sample(0.0, START) });
        let before = quality_at(&mut table, START);
        assert!(!before.is_good());
        put(&mut table, Sample { value: None, ..sample(0.0, START) });
        assert_eq!(quality_at(&mut table, START), before, "{value:?}");
    }
}

#[test]
fn a_good_quality_without_a_value_does_not_launder_a_text_that_is_not_whole() {
    let spec = TagSpec { kind: ValueKind::Text, range: None, ..spec() };
    for (text, is_whole) in [("AUTO", true), ("AUTO\0", false), (&"x".repeat(300), false)] {
        let mut table = table_of(vec![spec.clone()]);
        let text = Value::Text(Text::cut(text));
        put(&mut table, Sample { value: Some(text.clone()), ..sample(0.0, START) });
        put(&mut table, Sample { value: None, ..sample(0.0, START) });
        let partial = Quality::Uncertain(Reason::Configuration);
        let state = state_at(&mut table, START);
        assert_eq!(state.quality, if is_whole { Quality::Good } else { partial });
        assert_eq!(state.value, Some(text));
    }
}

#[test]
fn texts_change_are_confirmed_and_go_stale_as_other_values_do() {
    let spec = TagSpec { kind: ValueKind::Text, range: None, ..spec() };
    let mut table = table_of(vec![spec.clone()]);
    let text = |text: &str| Some(Value::Text(Text::cut(text)));
    let said = |value, at| Sample { value, ..sample(0.0, at) };
    let changes = put(&mut table, said(text("AUTO"), START));
    assert_eq!(changes[0].value, text("AUTO"));
    assert_eq!(put(&mut table, said(text("AUTO"), at(1.0))), [], "the same again is no change");
    assert_eq!(put(&mut table, said(text("MANUAL"), at(1.5)))[0].value, text("MANUAL"));
    assert_eq!(put(&mut table, said(text("AUTO"), at(2.0)))[0].value, text("AUTO"));
    let wrong = put(&mut table, said(Some(Value::F64(1.0)), at(2.0)));
    assert_eq!(wrong[0].quality, Quality::Bad(Reason::Configuration));
    assert_eq!(put(&mut table, said(text("AUTO"), at(2.0)))[0].value, text("AUTO"));
    // The tag keeps its text where another table takes over.
    let mut next = table_of(vec![spec]);
    next.inherit(&table, &HandleRemap::between_tag_sets(table.tags(), next.tags()));
    assert_eq!(state_at(&mut next, at(2.0)).value, text("AUTO"));
    let late = at(1000.0);
    let stale = state_at(&mut table, late);
    assert_eq!((stale.value, stale.quality), (text("AUTO"), Quality::Bad(Reason::Stale)));
}

#[test]
fn a_doubt_of_the_host_stays_until_the_next_value_that_counts() {
    let doubt = Quality::Uncertain(Reason::SourceTime);
    let said = |quality| Sample { value: None, quality, ..sample(0.0, at(1.0)) };
    let sensor = Quality::Bad(Reason::Sensor);
    let old = || Sample { is_buffered: true, ..timed(61.0, 90, at(1.0)) };
    let mut table = table();
    put(&mut table, timed(60.0, 100, START).with_doubt(doubt));
    for (step, quality) in [
        (said(Quality::Good), doubt),
        (said(sensor), sensor),
        (said(Quality::Good), doubt),
        (old(), doubt),
        (said(Quality::Good), doubt),
        (timed(62.0, 101, at(1.0)), Quality::Good),
        // Of a value that does not count, the doubt does not stay.
        (old().with_doubt(doubt), doubt),
        (said(Quality::Good), Quality::Good),
        // Without a value it concerns the last one.
        (said(Quality::Good).with_doubt(doubt), doubt),
        (said(Quality::Good), doubt),
        (timed(62.0, 102, at(1.0)), Quality::Good),
    ] {
        table.apply(&step, |_| {});
        assert_eq!(quality_at(&mut table, at(1.0)), quality, "{step:?}");
    }
}

#[test]
fn a_doubt_of_the_host_goes_on_in_the_next_table() {
    let doubt = Quality::Uncertain(Reason::SourceTime);
    let mut before = table();
    put(&mut before, sample(60.0, START).with_doubt(doubt));
    let mut after = TagTable::new(before.tags().clone(), START);
    let numbers = HandleRemap::between_tag_sets(before.tags(), after.tags());
    after.inherit(&before, &numbers);
    put(&mut after, Sample { value: None, ..sample(0.0, at(1.0)) });
    assert_eq!(quality_at(&mut after, at(1.0)), doubt);
    put(&mut after, sample(60.0, at(1.0)));
    assert_eq!(quality_at(&mut after, at(1.0)), Quality::Good, "the same value anew");
}

#[test]
fn a_value_that_was_old_when_it_came_is_stale_at_once() {
    let mut table = table();
    put(&mut table, Sample { valid_from: START.before(seconds(4.0)), ..sample(60.0, START) });
    assert_eq!(quality_at(&mut table, START), Quality::Bad(Reason::Stale));
}

#[test]
fn a_deadline_may_come_nearer() {
    let mut table = table();
    put(&mut table, sample(60.0, at(10.0)));
    assert_eq!(quality_at(&mut table, at(10.0)), Quality::Good);
    put(&mut table, Sample { valid_from: at(7.5), ..sample(61.0, at(10.0)) });
    table.advance(at(10.4), |_| {});
    assert_eq!(table.snapshot().counts().good, 1);
    table.advance(at(10.6), |_| {});
    assert_eq!(table.snapshot().counts(), QualityCounts { bad: 1, ..QualityCounts::default() });
}

#[test]
fn a_bad_quality_is_taken_whatever_its_source_time() {
    let mut table = table();
    put(&mut table, Sample { source_time: Some(SourceTime(100)), ..sample(1.0, START) });
    let quality = Quality::Bad(Reason::Communication);
    let source_time = Some(SourceTime(0));
    put(&mut table, Sample { value: None, quality, source_time, ..sample(0.0, START) });
    assert_eq!(quality_at(&mut table, START), quality);
}

/// A good value of a source whose clock shows so many seconds.
fn timed(value: f64, source_seconds: i64, received: Moment) -> Sample {
    let source_time = Some(SourceTime(source_seconds * 1_000_000_000));
    Sample { source_time, ..sample(value, received) }
}

#[test]
fn values_of_a_connection_count_in_order_of_arrival() {
    let bad = Quality::Bad(Reason::Sensor);
    let mut table = table();
    put(&mut table, timed(1.0, 100, START));
    let set_back = timed(2.0, 98, at(0.3));
    assert_eq!(put(&mut table, set_back).len(), 1, "the source's clock was set back");
    assert_eq!(state_at(&mut table, at(0.3)).value, Some(Value::F64(2.0)));
    put(&mut table, Sample { quality: bad, ..timed(2.0, 97, at(0.6)) });
    assert_eq!(quality_at(&mut table, at(0.6)), bad, "so does bad quality");
    put(&mut table, timed(2.0, 96, at(0.7)));
    assert_eq!(quality_at(&mut table, at(0.7)), Quality::Good);
}

#[test]
fn source_time_orders_what_comes_out_of_a_buffer() {
    let buffered = |value, source_seconds, received| Sample {
        is_buffered: true,
        ..timed(value, source_seconds, received)
    };
    let mut table = table();
    put(&mut table, timed(1.0, 100, START));
    let older = buffered(2.0, 99, START);
    assert!(!table.apply(&older, |_| panic!("it changes nothing")));
    assert_eq!(state_at(&mut table, START).value, Some(Value::F64(1.0)));
    assert_eq!(put(&mut table, buffered(3.0, 101, START)).len(), 1);
    let repeated = buffered(3.0, 101, at(1.0));
    assert_eq!(put(&mut table, repeated), [], "the same again is no change");
    for doubt in [Quality::Bad(Reason::Sensor), Quality::Uncertain(Reason::Sensor)] {
        put(&mut table, timed(1.0, 200, at(1.0)));
        put(&mut table, Sample { quality: doubt, ..buffered(9.0, 50, at(1.0)) });
        let state = state_at(&mut table, at(1.0));
        assert_eq!((state.value, state.quality), (Some(Value::F64(1.0)), doubt));
    }
    put(&mut table, sample(4.0, at(2.0)));
    let older = Sample { valid_from: at(1.5), ..buffered(5.0, 300, at(2.0)) };
    assert!(!table.apply(&older, |_| {}), "than a live value without a time of its own");
}

#[test]
fn what_was_before_a_pause_is_stale_until_it_comes_anew() {
    let hour = TagSpec { freshness: seconds(3600.0), ..spec() };
    let doubled = TagSpec {
        id: "doubled".into(),
        expression: Some("{T1.TopOil} * 2".into()),
        range: None,
        ..hour.clone()
    };
    let mut table = table_of(vec![hour, doubled]);
    put(&mut table, sample(60.0, START));
    table.advance(at(1.0), |_| {});
    assert_eq!(table.snapshot().counts().good, 2);
    let mut changed = 0;
    let suspended = Pause {
        from: at(1.0),
        until: at(9.0),
        duration: seconds(8.0),
        evidence: PauseEvidence::Suspended,
    };
    table.mark_stale_before(&suspended, |change| {
        assert_eq!(change.quality, Quality::Bad(Reason::Stale));
        changed += 1;
    });
    table.advance(at(9.0), |_| {});
    assert_eq!((changed, table.snapshot().counts().bad), (1, 2), "derived ones follow");
    put(&mut table, Sample { valid_from: at(8.9), ..sample(61.0, at(9.1)) });
    assert_eq!(quality_at(&mut table, at(9.1)), Quality::Bad(Reason::Stale), "true before it");
    put(&mut table, sample(61.0, at(9.2)));
    assert_eq!(quality_at(&mut table, at(9.2)), Quality::Good);
    assert_eq!(table.snapshot().counts().good, 2);
}

#[test]
fn what_a_queue_holds_outlives_a_stop_and_no_sleep() {
    let hour = |id: &str| TagSpec { id: id.into(), freshness: seconds(3600.0), ..spec() };
    let mut table = table_of(vec![hour("device"), hour("program")]);
    table.keep_current_across_stops([TagHandle(1)]);
    for tag in [0, 1] {
        put(&mut table, Sample { tag: TagHandle(tag), ..sample(60.0, START) });
    }
    let pause =
        |evidence| Pause { from: at(1.0), until: at(9.0), duration: seconds(8.0), evidence };
    table.mark_stale_before(&pause(PauseEvidence::Stopped), |_| {});
    table.advance(at(9.0), |_| {});
    let quality = |table: &TagTable, tag| table.snapshot().state(TagHandle(tag)).unwrap().quality;
    assert_eq!(quality(&table, 0), Quality::Bad(Reason::Stale));
    assert_eq!(quality(&table, 1), Quality::Good);
    let late = Sample { tag: TagHandle(1), valid_from: at(0.5), ..sample(61.0, at(9.0)) };
    put(&mut table, late);
    assert_eq!(quality(&table, 1), Quality::Good, "it waited in the queue");
    table.mark_stale_before(&pause(PauseEvidence::Suspended), |_| {});
    assert_eq!(quality(&table, 1), Quality::Bad(Reason::Stale));
}

#[test]
fn the_origin_of_a_value_goes_with_it_and_into_what_rests_on_it() {
    let derived = |id: &str| TagSpec {
        id: id.into(),
        expression: Some("{a} + {b}".into()),
        range: None,
        ..spec()
    };
    let named = |id: &str| TagSpec { id: id.into(), ..spec() };
    let mut table = table_of(vec![named("a"), named("b"), derived("sum")]);
    let of = |tag: u32, origin, received| Sample {
        tag: TagHandle(tag),
        origin,
        ..sample(1.0, received)
    };
    put(&mut table, of(0, Origin::LIVE, START));
    put(&mut table, of(1, Origin::LIVE, START));
    table.advance(START, |_| {});
    let origin = |table: &TagTable, tag| table.snapshot().state(TagHandle(tag)).unwrap().origin;
    assert!([0, 1, 2].iter().all(|&tag| origin(&table, tag).is_live()));
    assert_eq!(put(&mut table, of(1, Origin::TEST, at(0.5))).len(), 1, "a change, though alike");
    table.advance(at(0.5), |_| {});
    assert_eq!(
        [0, 1, 2].map(|tag| origin(&table, tag)),
        [Origin::LIVE, Origin::TEST, Origin::TEST]
    );
    put(&mut table, of(1, Origin::LIVE, at(1.0)));
    table.advance(at(1.0), |_| {});
    assert!(origin(&table, 2).is_live());
}

#[test]
fn the_host_judges_values_itself() {
    let check = |value: Value, expected| {
        let mut table = table();
        put(&mut table, Sample { value: Some(value.clone()), ..sample(0.0, START) });
        assert_eq!(quality_at(&mut table, START), expected, "{value:?}");
    };
    check(Value::F64(150.0), Quality::Good);
    check(Value::F64(150.1), Quality::Uncertain(Reason::OutOfRange));
    check(Value::F64(f64::NAN), Quality::Bad(Reason::NotFinite));
    check(Value::F64(f64::INFINITY), Quality::Bad(Reason::NotFinite));
    check(Value::DoublePoint(DoublePoint::On), Quality::Bad(Reason::Configuration));
    let spec = TagSpec { kind: ValueKind::DoublePoint, range: None, ..spec() };
    let mut table = table_of(vec![spec]);
    let faulty = Some(Value::DoublePoint(DoublePoint::BadState));
    put(&mut table, Sample { value: faulty.clone(), ..sample(0.0, START) });
    let state = state_at(&mut table, START);
    assert_eq!(state.quality, Quality::Uncertain(Reason::Sensor));
    assert_eq!(state.report_quality, Quality::Good, "that contacts contradict is sure");
    let doubtful = Quality::Uncertain(Reason::OutOfRange);
    put(&mut table, Sample { value: faulty, quality: doubtful, ..sample(0.0, START) });
    assert_eq!(state_at(&mut table, START).report_quality, doubtful);
}

#[test]
fn samples_of_unknown_tags_are_counted_and_harmless() {
    let unknown = Sample { tag: TagHandle(7), ..sample(1.0, START) };
    assert!(!table().apply(&unknown, |_| {}));
}

#[test]
fn numbers_are_scaled_before_they_are_judged() {
    let scale = Some(Scale { factor: 0.1, offset: -50.0 });
    let mut table = table_of(vec![TagSpec { scale, ..spec() }]);
    put(&mut table, sample(1200.0, START));
    let state = state_at(&mut table, START);
    assert_eq!((state.value, state.quality), (Some(Value::F64(70.0)), Quality::Good));
    put(&mut table, sample(2100.0, START));
    assert_eq!(quality_at(&mut table, START), Quality::Uncertain(Reason::OutOfRange));
}

#[test]
fn a_dead_band_hides_small_changes_and_keeps_the_value_fresh() {
    let mut table = table_of(vec![TagSpec { dead_band: 0.5, ..spec() }]);
    put(&mut table, sample(60.0, START));
    assert_eq!(put(&mut table, sample(60.4, at(2.0))), []);
    let state = state_at(&mut table, at(4.0));
    assert_eq!((state.value, state.quality), (Some(Value::F64(60.0)), Quality::Good));
    assert_eq!(put(&mut table, sample(60.5, at(4.0)))[0].value, Some(Value::F64(60.5)));
    put(&mut table, sample(f64::NAN, at(5.0)));
    assert_eq!(quality_at(&mut table, at(5.0)), Quality::Bad(Reason::NotFinite));
    put(&mut table, sample(60.4, at(5.0)));
    assert_eq!(state_at(&mut table, at(5.0)).value, Some(Value::F64(60.4)));
}

fn derived_table() -> TagTable {
    let tag = |id: &str, kind, expression: Option<&str>| TagSpec {
        id: id.into(),
        kind,
        range: None,
        expression: expression.map(Into::into),
        ..spec()
    };
    let specs = vec![
        tag("a", ValueKind::F64, None),
        tag("alarm", ValueKind::Bool, Some("{sum} > 10")),
        tag("b", ValueKind::F64, None),
        tag("sum", ValueKind::F64, Some("{a} + {b}")),
    ];
    table_of(specs)
}

#[test]
fn derived_tags_follow_what_they_rest_on() {
    let mut table = derived_table();
    let state = |table: &TagTable, tag| table.snapshot().state(TagHandle(tag)).unwrap();
    put(&mut table, sample(4.0, START));
    table.advance(START, |_| {});
    assert_eq!(state(&table, 3).quality, Quality::Bad(Reason::NotConnected));
    put(&mut table, Sample { tag: TagHandle(2), ..sample(7.0, at(1.0)) });
    let mut changes = Vec::new();
    table.advance(at(1.0), |change| changes.push(change.tag.0));
    assert_eq!(changes, [3, 1], "the sum before what rests on it");
    assert_eq!(state(&table, 3).value, Some(Value::F64(11.0)));
    assert_eq!(state(&table, 3).age, Some(seconds(1.0)), "as old as the older of the two");
    assert_eq!(state(&table, 1).value, Some(Value::Bool(true)));
    assert_eq!(state(&table, 1).quality, Quality::Good);

    // The same values again: nothing changes but the age.
    put(&mut table, sample(4.0, at(2.0)));
    table.advance(at(2.0), |_| panic!("nothing changes"));
    assert_eq!(state(&table, 1).age, Some(seconds(1.0)));

    // One of the two goes stale: so does what rests on it.
    put(&mut table, sample(4.0, at(4.0)));
    table.advance(at(4.5), |_| {});
    assert_eq!(state(&table, 0).quality, Quality::Good);
    assert_eq!(state(&table, 1).quality, Quality::Bad(Reason::Stale));
    assert_eq!(table.snapshot().counts(), QualityCounts { good: 1, uncertain: 0, bad: 3 });

    let meddling = Sample { tag: TagHandle(3), ..sample(0.0, at(5.0)) };
    assert!(!table.apply(&meddling, |_| {}), "no sample sets a derived tag");
}

#[test]
fn derived_tags_that_cannot_be_are_named() {
    let tag = |id: &str, expression: &str| TagSpec {
        id: id.into(),
        expression: Some(expression.into()),
        ..spec()
    };
    let faults = |specs: Vec<TagSpec>| -> Vec<String> {
        let faults = TagSet::new(specs).unwrap_err();
        faults.iter().map(ToString::to_string).collect()
    };
    let circle =
        faults(vec![tag("a", "{b}"), tag("b", "{c} + {b0}"), tag("c", "{a}"), spec_of("b0")]);
    assert_eq!(circle.len(), 3, "{circle:?}");
    assert!(circle[0].contains("rests on itself"));
    assert!(faults(vec![tag("a", "{x}")])[0].contains("names 'x'"));
    assert!(faults(vec![tag("a", "1 +")])[0].contains("cannot be read"));
}

fn spec_of(id: &str) -> TagSpec {
    TagSpec { id: id.into(), ..spec() }
}

/// Operation on a table in a random sequence.
#[derive(Clone, Debug)]
enum Step {
    Put {
        tag: u32,
        value: Option<u8>,
        bad: bool,
        doubted: bool,
        lag_millis: u64,
        source_time: Option<i64>,
        is_buffered: bool,
    },
    Advance {
        millis: u64,
    },
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let put = (
        0..6_u32,
        prop::option::of(0..3_u8),
        any::<bool>(),
        0..3000_u64,
        prop::option::of(0..9_i64),
        [any::<bool>(), any::<bool>()],
    );
    let put = put.prop_map(|(tag, value, bad, lag_millis, source_time, flags)| Step::Put {
        tag,
        value,
        bad,
        doubted: flags[1],
        lag_millis,
        source_time,
        is_buffered: flags[0],
    });
    let advance = prop_oneof![0..40_u64, 0..4000_u64, 0..200_000_u64];
    let step = prop_oneof![3 => put, 2 => advance.prop_map(|millis| Step::Advance { millis })];
    prop::collection::vec(step, 0..120)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// Counts, changes and states are what looking at every tag anew would give.
    #[test]
    fn advancing_finds_what_looking_at_all_would(steps in steps()) {
        let freshness = [100.0, 1.0, 3.0, 70.0, 600.0, 0.01];
        let specs = freshness.map(|limit| TagSpec { freshness: seconds(limit), ..spec() });
        let mut table = table_of(specs.to_vec());
        let mut now = START;
        let mut shown: Vec<_> =
            table.snapshot().states().map(|state| (state.value.clone(), state.quality)).collect();
        for step in steps {
            match step {
                Step::Put { tag, value, bad, doubted, lag_millis, source_time, is_buffered } => {
                    let reason = Quality::Bad(Reason::Sensor);
                    let doubt = Quality::Uncertain(Reason::SourceTime);
                    table.apply(&Sample {
                        tag: TagHandle(tag),
                        value: value.map(|value| Value::F64(f64::from(value))),
                        quality: if bad { reason } else { Quality::Good },
                        doubt: if doubted { doubt } else { Quality::Good },
                        source_time: source_time.map(SourceTime),
                        received: now,
                        valid_from: now.before(Duration::from_millis(lag_millis)),
                        origin: Origin::LIVE,
                        is_buffered,
                    }, |_| {});
                }
                Step::Advance { millis } => {
                    now = now.after(Duration::from_millis(millis));
                    table.advance(now, |_| {});
                    let states: Vec<_> = table.snapshot().states().collect();
                    let mut counts = QualityCounts::default();
                    for (tag, state) in states.iter().enumerate() {
                        *counts.count_mut(state.quality.level().code()) += 1;
                        if let Some(age) = state.age {
                            prop_assert!(age <= seconds(freshness[tag]) || !state.quality.is_good());
                        }
                        let is_changed = table.snapshot().changed().contains(&TagHandle(tag as u32));
                        let differs = shown[tag] != (state.value.clone(), state.quality);
                        prop_assert!(is_changed || !differs, "tag {} changed unseen", tag);
                    }
                    prop_assert_eq!(table.snapshot().counts(), counts);
                    shown = states.iter().map(|state| (state.value.clone(), state.quality)).collect();
                }
            }
        }
    }
}

/// A small generator of numbers (G. Marsaglia, "Xorshift RNGs", 2003).
struct Dice(u64);

impl Dice {
    fn below(&mut self, sides: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % sides
    }
}

/// Reference state of a tag, kept by an observer.
#[derive(Clone, Copy, Default)]
struct ObservedTag {
    source_time: Option<i64>,
    valid_from: Option<Moment>,
    is_bad: bool,
}

/// A year in steps of a minute on average: links go and come back, the wall clock is set
/// forwards and backwards, the machine sleeps, the scene is loaded anew.
#[test]
fn a_year_of_losses_clock_jumps_and_reloads_leaves_no_drift() {
    const TAGS: u64 = 24;
    const DAY: u64 = 86_400;
    let mut dice = Dice(0x2026_1122);
    let limits = |tag: u64| [0.5, 3.0, 60.0, 100.0, 3600.0, 86_400.0][tag as usize % 6];
    let specs = || (0..TAGS).map(|tag| TagSpec { freshness: seconds(limits(tag)), ..spec() });
    let mut table = table_of(specs().collect());
    let mut noted = vec![ObservedTag { is_bad: true, ..ObservedTag::default() }; TAGS as usize];
    let (mut now, mut wall, mut is_up) = (START, 1_790_000_000_i64, true);
    let mut accepted = 0_u64;
    while now < START.after(seconds(365.0 * DAY as f64)) {
        let step = Duration::from_millis(dice.below(120_000));
        now = now.after(step);
        wall += step.as_secs() as i64;
        match dice.below(20_000) {
            0 => wall += 3600,
            1 => wall -= 3600,
            // It slept: nothing came meanwhile.
            2 => {
                now = now.after(seconds(8.0 * 3600.0));
                wall += 8 * 3600;
            }
            3 => {
                table = table_of(specs().collect());
                noted.fill(ObservedTag { is_bad: true, ..ObservedTag::default() });
            }
            4..400 => {
                is_up = !is_up;
                if !is_up {
                    let quality = Quality::Bad(Reason::Communication);
                    let lost = |tag| Sample {
                        tag: TagHandle(tag as u32),
                        value: None,
                        quality,
                        ..sample(0.0, now)
                    };
                    (0..TAGS).map(lost).for_each(|sample| assert!(table.apply(&sample, |_| {})));
                    noted.iter_mut().for_each(|tag| tag.is_bad = true);
                }
            }
            _ => {}
        }
        for _ in 0..if is_up { 1 + dice.below(4) } else { 0 } {
            let tag = dice.below(TAGS);
            let source_time = (dice.below(2) == 0).then_some(wall - dice.below(3) as i64);
            let note = &mut noted[tag as usize];
            let is_buffered = dice.below(2) == 0;
            let update = Sample {
                tag: TagHandle(tag as u32),
                source_time: source_time.map(|time| SourceTime(time * 1_000_000_000)),
                is_buffered,
                ..sample(dice.below(100) as f64, now)
            };
            let is_older = is_buffered
                && source_time.zip(note.source_time).is_some_and(|(new, old)| new < old);
            assert_eq!(table.apply(&update, |_| {}), !is_older);
            if !is_older {
                *note = ObservedTag { source_time, valid_from: Some(now), is_bad: false };
                accepted += 1;
            }
        }
        table.advance(now, |_| {});
        let is_good = |(tag, note): (u64, &ObservedTag)| {
            !note.is_bad
                && note.valid_from.is_some_and(|from| now.since(from) <= seconds(limits(tag)))
        };
        let good = (0..).zip(&noted).filter(|&pair| is_good(pair)).count();
        assert_eq!(table.snapshot().counts().good, good, "at {now:?}");
        assert!(table.wheel.len() <= 2 * TAGS as usize, "the wheel holds {}", table.wheel.len());
    }
    assert!(accepted > 400_000, "{accepted} updates in the year");
    assert!(table.changes.capacity() <= 64 * TAGS as usize);
}

#[test]
fn a_table_goes_on_where_another_was_under_its_own_rules() {
    let other = |id: &str, freshness: f64| TagSpec {
        id: id.into(),
        freshness: seconds(freshness),
        ..spec()
    };
    let derived = TagSpec { expression: Some("{b} * 2".into()), range: None, ..other("d", 3.0) };
    let mut before = table_of(vec![other("a", 3.0), other("b", 3.0), derived.clone()]);
    let of = |tag: u32, value| Sample { tag: TagHandle(tag), ..sample(value, START) };
    put(&mut before, of(0, 20.0));
    put(&mut before, of(1, 60.0));
    before.advance(at(1.0), |_| {});

    // `a` has gone, `b` is judged by a narrower range and stays fresh for longer, `c` is new.
    let narrow = TagSpec { range: Some(0.0..=50.0), ..other("b", 9.0) };
    let scale = Some(Scale { factor: 10.0, offset: 0.0 });
    let narrow = TagSpec { scale, ..narrow };
    let mut after = table_of(vec![narrow, other("c", 3.0), derived]);
    let numbers = HandleRemap::between_tag_sets(before.tags(), after.tags());
    assert_eq!([0, 1, 2].map(|old| numbers.index(old)), [None, Some(0), Some(2)]);
    after.inherit(&before, &numbers);
    let state = |table: &TagTable, tag| table.snapshot().state(TagHandle(tag)).unwrap();
    after.advance(at(2.5), |_| {});
    assert_eq!(state(&after, 0).value, Some(Value::F64(60.0)), "it is not scaled again");
    assert_eq!(state(&after, 0).quality, Quality::Uncertain(Reason::OutOfRange));
    assert_eq!(state(&after, 0).age, Some(seconds(2.5)), "no value grows younger by it");
    assert_eq!(state(&after, 1).quality, Quality::Bad(Reason::NotConnected));
    assert_eq!(state(&after, 2).value, Some(Value::F64(120.0)));
    assert_eq!(after.snapshot().counts().uncertain, 2);
    after.advance(at(9.1), |_| {});
    assert_eq!(state(&after, 0).quality, Quality::Bad(Reason::Stale));
    assert_eq!(after.snapshot().counts().bad, 3);
}
