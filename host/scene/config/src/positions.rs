//! Text positions: JSON pointers to lines and columns.

use serde::Deserialize;

use crate::former_names::{FormerPlaces, RenamedSetting};
use crate::{Diagnostic, Severity, pointer};

/// Positions of all values in a text. They outlive parsing, so that later errors (a missing model
/// file, an unknown plugin) can be placed too.
#[derive(Clone, Debug, Default)]
pub struct Positions {
    text: String,
    /// Byte offsets at which lines start.
    line_starts: Vec<u32>,
    /// Values in the order of the text, parents before children.
    places: Vec<ValuePosition>,
    /// Former places of settings that were renamed.
    former: FormerPlaces,
}

/// One value of the text. Offsets are bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ValuePosition {
    /// Offset of the value.
    pub(crate) value: u32,
    /// Offset of the key in front of it, for a member of an object.
    pub(crate) key: Option<u32>,
    /// Index of the first place behind this value and all in it.
    pub(crate) next: u32,
}

impl Positions {
    /// `places` must describe `text`, which must be shorter than 4 GiB.
    pub(crate) fn new(text: &str, places: Vec<ValuePosition>) -> Self {
        let behind_breaks = text.match_indices('\n').map(|(at, _)| at as u32 + 1);
        let line_starts = std::iter::once(0).chain(behind_breaks).collect();
        Self { text: text.to_owned(), line_starts, places, former: FormerPlaces::default() }
    }

    /// Takes settings that were renamed: pointers to their present names lead to the text.
    pub fn add_former(&mut self, renamed: impl IntoIterator<Item = RenamedSetting>) {
        self.former.extend(renamed.into_iter().collect());
    }

    /// An error at the value of `pointer`, or where that does not exist (a
    /// default, say) at the nearest value around it.
    pub fn diagnostic(
        &self,
        pointer: impl Into<String>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Diagnostic {
        let pointer = self.former.find(&pointer.into());
        let offset = self.find(&pointer).map_or(0, |place| place.value);
        self.at_offset(Severity::Error, offset, pointer, cause.into(), remedy.into())
    }

    /// A diagnostic at the key that leads to `pointer`.
    pub(crate) fn at_key(
        &self,
        severity: Severity,
        pointer: &str,
        cause: String,
        remedy: String,
    ) -> Diagnostic {
        let pointer = self.former.find(pointer);
        let offset = self.find(&pointer).map_or(0, |place| place.key.unwrap_or(place.value));
        self.at_offset(severity, offset, pointer, cause, remedy)
    }

    /// A diagnostic at a byte of the text.
    pub(crate) fn at_offset(
        &self,
        severity: Severity,
        offset: u32,
        pointer: String,
        cause: String,
        remedy: String,
    ) -> Diagnostic {
        let (line, column) = self.line_and_column(offset);
        Diagnostic { severity, line, column, pointer, cause, remedy }
    }

    /// Line and column of the value at `pointer`, or of the nearest around it.
    pub fn locate(&self, pointer: &str) -> (u32, u32) {
        let pointer = self.former.find(pointer);
        self.line_and_column(self.find(&pointer).map_or(0, |place| place.value))
    }

    /// The byte at a column counted in bytes from 1, as serde_json counts.
    pub(crate) fn offset(&self, line: usize, column_bytes: usize) -> u32 {
        let start = self.line_starts.get(line.saturating_sub(1)).map_or(0, |start| *start as usize);
        let offset = start + column_bytes.saturating_sub(1);
        self.text.floor_char_boundary(offset) as u32
    }

    pub(crate) fn line_and_column(&self, offset: u32) -> (u32, u32) {
        let line = self.line_starts.partition_point(|start| *start <= offset);
        let start = self.line_starts[line - 1] as usize;
        let before = self.text.get(start..offset as usize).unwrap_or_default();
        (line as u32, before.chars().count() as u32 + 1)
    }

    fn find(&self, pointer: &str) -> Option<ValuePosition> {
        let mut at = 0;
        for token in pointer::tokens(pointer) {
            match self.child(at, &token) {
                Some(child) => at = child,
                None => break,
            }
        }
        self.places.get(at).copied()
    }

    /// Returns the last member of that name, since the last of duplicates counts; or the element
    /// of that index.
    fn child(&self, parent: usize, token: &str) -> Option<usize> {
        let end = self.places.get(parent)?.next as usize;
        let children =
            std::iter::successors(Some(parent + 1), |at| Some(self.places.get(*at)?.next as usize));
        let mut children = children.take_while(|at| *at < end);
        let first = self.places.get(parent + 1)?;
        if first.key.is_none() {
            return token.parse().ok().and_then(|index| children.nth(index));
        }
        children.filter(|at| self.is_called(*at, token)).last()
    }

    fn is_called(&self, at: usize, name: &str) -> bool {
        let key = self.places[at].key.map(|key| &self.text[key as usize..]);
        let Some(quoted) = key else { return false };
        let spelled = quoted.strip_prefix('"').unwrap_or_default();
        match spelled.split_once(['"', '\\']) {
            Some((plain, _)) if spelled[plain.len()..].starts_with('"') => plain == name,
            _ => decode_string(quoted).as_deref() == Some(name),
        }
    }
}

/// The JSON string that `text` starts with.
pub(crate) fn decode_string(text: &str) -> Option<String> {
    String::deserialize(&mut serde_json::Deserializer::from_str(text)).ok()
}
