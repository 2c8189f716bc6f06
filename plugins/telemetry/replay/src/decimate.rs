//! Fewer updates than a recording has: the last of each part of a second.

use crate::recording::Update;

/// Lets through what tags need: of each tag the last update of each interval, and
/// every change of a discrete one, in order.
pub(crate) struct Decimator {
    /// Nanoseconds; nothing lets all through.
    interval: Option<i64>,
    points: Vec<State>,
    /// Points with something held back.
    held: Vec<usize>,
}

struct State {
    is_discrete: bool,
    last: Option<Update>,
    held: Option<Update>,
}

impl Decimator {
    /// For tags, discrete or not, that are updated once in an interval at most.
    pub(crate) fn new(is_discrete: impl Iterator<Item = bool>, interval: Option<i64>) -> Self {
        let state = |is_discrete| State { is_discrete, last: None, held: None };
        let interval = interval.map(|interval| interval.max(1));
        Self { interval, points: is_discrete.map(state).collect(), held: Vec::new() }
    }

    /// Takes an update; appends what is to be published.
    pub(crate) fn take(&mut self, update: Update, out: &mut Vec<Update>) {
        let Some(interval) = self.interval else { return out.push(update) };
        let Some(state) = self.points.get_mut(update.point) else { return };
        let is_change = state
            .last
            .as_ref()
            .is_none_or(|last| (&last.value, last.quality) != (&update.value, update.quality));
        if state.last.is_none() || (state.is_discrete && is_change) {
            // What is held back of it says the same as what went before.
            state.held = None;
            state.last = Some(update.clone());
            return out.push(update);
        }
        let (point, part) = (update.point, update.nanos.div_euclid(interval));
        match state.held.replace(update) {
            Some(held) if held.nanos.div_euclid(interval) < part => {
                state.last = Some(held.clone());
                out.push(held);
            }
            Some(_) => {}
            None => self.held.push(point),
        }
    }

    /// Appends what was held back in intervals that are over at `nanos`.
    pub(crate) fn release(&mut self, nanos: i64, out: &mut Vec<Update>) {
        let Some(interval) = self.interval else { return };
        let points = &mut self.points;
        self.held.retain(|&point| {
            let state = &mut points[point];
            let Some(held) = &state.held else { return false };
            let is_over = held.nanos.div_euclid(interval) < nanos.div_euclid(interval);
            if is_over {
                state.last = state.held.take();
                out.extend(state.last.clone());
            }
            !is_over
        });
    }

    /// Appends all that was held back, and begins anew.
    pub(crate) fn close(&mut self, out: &mut Vec<Update>) {
        self.release(i64::MAX, out);
        for state in &mut self.points {
            state.last = None;
        }
    }
}

#[cfg(test)]
#[path = "decimate_tests.rs"]
mod tests;
