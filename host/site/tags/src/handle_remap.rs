//! Handle remap: maps the indices of one set of things to those of another.

use crate::{TagHandle, TagSet};

/// Mark of an index whose thing was removed.
const GONE: u32 = u32::MAX;

/// Map from the indices of one set to those of another. It translates messages of plugins that
/// still use the old indices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct HandleRemap {
    /// New indices by old index; none where all are unchanged.
    new: Option<Vec<u32>>,
}

impl HandleRemap {
    /// Creates a map from the new index of each old thing; `None` for a removed thing.
    pub fn new(new: impl ExactSizeIterator<Item = Option<u32>>) -> Self {
        let new: Vec<u32> = new.map(|number| number.unwrap_or(GONE)).collect();
        let is_plain = new.iter().zip(0..).all(|(new, old)| *new == old);
        Self { new: (!is_plain).then_some(new) }
    }

    /// Maps the tags of one set to those of another, by their ids.
    pub fn between_tag_sets(before: &TagSet, after: &TagSet) -> Self {
        // Both are mostly alike: what follows the last one found is tried first.
        let mut next = 0;
        let specs = after.specs();
        let found = before.specs().iter().map(|spec| {
            let at = match specs.get(next) {
                Some(other) if other.id == spec.id => next,
                _ => specs.binary_search_by(|other| other.id.cmp(&spec.id)).ok()?,
            };
            next = at + 1;
            Some(at as u32)
        });
        let found: Vec<Option<u32>> = found.collect();
        Self::new(found.into_iter())
    }

    /// Reports whether all indices are unchanged.
    pub fn is_identity(&self) -> bool {
        self.new.is_none()
    }

    /// Returns the new index; `None` for a removed thing.
    pub fn index(&self, old: u32) -> Option<u32> {
        match &self.new {
            None => Some(old),
            Some(new) => new.get(old as usize).copied().filter(|number| *number != GONE),
        }
    }

    /// Returns the new handle of a tag; `None` for a removed tag.
    pub fn tag(&self, TagHandle(old): TagHandle) -> Option<TagHandle> {
        self.index(old).map(TagHandle)
    }

    /// Composes this map with a later one.
    pub fn then(&self, next: &Self) -> Self {
        match &self.new {
            None => next.clone(),
            Some(_) if next.is_identity() => self.clone(),
            Some(new) => Self::new(new.iter().map(|&number| match number {
                GONE => None,
                number => next.index(number),
            })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_followed_from_set_to_set() {
        let numbers = |new: &[Option<u32>]| HandleRemap::new(new.iter().copied());
        let first = numbers(&[Some(0), Some(2), None]);
        assert_eq!([0, 1, 2, 9].map(|old| first.index(old)), [Some(0), Some(2), None, None]);
        assert!(numbers(&[Some(0), Some(1)]).is_identity());
        let second = numbers(&[Some(1), Some(0), None]);
        assert_eq!([0, 1, 2].map(|old| first.then(&second).index(old)), [Some(1), None, None]);
        assert_eq!(HandleRemap::default().then(&second), second);
        assert_eq!(second.then(&HandleRemap::default()), second);
    }
}
