//! Message matrix: recordings with rows that are lost, cut, too long, unknown, of others,
//! doubled and out of order, judged at every instant.

use busbar_plugin_sdk::testing::{FaultGenerator, MessageFault, TruthOracle, matrix_steps};

use super::*;
use crate::address::Points;
use crate::comtrade::{Cfg, MAX_CFG_BYTES};
use crate::lines::MAX_LINE_BYTES;
use crate::oscillogram::{Oscillogram, Parts};
use crate::player::Player;
use crate::recording::Recording as Source;
use crate::remarks::Remarks;
use crate::table::Table;

/// Rows of a recording, one a step.
const STEPS: usize = 2500;
/// Rows of all seeds and kinds where the environment says nothing.
const SAMPLE: u64 = 9 * STEPS as u64;
/// Time between two rows.
const STEP: Duration = Duration::from_millis(100);
const TAGS: u32 = 3;
/// Tag whose values are texts, but of COMTRADE, which has none.
const TEXT: usize = 2;

/// Kinds of recordings played.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Wide,
    Long,
    Comtrade,
}

/// One step: its rows, the truth after it, and the sign that it gives.
struct Step {
    rows: Vec<Vec<u8>>,
    truth: [i64; TAGS as usize],
    /// Tags that a row says something of that cannot be understood.
    signs: Vec<u32>,
}

fn config(kind: Kind) -> crate::settings::Config {
    let settings = match kind {
        Kind::Comtrade => json!({"file": "/a.cfg"}),
        Kind::Wide => json!({"file": "/a.csv", "csv": {"time_format": "seconds", "quality": "q"}}),
        Kind::Long => {
            json!({"file": "/a.csv", "csv": {"time_format": "seconds", "quality": "q", "form": "long"}})
        }
    };
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

fn tags(kind: Kind) -> Vec<TagSpec> {
    let key = match kind {
        Kind::Wide => "column",
        Kind::Long => "name",
        Kind::Comtrade => "channel",
    };
    let tag = |tag: u32| {
        let value_kind = value_of(kind, tag as usize, 0).kind();
        tag_spec(tag, &format!("t{tag}"), value_kind, json!({key: format!("t{tag}")}))
    };
    (0..TAGS).map(tag).collect()
}

/// Value of a tag for the number of a step.
fn value_of(kind: Kind, tag: usize, number: i64) -> Value {
    match kind {
        Kind::Wide | Kind::Long if tag == TEXT => Value::Text(Text::cut(&format!("Mode {number}"))),
        _ => Value::I64(number),
    }
}

/// Rows of one instant, as they should be.
fn rows(kind: Kind, number: usize, truth: &[i64]) -> Vec<Vec<u8>> {
    let time = number as f64 * STEP.as_secs_f64();
    let worded = |(tag, number): (usize, &i64)| match value_of(kind, tag, *number) {
        Value::Text(text) => text.to_string(),
        _ => number.to_string(),
    };
    let values: Vec<String> = truth.iter().enumerate().map(worded).collect();
    match kind {
        Kind::Wide => vec![format!("{time:.1},{},good", values.join(",")).into()],
        Kind::Comtrade => vec![format!("{},,{}", number + 1, values.join(",")).into()],
        Kind::Long => values
            .iter()
            .enumerate()
            .map(|(tag, value)| format!("{time:.1},t{tag},{value},good").into())
            .collect(),
    }
}

/// One step with a fault in one of its rows.
fn corrupt(
    kind: Kind,
    step: &mut Step,
    fault: MessageFault,
    random: &mut FaultGenerator,
    before: &[Vec<u8>],
) {
    let index = random.below(step.rows.len());
    let all: Vec<u32> = (0..TAGS).collect();
    let own = if kind == Kind::Long { vec![index as u32] } else { all.clone() };
    let row = &mut step.rows[index];
    step.signs = match fault {
        // Of COMTRADE the next number tells it.
        MessageFault::Lost => {
            step.rows.remove(index);
            if kind == Kind::Comtrade { all } else { vec![] }
        }
        MessageFault::Cut => {
            // Within the last word, or a number of fields less.
            let last = if kind == Kind::Comtrade { b',' } else { b'g' };
            let end = row.iter().rposition(|byte| *byte == last).unwrap();
            row.truncate(random.below(end).max(1));
            all
        }
        MessageFault::Oversized if random.one_in(20) => {
            row.resize(MAX_LINE_BYTES + 1, b'9');
            all
        }
        MessageFault::Oversized => {
            row.extend(b",1,1");
            all
        }
        MessageFault::Unknown => {
            let text = String::from_utf8(row.clone()).unwrap();
            let mut cells: Vec<&str> = text.split(',').collect();
            // The time, or a value of wide rows; of long ones the value.
            let is_text = kind == Kind::Long && index == TEXT;
            let place = if is_text { 0 } else { [0, 2][random.below(2)] };
            cells[place] = ["?", "0x10", "1e", "\u{ff11}"][random.below(4)];
            *row = cells.join(",").into();
            own
        }
        MessageFault::Misassigned => {
            match kind {
                // The name of a signal cannot be read.
                Kind::Long => {
                    let text = String::from_utf8(row.clone()).unwrap();
                    *row = text.replace(&format!("t{index}"), "t\u{fffd}").into();
                    all
                }
                // The row of the instant before comes twice; COMTRADE's numbers tell it.
                Kind::Comtrade => {
                    *row = before[index].clone();
                    all
                }
                Kind::Wide => {
                    *row = before[index].clone();
                    vec![]
                }
            }
        }
        MessageFault::Duplicated => {
            let twice = row.clone();
            step.rows.insert(index, twice);
            vec![]
        }
        MessageFault::Reordered => {
            step.rows.push(before[index].clone());
            own
        }
    };
}

/// A recording with faults, and what is true in it.
fn record(kind: Kind, random: &mut FaultGenerator) -> (Vec<u8>, Vec<Step>) {
    let header = match kind {
        Kind::Wide => "time,t0,t1,t2,q\n",
        Kind::Long => "time,name,value,q\n",
        Kind::Comtrade => "",
    };
    let (mut text, mut steps) = (Vec::from(header), Vec::<Step>::new());
    let mut before = Vec::new();
    for number in 0..STEPS {
        let truth: [i64; TAGS as usize] = std::array::from_fn(|tag| (number * 10 + tag) as i64);
        let right = rows(kind, number, &truth);
        let mut step = Step { rows: right.clone(), truth, signs: Vec::new() };
        // The last second is whole.
        let fault = random.next_fault().filter(|_| number > 0 && number + 10 < STEPS);
        if let Some(fault) = fault {
            corrupt(kind, &mut step, fault, random, &before);
        }
        before = right;
        text.extend(step.rows.iter().flat_map(|row| [row, &b"\n"[..]].concat()));
        steps.push(step);
    }
    (text, steps)
}

fn open(kind: Kind, bytes: Vec<u8>, points: &Points, remarks: &mut Remarks) -> Box<dyn Source> {
    let file = std::io::Cursor::new(bytes);
    if kind != Kind::Comtrade {
        return Box::new(Table::new(&config(kind), file, points, remarks).unwrap());
    }
    let channel = |tag: u32| format!("{},t{tag},,,,1,0,0,-99998,99998,1,1,P\n", tag + 1);
    let channels: String = (0..TAGS).map(channel).collect();
    let cfg = format!(
        "a,b,1999\n{TAGS},{TAGS}A,0D\n{channels}50\n1\n10,{STEPS}\n01/02/2024,10:00:00.0\n\
         01/02/2024,10:00:00.0\nASCII\n1\n"
    );
    assert!(cfg.len() < MAX_CFG_BYTES);
    let cfg = Cfg::parse(cfg.as_bytes()).unwrap();
    let parts = Parts { path: PathBuf::new(), file, offset: 0, line: 1, bytes: None };
    Box::new(Oscillogram::new(&config(kind), cfg, parts, points, remarks).unwrap())
}

fn run(kind: Kind, seed: u64) {
    let mut random = FaultGenerator::new(seed);
    let (bytes, steps) = record(kind, &mut random);
    let tags = tags(kind);
    let points = Points::parse(&tags, &config(kind)).unwrap();
    let mut remarks = Remarks::new(host(), String::new());
    let recording = open(kind, bytes, &points, &mut remarks);
    let is_discrete = points.0.iter().map(|point| point.is_discrete()).collect();
    let mut player = Player::new(recording, is_discrete, None, 0, i64::MAX).unwrap();
    let mut oracle = TruthOracle::new(seed, Duration::ZERO, &tags);
    let start = oracle.wall_clock();
    let sink = oracle.sink();
    let mut out = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        for (tag, value) in (0..).zip(step.truth) {
            oracle.set_truth(tag, Some(value_of(kind, tag as usize, value)));
        }
        if !step.signs.is_empty() {
            oracle.note_sign(step.signs.iter().copied(), "a row that cannot be read");
        }
        let head = STEP * number as u32;
        player.advance(head.as_nanos() as i64, &mut out, &mut remarks).unwrap();
        let sample = |update: crate::recording::Update| Sample {
            tag: update.point as u32,
            value: update.value,
            quality: update.quality,
            source_time: Some(start + Duration::from_nanos(update.nanos as u64)),
            flags: Default::default(),
        };
        sink.publish(&out.drain(..).map(sample).collect::<Vec<_>>());
        oracle.check();
        if number + 1 < steps.len() {
            oracle.advance(STEP);
        }
    }
    oracle.check_recovered();
    let counts = oracle.counts();
    assert!(counts.good > counts.judged / 2, "{kind:?}: {counts:?}");
    assert!(counts.signs as usize > STEPS / 10, "{kind:?}: {counts:?}");
}

#[test]
fn rows_that_cannot_be_read_leave_no_value_good() {
    let kinds = [Kind::Wide, Kind::Long, Kind::Comtrade];
    let seeds = matrix_steps(SAMPLE).div_ceil((kinds.len() * STEPS) as u64);
    for kind in kinds {
        for seed in 1..=seeds {
            run(kind, seed);
        }
    }
}
