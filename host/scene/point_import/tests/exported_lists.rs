//! One list as spreadsheets and tools of different systems save it: encodings, delimiters,
//! titles, `sep=` lines, rows of units, decimal commas, words for no value. All give the same
//! points, or are refused; none gives others.

use busbar_point_import::{Point, PointList};
use busbar_types::ValueKind;
use encoding_rs::{Encoding, GB18030, UTF_8, WINDOWS_1251, WINDOWS_1252};
use fastrand::Rng;
use serde_json::json;

/// Descriptions of a language, and the encoding of its systems.
const LANGUAGES: [(&[&str], &Encoding); 3] = [
    (&["Öltemperatur", "Störung Lüfter", "Außentemperatur", "Schlüsselschalter"], WINDOWS_1252),
    (&["Температура масла", "Положение выключателя", "Ток фазы А", "Уровень масла"], WINDOWS_1251),
    (&["主变压器油温", "断路器位置", "母线电压", "隔离开关分位"], GB18030),
];

fn pick<T: Copy>(rng: &mut Rng, choices: &[T]) -> T {
    choices[rng.usize(..choices.len())]
}

/// A row, before it is written.
#[derive(Debug)]
struct Row {
    tag: String,
    description: &'static str,
    kind: &'static str,
    unit: &'static str,
    low: Option<f64>,
    high: Option<f64>,
    scale: Option<f64>,
}

fn rows(words: &'static [&'static str], rng: &mut Rng) -> Vec<Row> {
    let number = |rng: &mut Rng| {
        let digits = rng.i32(0..4);
        let value = rng.i32(-2_000_000..2_000_000);
        rng.bool().then(|| f64::from(value) / 10_f64.powi(digits))
    };
    (0..rng.usize(2..20))
        .map(|index| {
            let is_state = rng.u8(..4) == 0;
            let (kind, unit) = if is_state { ("DPS", "") } else { ("Float8", "kV") };
            let (low, high) = (number(rng), number(rng));
            let is_band = !is_state && low.zip(high).is_none_or(|(low, high)| low < high);
            Row {
                tag: format!("=S12D1Q{index}"),
                description: words[rng.usize(..words.len())],
                kind,
                unit,
                low: low.filter(|_| is_band),
                high: high.filter(|_| is_band),
                scale: number(rng).filter(|scale| !is_state && *scale != 0.0 && *scale != 1.0),
            }
        })
        .collect()
}

/// A number with a decimal mark, and thousands parted where there is a separator.
fn written(value: f64, mark: char, separator: Option<char>) -> String {
    let text = value.to_string();
    let (whole, fraction) = text.split_once('.').map_or((text.as_str(), ""), |parts| parts);
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |digits| ("-", digits));
    let mut digits = digits.to_owned();
    let mut start = digits.len();
    while start > 3 && separator.is_some() {
        start -= 3;
        digits.insert(start, separator.unwrap_or_default());
    }
    let fraction = if fraction.is_empty() { String::new() } else { format!("{mark}{fraction}") };
    format!("{sign}{digits}{fraction}")
}

struct Export {
    delimiter: char,
    mark: char,
    separator: Option<char>,
    no_value: &'static str,
    end: &'static str,
}

impl Export {
    fn random(rng: &mut Rng) -> Self {
        let mark = pick(rng, &['.', ',']);
        let separators = if mark == '.' { [None, Some(',')] } else { [None, Some('.')] };
        // Systems with a decimal comma part fields by something else.
        let delimiters = if mark == '.' { [',', ';', '\t', '|'] } else { [';', ';', '\t', '|'] };
        Self {
            delimiter: pick(rng, &delimiters),
            mark,
            separator: pick(rng, &separators),
            no_value: pick(rng, &["", "", "-", "n/a", "---"]),
            end: pick(rng, &["\n", "\r\n"]),
        }
    }

    fn line(&self, cells: &[&str]) -> String {
        let quoted = cells.iter().map(|cell| {
            let is_special = cell.contains([self.delimiter, '"', '\n']);
            if is_special {
                format!("\"{}\"", cell.replace('"', "\"\""))
            } else {
                (*cell).to_owned()
            }
        });
        quoted.collect::<Vec<_>>().join(&self.delimiter.to_string()) + self.end
    }

    fn text(&self, rows: &[Row], rng: &mut Rng) -> String {
        let mut text = String::new();
        if rng.u8(..3) == 0 {
            text += &format!("sep={}{}", self.delimiter, self.end);
        }
        for _ in 0..rng.usize(..3) {
            let title = pick(rng, &["Signal list", "Name", "", "Station: North, rev. 3"]);
            text += &self.line(&[title, "", ""]);
        }
        let unit = pick(rng, &["Unit", "Eng Units", "unit (EU)"]);
        let header =
            ["Tag Name", "Description", "Data Type", unit, "Low", "High", "Scale", "Address.ioa"];
        text += &self.line(&header);
        if rng.u8(..3) == 0 {
            text += &self.line(&["", "[text]", "", "", "[kV]", "[kV]", "-", ""]);
        }
        for (index, row) in rows.iter().enumerate() {
            let number = |value: Option<f64>| {
                value.map_or(self.no_value.to_owned(), |v| written(v, self.mark, self.separator))
            };
            let [mut low, high, scale] = [row.low, row.high, row.scale].map(number);
            if row.low.is_some() && rng.u8(..8) == 0 {
                low += " kV";
            }
            let ioa = index.to_string();
            let mut cells =
                vec![&*row.tag, row.description, row.kind, row.unit, &low, &high, &scale, &ioa];
            if rng.u8(..5) == 0 {
                cells.extend(["", ""]);
            }
            text += &self.line(&cells);
            if rng.u8(..8) == 0 {
                text += &self.line(&["# remark", "", ""]);
            }
        }
        text
    }
}

fn encoded(text: &str, encoding: &'static Encoding, rng: &mut Rng) -> Vec<u8> {
    let wide = |mark: bool, little: bool| -> Vec<u8> {
        let units = mark.then_some(0xFEFF).into_iter().chain(text.encode_utf16());
        units.flat_map(|u: u16| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect()
    };
    match rng.u8(..5) {
        0 => text.as_bytes().to_vec(),
        1 => [b"\xEF\xBB\xBF", text.as_bytes()].concat(),
        2 => wide(true, rng.bool()),
        3 => wide(false, true),
        _ => encoding.encode(text).0.into_owned(),
    }
}

fn is_point(point: &Point, row: &Row, index: usize) -> bool {
    let kind = if row.kind == "DPS" { ValueKind::DoublePoint } else { ValueKind::F64 };
    let band = [row.low, row.high];
    point.tag == row.tag
        && point.description == row.description
        && point.value_type == kind
        && point.unit == row.unit
        && point.range == band
        && point.scale == row.scale.map(|scale| [scale, 0.0])
        && point.address == json!({ "ioa": index })
}

#[test]
fn every_export_gives_the_points_that_were_written() {
    let mut rng = Rng::with_seed(39);
    let (mut read, mut refused) = (0_u32, 0_u32);
    for round in 0..2_000 {
        let (words, encoding) = LANGUAGES[rng.usize(..LANGUAGES.len())];
        let rows = rows(words, &mut rng);
        let export = Export::random(&mut rng);
        let text = export.text(&rows, &mut rng);
        let list = PointList::parse(&encoded(&text, encoding, &mut rng));
        assert!(!list.is_unreadable, "{round}: {:?}\n{text}", list.faults);
        for fault in &list.faults {
            // A number that could be two, in a list that does not show which.
            assert!(fault.cause.contains(" may be "), "{round}: {fault}\n{text}");
        }
        for point in &list.points {
            let index = rows.iter().position(|row| row.tag == point.tag).expect("it was written");
            assert!(
                is_point(point, &rows[index], index),
                "{round}: {point:?}\n{:?}\n{text}",
                rows[index]
            );
        }
        assert!(list.points.len() + list.faults.len() >= rows.len(), "{round}: {text}");
        read += list.points.len() as u32;
        refused += list.faults.len() as u32;
    }
    assert!(read > 15_000 && refused > 10 && refused < read / 20, "{read} read, {refused} refused");
}

#[test]
fn what_is_assumed_of_a_list_is_told() {
    let text = "sep=;\nTag;Description;Address\n[id];[text];\nA;\u{d6}l;1\nB;K\u{fc}hler;2\n";
    let list = PointList::parse(&WINDOWS_1252.encode(text).0);
    assert_eq!(list.points.iter().map(|point| point.line).collect::<Vec<_>>(), [4, 5]);
    assert_eq!(list.points[0].description, "\u{d6}l");
    let told = list.remarks.join("\n");
    for part in ["read as windows-1252", "line 2 is its header", "line 3 explains the columns"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    assert_eq!(PointList::parse(UTF_8.encode(text).0.as_ref()).remarks.len(), 2);
    // Plain lists assume nothing.
    assert_eq!(PointList::parse(b"tag,address\nA,1\n").remarks, Vec::<String>::new());
}

#[test]
fn numbers_with_one_mark_are_read_as_the_list_writes_them() {
    let high_of = |rows: &str| {
        let list = PointList::parse(format!("tag;high;address\n{rows}").as_bytes());
        let high = list.points.iter().find(|point| point.tag == "A").map(|point| point.range[1]);
        (
            high,
            list.faults
                .first()
                .map(|fault| (fault.line, fault.column.clone(), fault.cause.clone())),
        )
    };
    assert_eq!(high_of("A;1.234;1\nB;0,5;2\n").0, Some(Some(1234.0)));
    assert_eq!(high_of("A;1.234;1\nB;0.5;2\n").0, Some(Some(1.234)));
    let (high, fault) = high_of("A;1.234;1\nB;7;2\n");
    assert_eq!(high, None);
    let cause = "'1.234' may be 1.234 or 1234: no other number shows which".to_owned();
    assert_eq!(fault, Some((2, "high".to_owned(), cause)));
    // The address's factor is written like the rest.
    let list = PointList::parse("tag;address.ioa;address.scale\nA;1;0,25\nB;2;1.500\n".as_bytes());
    assert_eq!(list.points[0].address, json!({"ioa": 1, "scale": 0.25}));
    assert_eq!(list.points[1].address, json!({"ioa": 2, "scale": 1500.0}));
}

#[test]
fn columns_of_two_words_for_one_thing_are_no_fault() {
    let list = PointList::parse(b"Tag,Description,Comment,Address\nA,Oil,see sheet 3,1\n");
    assert_eq!((list.faults.len(), list.points[0].description.as_str()), (0, "Oil"));
    assert_eq!(list.unused, ["Comment"]);
    // A usual name comes before a less usual one, wherever it stands.
    let text = b"Signal,Tag,Unit (raw),UOM,Unit,Min (kV),Low,Address\nx,A,V,W,kV,1,2,1\n";
    let list = PointList::parse(text);
    let point = &list.points[0];
    assert_eq!((point.tag.as_str(), point.unit.as_str(), point.range[0]), ("A", "kV", Some(2.0)));
    assert_eq!(list.unused, ["Signal", "Unit (raw)", "UOM", "Min (kV)"]);
    let list = PointList::parse(b"Signal name,Eng Unit,Low (kV),Low (MV),Address\nA,kV,2,3,1\n");
    let point = &list.points[0];
    assert_eq!((point.tag.as_str(), point.unit.as_str(), point.range[0]), ("A", "kV", Some(2.0)));
    assert_eq!(list.unused, ["Low (MV)"]);
    let list = PointList::parse(b"Tag,Unit,unit,Address\nA,kV,MW,1\n");
    assert!(list.is_unreadable && list.faults[0].cause.contains("two columns hold the same"));
}

/// Exports that were cut, mixed up or altered are points or faults with their lines.
#[test]
fn damaged_exports_are_points_or_faults() {
    let mut rng = Rng::with_seed(40);
    for round in 0..3_000 {
        let (words, encoding) = LANGUAGES[rng.usize(..LANGUAGES.len())];
        let rows = rows(words, &mut rng);
        let text = Export::random(&mut rng).text(&rows, &mut rng);
        let mut bytes = encoded(&text, encoding, &mut rng);
        for _ in 0..rng.usize(1..8) {
            let place = rng.usize(..bytes.len());
            match rng.u8(..5) {
                0 => bytes.truncate(place.max(1)),
                1 => bytes[place] ^= 1 << rng.u8(..8),
                2 => bytes.insert(place, pick(&mut rng, b"\"\n\r,;\t\0|=.-\xff\xfe")),
                3 => bytes.drain(..place.min(40)).for_each(drop),
                _ => bytes.rotate_left(place.min(7)),
            }
            if bytes.is_empty() {
                bytes.push(b'x');
            }
        }
        let list = PointList::parse(&bytes);
        let ends = bytes.iter().filter(|byte| b"\r\n".contains(byte)).count() as u64;
        for fault in &list.faults {
            assert!((1..=ends + 1).contains(&fault.line), "{round}: {fault}");
            assert!(!fault.cause.is_empty() && !fault.remedy.is_empty(), "{round}: {fault}");
        }
        assert!(!list.is_unreadable || !list.faults.is_empty(), "{round}");
        let mut tags: Vec<_> = list.points.iter().map(|point| &point.tag).collect();
        tags.sort();
        tags.dedup();
        assert_eq!(tags.len(), list.points.len(), "{round}");
        for point in &list.points {
            assert!(!point.tag.is_empty() && point.line <= ends + 1, "{round}: {point:?}");
            let numbers = point.range.iter().chain(&point.limits).flatten();
            assert!(numbers.chain(point.scale.iter().flatten()).all(|n| n.is_finite()));
        }
    }
}
