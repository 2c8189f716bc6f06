//! Location of a tag's value, quality and time in a data object, by the type that the server
//! returns (IEC 61850-7-3, 7: common data classes).

use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::typespec::TypeSpec;

use crate::service::Name;

/// Attributes that stand for the value of a structure, the first found first: process values of the
/// common data classes, then their parts.
pub(crate) const VALUES: [&str; 17] = [
    "stVal", "mag", "cVal", "mxVal", "general", "valWTr", "posVal", "actVal", "instMag",
    "instCVal", "frVal", "setVal", "setMag", "subVal", "ctlVal", "f", "i",
];
/// Levels of a data object.
const MAX_LEVELS: usize = 12;
/// Names that one message lists.
const MAX_LISTED: usize = 20;

/// The place of a tag in its data object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// From the data object to the value.
    names: Vec<String>,
    /// The same as indices.
    indices: Vec<usize>,
    /// Number of leading steps to the structure with quality and time.
    holder: usize,
    quality: Option<usize>,
    time: Option<usize>,
}

/// Path of component indices within a variable that is read or reported.
pub(crate) type Path = Vec<usize>;

/// Share of a point in a variable: value, quality, time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Share {
    pub(crate) value: Option<Path>,
    pub(crate) quality: Option<Path>,
    pub(crate) time: Option<Path>,
}

/// Finds the place of what follows a data object.
///
/// # Errors
/// In words: what is not there, or what to add.
pub(crate) fn locate(object: &TypeSpec, path: &[String]) -> Result<Place, String> {
    let mut found =
        Place { names: Vec::new(), indices: Vec::new(), holder: 0, quality: None, time: None };
    let mut spec = object;
    let mut wanted = path.iter();
    for _ in 0..=MAX_LEVELS {
        found.note_holder(spec);
        let TypeSpec::Structure { components, .. } = spec else {
            return match wanted.next() {
                None => Ok(found
                    .narrowed(matches!(spec, TypeSpec::VisibleString(_) | TypeSpec::MmsString(_)))),
                Some(name) => Err(format!("there is no {name} below {}", found.shown())),
            };
        };
        let index_of = |name: &str| {
            components.iter().position(|component| component.name.as_deref() == Some(name))
        };
        let index = match wanted.next() {
            Some(name) => index_of(name).ok_or_else(|| {
                format!("there is no {name} in {}, but {}", found.shown(), listed(spec))
            })?,
            None => VALUES.iter().find_map(|name| index_of(name)).ok_or_else(|| {
                format!("{} has several parts, name one: {}", found.shown(), listed(spec))
            })?,
        };
        let component = &components[index];
        found.names.push(component.name.clone().unwrap_or_default());
        found.indices.push(index);
        spec = &component.type_spec;
    }
    Err(format!("it is deeper than {MAX_LEVELS} levels"))
}

fn listed(spec: &TypeSpec) -> String {
    let names = spec.component_names();
    let more = if names.len() > MAX_LISTED { ", ..." } else { "" };
    format!("{}{more}", names[..names.len().min(MAX_LISTED)].join(", "))
}

impl Place {
    /// The deepest structure on the way that has a quality or a time keeps them.
    fn note_holder(&mut self, spec: &TypeSpec) {
        let TypeSpec::Structure { components, .. } = spec else { return };
        let index_of = |wanted: &str, is_right: fn(&TypeSpec) -> bool| {
            components.iter().position(|component| {
                component.name.as_deref() == Some(wanted) && is_right(&component.type_spec)
            })
        };
        let quality = index_of("q", |spec| matches!(spec, TypeSpec::BitString(_)));
        let time = index_of("t", |spec| matches!(spec, TypeSpec::UtcTime));
        if quality.is_some() || time.is_some() {
            (self.holder, self.quality, self.time) = (self.indices.len(), quality, time);
        }
    }

    /// Narrows a place without quality and time to its value, which is read by itself. A text is
    /// read with what is beside it: the library takes bytes that are no characters in a structure
    /// alone.
    fn narrowed(mut self, is_text: bool) -> Self {
        if self.quality.is_none() && self.time.is_none() {
            self.holder = self.indices.len().saturating_sub(usize::from(is_text));
        }
        self
    }

    fn shown(&self) -> String {
        let last = self.names.last();
        last.cloned().unwrap_or_else(|| "the data object".into())
    }

    /// Returns the names that lead from the data object to the value.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) fn has_quality(&self) -> bool {
        self.quality.is_some()
    }

    /// The variable to read, which has all of it.
    pub(crate) fn variable(&self, object: &Name) -> Name {
        let parts = &self.names[..self.holder];
        parts.iter().fold(object.clone(), |name, part| name.part(part))
    }

    /// Returns the share of the point in a variable that is this data object, or its part under
    /// these names; nothing for another part.
    pub(crate) fn share(&self, below: &[&str]) -> Option<Share> {
        let depth = below.len();
        let is_on_way =
            self.names.len() >= depth && self.names.iter().zip(below).all(|(a, b)| a == b);
        if is_on_way {
            let holder = self.indices.get(depth..self.holder);
            let beside =
                |index: Option<usize>| Some(holder?.iter().copied().chain([index?]).collect());
            return Some(Share {
                value: Some(self.indices[depth..].to_vec()),
                quality: beside(self.quality),
                time: beside(self.time),
            });
        }
        // Quality or time as a member of its own.
        let (last, parents) = below.split_last()?;
        let is_beside =
            parents.len() == self.holder && self.names.iter().zip(parents).all(|(a, b)| a == b);
        let alone = Share { value: None, quality: None, time: None };
        match *last {
            "q" if is_beside && self.quality.is_some() => {
                Some(Share { quality: Some(Path::new()), ..alone })
            }
            "t" if is_beside && self.time.is_some() => {
                Some(Share { time: Some(Path::new()), ..alone })
            }
            _ => None,
        }
    }
}

/// Follows a path into a value.
pub(crate) fn follow<'v>(value: &'v Value, path: &[usize]) -> Option<&'v Value> {
    path.iter().try_fold(value, |value, &index| value.member(index))
}

#[cfg(test)]
#[path = "locate_tests.rs"]
mod tests;
