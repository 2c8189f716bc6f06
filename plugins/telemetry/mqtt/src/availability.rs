//! Availability of sources, by the words that their topics carry.

use std::collections::BTreeSet;
use std::ops::Range;

use serde_json::Value as Json;

/// Words of a source that is there, unless the settings have others.
pub(crate) const ONLINE: [&str; 10] =
    ["online", "true", "1", "up", "connected", "available", "alive", "on", "yes", "birth"];
/// Words of a source that is gone, unless the settings have others.
pub(crate) const OFFLINE: [&str; 14] = [
    "offline",
    "false",
    "0",
    "down",
    "disconnected",
    "unavailable",
    "not available",
    "dead",
    "off",
    "no",
    "lost",
    "death",
    "gone",
    "not connected",
];
/// Characters of a state that a log line shows.
const MAX_SHOWN_CHARS: usize = 60;
/// The greatest whole number that is read as one, exact as f64.
const MAX_WHOLE: f64 = 9.0e15;

/// Availability topic, which reports whether the source of other topics is online.
#[derive(Clone, Debug)]
pub(crate) struct Availability {
    pub(crate) topic: String,
    pub(crate) covers: String,
    pub(crate) pointer: Option<String>,
    /// Words in the form of [`plain`].
    pub(crate) online: BTreeSet<String>,
    pub(crate) offline: BTreeSet<String>,
}

/// State of a source as its availability topic reports it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SourceState {
    There,
    Gone,
    /// The word is none of the settings; the source counts as gone.
    Unknown,
}

/// Source whose availability a topic reports.
pub(crate) struct Guard {
    pub(crate) availability: Availability,
    pub(crate) is_gone: bool,
    /// Unknown word that was logged last.
    told: Option<String>,
    pub(crate) points: Vec<Range<usize>>,
}

/// Result of a message on availability.
pub(crate) struct Notice {
    pub(crate) is_there: bool,
    /// A line for the log, where something changed; a warning where the word is unknown.
    pub(crate) line: Option<(bool, String)>,
}

impl Guard {
    pub(crate) fn new(availability: &Availability) -> Self {
        Self { availability: availability.clone(), is_gone: false, told: None, points: Vec::new() }
    }

    /// Begins a connection, in which the state of the source is not known yet.
    pub(crate) fn begin(&mut self) {
        (self.is_gone, self.told) = (false, None);
    }

    /// Takes a message; its payload is missing where it was too long.
    pub(crate) fn take(&mut self, payload: Option<&[u8]>) -> Notice {
        let Availability { topic, covers, pointer, online, offline } = &self.availability;
        let word = payload.map(|payload| word_of(payload, pointer.as_deref()));
        let (state, shown) = match word {
            None => (SourceState::Unknown, "a message that is too long".to_owned()),
            Some(Err(what)) => (SourceState::Unknown, what),
            Some(Ok(word)) => {
                let plain = plain(&word);
                let shown: String = word.trim().chars().take(MAX_SHOWN_CHARS).collect();
                let state = match (online.contains(&plain), offline.contains(&plain)) {
                    (true, _) => SourceState::There,
                    (_, true) => SourceState::Gone,
                    _ => SourceState::Unknown,
                };
                (state, format!("'{shown}'"))
            }
        };
        let is_there = state == SourceState::There;
        let is_changed = std::mem::replace(&mut self.is_gone, !is_there) == is_there;
        let line = match state {
            SourceState::Unknown if is_changed || self.told.as_ref() != Some(&shown) => {
                self.told = Some(shown.clone());
                let list = |words: &BTreeSet<String>| {
                    words.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
                };
                let text = format!(
                    "'{topic}' has {shown}, no word of online ({}) or offline ({}): the source of \
                     '{covers}' counts as gone; add the word to availability, or set pointer to \
                     where it is",
                    list(online),
                    list(offline)
                );
                Some((true, text))
            }
            SourceState::There if is_changed => Some((
                false,
                format!("'{topic}' has {shown}: the source of '{covers}' is there again"),
            )),
            SourceState::Gone if is_changed => {
                Some((false, format!("'{topic}' has {shown}: the source of '{covers}' is gone")))
            }
            _ => None,
        };
        if state != SourceState::Unknown {
            self.told = None;
        }
        Notice { is_there, line }
    }
}

/// Normalizes a word for comparison: lower case, no blanks around it, whole numbers without a
/// fraction.
pub(crate) fn plain(word: &str) -> String {
    let word = word.trim().to_lowercase();
    match word.parse::<f64>() {
        Ok(number) if number.fract() == 0.0 && number.abs() <= MAX_WHOLE => {
            (number as i64).to_string()
        }
        _ => word,
    }
}

/// Returns the word in a payload; otherwise a description of what it has instead.
fn word_of(payload: &[u8], pointer: Option<&str>) -> Result<String, String> {
    let Some(pointer) = pointer else {
        let text = std::str::from_utf8(payload).map_err(|_| "what is not UTF-8".to_owned())?;
        // Some sources send JSON: "online", in quotes.
        return Ok(serde_json::from_str::<String>(text).unwrap_or_else(|_| text.to_owned()));
    };
    let json: Json = serde_json::from_slice(payload).map_err(|_| "no JSON".to_owned())?;
    match json.pointer(pointer) {
        None => Err(format!("nothing at '{pointer}'")),
        Some(Json::String(text)) => Ok(text.clone()),
        Some(other) => Ok(other.to_string()),
    }
}

#[cfg(test)]
#[path = "availability_tests.rs"]
mod tests;
