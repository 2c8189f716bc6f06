//! The history of one tag.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_tags::Moment;

use crate::point::Packed;
use crate::reduce::Reducer;
use crate::{Point, PointState};

/// Points that are kept as they came.
pub const MAX_FINE_POINTS: usize = 256;
/// Retention time of a history.
pub const MAX_AGE: Duration = Duration::from_secs(4 * 3600);
/// Width of the buckets to which older points are reduced.
pub const BUCKET: Duration = Duration::from_secs(60);

const BUCKET_NANOS: u64 = BUCKET.as_secs() * 1_000_000_000;
/// Room is taken for so many points at a time: doubling would waste half of it.
const ROOM: usize = 64;

/// Time series of one tag, with fine and reduced points.
#[derive(Clone, Debug)]
pub(crate) struct Series {
    /// Reduced, before those in `reducer`, which are before `fine`.
    coarse: VecDeque<Packed>,
    reducer: Reducer,
    fine: VecDeque<Packed>,
}

impl Default for Series {
    fn default() -> Self {
        let reducer = Reducer::new(Moment(0), BUCKET_NANOS);
        Self { coarse: VecDeque::new(), reducer, fine: VecDeque::new() }
    }
}

impl Series {
    /// Adds the state of the tag from now on.
    pub(crate) fn push(&mut self, point: Point) {
        let last = self.fine.back().map_or(Moment(0), |last| last.at());
        let at = point.at.max(last);
        if self.fine.len() >= MAX_FINE_POINTS
            && let Some(oldest) = self.fine.pop_front()
        {
            let coarse = &mut self.coarse;
            self.reducer.push(oldest.point(), |point| push(coarse, point));
        }
        push(&mut self.fine, Point { at, ..point });
        self.forget(at.before(MAX_AGE));
    }

    /// Returns the state since the last point.
    pub(crate) fn last(&self) -> Option<PointState> {
        self.fine.back().map(|last| last.point().state)
    }

    /// Drops the points before a time, except the last of them, which still holds.
    fn forget(&mut self, border: Moment) {
        while self.coarse.get(1).is_some_and(|second| second.at() <= border) {
            self.coarse.pop_front();
        }
    }

    /// Visits all points, in order.
    pub(crate) fn for_each(&self, mut give: impl FnMut(Point)) {
        self.coarse.iter().for_each(|packed| give(packed.point()));
        self.reducer.rest(&mut give);
        self.fine.iter().for_each(|packed| give(packed.point()));
    }

    /// Bytes that points take.
    pub(crate) fn bytes(&self) -> usize {
        (self.coarse.capacity() + self.fine.capacity()) * size_of::<Packed>()
    }
}

fn push(into: &mut VecDeque<Packed>, point: Point) {
    if into.len() == into.capacity() {
        into.reserve_exact(ROOM);
    }
    into.push_back(Packed::from_point(point));
}
