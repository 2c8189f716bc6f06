//! The kind of a row: its type name, read in the light of its unit, scale and address.
//!
//! The most dangerous result is a measured value that shows as a switch position. So a name
//! with two readings is decided by evidence alone, and evidence against a name is a fault.

use busbar_types::ValueKind;

use crate::type_evidence::{AddressFamily, Clue, ClueSource, Evidence};
use crate::type_names::{TypeMeaning, meaning_of};

/// Error of a row whose type is unclear: cause and remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TypeFault {
    pub(crate) cause: String,
    pub(crate) remedy: String,
}

/// Kind of a row's values; `text` is the type cell, if the row has one.
///
/// # Errors
/// A name that is unknown or undecided, or evidence that contradicts it.
pub(crate) fn decide(text: Option<&str>, evidence: &Evidence) -> Result<ValueKind, TypeFault> {
    let number = evidence.number.first();
    let state = evidence.state.first();
    // A clue with a kind of its own counts before others.
    let state = evidence.state.iter().find(|clue| clue.kind.is_some()).or(state);
    let Some(text) = text else { return decide_without_name(number, state) };
    let is_iec60870 = evidence.family == Some(AddressFamily::Iec60870);
    match meaning_of(text, is_iec60870) {
        TypeMeaning::Kind(kind) if kind.is_state() => check_state(text, kind, evidence),
        TypeMeaning::Kind(ValueKind::Text) => check_text(text, evidence),
        TypeMeaning::Kind(kind) => check_number(text, kind, evidence),
        TypeMeaning::Integer => {
            let mut sources = evidence.number.iter().map(|clue| clue.source);
            let scales = [ClueSource::Scale, ClueSource::AddressScale];
            let is_scaled = sources.any(|source| scales.contains(&source));
            let kind = if is_scaled { ValueKind::F64 } else { ValueKind::I64 };
            check_number(text, kind, evidence)
        }
        TypeMeaning::NumberOrPoint(point) => decide_between(text, point, evidence, number, state),
        TypeMeaning::Unclear(readings) => Err(TypeFault {
            cause: format!("'{text}' may mean {readings}"),
            remedy: "write f64, i64, bool, double_point or text".into(),
        }),
        TypeMeaning::NoValue(what) => Err(TypeFault {
            cause: format!("'{text}' is {what}: no tag has such values"),
            remedy: "leave the row out, or give the type of a value that is f64, i64, bool, \
                     double_point or text"
                .into(),
        }),
        TypeMeaning::Unknown => Err(TypeFault {
            cause: format!("'{text}' is no type that is known"),
            remedy: "write f64 (or float, analog, AI), i64 (int), bool (single point, DI), \
                     double_point (DP) or text (string); commands are not for a viewer"
                .into(),
        }),
    }
}

fn decide_without_name(
    number: Option<&Clue>,
    state: Option<&Clue>,
) -> Result<ValueKind, TypeFault> {
    match (number, state) {
        (Some(number), Some(state)) => Err(TypeFault {
            cause: format!("{} is of a number, {} of states", number.what, state.what),
            remedy: "correct one of them, or give the type: f64, i64, bool, double_point or text"
                .into(),
        }),
        (_, Some(state)) => Ok(state.kind.unwrap_or(ValueKind::Bool)),
        (number, None) => Ok(number.and_then(|clue| clue.kind).unwrap_or_default()),
    }
}

/// A type of states, which has no unit and no measured value's address.
fn check_state(text: &str, kind: ValueKind, evidence: &Evidence) -> Result<ValueKind, TypeFault> {
    let is_other = |clue: &&Clue| clue.kind.is_some_and(|other| other != kind);
    // Ranges are filled in for all tags alike; a scale has its own fault.
    let is_told = |clue: &&Clue| !matches!(clue.source, ClueSource::Scale | ClueSource::Band);
    let contrary = evidence.number.iter().find(is_told);
    if let Some(clue) = contrary {
        return Err(TypeFault {
            cause: format!("'{text}' is a type of states, but {} is of a number", clue.what),
            remedy: "correct the type (f64 for a measured value), or the other".into(),
        });
    }
    match evidence.state.iter().find(is_other) {
        // Bits are the plugin's to judge: a double point may be two of them.
        Some(clue) if clue.source != ClueSource::AddressBit => Err(TypeFault {
            cause: format!(
                "'{text}' is {}, but {} is {}",
                kind.name(),
                clue.what,
                clue.kind.unwrap_or_default().name()
            ),
            remedy: "correct one of them".into(),
        }),
        _ => Ok(kind),
    }
}

/// A type of texts, which have neither unit nor scale, and whose address is of no number.
fn check_text(text: &str, evidence: &Evidence) -> Result<ValueKind, TypeFault> {
    // Ranges are filled in for all tags alike; a scale has its own fault.
    let is_told = |clue: &&Clue| !matches!(clue.source, ClueSource::Scale | ClueSource::Band);
    let number = evidence.number.iter().find(is_told);
    let state = evidence.state.iter().find(|clue| clue.kind.is_some());
    if evidence.family == Some(AddressFamily::Iec60870) {
        return Err(TypeFault {
            cause: format!("'{text}' is a type of texts, and IEC 60870-5 carries none"),
            remedy: "leave the row out, or correct its type".into(),
        });
    }
    match number.map(|clue| (clue, "a number")).or(state.map(|clue| (clue, "states"))) {
        None => Ok(ValueKind::Text),
        Some((clue, other)) => Err(TypeFault {
            cause: format!("'{text}' is a type of texts, but {} is of {other}", clue.what),
            remedy: "correct the type (f64 for a measured value, bool for a state), or the other"
                .into(),
        }),
    }
}

/// A type of numbers, to whose address the protocol gives no point.
fn check_number(text: &str, kind: ValueKind, evidence: &Evidence) -> Result<ValueKind, TypeFault> {
    match evidence.state.iter().find(|clue| clue.kind.is_some()) {
        Some(clue) => Err(TypeFault {
            cause: format!("'{text}' is a type of numbers, but {} is of states", clue.what),
            remedy: "correct the type (bool or double_point for states), or the other".into(),
        }),
        None => Ok(kind),
    }
}

/// Decides between the two meanings of `Double` and `Single`.
fn decide_between(
    text: &str,
    point: ValueKind,
    evidence: &Evidence,
    number: Option<&Clue>,
    state: Option<&Clue>,
) -> Result<ValueKind, TypeFault> {
    let readings = match point {
        ValueKind::DoublePoint => "a number of 64 bits or a double point (switch position)",
        _ => "a number of 32 bits or a single point (on or off)",
    };
    let remedy = format!("write f64 or {} as its type", point.name());
    match (number, state) {
        (Some(number), Some(state)) => Err(TypeFault {
            cause: format!(
                "'{text}' may mean {readings}: {} is of a number, {} of states",
                number.what, state.what
            ),
            remedy: format!("{remedy}, and correct the other"),
        }),
        (Some(_), None) => Ok(ValueKind::F64),
        (None, Some(Clue { kind: Some(kind), what, .. })) if *kind != point => Err(TypeFault {
            cause: format!("'{text}' may mean {readings}, but {what} is {}", kind.name()),
            remedy: format!("{remedy}, and correct the other"),
        }),
        (None, Some(_)) => Ok(point),
        (None, None) => match evidence.family {
            Some(family) if family.means_points() => Ok(point),
            Some(_) => Ok(ValueKind::F64),
            None => Err(TypeFault {
                cause: format!(
                    "'{text}' may mean {readings}, and neither unit, scale nor address tells which"
                ),
                remedy,
            }),
        },
    }
}
