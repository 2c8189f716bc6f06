use super::*;
use crate::testing::{FaultGenerator, MessageFault, tag_spec};
use crate::{Quality, Reason, Sample, SampleFlags, ValueKind};

const BOUND: Duration = Duration::from_millis(100);
const SECOND: Duration = Duration::from_secs(1);

fn oracle() -> TruthOracle {
    TruthOracle::new(5, BOUND, &[tag_spec(1, "Oil", ValueKind::I64, "oil".into())])
}

fn good(value: i64) -> Sample {
    Sample::good(1, Value::I64(value))
}

/// Creates an oracle whose tag is good with 1, by a message of a second ago.
fn told() -> TruthOracle {
    let mut oracle = oracle();
    oracle.set_truth(1, Some(Value::I64(1)));
    oracle.note_message(1);
    oracle.sink().publish(&[good(1)]);
    oracle.advance(SECOND);
    oracle.check_recovered();
    oracle
}

#[test]
fn a_value_that_a_message_made_old_is_good_for_the_bound_alone() {
    let mut oracle = told();
    oracle.set_truth(1, Some(Value::I64(2)));
    oracle.note_message(1);
    oracle.check();
    oracle.advance(BOUND - Duration::from_millis(1));
    oracle.check();
    oracle.advance(Duration::from_millis(1));
    let story = oracle.find_fault().unwrap();
    for part in ["seed 5, step 3", "tag 1 (Oil)", "truth Some(I64(2))", "shown Some(I64(1))"] {
        assert!(story.contains(part), "{part}: {story}");
    }
    oracle.sink().publish(&[good(2)]);
    oracle.check_recovered();
}

#[test]
fn a_sign_never_leaves_a_value_as_it_was_even_one_that_is_right() {
    let mut oracle = told();
    oracle.note_sign([1], "cut");
    oracle.advance(BOUND);
    assert!(oracle.find_fault().unwrap().contains("before a sign 100.000ms ago: cut"));
    // Read anew, it may stay; so it may as uncertain.
    let sink = oracle.sink();
    let doubt = Quality::Uncertain(Reason::Communication);
    sink.publish(&[Sample { value: None, quality: doubt, ..good(1) }]);
    oracle.check();
    sink.publish(&[Sample { value: None, ..good(1) }]);
    assert!(oracle.find_fault().is_some(), "quality alone is no new value");
    sink.publish(&[good(1)]);
    oracle.check_recovered();
}

#[test]
fn a_message_that_arrives_late_has_the_truth_of_when_it_was_sent() {
    let mut oracle = told();
    let first = oracle.moment();
    oracle.set_truth(1, Some(Value::I64(2)));
    let second = oracle.moment();
    oracle.set_truth(1, Some(Value::I64(3)));
    // Sent before 2 was true: 1 may stay.
    oracle.note_late_message(1, first);
    oracle.advance(BOUND);
    oracle.check();
    oracle.note_late_message(1, second);
    oracle.advance(BOUND);
    assert!(oracle.find_fault().unwrap().contains("old"));
    oracle.sink().publish(&[good(2)]);
    oracle.check();
    // A sign of then leaves it to what came since, and no older value.
    oracle.note_late_sign([1], "cut", second);
    oracle.advance(BOUND);
    assert!(oracle.find_fault().unwrap().contains("before a sign"));
    oracle.sink().publish(&[good(2)]);
    oracle.check();
    oracle.sink().publish(&[good(1)]);
    assert!(oracle.find_fault().is_some());
    oracle.sink().publish(&[good(3)]);
    oracle.check();
    // What arrives later and was sent before says nothing new.
    oracle.note_late_message(1, first);
    oracle.advance(BOUND);
    oracle.sink().publish(&[good(1)]);
    assert!(oracle.find_fault().is_some());
}

#[test]
fn what_was_never_true_is_wrong_at_once() {
    let mut oracle = told();
    oracle.sink().publish(&[good(7)]);
    assert!(oracle.find_fault().unwrap().contains("not true at any time"));
    oracle.sink().publish(&[Sample { quality: Quality::Bad(Reason::Sensor), ..good(7) }]);
    oracle.check();
}

#[test]
fn a_message_that_vanishes_without_a_sign_is_excused_as_long_as_freshness_and_bound() {
    let mut oracle = told();
    oracle.set_truth(1, Some(Value::I64(2)));
    for _ in 0..5 {
        oracle.advance(SECOND);
        oracle.sink().publish(&[good(1)]);
        oracle.check();
    }
    oracle.advance(BOUND + Duration::from_millis(1));
    assert!(oracle.find_fault().unwrap().contains("ceased to be true"));
}

#[test]
fn a_tag_that_stays_bad_is_a_dead_end() {
    let mut oracle = told();
    oracle.sink().publish(&[Sample::bad(1, Reason::Communication)]);
    oracle.check();
    assert!(oracle.find_dead_end().unwrap().contains("dead end"));
    oracle.set_truth(1, None);
    oracle.check_recovered();
    oracle.sink().publish(&[good(1)]);
    oracle.note_message(1);
    oracle.advance(BOUND);
    assert!(oracle.find_fault().is_some(), "the device says that there is no value");
}

#[test]
fn the_rules_of_the_host_order_and_judge_times() {
    let mut oracle = told();
    let now = oracle.wall_clock();
    let at = |seconds: i64, value| {
        let distance = Duration::from_secs(seconds.unsigned_abs());
        let time = if seconds < 0 { now - distance } else { now + distance };
        Sample { source_time: Some(time), ..good(value) }
    };
    let quality = |oracle: &mut TruthOracle| {
        let now = oracle.wall_clock();
        let shown = oracle.shown(1);
        (shown.value(), shown.quality(now))
    };
    let (sink, of) = (oracle.sink(), |value| Some(Value::I64(value)));
    // In order of arrival, were it older.
    sink.publish(&[at(0, 2), at(-2, 3)]);
    assert_eq!(quality(&mut oracle), (of(3), Quality::Good));
    // By source time out of a buffer; what is said of quality counts.
    sink.publish(&[at(-3, 4).with_flags(SampleFlags::BUFFERED)]);
    assert_eq!(quality(&mut oracle), (of(3), Quality::Good));
    let sensor = Quality::Bad(Reason::Sensor);
    let bad = Sample { quality: sensor, ..at(-3, 4) };
    sink.publish(&[bad.with_flags(SampleFlags::BUFFERED)]);
    assert_eq!(quality(&mut oracle), (of(3), sensor));
    sink.publish(&[at(-6, 5)]);
    assert_eq!(quality(&mut oracle), (of(5), Quality::Bad(Reason::Stale)));
    let doubt = Quality::Uncertain(Reason::SourceTime);
    sink.publish(&[at(11, 6)]);
    assert_eq!(quality(&mut oracle), (of(6), doubt));
    oracle.advance(SECOND * 3);
    sink.publish(&[at(11, 6)]);
    assert_eq!(quality(&mut oracle), (of(6), doubt), "it was in the future when it came");
    sink.publish(&[good(7).with_flags(SampleFlags::TIME_UNUSABLE)]);
    assert_eq!(quality(&mut oracle), (of(7), doubt));
    sink.publish(&[Sample::good(1, Value::F64(1.0))]);
    let wrong_kind = Quality::Bad(Reason::Configuration);
    assert_eq!(quality(&mut oracle), (Some(Value::F64(1.0)), wrong_kind));
}

#[test]
fn the_real_clock_waits_for_what_comes() {
    let mut oracle = oracle().on_real_clock();
    oracle.set_truth(1, Some(Value::I64(1)));
    let sink = oracle.sink();
    let thread = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(20));
        sink.publish(&[good(1)]);
    });
    oracle.wait_recovered(Duration::from_secs(10));
    assert!(oracle.now() >= Duration::from_millis(20));
    thread.join().unwrap();
}

/// Feeds a message to an adapter of four-byte numbers, with its treatment of other lengths.
fn adapt(message: &[u8], marks_unusable: bool, sink: &SampleSink) {
    match message.try_into().map(i32::from_be_bytes) {
        Ok(number) => _ = sink.publish(&[good(number.into())]),
        Err(_) if marks_unusable => _ = sink.publish(&[Sample::bad(1, Reason::Communication)]),
        Err(_) => {}
    }
}

/// Runs an adapter through cut messages; returns the first fault found.
fn run(marks_unusable: bool) -> Option<String> {
    let mut oracle = oracle();
    let mut faults = FaultGenerator::new(9).with_kinds(&[MessageFault::Cut]);
    for number in 0..10_000_i32 {
        let mut message = number.to_be_bytes().to_vec();
        oracle.set_truth(1, Some(Value::I64(number.into())));
        if faults.next_fault().is_some() {
            faults.cut(&mut message);
            oracle.note_sign([1], "cut");
        } else {
            oracle.note_message(1);
        }
        adapt(&message, marks_unusable, &oracle.sink());
        oracle.advance(BOUND);
        if let Some(fault) = oracle.find_fault() {
            return Some(fault);
        }
    }
    let counts = oracle.counts();
    assert_eq!(counts.good, counts.messages);
    assert!(counts.signs > 2000 && counts.judged == 10_000);
    None
}

#[test]
fn an_adapter_that_drops_what_it_cannot_understand_is_found() {
    assert_eq!(run(true), None);
    assert!(run(false).is_some());
}
