//! Many points to few that look the same.

use busbar_tags::Moment;

use crate::{Point, PointState};

/// Points that stay of one bucket at most.
pub(crate) const MAX_OF_BUCKET: usize = 5;

/// Downsampling (M4) of a time bucket to its first, least, greatest and last point, and its first
/// one that was not good, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Reducer {
    start: Moment,
    width_nanos: u64,
    open: Option<Bucket>,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    number: u64,
    first: Point,
    last: Point,
    least: Option<Point>,
    greatest: Option<Point>,
    doubtful: Option<Point>,
}

impl Reducer {
    /// Buckets of `width_nanos`, the first from `start` on.
    pub(crate) fn new(start: Moment, width_nanos: u64) -> Self {
        Self { start, width_nanos: width_nanos.max(1), open: None }
    }

    /// Adds a point, not before the one before it. Emits the reduced points of a bucket that it
    /// completes.
    pub(crate) fn push(&mut self, point: Point, give: impl FnMut(Point)) {
        let number = point.at.0.saturating_sub(self.start.0) / self.width_nanos;
        match &mut self.open {
            Some(open) if open.number == number => open.add(point),
            _ => {
                if let Some(closed) = self.open.replace(Bucket::new(number, point)) {
                    closed.points(give);
                }
            }
        }
    }

    /// Emits the points of the bucket that is still open.
    pub(crate) fn rest(&self, give: impl FnMut(Point)) {
        if let Some(open) = &self.open {
            open.points(give);
        }
    }
}

impl Bucket {
    fn new(number: u64, point: Point) -> Self {
        let (first, last) = (point, point);
        let mut bucket = Self { number, first, last, least: None, greatest: None, doubtful: None };
        bucket.add(point);
        bucket
    }

    fn add(&mut self, point: Point) {
        self.last = point;
        if !point.state.is_good() && self.doubtful.is_none() {
            self.doubtful = Some(point);
        }
        let Some(number) = point.state.number() else { return };
        let beyond = |known: Option<Point>, is_beyond: fn(f64, f64) -> bool| {
            known
                .and_then(|known| known.state.number())
                .is_none_or(|known| is_beyond(number, known))
        };
        if beyond(self.least, |new, known| new < known) {
            self.least = Some(point);
        }
        if beyond(self.greatest, |new, known| new > known) {
            self.greatest = Some(point);
        }
    }

    fn points(&self, mut give: impl FnMut(Point)) {
        let mut points: [Option<Point>; MAX_OF_BUCKET] =
            [Some(self.first), self.least, self.greatest, self.doubtful, Some(self.last)];
        points.sort_by_key(|point| point.map(|point| point.at));
        let mut before = None;
        for point in points.into_iter().flatten() {
            if !is_twin(before, point) {
                give(point);
            }
            before = Some(point);
        }
    }
}

/// Reports whether a point repeats the state and time of the one before.
fn is_twin(before: Option<Point>, point: Point) -> bool {
    before.is_some_and(|before| {
        let same = match (before.state, point.state) {
            (PointState::Bad, PointState::Bad) => true,
            (before, state) => before == state,
        };
        before.at == point.at && same
    })
}
