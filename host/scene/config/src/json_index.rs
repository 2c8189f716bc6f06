//! Index of a JSON text in one pass: positions of values, duplicate keys, nesting too deep.

use std::borrow::Cow;

use crate::positions::{ValuePosition, decode_string};
use crate::{Diagnostic, MAX_DIAGNOSTICS, MAX_NESTING_DEPTH, Positions, Severity, join_pointer};

/// Result of the indexing pass.
#[derive(Default)]
pub(crate) struct Index {
    /// Values in the order of the text, parents before children.
    pub(crate) places: Vec<ValuePosition>,
    /// Keys that an object has twice; at most [`MAX_DIAGNOSTICS`].
    pub(crate) duplicates: Vec<DuplicateKey>,
    /// Number of further duplicate keys.
    pub(crate) more_duplicates: usize,
    /// Offset and pointer of the first value below [`MAX_NESTING_DEPTH`].
    pub(crate) too_deep: Option<(u32, String)>,
}

/// A key that an object has twice.
pub(crate) struct DuplicateKey {
    offset: u32,
    first_offset: u32,
    pointer: String,
}

/// An array or object that is not closed yet.
struct OpenContainer<'t> {
    /// Index of its place.
    place: usize,
    is_object: bool,
    /// Commas passed: the index of the element that comes, in an array.
    commas: usize,
    /// Keys so far and their offsets, in an object.
    keys: Vec<(Cow<'t, str>, u32)>,
}

/// Indexes a text that the strict parser has accepted.
pub(crate) fn index(text: &str) -> Index {
    let mut scan = IndexScanner { text, found: Index::default(), open: Vec::new(), key: None };
    let mut at = 0;
    while let Some(byte) = text.as_bytes().get(at) {
        at = scan.token(*byte, at);
    }
    scan.found
}

struct IndexScanner<'t> {
    text: &'t str,
    found: Index,
    open: Vec<OpenContainer<'t>>,
    /// Offset of the key whose value comes next.
    key: Option<u32>,
}

impl<'t> IndexScanner<'t> {
    /// Scans the token that starts at `at`; returns the offset behind it.
    fn token(&mut self, byte: u8, at: usize) -> usize {
        match byte {
            b' ' | b'\t' | b'\r' | b'\n' | b':' => at + 1,
            b',' => {
                if let Some(open) = self.open.last_mut() {
                    open.commas += 1;
                }
                at + 1
            }
            b'{' | b'[' => {
                self.enter(byte == b'{', at);
                at + 1
            }
            b'}' | b']' => {
                self.leave();
                at + 1
            }
            b'"' => {
                let end = self.string_end(at);
                match self.open.last_mut().filter(|open| open.is_object && self.key.is_none()) {
                    Some(object) => {
                        object.keys.push((key_text(&self.text[at..end]), at as u32));
                        self.key = Some(at as u32);
                    }
                    None => self.add_place(at),
                }
                end
            }
            _ => {
                self.add_place(at);
                let rest = self.text[at..].bytes();
                at + rest.take_while(|b| !matches!(b, b',' | b']' | b'}' | b' ' | 9..=13)).count()
            }
        }
    }

    fn add_place(&mut self, at: usize) {
        let next = self.found.places.len() as u32 + 1;
        self.found.places.push(ValuePosition { value: at as u32, key: self.key.take(), next });
    }

    fn enter(&mut self, is_object: bool, at: usize) {
        if self.open.len() >= MAX_NESTING_DEPTH && self.found.too_deep.is_none() {
            self.found.too_deep = Some((at as u32, self.pointer()));
        }
        let place = self.found.places.len();
        self.add_place(at);
        self.open.push(OpenContainer { place, is_object, commas: 0, keys: Vec::new() });
    }

    fn leave(&mut self) {
        let Some(mut closed) = self.open.pop() else {
            return;
        };
        self.found.places[closed.place].next = self.found.places.len() as u32;
        closed.keys.sort_unstable();
        for pair in closed.keys.windows(2) {
            let [(first, first_offset), (key, offset)] = pair else {
                continue;
            };
            if first != key {
                continue;
            }
            if self.found.duplicates.len() >= MAX_DIAGNOSTICS {
                self.found.more_duplicates += 1;
            } else {
                self.found.duplicates.push(DuplicateKey {
                    offset: *offset,
                    first_offset: *first_offset,
                    pointer: join_pointer(&self.pointer(), key),
                });
            }
        }
    }

    /// The pointer of the value being read.
    fn pointer(&self) -> String {
        self.open.iter().fold(String::new(), |pointer, open| match open.keys.last() {
            Some((key, _)) => join_pointer(&pointer, key),
            None => join_pointer(&pointer, open.commas),
        })
    }

    /// The offset behind the string that starts at `start`.
    fn string_end(&self, start: usize) -> usize {
        let bytes = self.text.as_bytes();
        let mut at = start + 1;
        loop {
            match bytes.get(at) {
                Some(b'"') => return at + 1,
                Some(b'\\') => at += 2,
                Some(_) => at += 1,
                None => return bytes.len(),
            }
        }
    }
}

/// The key that a quoted string spells.
fn key_text(quoted: &str) -> Cow<'_, str> {
    if quoted.contains('\\') {
        return Cow::Owned(decode_string(quoted).unwrap_or_default());
    }
    Cow::Borrowed(quoted.trim_matches('"'))
}

impl DuplicateKey {
    pub(crate) fn diagnostic(self, positions: &Positions) -> Diagnostic {
        let (line, column) = positions.line_and_column(self.first_offset);
        let cause = format!("this key is given twice, first at line {line}, column {column}");
        let remedy = "remove one of the two".to_owned();
        positions.at_offset(Severity::Error, self.offset, self.pointer, cause, remedy)
    }
}
