use iec61850_rs::common::OptFlds;
use iec61850_rs::proto::mms::report::ReportEntry;
use iec61850_rs::proto::mms::{ObjectName, VariableAccess};

use super::*;

const LIMIT: Duration = Duration::from_secs(5);
const MEMBERS: usize = 6;

/// A report of members, as a segment where it has a number as one.
fn report(number: u32, segment: Option<(u32, bool)>, members: &[usize]) -> Report {
    let options = OptFlds::NONE.with_sequence_number(true).with_data_set_name(true);
    let entry = |&index: &usize| ReportEntry {
        index,
        reference: None,
        value: Value::Integer(10 + index as i64),
        reason: None,
    };
    Report {
        rpt_id: "Events".into(),
        opt_flds: options.with_segmentation(segment.is_some()),
        seq_num: Some(number),
        time_of_entry: None,
        data_set: Some("L/LLN0$ds".into()),
        buf_ovfl: None,
        entry_id: None,
        conf_rev: None,
        sub_seq_num: segment.map(|(number, _)| number),
        more_segments_follow: segment.is_some_and(|(_, more)| more),
        inclusion: Report::inclusion_for(MEMBERS, members),
        entries: members.iter().map(entry).collect(),
    }
}

fn pdu_of(values: &[Value]) -> Vec<u8> {
    let encoded: Vec<_> = values
        .iter()
        .map(|value| Value::encode_all(std::slice::from_ref(value)).unwrap())
        .collect();
    let results = encoded.iter().map(|bytes| AccessResult::Success(first_of(bytes))).collect();
    let access = VariableAccess::VariableListName(ObjectName::VmdSpecific("RPT"));
    Mms::Unconfirmed(Unconfirmed::InformationReport { access, results }).to_vec().unwrap()
}

fn first_of(bytes: &[u8]) -> iec61850_rs::ber::Tlv<'_> {
    iec61850_rs::ber::Cursor::new(bytes).next_required().unwrap()
}

struct Reading {
    reader: ReportReader,
    now: Instant,
}

impl Reading {
    fn new() -> Self {
        Self { reader: ReportReader::new(LIMIT), now: Instant::now() }
    }

    fn take(&mut self, report: &Report) -> Result<Option<Report>, Unusable> {
        self.reader.take(&pdu_of(&report.to_values().unwrap()), self.now)
    }

    fn fails(&mut self, report: &Report, why: &str) {
        let unusable = self.take(report).unwrap_err();
        assert_eq!(unusable.report_id.as_deref(), Some(report.rpt_id.as_str()));
        assert!(unusable.why.contains(why), "{}", unusable.why);
    }
}

fn members(report: &Report) -> Vec<usize> {
    report.entries.iter().map(|entry| entry.index).collect()
}

#[test]
fn a_whole_report_is_handed_on_at_once() {
    let mut reading = Reading::new();
    let sent = report(7, None, &[1, 4]);
    assert_eq!(reading.take(&sent), Ok(Some(sent)));
    assert_eq!(reading.reader.deadline(), None);
    // In one segment, it is one as well.
    let single = report(8, Some((0, false)), &[2]);
    assert_eq!(reading.take(&single), Ok(Some(single)));
}

#[test]
fn segments_are_joined_and_have_to_come_in_time() {
    let mut reading = Reading::new();
    assert_eq!(reading.take(&report(7, Some((0, true)), &[0, 1])), Ok(None));
    assert_eq!(reading.reader.deadline(), Some(reading.now + LIMIT));
    assert!(!reading.reader.is_late(reading.now + LIMIT - Duration::from_millis(1)));
    assert!(reading.reader.is_late(reading.now + LIMIT));
    assert_eq!(reading.take(&report(7, Some((1, true)), &[2])), Ok(None));
    let whole = reading.take(&report(7, Some((2, false)), &[5])).unwrap().unwrap();
    assert_eq!((members(&whole), whole.data_set_len()), (vec![0, 1, 2, 5], MEMBERS));
    assert_eq!(reading.reader.deadline(), None);
}

#[test]
fn a_report_without_one_of_its_segments_is_none() {
    for lost in 0..3 {
        let mut reading = Reading::new();
        let mut unusable = 0;
        for number in (0..3).filter(|number| *number != lost) {
            match reading.take(&report(7, Some((number, number < 2)), &[number as usize])) {
                Ok(Some(report)) => panic!("half a report: {report:?}"),
                Ok(None) => {}
                Err(_) => unusable += 1,
            }
        }
        // Whether the last one comes only time can tell.
        assert!(unusable > 0 || (lost == 2 && reading.reader.is_late(reading.now + LIMIT)));
    }
}

#[test]
fn a_segment_that_comes_again_is_a_fault() {
    let mut reading = Reading::new();
    assert_eq!(reading.take(&report(7, Some((0, true)), &[0])), Ok(None));
    assert_eq!(reading.take(&report(7, Some((1, true)), &[1])), Ok(None));
    reading.fails(&report(7, Some((1, true)), &[1]), "a segment of it is missing");
    reading.fails(&report(7, Some((2, false)), &[2]), "a segment of it is missing");
}

#[test]
fn segments_of_two_blocks_of_one_id_are_never_mixed() {
    let mut reading = Reading::new();
    let others = |segment| {
        let other = report(7, Some(segment), &[3]);
        Report { data_set: Some("L/LLN0$other".into()), ..other }
    };
    assert_eq!(reading.take(&report(7, Some((0, true)), &[0])), Ok(None));
    // Of the data set `other`, whose first segment was lost.
    reading.fails(&others((1, false)), "mixed up");
    let longer = report(7, Some((1, false)), &[1]);
    let inclusion = Report::inclusion_for(MEMBERS + 8, &[1]);
    reading.fails(&Report { inclusion, ..longer }, "mixed up");
    let whole = reading.take(&report(7, Some((1, false)), &[1])).unwrap().unwrap();
    assert_eq!(members(&whole), [0, 1]);
    // Where a first segment comes, the report that was begun is lost.
    assert_eq!(reading.take(&report(8, Some((0, true)), &[0])), Ok(None));
    let other = Report { seq_num: Some(8), ..others((0, true)) };
    reading.fails(&other, "a segment of it is missing");
    reading.fails(&report(8, Some((1, false)), &[1]), "mixed up");
    let other = Report { seq_num: Some(8), ..others((1, false)) };
    assert_eq!(reading.take(&other).unwrap().unwrap().data_set.unwrap(), "L/LLN0$other");
}

#[test]
fn too_many_reports_and_members_are_not_kept() {
    let mut reading = Reading::new();
    for number in 0..MAX_OPEN_REPORTS as u32 {
        assert_eq!(reading.take(&report(number, Some((0, true)), &[0])), Ok(None));
    }
    let unusable = reading.take(&report(99, Some((0, true)), &[0])).unwrap_err();
    // Nobody knows any more of which block the oldest was.
    assert_eq!(unusable.report_id, None);
    assert!(reading.reader.runs.len() <= MAX_OPEN_REPORTS);
    let mut reading = Reading::new();
    let all: Vec<_> = (0..MEMBERS).collect();
    let count = (LIMITS.max_dataset_members / MEMBERS) as u32;
    for number in 0..count {
        assert_eq!(reading.take(&report(1, Some((number, true)), &all)), Ok(None));
    }
    reading.fails(&report(1, Some((count, true)), &all), "more members than any data set");
}

#[test]
fn what_cannot_be_read_says_whose_it_is_as_far_as_that_can_be_read() {
    let mut reading = Reading::new();
    let values = report(7, None, &[1, 4]).to_values().unwrap();
    for length in 0..values.len() {
        let unusable = reading.reader.take(&pdu_of(&values[..length]), reading.now).unwrap_err();
        let expected = (length > 0).then_some("Events");
        assert_eq!(unusable.report_id.as_deref(), expected, "{length} members");
    }
    let mut options = values.clone();
    options[1] = Value::Boolean(true);
    let unusable = reading.reader.take(&pdu_of(&options), reading.now).unwrap_err();
    assert_eq!(unusable.report_id.as_deref(), Some("Events"));
    let mut more = values;
    more.push(Value::Integer(1));
    assert!(reading.reader.take(&pdu_of(&more), reading.now).is_err());
    let nothing = reading.reader.take(&[0xA3, 0x04, 0xA9, 0x02, 0x05, 0x00], reading.now);
    assert_eq!(nothing.unwrap_err().report_id, None);
    assert_eq!(reading.reader.deadline(), None);
}
