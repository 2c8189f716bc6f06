//! Message matrix: rows and notifications that are lost, cut, oversized, unknown,
//! misassigned, doubled and out of order, judged after each of them.

use std::borrow::Cow;
use std::time::SystemTime;

use busbar_plugin_sdk::testing::{FaultGenerator, MessageFault, TruthOracle, matrix_steps};

use super::*;
use crate::answer::{Answer, MAX_ROWS, QueryFault, Samples};
use crate::cell::{Cell, Row};
use crate::convert::rules_of_tests;
use crate::point_states::PointStates;
use crate::points;

/// Steps of one seed, and of all where the environment says nothing.
const STEPS: usize = 4000;
const SAMPLE: u64 = 3 * STEPS as u64;
const STEP: Duration = Duration::from_millis(100);
const TAGS: u32 = 5;
/// Tag whose values are texts.
const TEXT: usize = 4;
/// Columns of an answer.
const COLUMNS: [&str; 4] = ["key", "value", "quality", "time"];
/// Step by which the database's clock is set back at times.
const STEP_BACK: Duration = Duration::from_secs(3);

struct Cells([Cell<'static>; 4]);

impl Row for Cells {
    fn cell(&self, column: usize) -> Cell<'_> {
        self.0[column].clone()
    }
}

fn text(text: impl Into<String>) -> Cell<'static> {
    Cell::Text(Cow::from(text.into()))
}

/// Value of a tag for the number of a step.
fn value_of(tag: usize, number: i64) -> Value {
    match tag {
        TEXT => super::text(&format!("Mode {number}")),
        _ => Value::I64(number),
    }
}

/// A database whose answers get faults.
struct Database {
    values: [i64; TAGS as usize],
    /// Time that its rows get.
    time: SystemTime,
    random: FaultGenerator,
}

impl Database {
    fn row(&self, tag: usize) -> [Cell<'static>; 4] {
        let key = text(format!("t{tag}"));
        let value = match value_of(tag, self.values[tag]) {
            Value::Text(value) => text(value.as_str()),
            _ => Cell::Int(self.values[tag]),
        };
        [key, value, text("good"), Cell::Time(self.time)]
    }

    /// The answer to a poll, and the tags whose rows have a fault.
    fn answer(&mut self, fault: Option<MessageFault>) -> (Vec<[Cell<'static>; 4]>, Vec<u32>) {
        let mut rows: Vec<_> = (0..TAGS as usize).map(|tag| self.row(tag)).collect();
        let index = self.random.below(rows.len());
        let own = vec![index as u32];
        let Some(fault) = fault else { return (rows, vec![]) };
        let row = &mut rows[index];
        let signs = match fault {
            MessageFault::Lost => {
                rows.remove(index);
                own
            }
            MessageFault::Cut => {
                row[[1, 3][self.random.below(2)]] = Cell::Null;
                own
            }
            MessageFault::Oversized => {
                row[1 + self.random.below(3)] = text("9".repeat(1000));
                own
            }
            MessageFault::Unknown => {
                let unknown = [
                    text("?"),
                    Cell::Float(0.5),
                    Cell::Float(f64::NAN),
                    Cell::Unusable("a blob".into()),
                    Cell::Int(i64::MAX),
                    text("2026-11-22 03:50:29"),
                ];
                let place = 1 + self.random.below(3);
                let other = unknown[self.random.below(unknown.len())].clone();
                // As a value that is an integer, or a text, as any other.
                let fits = match other {
                    Cell::Int(_) => true,
                    Cell::Text(_) => index == TEXT,
                    _ => false,
                };
                row[place] = if place == 1 && fits { Cell::Null } else { other };
                own
            }
            MessageFault::Misassigned => match self.random.below(3) {
                0 => {
                    row[0] = text("nobody");
                    own
                }
                1 => {
                    row[0] = Cell::Unusable("a text that is not UTF-8".into());
                    (0..TAGS).collect()
                }
                _ => {
                    // Two rows of one key, and nobody tells which is the newer.
                    let other = (index + 1) % TAGS as usize;
                    row[0] = text(format!("t{other}"));
                    vec![index as u32, other as u32]
                }
            },
            MessageFault::Duplicated => {
                let twice = row.clone();
                rows.push(twice);
                own
            }
            MessageFault::Reordered => {
                // Of a table of history: an older row follows, and counts for nothing.
                let mut older = row.clone();
                older[1] = Cell::Int(-1);
                older[3] = Cell::Time(self.time - Duration::from_secs(1));
                rows.push(older);
                vec![]
            }
        };
        (rows, signs)
    }

    /// A notification of one tag, and the tags that its fault concerns.
    fn payload(&mut self, tag: u32, fault: Option<MessageFault>) -> (String, Vec<u32>) {
        let (value, all) = (self.values[tag as usize], (0..TAGS).collect());
        let time = self.time.duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs_f64();
        let value = match value_of(tag as usize, value) {
            Value::Text(text) => format!("\"{text}\""),
            _ => value.to_string(),
        };
        let whole = format!(r#"{{"key": "t{tag}", "value": {value}, "time": {time}}}"#);
        match fault {
            Some(MessageFault::Cut) => (whole[..self.random.below(whole.len())].to_owned(), all),
            Some(MessageFault::Oversized) => (format!("{whole}{}", "]".repeat(7000)), all),
            Some(MessageFault::Unknown) => {
                let other = ["\"?\"", "{}", "[1]", "0.5", "null", "1e300"][self.random.below(6)];
                let is_text = tag as usize == TEXT && other == "\"?\"";
                let other = if is_text { "true" } else { other };
                let spoiled = if self.random.one_in(2) {
                    format!(r#"{{"key": "t{tag}", "value": {other}, "time": {time}}}"#)
                } else {
                    let other = if other == "0.5" { "-1" } else { other };
                    format!(r#"{{"key": "t{tag}", "value": {value}, "time": {other}}}"#)
                };
                (spoiled, vec![tag])
            }
            Some(MessageFault::Misassigned) => {
                (whole.replace("{\"key\"", "{\"key\": \"t0\", \"tag\""), all)
            }
            _ => (whole, vec![]),
        }
    }
}

fn settings() -> crate::settings::Config {
    let settings = json!({
        "postgres": {"host": "/run", "database": "d", "user": "u"},
        "queries": [{"name": "q", "sql": "SELECT 1", "poll_seconds": 1}],
        "listen": [{"channel": "c", "query": "q"}]
    });
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

fn read(point_states: &PointStates, rows: Vec<[Cell<'static>; 4]>) -> Result<Samples, QueryFault> {
    let points = point_states.points(0);
    let mut answer = Answer::begin(&points, &COLUMNS, &rules_of_tests(None))?;
    for row in rows {
        answer.take(&Cells(row))?;
    }
    answer.finish()
}

fn tags() -> Vec<TagSpec> {
    let tag = |tag| {
        let kind = value_of(tag as usize, 0).kind();
        key(tag, "q", &format!("t{tag}"), kind)
    };
    (0..TAGS).map(tag).collect()
}

fn point_states(oracle: &TruthOracle) -> PointStates {
    let (config, tags) = (settings(), tags());
    let points = points::parse(&tags, &config).unwrap().remove(0);
    PointStates::new(
        "db".into(),
        [("q".into(), points)],
        rules_of_tests(None),
        oracle.sink(),
        host(),
    )
}

fn run(seed: u64) {
    let mut oracle = TruthOracle::new(seed, Duration::ZERO, &tags());
    let mut point_states = point_states(&oracle);
    let (mut random, start) = (FaultGenerator::new(seed), oracle.wall_clock());
    let mut database =
        Database { values: [0; TAGS as usize], time: start, random: FaultGenerator::new(!seed) };
    point_states.open();
    point_states.note_connected();
    let mut back = Duration::ZERO;
    for step in 0..STEPS {
        oracle.advance(STEP);
        if random.one_in(50) {
            // Its clock is set back, or right again.
            back = if back.is_zero() { STEP_BACK } else { Duration::ZERO };
        }
        database.time = oracle.wall_clock() - back;
        let fault = random.next_fault().filter(|_| step + 10 < STEPS);
        if random.one_in(3) {
            let tag = random.below(TAGS as usize) as u32;
            database.values[tag as usize] = step as i64 * 10;
            oracle.set_truth(tag, Some(value_of(tag as usize, step as i64 * 10)));
            let (payload, signs) = database.payload(tag, fault);
            if fault == Some(MessageFault::Lost) {
                // Nobody can know; the next poll does.
            } else if signs.is_empty() {
                oracle.note_message(tag);
                point_states.note_notification(0, &payload);
            } else {
                oracle.note_sign(signs, &payload);
                point_states.note_notification(0, &payload);
                // A value that is null is understood: there is none.
                let is_null = payload.contains("\"value\": null");
                assert_eq!(
                    point_states.take_wanted(),
                    if is_null { &[][..] } else { &[0] },
                    "{payload}"
                );
            }
            point_states.flush();
        } else {
            for tag in 0..TAGS {
                let value = step as i64 * 10 + i64::from(tag);
                database.values[tag as usize] = value;
                oracle.set_truth(tag, Some(value_of(tag as usize, value)));
                oracle.note_message(tag);
            }
            // Some queries fail half-way, or as a whole.
            let fails = fault.is_some() && random.one_in(4);
            let (rows, signs) = database.answer(fault);
            oracle.note_sign(signs, "a row with a fault");
            let outcome = match random.below(3) {
                _ if !fails => read(&point_states, rows),
                0 => Err(QueryFault::Unavailable("it took too long".into())),
                1 => Err(QueryFault::Refused("there is no table any more".into())),
                _ => Err(QueryFault::TooManyRows),
            };
            point_states.note_answer(0, outcome);
        }
        if random.one_in(200) && step + 10 < STEPS {
            oracle.note_sign(0..TAGS, "the connection is lost");
            point_states.note_lost("reset", STEP);
            oracle.check();
            point_states.note_connected();
        }
        oracle.check();
    }
    // The last steps are whole, and polls among them.
    let (rows, _) = database.answer(None);
    let outcome = read(&point_states, rows);
    point_states.note_answer(0, outcome);
    oracle.check_recovered();
    let counts = oracle.counts();
    assert!(counts.good > counts.judged / 3 && counts.signs > 500, "{counts:?}");
}

#[test]
fn rows_and_notifications_with_faults_leave_no_old_value_good() {
    (1..=matrix_steps(SAMPLE).div_ceil(STEPS as u64)).for_each(run);
}

#[test]
fn rows_beyond_the_limit_make_all_tags_bad() {
    let mut oracle = TruthOracle::new(0, Duration::ZERO, &tags());
    let mut point_states = point_states(&oracle);
    let database = Database {
        values: [1; TAGS as usize],
        time: oracle.wall_clock(),
        random: FaultGenerator::new(0),
    };
    (0..TAGS).for_each(|tag| oracle.set_truth(tag, Some(value_of(tag as usize, 1))));
    let rows: Vec<_> = (0..TAGS as usize).map(|tag| database.row(tag)).collect();
    let outcome = read(&point_states, rows.clone());
    point_states.note_answer(0, outcome);
    oracle.check_recovered();
    oracle.note_sign(0..TAGS, "too many rows");
    let others = (0..MAX_ROWS).map(|_| [text("other"), Cell::Int(1), text("good"), Cell::Null]);
    let outcome = read(&point_states, rows.into_iter().chain(others).collect());
    point_states.note_answer(0, outcome);
    oracle.check();
    assert!(!oracle.is_good(0));
}

#[test]
fn rows_that_stop_changing_age_by_their_time() {
    let mut oracle = TruthOracle::new(0, Duration::ZERO, &tags());
    let mut point_states = point_states(&oracle);
    let database = Database {
        values: [1; TAGS as usize],
        time: oracle.wall_clock(),
        random: FaultGenerator::new(0),
    };
    (0..TAGS).for_each(|tag| oracle.set_truth(tag, Some(value_of(tag as usize, 1))));
    for second in 0..20 {
        let rows = (0..TAGS as usize).map(|tag| database.row(tag)).collect();
        let outcome = read(&point_states, rows);
        point_states.note_answer(0, outcome);
        assert_eq!(oracle.is_good(0), second <= 5, "after {second} s");
        oracle.advance(Duration::from_secs(1));
    }
}

#[test]
fn bad_quality_with_an_older_time_counts() {
    let mut oracle = TruthOracle::new(0, Duration::ZERO, &tags());
    let mut point_states = point_states(&oracle);
    let mut database = Database {
        values: [1; TAGS as usize],
        time: oracle.wall_clock(),
        random: FaultGenerator::new(0),
    };
    (0..TAGS).for_each(|tag| oracle.set_truth(tag, Some(value_of(tag as usize, 1))));
    let mut rows: Vec<_> = (0..TAGS as usize).map(|tag| database.row(tag)).collect();
    let outcome = read(&point_states, rows.clone());
    point_states.note_answer(0, outcome);
    oracle.check_recovered();
    // The row is written anew 20 s older, and bad.
    database.time -= Duration::from_secs(20);
    rows[0] = database.row(0);
    rows[0][2] = text("bad");
    oracle.set_truth(0, None);
    oracle.note_message(0);
    let outcome = read(&point_states, rows);
    point_states.note_answer(0, outcome);
    oracle.check();
    let now = oracle.wall_clock();
    assert_eq!(oracle.shown(0).quality(now), Quality::Bad(Reason::Sensor));
}

#[test]
fn a_notification_for_tags_of_columns_leaves_them_uncertain_until_they_are_asked_for() {
    let tags = [column(0, "q", "a", ValueKind::I64)];
    let config = settings();
    let points = points::parse(&tags, &config).unwrap().remove(0);
    let mut oracle = TruthOracle::new(0, Duration::ZERO, &tags);
    let queries = [("q".into(), points)];
    let mut point_states =
        PointStates::new("db".into(), queries, rules_of_tests(None), oracle.sink(), host());
    oracle.set_truth(0, Some(Value::I64(1)));
    oracle.sink().publish(&[Sample::good(0, Value::I64(1))]);
    oracle.check_recovered();
    oracle.set_truth(0, Some(Value::I64(2)));
    oracle.note_sign([0], "a key that no column has");
    point_states.note_notification(0, r#"{"key": "a", "value": 2}"#);
    point_states.flush();
    oracle.check();
    assert_eq!(point_states.take_wanted(), [0]);
}
