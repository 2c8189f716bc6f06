//! Retained draw list: instances kept between frames, with a bounded change log.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::DrawInstance;

/// Changes that a list remembers; a reader of an older revision reads the whole list.
pub const MAX_DRAW_CHANGES: usize = 1 << 14;

/// Marker of an empty place.
const EMPTY: u32 = u32::MAX;

/// Instances to draw, in numbered places that may be empty. A log of changes lets a frame cost by
/// the changes, not by the number of instances.
///
/// Its revisions are like no other list's: a copy goes its own way from where it was made.
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    /// Index in `drawn` of each place, or [`EMPTY`].
    places: Vec<u32>,
    /// Instances in no particular order, each with its place: few of a large scene.
    drawn: Vec<(u32, DrawInstance)>,
    revision: u64,
    /// The revision before the first of `changes`.
    base: u64,
    /// Revisions, and the place that each changed.
    changes: VecDeque<(u64, u32)>,
}

impl DrawList {
    /// Makes a list with so many places, all empty.
    pub fn with_places(count: usize) -> Self {
        Self { places: vec![EMPTY; count], ..Self::default() }
    }

    /// Returns the number of places, empty ones included.
    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Reports whether the list has no places.
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Returns the instance in a place.
    pub fn get(&self, place: usize) -> Option<&DrawInstance> {
        self.get_drawn(*self.places.get(place)?)
    }

    /// Iterates over all instances, in the order of places.
    pub fn iter(&self) -> impl Iterator<Item = &DrawInstance> {
        self.places.iter().filter_map(|&index| self.get_drawn(index))
    }

    /// Iterates over all instances with their places, in order.
    pub(crate) fn iter_with_places(&self) -> impl Iterator<Item = (u32, &DrawInstance)> {
        (0..).zip(&self.places).filter_map(|(place, &index)| Some((place, self.get_drawn(index)?)))
    }

    fn get_drawn(&self, index: u32) -> Option<&DrawInstance> {
        // `EMPTY` is beyond all.
        self.drawn.get(index as usize).map(|(_, drawn)| drawn)
    }

    /// Puts something into a place, or empties it; places up to it are made.
    pub fn set(&mut self, place: usize, drawn: Option<DrawInstance>) {
        if place >= self.places.len() {
            self.places.resize(place + 1, EMPTY);
        }
        let index = self.places[place];
        if self.get_drawn(index) == drawn.as_ref() {
            return;
        }
        match (self.drawn.get_mut(index as usize), drawn) {
            (Some((_, known)), Some(drawn)) => *known = drawn,
            (None, Some(drawn)) => {
                self.places[place] = self.drawn.len() as u32;
                self.drawn.push((place as u32, drawn));
            }
            (_, None) => {
                self.places[place] = EMPTY;
                self.drawn.swap_remove(index as usize);
                if let Some(&(moved, _)) = self.drawn.get(index as usize) {
                    self.places[moved as usize] = index;
                }
            }
        }
        self.record_change(place);
    }

    /// Tints the instance in a place.
    pub fn set_highlight(&mut self, place: usize, highlight: [f32; 4]) {
        let index = self.places.get(place).copied().unwrap_or(EMPTY);
        if let Some((_, drawn)) = self.drawn.get_mut(index as usize)
            && drawn.highlight != highlight
        {
            drawn.highlight = highlight;
            self.record_change(place);
        }
    }

    fn record_change(&mut self, place: usize) {
        // No two lists that differ are of the same revision.
        static LAST: AtomicU64 = AtomicU64::new(0);
        self.revision = LAST.fetch_add(1, Ordering::Relaxed) + 1;
        if self.changes.len() == MAX_DRAW_CHANGES
            && let Some((oldest, _)) = self.changes.pop_front()
        {
            self.base = oldest;
        }
        self.changes.push_back((self.revision, place as u32));
    }

    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the places that changed since a revision, with repetitions. `None` where the list
    /// never had that revision, or too long ago.
    pub(crate) fn changed_since(&self, revision: u64) -> Option<impl Iterator<Item = usize>> {
        let seen = if revision == self.base {
            0
        } else {
            self.changes.binary_search_by_key(&revision, |&(revision, _)| revision).ok()? + 1
        };
        Some(self.changes.range(seen..).map(|&(_, place)| place as usize))
    }
}

/// Source of the instances that a frame draws.
#[derive(Clone, Copy, Debug)]
pub enum InstanceSource<'a> {
    /// Listed for this frame.
    Listed(&'a [DrawInstance]),
    /// Kept between frames, for as many as there may be.
    Retained(&'a DrawList),
}

impl<'a> InstanceSource<'a> {
    /// Iterates over all instances in order.
    pub fn iter(self) -> impl Iterator<Item = &'a DrawInstance> {
        let (listed, kept) = match self {
            Self::Listed(listed) => (Some(listed), None),
            Self::Retained(kept) => (None, Some(kept)),
        };
        listed.into_iter().flatten().chain(kept.into_iter().flat_map(DrawList::iter))
    }
}

#[cfg(test)]
mod tests {
    use glam::Mat4;

    use super::*;
    use crate::ModelHandle;

    fn drawn(object: u32) -> Option<DrawInstance> {
        Some(DrawInstance {
            model: ModelHandle(0),
            mesh: 0,
            cursor: 0,
            morph: None,
            world_from_mesh: Mat4::IDENTITY,
            object,
            highlight: [0.0; 4],
            first_feature: None,
        })
    }

    fn changed(list: &DrawList, since: u64) -> Option<Vec<usize>> {
        Some(list.changed_since(since)?.collect())
    }

    #[test]
    fn what_changed_is_told_and_what_did_not_is_not() {
        let mut list = DrawList::default();
        let empty = list.revision();
        list.set(2, drawn(1));
        assert_eq!((list.len(), list.iter().count()), (3, 1));
        let one = list.revision();
        list.set(2, drawn(1));
        list.set_highlight(2, [0.0; 4]);
        list.set_highlight(0, [1.0; 4]);
        assert_eq!(changed(&list, one), Some(vec![]));
        list.set(0, drawn(2));
        list.set_highlight(2, [1.0; 4]);
        list.set(0, None);
        assert_eq!(changed(&list, one), Some(vec![0, 2, 0]));
        assert_eq!(changed(&list, empty), Some(vec![2, 0, 2, 0]));
        assert_eq!((list.get(0), list.get(9)), (None, None));
    }

    #[test]
    fn places_keep_what_is_in_them_whatever_leaves_others() {
        let mut list = DrawList::default();
        for place in [5, 1, 3, 0] {
            list.set(place, drawn(place as u32));
        }
        list.set(1, None);
        list.set(1, None);
        list.set(5, None);
        list.set(4, drawn(4));
        let objects: Vec<u32> = list.iter().map(|drawn| drawn.object).collect();
        assert_eq!(objects, [0, 3, 4]);
        let held = (0..7).map(|place| list.get(place).map(|drawn| drawn.object));
        let expected = [Some(0), None, None, Some(3), Some(4), None, None];
        assert!(held.eq(expected));
    }

    #[test]
    fn a_copy_that_went_its_own_way_is_another_list() {
        let mut list = DrawList::default();
        list.set(0, drawn(1));
        let mut copy = list.clone();
        let common = list.revision();
        copy.set(0, drawn(2));
        list.set(0, drawn(3));
        assert_eq!(changed(&list, common), Some(vec![0]));
        assert_eq!(changed(&list, copy.revision()), None);
        assert_eq!(changed(&copy, list.revision()), None);
    }

    #[test]
    fn only_so_many_changes_are_remembered() {
        let mut list = DrawList::default();
        list.set(0, drawn(1));
        let first = list.revision();
        for object in 0..MAX_DRAW_CHANGES as u32 {
            list.set(0, drawn(object + 2));
        }
        assert_eq!(changed(&list, first).map(|places| places.len()), Some(MAX_DRAW_CHANGES));
        list.set(0, drawn(1));
        assert_eq!(changed(&list, first), None);
    }
}
