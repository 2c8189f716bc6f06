use std::io::Cursor;

use super::*;
use crate::comtrade::writer::Recipe;
use crate::comtrade::{Cfg, DataType, Revision};

fn open(recipe: Recipe, dat: Vec<u8>) -> Data<Cursor<Vec<u8>>> {
    let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
    Data::open(Cursor::new(dat), RecordLayout::new(&cfg), 0, 1, None).unwrap()
}

#[track_caller]
fn assert_is(record: Record<'_>, recipe: &Recipe, sample: u64) {
    assert_eq!(record.sample, sample);
    assert_eq!(record.timestamp, Some(f64::from(recipe.timestamp(sample))));
    let analogs = recipe.analogs(sample);
    assert_eq!([record.analog(0).unwrap(), record.analog(1).unwrap()], analogs, "sample {sample}");
    for channel in 0..18 {
        let expected = Some(Recipe::digital(sample, channel));
        assert_eq!(record.digital(channel as usize).unwrap(), expected, "sample {sample}");
    }
}

const TYPES: [DataType; 4] =
    [DataType::Ascii, DataType::Binary, DataType::Binary32, DataType::Float32];

#[test]
fn records_of_all_types_are_read_in_any_order() {
    for revision in [Revision::Of1991, Revision::Of1999, Revision::Of2013] {
        for data in TYPES {
            let recipe = Recipe { samples: 3000, ..Recipe::new(revision, data) };
            let mut file = open(recipe, recipe.dat());
            for sample in 1..=recipe.samples {
                assert_is(file.read().unwrap().unwrap(), &recipe, sample);
            }
            assert!(file.read().unwrap().is_none());
            assert!(file.read().unwrap().is_none());
            for position in [0, 2999, 63, 64, 65, 1, 1500, 0] {
                file.seek(position).unwrap();
                assert_eq!(file.position(), position);
                assert_is(file.read().unwrap().unwrap(), &recipe, position + 1);
            }
        }
    }
}

#[test]
fn blocks_are_bounded_and_lead_back() {
    let recipe = Recipe { samples: 300_000, ..Recipe::new(Revision::Of1999, DataType::Ascii) };
    let mut file = open(recipe, recipe.dat());
    while file.read().unwrap().is_some() {}
    let Source::Text { blocks, .. } = &file.source else { panic!("it is text") };
    assert!(blocks.places.len() < MAX_BLOCKS && blocks.lines > FIRST_BLOCK_LINES);
    for position in [299_999, 123_456, 0] {
        file.seek(position).unwrap();
        assert_is(file.read().unwrap().unwrap(), &recipe, position + 1);
    }
}

#[test]
fn marks_of_1991_are_missing_where_they_are_no_values() {
    let cfg = Recipe::new(Revision::Of1991, DataType::Binary).cfg();
    let read = |cfg: &str, raw: i16| {
        let layout = RecordLayout::new(&Cfg::parse(cfg.as_bytes()).unwrap());
        let record = [&[1, 0, 0, 0, 0, 0, 0, 0][..], &raw.to_le_bytes(), &[0; 6]].concat();
        layout.read_binary(&record).analog(0).unwrap()
    };
    assert_eq!(read(&cfg, -1), Some(-1.0));
    assert_eq!(read(&cfg, i16::MIN), None);
    let unipolar = cfg.replacen("-30000", "0", 1);
    assert_eq!(read(&unipolar, -1), None);
    assert_eq!(read(&unipolar, 1), Some(1.0));
}

#[test]
fn a_malformed_line_does_not_stop_the_rest() {
    let recipe = Recipe { samples: 2, ..Recipe::new(Revision::Of1999, DataType::Ascii) };
    let good = String::from_utf8(recipe.record(1)).unwrap();
    let tail = &good[good.find(',').unwrap()..];
    let lines = [
        "1,2,3\n".to_owned(),
        format!("x{tail}"),
        format!("1,soon{}", &tail[tail[1..].find(',').unwrap() + 1..]),
        "\n".to_owned(),
        "\u{1}".repeat(MAX_LINE_BYTES + 1) + "\n",
        good.replacen(",0,", ",", 1),
        good.clone(),
    ];
    let mut file = open(recipe, lines.concat().into_bytes());
    let mut faults = Vec::new();
    loop {
        match file.read() {
            Ok(Some(record)) => break assert_is(record, &recipe, 1),
            Ok(None) => panic!("the last line is good"),
            Err(fault) => {
                assert!(!fault.is_final());
                faults.push(fault.to_string());
            }
        }
    }
    let expected = [
        "line 1: 3 fields instead of 22",
        "line 2: 'x' is no sample number",
        "line 3: 'soon' is no time stamp",
        "line 5 has more than",
        "line 6: 21 fields instead of 22",
    ];
    assert_eq!(faults.len(), expected.len(), "{faults:?}");
    for (fault, expected) in faults.iter().zip(expected) {
        assert!(fault.starts_with(expected), "{fault}");
    }
}

#[test]
fn a_value_that_is_none_is_named() {
    let recipe = Recipe { samples: 2, ..Recipe::new(Revision::Of1999, DataType::Ascii) };
    let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
    let (layout, mut fields) = (RecordLayout::new(&cfg), Vec::new());
    let line = format!("1,,abc,inf,2,{}", ["0"; 17].join(","));
    let record = layout.read_line(line.as_bytes(), &mut fields).unwrap();
    assert_eq!(record.timestamp, None);
    assert_eq!(record.analog(0), Err(RecordError::Value("abc".into())));
    assert_eq!(record.analog(1), Err(RecordError::Value("inf".into())));
    assert_eq!(record.digital(0), Err(RecordError::Value("2".into())));
    assert_eq!(record.digital(1), Ok(Some(false)));
    let line = line.replacen("abc,inf,2", ",99999,", 1);
    let record = layout.read_line(line.as_bytes(), &mut fields).unwrap();
    assert_eq!(
        (record.analog(0), record.analog(1), record.digital(0)),
        (Ok(None), Ok(None), Ok(None))
    );
}

#[test]
fn what_was_cut_short_is_counted() {
    let recipe = Recipe::new(Revision::Of1999, DataType::Binary);
    let mut dat = recipe.dat();
    dat.truncate(dat.len() - 5);
    let mut file = open(recipe, dat);
    assert_eq!((file.records(), file.rest_bytes()), (Some(999), 11));
    file.seek(998).unwrap();
    assert!(file.read().unwrap().is_some());
    assert!(file.read().unwrap().is_none());
    file.seek(u64::MAX).unwrap();
    assert!(file.read().unwrap().is_none());
}
