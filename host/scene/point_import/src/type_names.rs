//! Data type names of engineering tools, protocols and programming languages -> kinds of
//! values.
//!
//! Sources: OPC 10000-6 (built-in types), OPC DA (VARTYPE), IEC 61131-3 (elementary types),
//! IEC 61850-6 and 61850-7-3 (bTypes, common data classes), IEC 60870-5-101, 7.2.1 (type
//! identifications), and the manuals of Kepware, Ignition, WinCC, InTouch and PI.

use std::collections::HashMap;
use std::sync::OnceLock;

use busbar_types::ValueKind;

use crate::type_name_table::{
    BINARY, COMMAND, FLOATS, INTEGERS, NAME_SPACES, NAMES, STATES, STATUS_WORDS, STORAGE,
    STRUCTURE, TEXT, TEXTS, TIME, WIDTHS,
};

/// Limit of a type name, bytes.
const MAX_TYPE_BYTES: usize = 200;

/// Third parts of type identifications: with or without time, and the form of the value.
const DETAILS: [&str; 10] = ["NA", "NB", "NC", "ND", "TA", "TB", "TC", "TD", "TE", "TF"];

/// Meaning of a type name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TypeMeaning {
    /// One kind, whichever tool the name is of.
    Kind(ValueKind),
    /// Integer on the wire; a scale makes it a number with a fraction.
    Integer,
    /// `Double` or `Single`: a floating-point number, or a point of this kind.
    NumberOrPoint(ValueKind),
    /// Several meanings, described in words, which only other evidence can decide.
    Unclear(&'static str),
    /// Type that no tag can have, described in words.
    NoValue(&'static str),
    /// Name outside all tables.
    Unknown,
}

use TypeMeaning::{Integer, Kind, NoValue, NumberOrPoint, Unknown};

/// Finds the meaning of a type name. `is_iec60870` is true for an address of IEC 60870-5-101 or
/// 104, where a bare number is a type identification.
pub(crate) fn meaning_of(text: &str, is_iec60870: bool) -> TypeMeaning {
    if text.len() > MAX_TYPE_BYTES {
        return Unknown;
    }
    // Of the configuration's own words, the others are names of tools too.
    if text == "i64" {
        return Kind(ValueKind::I64);
    }
    if let Some(meaning) = iec60870_type(text).or_else(|| opcua_type(text)) {
        return meaning;
    }
    let Some(name) = without_lengths(text) else { return STRUCTURE };
    let words = words_of(&name, false);
    if let Some(meaning) = iec60870_number(&words, is_iec60870) {
        return meaning;
    }
    if words.iter().any(|word| word == "array") {
        return STRUCTURE;
    }
    let spaces = words.iter().take_while(|word| NAME_SPACES.contains(&word.as_str())).count();
    let bare = words.get(spaces..).unwrap_or_default();
    let found = match by_name(bare) {
        Unknown => by_words(bare),
        meaning => meaning,
    };
    match found {
        // A name space of a programming language or of OPC: there, no point is called so.
        NumberOrPoint(_) if spaces > 0 => Kind(ValueKind::F64),
        // `SwappedFloat`, `UnsignedInt16`.
        Unknown => by_words(words_of(&name, true).get(spaces..).unwrap_or_default()),
        meaning => meaning,
    }
}

/// Finds a whole name in the table, in one word or several.
fn by_name(words: &[String]) -> TypeMeaning {
    static TABLE: OnceLock<HashMap<String, TypeMeaning>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let all = NAMES.iter().flat_map(|(meaning, names)| names.iter().map(|n| (n, *meaning)));
        all.map(|(name, meaning)| (name.replace(' ', ""), meaning)).collect()
    });
    table.get(&words.concat()).copied().unwrap_or(Unknown)
}

/// Reads a name word by word; each of them must be known.
fn by_words(words: &[String]) -> TypeMeaning {
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    if words.len() > 1 && has(&["command", "commands", "cmd", "setpoint"]) {
        return COMMAND;
    }
    if has(&TEXTS) {
        return TEXT;
    }
    let (mut is_float, mut is_integer, mut is_state) = (false, false, false);
    for (index, word) in words.iter().enumerate() {
        let is_width = |word: &String| WIDTHS.contains(&word.as_str());
        let has_width = words.get(index + 1).is_some_and(is_width);
        match word.as_str() {
            "f" | "r" if has_width => is_float = true,
            "u" | "ui" | "s" | "i" if has_width => is_integer = true,
            // SCL: INT32U.
            "u" if index > 0 && is_width(&words[index - 1]) => is_integer = true,
            word if FLOATS.contains(&word) => is_float = true,
            word if INTEGERS.contains(&word) => is_integer = true,
            word if STATES.contains(&word) => is_state = true,
            "double" | "dbl" | "single" | "sng" => {}
            word if STORAGE.contains(&word) || STATUS_WORDS.contains(&word) => {}
            word if WIDTHS.contains(&word) => {}
            _ => return Unknown,
        }
    }
    let point = match (has(&["double", "dbl"]), has(&["single", "sng"])) {
        (true, false) => Some(ValueKind::DoublePoint),
        (false, true) => Some(ValueKind::Bool),
        _ => None,
    };
    match (is_float, is_integer, is_state, point) {
        (true, _, false, _) => Kind(ValueKind::F64),
        // `Double word`, `double integer`.
        (false, true, false, _) => Integer,
        (false, false, true, point) => Kind(point.unwrap_or(ValueKind::Bool)),
        (false, false, false, Some(point)) if has(&STATUS_WORDS) => Kind(point),
        (false, false, false, Some(point)) if has(&["point", "points"]) => Kind(point),
        (false, false, false, Some(_)) if has(&["32", "64"]) => Kind(ValueKind::F64),
        (false, false, false, Some(point)) => NumberOrPoint(point),
        _ => Unknown,
    }
}

/// Reads a type identification by name, such as `M_DP_TB_1 (31)` (IEC 60870-5-101, 7.2.1).
pub(crate) fn iec60870_type(text: &str) -> Option<TypeMeaning> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.split(|c: char| !is_part(c)).find_map(|token| {
        let token = token.to_ascii_uppercase();
        let mut parts = token.split('_');
        let (direction, group) = (parts.next()?, parts.next()?);
        let detail = parts.next().unwrap_or_default();
        // `M_SP_01` may be a motor's setpoint; `M_SP` alone is short for all of its types.
        let is_alone = detail.is_empty() && text.trim().len() == token.len();
        let is_whole = DETAILS.contains(&detail) || is_alone && direction == "M";
        match (direction, group) {
            _ if !is_whole => None,
            ("M", "SP" | "PS") => Some(Kind(ValueKind::Bool)),
            ("M", "DP") => Some(Kind(ValueKind::DoublePoint)),
            ("M", "EP") if ["TA", "TD"].contains(&detail) => Some(Kind(ValueKind::DoublePoint)),
            ("M", "EP") if !detail.is_empty() => Some(Kind(ValueKind::Bool)),
            ("M", "ME") => Some(Kind(ValueKind::F64)),
            ("M", "ST" | "IT") => Some(Integer),
            ("M", "BO") if !detail.is_empty() => Some(Integer),
            ("C" | "P" | "F", _) => Some(COMMAND),
            _ => None,
        }
    })
}

/// Reads a type identification as a number: `TI 31`, `<31>`, or `31` alone where the address
/// is of that protocol.
fn iec60870_number(words: &[String], is_iec60870: bool) -> Option<TypeMeaning> {
    let number = match words {
        [number] if is_iec60870 => number,
        [word, number] if ["ti", "tid", "tk", "typeid", "asdu"].contains(&word.as_str()) => number,
        [a, b, number] if [a.as_str(), b.as_str()] == ["type", "id"] => number,
        _ => return None,
    };
    iec60870_meaning(number.parse().ok()?)
}

/// Returns the meaning of a type identification (IEC 60870-5-101, 7.2.1.1 to 7.2.1.3).
pub(crate) fn iec60870_meaning(number: u64) -> Option<TypeMeaning> {
    match number {
        1 | 2 | 18..=20 | 30 | 39 | 40 => Some(Kind(ValueKind::Bool)),
        3 | 4 | 17 | 31 | 38 => Some(Kind(ValueKind::DoublePoint)),
        9..=14 | 21 | 34..=36 => Some(Kind(ValueKind::F64)),
        5..=8 | 15 | 16 | 32 | 33 | 37 => Some(Integer),
        45..=69 | 100..=127 => Some(COMMAND),
        _ => None,
    }
}

/// Reads the node id of a built-in data type, such as `i=11` (OPC 10000-6, 5.1.2).
fn opcua_type(text: &str) -> Option<TypeMeaning> {
    let id = text.trim().strip_prefix("ns=0;").unwrap_or(text.trim()).strip_prefix("i=")?;
    match id.parse().ok()? {
        1_u32 => Some(Kind(ValueKind::Bool)),
        2..=9 | 27..=29 => Some(Integer),
        10 | 11 | 26 | 50 | 290 => Some(Kind(ValueKind::F64)),
        12 | 20 | 21 => Some(TEXT),
        14..=16 => Some(BINARY),
        13 | 294 => Some(TIME),
        _ => Some(NoValue("a structure")),
    }
}

/// A type name without lengths, such as those of `decimal(10,2)`; `None` for an array.
fn without_lengths(text: &str) -> Option<String> {
    let mut name = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(['(', '[']) {
        let (before, inside) = rest.split_at(start);
        name += before;
        let is_array = inside.starts_with('[') && !before.trim().is_empty();
        let end = inside.find([')', ']'])?;
        let content = inside.get(1..end).unwrap_or_default();
        let is_length = content.chars().all(|c| c.is_ascii_digit() || " ,.:*".contains(c));
        // `STRING[20]` is a text.
        if is_array && is_length && by_words(&words_of(&name, false)) != TEXT {
            return None;
        }
        if !is_length || before.trim().is_empty() {
            name.push(' ');
            name += content;
            name.push(' ');
        }
        rest = inside.get(end + 1..).unwrap_or_default();
    }
    name += rest;
    Some(name)
}

/// The words and numbers of a name in small letters; cut at capitals too, if so wanted.
fn words_of(name: &str, cuts_at_capitals: bool) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last: Option<char> = None;
    for c in name.chars() {
        if !c.is_alphanumeric() {
            last = None;
            continue;
        }
        let starts = last.is_none_or(|last| {
            last.is_ascii_digit() != c.is_ascii_digit()
                || cuts_at_capitals && last.is_lowercase() && c.is_uppercase()
        });
        if starts {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
        last = Some(c);
    }
    words
}

#[cfg(test)]
#[path = "type_names_tests.rs"]
mod tests;
