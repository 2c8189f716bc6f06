//! Type names of tools, with and against the evidence of unit, scale and address: every row
//! gets the kind that its tool means, or a fault with its line, column and remedy.
//!
//! The rule is written here once more, by classes alone: the tables of the crate are not
//! known here.

use busbar_point_import::PointList;
use busbar_types::ValueKind;
use fastrand::Rng;

use ValueKind::{Bool, DoublePoint, F64, I64, Text};

/// Rows of one list: fewer than the faults that a list tells.
const ROWS: usize = 400;

/// A class of type names.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Class {
    Float,
    Integer,
    State(ValueKind),
    /// Ambiguous `Double` or `Single`.
    Either(ValueKind),
    Text,
    /// No tag has such values, or the name is of nothing.
    Refused,
    /// The list has no type.
    Missing,
}

/// Evidence of a cell for the kind.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Says {
    Nothing,
    Number,
    States,
    Kind(ValueKind),
    /// The protocol means points by `Double`, or numbers.
    MeansPoints,
    MeansNumbers,
}

const NAMES: &[(Class, &[&str])] = &[
    (
        Class::Float,
        &[
            "f64",
            "Float",
            "Float4",
            "Float8",
            "FLOAT32",
            "FLOAT64",
            "Real",
            "LReal",
            "LREAL",
            "VT_R4",
            "VT_R8",
            "System.Double",
            "xs:double",
            "double precision",
            "AI",
            "Analog",
            "M_ME_NC_1",
            "MV",
            "Floating-point number 64-bit IEEE 754",
            "Float CDAB",
        ],
    ),
    (
        Class::Integer,
        &[
            "Word",
            "DWord",
            "QWord",
            "DInt",
            "DINT",
            "Int",
            "UDInt",
            "LInt",
            "Short",
            "Long",
            "LLong",
            "BCD",
            "LBCD",
            "Int1",
            "Int2",
            "Int4",
            "Int8",
            "VT_I2",
            "VT_UI4",
            "Int16",
            "UInt32",
            "INT32U",
            "Byte",
            "u16",
            "S32",
            "Double Word",
            "counter",
            "M_IT_NA_1",
        ],
    ),
    (
        Class::State(Bool),
        &["Boolean", "BOOL", "bool", "VT_BOOL", "DI", "SPS", "M_SP_NA_1", "Single point", "Bit"],
    ),
    (
        Class::State(DoublePoint),
        &["double_point", "DPS", "Dbpos", "M_DP_TB_1", "Double point", "Double-bit Binary Input"],
    ),
    (Class::Either(DoublePoint), &["Double", "DOUBLE", "double"]),
    (Class::Either(Bool), &["Single", "SINGLE", "single"]),
    (
        Class::Refused,
        &["Date", "DateTime", "command", "C_SC_NA_1", "REAL[4]", "Char", "frob", "GUID"],
    ),
    (Class::Text, &["String", "VT_BSTR", "LocalizedText", "varchar(20)"]),
    (Class::Missing, &[""]),
];

const UNITS: &[(Says, &[&str])] = &[
    (Says::Number, &["MW", "kV", "A", "°C", "%", "Hz", "m³/h", "MVAr", "кВ", "兆瓦"]),
    (Says::States, &["open/closed", "0/1", "On/Off"]),
    (Says::Nothing, &["", "steps", "1", "n/a"]),
];

const SCALES: &[(bool, &str)] =
    &[(false, ""), (false, "1"), (true, "0.1"), (true, "-2"), (true, "1e-3")];

const ADDRESSES: &[(Says, &str)] = &[
    (Says::Nothing, "{\"topic\": \"site/p\"}"),
    (Says::Nothing, "40001"),
    (Says::Nothing, "{\"table\": \"holding\", \"register\": 3}"),
    (Says::Nothing, "{\"query\": \"q\", \"type\": \"double\"}"),
    (Says::Number, "{\"table\": \"holding\", \"register\": 3, \"type\": \"f64\"}"),
    (Says::Number, "{\"ioa\": 7, \"type\": \"measured\"}"),
    (Says::Number, "{\"ioa\": 7, \"type_id\": 36}"),
    (Says::Number, "{\"ioa\": 7, \"type\": \"counter\"}"),
    (Says::Number, "{\"ioa\": 7, \"type\": 32}"),
    (Says::MeansPoints, "{\"ioa\": 7, \"type\": \"bitstring\"}"),
    (Says::Number, "{\"ioa\": 7, \"TypeID\": \"M_ME_NC_1\"}"),
    (Says::Kind(Bool), "{\"ioa\": 7, \"type\": \"single\"}"),
    (Says::Kind(Bool), "{\"ioa\": 7, \"type\": 30}"),
    (Says::Kind(DoublePoint), "{\"ioa\": 7, \"type\": \"double\"}"),
    (Says::Kind(DoublePoint), "{\"IOA\": 7, \"type\": 31}"),
    (Says::Kind(DoublePoint), "M_DP_NA_1 12 7"),
    (Says::Kind(DoublePoint), "{\"point\": {\"kind\": [\"M_DP_TB_1\", 7]}}"),
    (Says::States, "{\"table\": \"discrete\", \"register\": 3}"),
    (Says::States, "{\"table\": \"coil\", \"register\": 3}"),
    (Says::MeansPoints, "{\"ioa\": 7}"),
    (Says::MeansPoints, "{\"ioa\": 7, \"common_address\": 12}"),
    (Says::MeansPoints, "{\"reference\": \"LD0/XCBR1.Pos\", \"fc\": \"ST\"}"),
    (Says::MeansNumbers, "{\"reference\": \"LD0/MMXU1.TotW\", \"fc\": \"MX\"}"),
    (Says::MeansNumbers, "{\"node\": \"ns=2;s=Q1.P\"}"),
    (Says::MeansNumbers, "ns=2;s=Q1.P"),
    (Says::MeansNumbers, "{\"node\": \"ns=2;s=M_SP_01\"}"),
    (Says::Nothing, "{\"topic\": \"pump/M_SP_Speed/C_SC\"}"),
    (Says::MeansNumbers, "{\"table\": \"input\", \"register\": 3, \"type\": \"i16\"}"),
];

/// The kind that a row is to have; `None` where it is to be refused.
fn expected(
    class: Class,
    unit: Says,
    is_scaled: bool,
    (address, text): (Says, &str),
) -> Option<ValueKind> {
    let is_number = is_scaled || unit == Says::Number || address == Says::Number;
    let of_address = match address {
        Says::Kind(kind) => Some(kind),
        _ => None,
    };
    let is_state = unit == Says::States || address == Says::States || of_address.is_some();
    match class {
        Class::Refused => None,
        Class::Text => {
            let is_iec60870 = text.to_lowercase().contains("\"ioa\"")
                || text.starts_with("M_")
                || text.contains("\"M_DP_TB_1\"");
            (!is_number && of_address.is_none() && !is_iec60870).then_some(Text)
        }
        Class::Float => of_address.is_none().then_some(F64),
        Class::Integer => of_address.is_none().then_some(if is_scaled { F64 } else { I64 }),
        Class::State(kind) => {
            let fits = of_address.is_none_or(|other| other == kind);
            (!is_number && fits).then_some(kind)
        }
        Class::Either(point) => match (is_number, is_state) {
            (true, true) => None,
            (true, false) => Some(F64),
            (false, true) => of_address.is_none_or(|other| other == point).then_some(point),
            (false, false) => match address {
                Says::MeansPoints => Some(point),
                Says::MeansNumbers => Some(F64),
                _ => None,
            },
        },
        Class::Missing => match (is_number, is_state) {
            (true, true) => None,
            (_, true) => Some(of_address.unwrap_or(Bool)),
            _ => Some(F64),
        },
    }
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}

/// A row of the list, and what is to come of it.
type Case<'a> = ([&'a str; 4], Class, Option<ValueKind>);

/// Reads rows as one list.
fn check_all(cases: &[Case<'_>]) {
    let mut text = "tag,type,unit,scale,address\n".to_owned();
    for (index, (row, ..)) in cases.iter().enumerate() {
        text += &format!("Q{index},{}\n", row.map(quoted).join(","));
    }
    let list = PointList::parse(text.as_bytes());
    let mut points = list.points.iter().peekable();
    for (index, (row, class, want)) in cases.iter().enumerate() {
        let line = index as u64 + 2;
        let found = points.next_if(|point| point.line == line).map(|point| point.value_type);
        let faults: Vec<_> = list.faults.iter().filter(|fault| fault.line == line).collect();
        assert_eq!(found, *want, "{row:?}: {faults:?}");
        assert_eq!(faults.is_empty(), want.is_some(), "{row:?}: {faults:?}");
        let Some(fault) = faults.first() else { continue };
        let is_placed =
            fault.column == "type" || fault.column == "scale" || *class == Class::Missing;
        assert!(is_placed && !fault.remedy.is_empty(), "{row:?}: {fault}");
        if let Class::Either(point) = class {
            let both = fault.remedy.contains("f64") && fault.remedy.contains(word(*point));
            assert!(both && fault.cause.contains("may mean a number"), "{row:?}: {fault}");
        }
    }
}

fn word(kind: ValueKind) -> &'static str {
    kind.name()
}

#[test]
fn every_type_name_with_every_evidence_has_its_kind_or_a_fault() {
    let mut counts = [0_u32; 2];
    let mut cases = Vec::new();
    for (class, names) in NAMES {
        for name in *names {
            for (unit_says, units) in UNITS {
                for unit in *units {
                    for (is_scaled, scale) in SCALES {
                        for (says, address) in ADDRESSES {
                            let want = expected(*class, *unit_says, *is_scaled, (*says, address));
                            counts[usize::from(want.is_some())] += 1;
                            cases.push(([*name, *unit, *scale, *address], *class, want));
                        }
                    }
                }
            }
        }
    }
    cases.chunks(ROWS).for_each(check_all);
    assert!(counts[0] > 30_000 && counts[1] > 50_000, "{counts:?}");
}

/// Case, marks and blanks that people and tools put into names change no kind.
#[test]
fn names_are_read_however_they_are_written() {
    let mut rng = Rng::with_seed(39);
    for _ in 0..5_000 {
        let (class, names) = NAMES[rng.usize(..NAMES.len())];
        let name = names[rng.usize(..names.len())];
        // The configuration's own words are of its own case.
        if ["f64", "u16", ""].contains(&name) {
            continue;
        }
        let mut written = String::new();
        for c in name.chars() {
            let swapped =
                if c.is_uppercase() { c.to_lowercase().next() } else { c.to_uppercase().next() };
            written.push(if rng.u8(..4) == 0 { swapped.unwrap_or(c) } else { c });
        }
        let written = match rng.u8(..5) {
            0 => format!(" {written}  "),
            1 => written.replace(' ', "_"),
            2 => written.replace(' ', "  "),
            3 => format!("{written}\u{a0}"),
            _ => written,
        };
        let (unit_says, units) = UNITS[rng.usize(..UNITS.len())];
        let (is_scaled, scale) = SCALES[rng.usize(..SCALES.len())];
        let (says, address) = ADDRESSES[rng.usize(..ADDRESSES.len())];
        let row = [&written, units[rng.usize(..units.len())], scale, address];
        check_all(&[(row, class, expected(class, unit_says, is_scaled, (says, address)))]);
    }
}

/// The cases of the issue.
#[test]
fn a_measured_value_is_never_a_switch_position() {
    let kind_of = |row: &str| {
        let list = PointList::parse(format!("tag,type,unit,low,high,address\n{row}\n").as_bytes());
        list.points.first().map(|point| point.value_type)
    };
    for name in ["Float8", "LReal", "Word", "DInt", "Long", "Double", "Single"] {
        let kind = kind_of(&format!("T1.P,{name},MW,,,\"{{\"\"ioa\"\": 4001}}\""));
        assert!(matches!(kind, Some(F64 | I64)), "{name}: {kind:?}");
    }
    assert_eq!(kind_of("Q1,Double,,,,\"{\"\"ioa\"\": 100}\""), Some(DoublePoint));
    assert_eq!(kind_of("Q1,Single,,,,\"{\"\"ioa\"\": 100}\""), Some(Bool));
    assert_eq!(kind_of("T1.P,Double,,-250,250,x"), Some(F64), "a range of a measured value");
    for row in ["Q1,Double,,,,x", "Q1,Single,,,,x", "Q1,Double,,0,3,x", "Q1,Double,,0,100,x"] {
        assert_eq!(kind_of(row), None, "{row}");
    }
}
