//! The histories of all tags that have one.

use busbar_tags::{Change, HandleRemap, Moment, Snapshot, TagHandle};

use crate::reduce::Reducer;
use crate::series::Series;
use crate::{Point, PointState};

/// Tags whose history is kept. Each takes 23 kB where it changes always, so that all of
/// them take 96 MB.
pub const MAX_TAGS: usize = 4096;

/// Mark of a tag without a series.
const NONE: u32 = u32::MAX;

/// Time series of the tags of the last hours.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// The series of each tag, by handle.
    of_tags: Vec<u32>,
    series: Vec<Series>,
}

impl History {
    /// Creates empty series for the first [`MAX_TAGS`] of these tags.
    pub fn new(tags: impl IntoIterator<Item = TagHandle>) -> Self {
        let mut history = Self::default();
        for TagHandle(tag) in tags {
            let tag = tag as usize;
            if history.series.len() == MAX_TAGS {
                break;
            }
            if history.of_tags.len() <= tag {
                history.of_tags.resize(tag + 1, NONE);
            }
            if history.of_tags[tag] == NONE {
                history.of_tags[tag] = history.series.len() as u32;
                history.series.push(Series::default());
            }
        }
        history
    }

    /// Inherits the series of tags, by their new indices.
    pub fn inherit(&mut self, mut before: Self, numbers: &HandleRemap) {
        for old in 0..before.of_tags.len() as u32 {
            let new = numbers.tag(TagHandle(old));
            let Some(own) = new.and_then(|new| self.series_mut(new)) else { continue };
            if let Some(series) = before.series_mut(TagHandle(old)) {
                *own = std::mem::take(series);
            }
        }
    }

    /// Records a change as it arrives, so that none between two frames is lost.
    #[inline]
    pub fn note(&mut self, change: &Change) {
        if let Some(series) = self.series_mut(change.tag) {
            let state = PointState::from_value(change.value.as_ref(), change.quality);
            series.push(Point { at: change.received, state });
        }
    }

    /// Records changes without samples: tags that became stale, or are no longer.
    pub fn follow(&mut self, snapshot: Snapshot<'_>, now: Moment) {
        for &tag in snapshot.changed() {
            let (Some(series), Some(tag)) = (self.series_mut(tag), snapshot.state(tag)) else {
                continue;
            };
            let state = PointState::from_value(tag.value.as_ref(), tag.quality);
            if series.last() != Some(state) {
                series.push(Point { at: now, state });
            }
        }
    }

    /// Reports whether a tag has a series.
    pub fn has(&self, tag: TagHandle) -> bool {
        self.series_of(tag).is_some()
    }

    /// Returns the points of a tag between two times, downsampled to so many columns of a
    /// picture. The first point is the state at the beginning, where that is known. The result is
    /// empty for a tag without a series.
    pub fn between(&self, tag: TagHandle, from: Moment, to: Moment, columns: usize) -> Vec<Point> {
        let Some(series) = self.series_of(tag) else { return Vec::new() };
        let width = to.since(from).as_nanos() as u64 / columns.max(1) as u64;
        let mut reducer = Reducer::new(from, width);
        let (mut points, mut at_start) = (Vec::new(), None);
        series.for_each(|point| {
            if point.at <= from {
                at_start = Some(Point { at: from, ..point });
            } else if point.at <= to {
                if let Some(start) = at_start.take() {
                    reducer.push(start, |point| points.push(point));
                }
                reducer.push(point, |point| points.push(point));
            }
        });
        if let Some(start) = at_start {
            reducer.push(start, |point| points.push(point));
        }
        reducer.rest(|point| points.push(point));
        points
    }

    /// Bytes that all points take.
    pub fn bytes(&self) -> usize {
        self.series.iter().map(Series::bytes).sum()
    }

    fn series_of(&self, TagHandle(tag): TagHandle) -> Option<&Series> {
        self.series.get(*self.of_tags.get(tag as usize)? as usize)
    }

    fn series_mut(&mut self, TagHandle(tag): TagHandle) -> Option<&mut Series> {
        self.series.get_mut(*self.of_tags.get(tag as usize)? as usize)
    }
}
