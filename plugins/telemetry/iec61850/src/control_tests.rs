use busbar_link::SettingsFaults;
use iec61850_rs::common::ReasonCode;
use iec61850_rs::proto::mms::report::{Report, ReportEntry};
use serde_json::json;

use super::*;
use crate::block::report_blocks;

const TIMEOUT: Duration = Duration::from_secs(5);
const DENIED: AccessError = AccessError(3);

fn control(settings: serde_json::Value) -> Control {
    let mut faults = SettingsFaults::default();
    let raw = serde_json::from_value(settings).unwrap();
    let blocks = report_blocks(&[raw], &mut faults);
    faults.into_result().unwrap();
    Control::new(blocks[0].clone(), TIMEOUT)
}

fn buffered() -> Control {
    control(json!({"rcb": "L/LLN0.BR.b01", "integrity_seconds": 2}))
}

/// Returns the attributes of a block, in the order of [`ATTRIBUTES`].
fn attributes(is_enabled: bool) -> Answer {
    let text = |text: &str| Value::VisibleString(text.into());
    let values = [
        text("Events"),
        Value::Boolean(is_enabled),
        text("L/LLN0$ds"),
        OptFlds::NONE.to_value(),
        TrgOps::EVENTS.to_value(),
        Value::Unsigned(0),
        Value::Unsigned(100),
    ];
    Answer::Values(values.map(Ok).into())
}

/// Returns the writes of a request, by the names of the attributes.
fn written(request: Option<Request>) -> Vec<(String, Value)> {
    let Some(Request::Write(writes)) = request else { panic!("{request:?} writes nothing") };
    let last = |name: &Name| name.item.rsplit('$').next().unwrap().to_owned();
    writes.into_iter().map(|(name, value)| (last(&name), value)).collect()
}

/// Leads a block to where it is configured.
fn mapped(control: &mut Control, now: Instant) {
    assert!(matches!(control.next_request(now), Some(Request::Read(names)) if names.len() == 7));
    assert_eq!(control.next_request(now), None, "an answer is waited for");
    assert_eq!(control.handle_answer(attributes(false), now), Outcome::InProgress);
    let set = Name { domain: "L".into(), item: "LLN0$ds".into() };
    assert_eq!(control.next_request(now), Some(Request::Members(set)));
    let outcome = control.handle_answer(Answer::Members(vec![None, None]), now);
    assert_eq!(outcome, Outcome::Members(vec![None, None]));
    control.uses = vec![Vec::new(); 2];
}

/// And to where it reports.
fn enabled(control: &mut Control, now: Instant) {
    mapped(control, now);
    let count = written(control.next_request(now)).len();
    assert_eq!(
        control.handle_answer(Answer::Written(vec![Ok(()); count]), now),
        Outcome::InProgress
    );
    assert_eq!(written(control.next_request(now)), [("RptEna".into(), Value::Boolean(true))]);
    assert_eq!(control.handle_answer(Answer::Written(vec![Ok(())]), now), Outcome::InProgress);
    assert!(control.is_running());
    let quiet = now + if control.block.is_buffered { REPLAY_PAUSE } else { Duration::ZERO };
    assert_eq!(written(control.next_request(quiet)), [("GI".into(), Value::Boolean(true))]);
    assert_eq!(control.handle_answer(Answer::Written(vec![Ok(())]), now), Outcome::InProgress);
}

fn report(members: usize, reason: ReasonCode) -> Report {
    let entry = ReportEntry {
        index: 0,
        reference: None,
        value: Value::Boolean(true),
        reason: Some(reason),
    };
    Report {
        rpt_id: "Events".into(),
        opt_flds: OptFlds::NONE,
        seq_num: None,
        time_of_entry: None,
        data_set: Some("L/LLN0$ds".into()),
        buf_ovfl: Some(false),
        entry_id: Some(vec![1; 8]),
        conf_rev: Some(1),
        sub_seq_num: None,
        more_segments_follow: false,
        inclusion: Report::inclusion_for(members, &[0]),
        entries: vec![entry],
    }
}

const CHANGED: ReasonCode = ReasonCode::NONE.with_data_change(true);
const ASKED: ReasonCode = ReasonCode::NONE.with_general_interrogation(true);

#[test]
fn only_what_is_not_so_yet_is_written() {
    let (mut control, now) = (buffered(), Instant::now());
    mapped(&mut control, now);
    let names: Vec<_> = written(control.next_request(now)).into_iter().map(|(n, _)| n).collect();
    // Neither the data set nor the buffer time were asked for; there is no entry to resume at.
    assert_eq!(names, ["OptFlds", "TrgOps", "IntgPd"]);
}

#[test]
fn a_buffer_is_resumed_after_the_last_entry() {
    let (mut control, now) = (buffered(), Instant::now());
    enabled(&mut control, now);
    control.note(&report(2, CHANGED));
    control.begin();
    mapped(&mut control, now);
    let writes = written(control.next_request(now));
    assert_eq!(writes.last(), Some(&("EntryID".into(), Value::OctetString(vec![1; 8]))));
    let mut results = vec![Ok(()); writes.len() - 1];
    results.push(Err(DENIED));
    let outcome = control.handle_answer(Answer::Written(results), now);
    assert!(matches!(outcome, Outcome::Degraded(what) if what.contains("changes may be missing")));
    control.begin();
    mapped(&mut control, now);
    assert!(written(control.next_request(now)).iter().all(|(name, _)| name != "EntryID"));
}

#[test]
fn what_comes_before_the_answer_to_the_interrogation_is_of_the_past() {
    let (mut control, now) = (buffered(), Instant::now());
    enabled(&mut control, now);
    assert!(control.note(&report(2, CHANGED)).is_replayed);
    assert!(!control.note(&report(2, ASKED)).is_replayed);
    assert!(!control.note(&report(2, CHANGED)).is_replayed);
    assert!(!control.take_late(now + TIMEOUT));
    // An unbuffered block has no past.
    let mut other = control_of_changes(now);
    assert!(!other.note(&report(2, CHANGED)).is_replayed);
    assert!(!other.take_late(now + TIMEOUT / 2));
    assert_eq!(other.deadline(), Some(now + TIMEOUT));
    assert!(other.take_late(now + TIMEOUT) && !other.take_late(now + TIMEOUT));
}

/// Leads a block to where it reports, and is not interrogated yet.
fn replaying(now: Instant) -> Control {
    let mut control = buffered();
    mapped(&mut control, now);
    let count = written(control.next_request(now)).len();
    control.handle_answer(Answer::Written(vec![Ok(()); count]), now);
    assert!(control.next_request(now).is_some());
    control.handle_answer(Answer::Written(vec![Ok(())]), now);
    control
}

#[test]
fn a_buffer_is_interrogated_when_nothing_more_comes_out_of_it() {
    let start = Instant::now();
    let mut control = replaying(start);
    let mut now = start;
    for _ in 0..4 {
        assert_eq!(control.deadline(), Some(now + REPLAY_PAUSE));
        now += REPLAY_PAUSE - Duration::from_millis(1);
        assert_eq!(control.next_request(now), None);
        // The answer to a former interrogation is in the buffer.
        control.note_report(now);
        assert!(control.note(&report(2, ASKED)).is_replayed);
    }
    assert!(control.note(&report(2, CHANGED)).is_replayed);
    assert!(control.next_request(now + REPLAY_PAUSE).is_some());
    assert!(!control.note(&report(2, ASKED)).is_replayed);
    // A buffer that never ends is not waited for.
    let mut control = replaying(start);
    let mut now = start;
    while control.next_request(now).is_none() {
        control.note_report(now);
        now += REPLAY_PAUSE / 2;
        assert!(now <= start + TIMEOUT);
    }
    assert_eq!(now, start + TIMEOUT);
}

#[test]
fn without_reasons_the_first_whole_report_answers_the_interrogation() {
    let now = Instant::now();
    let mut control = buffered();
    let plain = |members, is_whole: bool| {
        let mut report = report(members, CHANGED);
        report.entries[0].reason = None;
        if is_whole {
            let other = ReportEntry { index: 1, ..report.entries[0].clone() };
            report.entries.push(other);
        }
        report
    };
    enabled(&mut control, now);
    assert!(control.note(&plain(2, false)).is_replayed);
    assert!(!control.note(&plain(2, true)).is_replayed);
    assert!(!control.note(&plain(2, false)).is_replayed);
    let mut control = replaying(now);
    assert!(control.note(&plain(2, true)).is_replayed, "it was not asked for");
}

fn control_of_changes(now: Instant) -> Control {
    let mut control = control(json!({"rcb": "L/LLN0.RP.u01"}));
    enabled(&mut control, now);
    control
}

#[test]
fn a_report_that_does_not_fit_gives_no_values() {
    let now = Instant::now();
    let mut control = control_of_changes(now);
    let ours = report(2, CHANGED);
    assert!(control.has_sent(&ours));
    assert_eq!(control.check(&ours), Ok(()));
    assert_eq!(control.check(&report(3, CHANGED)), Err(Mismatch::Members { told: 2, sent: 3 }));
    let newer = Report { conf_rev: Some(2), ..ours.clone() };
    assert_eq!(control.check(&newer), Err(Mismatch::Revision));
    for other in [
        Report { rpt_id: "Others".into(), ..ours.clone() },
        Report { data_set: Some("L/LLN0$other".into()), ..ours.clone() },
    ] {
        assert!(!control.has_sent(&other));
    }
    control.abandon(None);
    assert!(control.has_sent(&ours) && !control.is_reporting() && control.is_settled());
    assert_eq!((control.deadline(), control.next_request(now + RETRY)), (None, None));
}

#[test]
fn a_gap_of_numbers_is_found_and_numbers_begin_anew() {
    let now = Instant::now();
    let mut control = control_of_changes(now);
    let numbered = |number| Report { seq_num: Some(number), ..report(2, CHANGED) };
    for number in [7, 8, 255, 0, 1, 65_535, 0] {
        let outcome = control.check(&numbered(number));
        let is_gap = [255, 65_535].contains(&number);
        assert_eq!(outcome.is_err(), is_gap, "{number}: {outcome:?}");
    }
    assert_eq!(
        control.check(&numbered(0)),
        Err(Mismatch::Sequence { last: 0, found: 0 }),
        "the same again"
    );
    assert_eq!(control.check(&numbered(1)), Ok(()));
    let left_alone = std::iter::repeat_with(|| control.note_fault()).take(5).collect::<Vec<_>>();
    assert_eq!(left_alone, [false, false, false, false, true]);
}

#[test]
fn members_that_are_named_have_to_be_those_of_the_data_set() {
    let now = Instant::now();
    let mut control = control_of_changes(now);
    let member = Name { domain: "L".into(), item: "GGIO1$ST$Ind1".into() };
    control.members = vec![Some(member), None];
    let mut named = report(2, CHANGED);
    for (reference, expected) in [
        ("L/GGIO1$ST$Ind1", Ok(())),
        ("L/GGIO1.Ind1[ST]", Ok(())),
        ("L/GGIO1$ST$Ind2", Err(Mismatch::Member(0))),
    ] {
        named.entries[0].reference = Some(reference.into());
        assert_eq!(control.check(&named), expected, "{reference}");
    }
}

#[test]
fn a_block_that_is_taken_is_tried_again_and_told_of_once() {
    let (mut control, now) = (buffered(), Instant::now());
    for _ in 0..2 {
        assert!(control.next_request(now).is_some());
        let outcome = control.handle_answer(attributes(true), now);
        assert!(matches!(outcome, Outcome::Failed(what) if what.contains("another client")));
        assert_eq!(control.deadline(), Some(now + RETRY));
        assert_eq!(control.next_request(now), None);
        control.begin();
    }
    assert!(control.has_changed("a") && !control.has_changed("a") && control.has_changed("b"));
    enabled(&mut control, now);
    assert!(control.has_changed("b"));
}
