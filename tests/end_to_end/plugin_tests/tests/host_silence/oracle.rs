//! Oracle: what the inputs of a piece admit, by its own enumeration of completions.

use crate::station::{TAGS, Variant};

/// Verdict that the inputs of a piece ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Expected {
    Normal,
    Abnormal,
    Unknown,
    /// Any verdict except normal.
    NotNormal,
    /// Any verdict: it depends on a history that the oracle does not follow.
    Any,
}

/// Pieces of equipment with the overlay that judges each.
pub(crate) const PIECES: [(&str, &str); 12] = [
    ("condition", "=C1"),
    ("contour", "=K1"),
    ("power_overlay", "=W1"),
    ("load_flow", "=F1"),
    ("load_flow", "=F2"),
    ("sf6_density", "=G1"),
    ("switch_position", "=S1"),
    ("energisation", "=EB"),
    ("thermography", "=T1-L1"),
    ("thermography", "=T1-L2"),
    ("thermography", "=T1-L3"),
    ("transformer_thermal", "=H1"),
];

impl Expected {
    /// Reports whether a verdict of the host is what is asked for.
    pub(crate) fn allows(self, verdict: &str) -> bool {
        match self {
            Self::Normal => verdict == "normal",
            Self::Abnormal => verdict == "abnormal",
            Self::Unknown => verdict == "unknown",
            Self::NotNormal => verdict != "normal",
            Self::Any => true,
        }
    }

    /// Reports whether a normal verdict is a violation.
    pub(crate) fn forbids_normal(self) -> bool {
        !self.allows("normal")
    }
}

/// Known inputs by tag; none where an input may be anything.
pub(crate) type Known<'a> = &'a dyn Fn(&str) -> Option<f64>;

/// Returns what the inputs of a piece ask for.
pub(crate) fn expected(piece: &str, known: Known<'_>, variant: Variant) -> Expected {
    let of = variant.thresholds();
    match piece {
        "=C1" => completions(&["C1.oil", "C1.gas"], known, |v| v[0] >= of.oil || v[1] >= 100.0),
        "=K1" => completions(&["K1.level"], known, |v| v[0] < 0.0 || v[0] > of.level),
        "=W1" => completions(&["W1.power", "W1.trip"], known, |v| {
            v[0] < 10.0 || v[0] > of.power || v[1] > 0.0
        }),
        "=F1" | "=F2" => completions(&["F1.p", "F1.q"], known, |v| v[0].hypot(v[1]) > of.rating),
        "=G1" => compartment(known("G1.pressure"), known("G1.temperature")),
        "=S1" => switch(known("S1.position")),
        "=EB" => bus(known("E1.position"), known("E2.position")),
        "=H1" => transformer(known),
        contact => phase(contact, known),
    }
}

/// Judges every completion of the inputs that are not known.
fn completions(tags: &[&str], known: Known<'_>, is_abnormal: impl Fn(&[f64]) -> bool) -> Expected {
    let mut cases: Vec<Vec<f64>> = vec![Vec::new()];
    for tag in tags {
        let grid = TAGS.iter().find(|case| case.id == *tag).map_or(&[][..], |case| case.grid);
        let values: Vec<f64> = known(tag).map_or_else(|| grid.to_vec(), |value| vec![value]);
        let longer = |case: &Vec<f64>| -> Vec<Vec<f64>> {
            values.iter().map(|value| [case.as_slice(), &[*value]].concat()).collect()
        };
        cases = cases.iter().flat_map(longer).collect();
    }
    let abnormal = cases.iter().filter(|case| is_abnormal(case)).count();
    match abnormal {
        0 => Expected::Normal,
        all if all == cases.len() => Expected::Abnormal,
        _ => Expected::Unknown,
    }
}

/// A gas compartment by its pressure in bar and its temperature in °C. Without the temperature it is
/// anything from the cold in which the gas condenses to the heat in which no pressure of the walk is
/// enough.
fn compartment(pressure: Option<f64>, temperature: Option<f64>) -> Expected {
    const COLDEST: f64 = -60.0;
    const ALARM: f64 = 6.4;
    // At constant pressure the density falls by the temperature, in kelvins; what a real gas adds
    // to that decides none of the walk's cases.
    let is_low = |pressure: f64, temperature: f64| {
        pressure * (273.15 + 20.0) / (273.15 + temperature) <= ALARM
    };
    match (pressure, temperature) {
        (None, _) => Expected::Unknown,
        (Some(pressure), Some(temperature)) if is_low(pressure, temperature) => Expected::Abnormal,
        (Some(_), Some(_)) => Expected::Normal,
        (Some(pressure), None) if is_low(pressure, COLDEST) => Expected::Abnormal,
        (Some(_), None) => Expected::Unknown,
    }
}

/// A switch by its position; both ends at once are a contradiction.
fn switch(position: Option<f64>) -> Expected {
    const BOTH_ENDS: f64 = 3.0;
    match position {
        None => Expected::Unknown,
        Some(BOTH_ENDS) => Expected::Abnormal,
        Some(_) => Expected::Normal,
    }
}

/// A bus that a source feeds through a breaker, with an earth switch. What is energised may have an
/// earth that is not known; a source that is surely earthed is in doubt.
fn bus(breaker: Option<f64>, earth: Option<f64>) -> Expected {
    const CLOSED: f64 = 2.0;
    match (breaker, earth) {
        (None, _) => Expected::Unknown,
        (Some(CLOSED), Some(CLOSED)) => Expected::NotNormal,
        (Some(_), _) => Expected::Normal,
    }
}

/// A transformer whose load and temperatures are measured. Below the limits the history, which the
/// walk does not follow, may contradict what is measured.
fn transformer(known: Known<'_>) -> Expected {
    let is_above = |tag: &str, limit: f64| known(tag).is_some_and(|value| value > limit);
    let is_hot = is_above("H1.oil", 120.0) || is_above("H1.winding", 170.0);
    match is_hot || is_above("H1.load", 200.0) {
        true => Expected::Abnormal,
        false if known("H1.load").is_none() => Expected::NotNormal,
        false => Expected::Any,
    }
}

/// A contact among three phases in one air (DL/T 664-2016): above 90 °C it is abnormal by itself; the
/// temperatures of the others differ too little to matter. Without the air a phase that is not known
/// may be far cooler.
fn phase(contact: &str, known: Known<'_>) -> Expected {
    let phases = ["T1.l1", "T1.l2", "T1.l3"];
    let nodes = ["=T1-L1", "=T1-L2", "=T1-L3"];
    let own = nodes.iter().position(|node| *node == contact).map(|index| phases[index]);
    let Some(celsius) = own.and_then(known) else { return Expected::Unknown };
    if celsius > 90.0 {
        return Expected::Abnormal;
    }
    let are_others_known = phases.iter().all(|tag| known(tag).is_some());
    match known("A1.air").is_some() || are_others_known {
        true => Expected::Normal,
        false => Expected::Unknown,
    }
}
