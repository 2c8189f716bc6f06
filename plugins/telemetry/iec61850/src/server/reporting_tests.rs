//! Reports of blocks that are enabled, and signs of reports that cannot be used, against the
//! tags' samples.

use std::time::Duration;

use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, Reason, Value as TagValue, ValueKind};
use iec61850_rs::common::{OptFlds, ReasonCode};
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::ReportEntry;
use iec61850_rs::proto::mms::typespec::TypeSpec;
use serde_json::json;

use super::*;
use crate::points::Points;
use crate::server::Job;
use crate::service::Request;
use crate::settings::Settings;

const MAX_MESSAGE: usize = 65_000;
/// Long enough for the pause after a buffer, and between two readings.
const PAUSE: Duration = Duration::from_millis(1100);

/// A server with two blocks, each with one object without quality: of block 1 object 1.
struct Fixture {
    server: Server,
    recorder: Recorder,
    now: Instant,
    /// Values as they are read.
    values: [i64; 2],
    sequence: [u32; 2],
    names_data_sets: bool,
}

fn object(tag: usize) -> String {
    format!("GGIO1$ST$Obj{tag}")
}

impl Fixture {
    /// All is enabled, interrogated and good with 1 and 2.
    fn new(ids: [&str; 2]) -> Self {
        let tag = |tag: u32| {
            let address = json!({"reference": format!("L/GGIO1.Obj{tag}"), "fc": "ST"});
            tag_spec(tag, "t", ValueKind::I64, address)
        };
        let settings = json!({
            "host": "a",
            "reports": [{"rcb": "L/LLN0.RP.u0"}, {"rcb": "L/LLN0.RP.u1"}]
        });
        let config = serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap();
        let recorder = Recorder::new();
        let points = Points::parse(&[tag(0), tag(1)]).unwrap();
        let mut server = Server::new(&config, points, recorder.sink(), host());
        server.begin();
        let mut fixture = Self {
            server,
            recorder,
            now: Instant::now(),
            values: [1, 2],
            sequence: [0, 0],
            names_data_sets: true,
        };
        fixture.serve(ids);
        for (block, id) in ids.into_iter().enumerate() {
            let report = fixture.report(block, id, fixture.values[block]);
            fixture.take(&report);
        }
        assert_eq!(fixture.shown(), [Some(1), Some(2)]);
        fixture
    }

    /// Answers all that is asked.
    fn serve(&mut self, ids: [&str; 2]) {
        while let Some((job, request)) = self.server.next_request(self.now, MAX_MESSAGE) {
            let answer = self.answer(&request, ids);
            self.server.handle_answer(job, answer, self.now);
            self.server.flush();
        }
    }

    fn answer(&self, request: &Request, ids: [&str; 2]) -> Answer {
        let block_of = |name: &Name| usize::from(name.item.contains("u1"));
        match request {
            Request::Type(_) => Answer::Type(TypeSpec::Integer(64)),
            Request::Read(names) => {
                let value = |name: &Name| match name.item.rsplit('$').next().unwrap() {
                    "Obj0" => Value::Integer(self.values[0]),
                    "Obj1" => Value::Integer(self.values[1]),
                    "RptID" => Value::VisibleString(ids[block_of(name)].into()),
                    "RptEna" => Value::Boolean(false),
                    "DatSet" => Value::VisibleString(format!("L/LLN0$ds{}", block_of(name))),
                    "OptFlds" => OptFlds::NONE.to_value(),
                    _ => Value::Unsigned(0),
                };
                Answer::Values(names.iter().map(value).map(Ok).collect())
            }
            Request::Members(name) => {
                let number = usize::from(name.item.ends_with('1'));
                Answer::Members(vec![Some(Name { domain: "L".into(), item: object(number) })])
            }
            Request::Write(writes) => Answer::Written(vec![Ok(()); writes.len()]),
            other => panic!("{other:?}"),
        }
    }

    fn report(&mut self, block: usize, id: &str, value: i64) -> Report {
        let number = self.sequence[block];
        self.sequence[block] += 1;
        let reason = ReasonCode::NONE.with_general_interrogation(true);
        let entry = ReportEntry {
            index: 0,
            reference: None,
            value: Value::Integer(value),
            reason: Some(reason),
        };
        Report {
            rpt_id: id.into(),
            opt_flds: OptFlds::NONE,
            seq_num: Some(number),
            time_of_entry: None,
            data_set: self.names_data_sets.then(|| format!("L/LLN0$ds{block}")),
            buf_ovfl: None,
            entry_id: None,
            conf_rev: Some(1),
            sub_seq_num: None,
            more_segments_follow: false,
            inclusion: Report::inclusion_for(1, &[0]),
            entries: vec![entry],
        }
    }

    fn take(&mut self, report: &Report) {
        self.server.take_report(report, self.now).unwrap();
        self.server.flush();
    }

    fn note(&mut self, report_id: Option<&str>) {
        let unusable = Unusable { report_id: report_id.map(str::to_owned), why: "cut".into() };
        self.server.note_unusable(&unusable, self.now);
        self.server.flush();
    }

    /// The good value of each tag.
    fn shown(&self) -> [Option<i64>; 2] {
        [0, 1].map(|tag| {
            let sample = self.recorder.latest(tag)?;
            match (sample.quality, sample.value) {
                (Quality::Good, Some(TagValue::I64(value))) => Some(value),
                _ => None,
            }
        })
    }
}

const IDS: [&str; 2] = ["A", "B"];

#[test]
fn what_cannot_be_used_makes_its_block_bad_until_that_is_read() {
    for (id, expected) in
        [(Some("A"), [None, Some(2)]), (None, [None, None]), (Some("nobody"), [None, None])]
    {
        let mut fixture = Fixture::new(IDS);
        fixture.note(id);
        assert_eq!(fixture.shown(), expected, "{id:?}");
        fixture.values[0] = 5;
        fixture.now += PAUSE;
        fixture.serve(IDS);
        assert_eq!(fixture.shown(), [Some(5), Some(2)], "{id:?}");
    }
}

#[test]
fn a_report_of_one_block_by_its_id_and_another_by_its_data_set_is_of_either() {
    let mut fixture = Fixture::new(IDS);
    let mut stray = fixture.report(1, "A", 7);
    fixture.take(&stray);
    assert_eq!(fixture.shown(), [None, None]);
    let mut fixture = Fixture::new(IDS);
    stray.data_set = Some("L/LLN0$none".into());
    fixture.take(&stray);
    assert_eq!(fixture.shown(), [None, Some(2)], "by its RptID");
    let mut fixture = Fixture::new(IDS);
    stray.rpt_id = "nobody".into();
    fixture.take(&stray);
    assert_eq!(fixture.shown(), [None, None]);
}

#[test]
fn blocks_of_one_id_are_told_apart_by_their_data_sets_or_not_at_all() {
    let ids = ["A", "A"];
    let mut fixture = Fixture::new(ids);
    let report = fixture.report(1, "A", 8);
    fixture.take(&report);
    assert_eq!(fixture.shown(), [Some(1), Some(8)]);
    fixture.names_data_sets = false;
    let report = fixture.report(1, "A", 9);
    fixture.take(&report);
    assert_eq!(fixture.shown(), [None, None], "8 is old, and 9 may be of either");
    fixture.values = [1, 9];
    fixture.now += PAUSE;
    fixture.serve(ids);
    assert_eq!(fixture.shown(), [Some(1), Some(9)]);
}

#[test]
fn a_gap_and_a_repeated_report_bring_no_values() {
    for step in [0, 2] {
        let mut fixture = Fixture::new(IDS);
        fixture.sequence[0] = fixture.sequence[0] + step - 1;
        let report = fixture.report(0, "A", 7);
        fixture.take(&report);
        assert_eq!(fixture.shown(), [None, Some(2)]);
    }
}

#[test]
fn a_block_whose_reports_cannot_be_used_again_and_again_is_polled() {
    let mut fixture = Fixture::new(IDS);
    for _ in 0..5 {
        fixture.note(Some("A"));
    }
    assert!(!fixture.server.controls()[0].is_reporting());
    let report = fixture.report(0, "A", 7);
    fixture.take(&report);
    fixture.values[0] = 6;
    fixture.now += PAUSE;
    fixture.serve(IDS);
    assert_eq!(fixture.shown(), [Some(6), Some(2)]);
    fixture.values[0] = 7;
    fixture.now += PAUSE;
    fixture.serve(IDS);
    assert_eq!(fixture.shown(), [Some(7), Some(2)]);
}

#[test]
fn a_member_of_another_type_is_bad_until_it_is_read() {
    let mut fixture = Fixture::new(IDS);
    let mut report = fixture.report(0, "A", 7);
    report.entries[0].value = Value::Boolean(true);
    fixture.take(&report);
    assert_eq!(fixture.recorder.latest(0).unwrap().quality, Quality::Bad(Reason::Configuration));
    fixture.now += PAUSE;
    fixture.serve(IDS);
    assert_eq!(fixture.shown(), [Some(1), Some(2)]);
}

#[test]
fn an_answer_to_an_earlier_question_is_not_the_newer_value() {
    let mut fixture = Fixture::new(IDS);
    fixture.note(Some("A"));
    let (first, _) = fixture.server.next_request(fixture.now, MAX_MESSAGE).unwrap();
    fixture.note(Some("A"));
    fixture.now += PAUSE;
    let (second, _) = fixture.server.next_request(fixture.now, MAX_MESSAGE).unwrap();
    let answer = |value| Answer::Values(vec![Ok(Value::Integer(value))]);
    assert!(matches!((&first, &second), (Job::Read { .. }, Job::Read { .. })));
    fixture.server.handle_answer(second, answer(6), fixture.now);
    fixture.server.handle_answer(first, answer(5), fixture.now);
    fixture.server.flush();
    assert_eq!(fixture.shown(), [Some(6), Some(2)]);
}

#[test]
fn a_reading_that_is_refused_is_tried_again_where_nothing_else_brings_the_value() {
    let mut fixture = Fixture::new(IDS);
    fixture.note(Some("A"));
    let (job, _) = fixture.server.next_request(fixture.now, MAX_MESSAGE).unwrap();
    fixture.server.handle_answer(job, Answer::Refused("no resources".into()), fixture.now);
    fixture.server.flush();
    assert_eq!(fixture.shown(), [None, Some(2)]);
    fixture.now += PAUSE;
    fixture.serve(IDS);
    assert_eq!(fixture.shown(), [Some(1), Some(2)]);
}
