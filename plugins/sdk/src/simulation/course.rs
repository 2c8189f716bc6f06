//! What a scenario has a tag do.

use std::time::{Duration, SystemTime};

use crate::Error;

/// Events of one tag.
const MAX_EVENTS: usize = 10_000;

/// What happens to a tag in a scenario, in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    begun: SystemTime,
    events: Vec<(Duration, CourseEvent)>,
}

/// Something that happens to a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CourseEvent {
    /// It goes to a value, in the tag's unit, and stays there.
    Value {
        /// Where to.
        value: f64,
        /// How long the way takes, at an even pace.
        over: Duration,
    },
    /// It moves by its own shape again.
    Release,
}

impl Course {
    /// Nothing happens, counted from an instant.
    pub fn new(begun: SystemTime) -> Self {
        Self { begun, events: Vec::new() }
    }

    /// Adds what happens so long after the begin.
    ///
    /// # Errors
    /// [`Error::settings`] for what would come before what was added last, and for more
    /// than 10,000 events.
    pub fn push(&mut self, at: Duration, event: CourseEvent) -> Result<(), Error> {
        if self.events.last().is_some_and(|(last, _)| *last > at) {
            return Err(Error::settings("the events of a tag are not in the order of time"));
        }
        if self.events.len() >= MAX_EVENTS {
            return Err(Error::settings(format!("a tag has more than {MAX_EVENTS} events")));
        }
        self.events.push((at, event));
        Ok(())
    }

    /// The values that it goes to, and how long that takes.
    pub(super) fn values(&self) -> impl Iterator<Item = (f64, Duration)> + '_ {
        self.events.iter().filter_map(|(_, event)| match *event {
            CourseEvent::Value { value, over } => Some((value, over)),
            CourseEvent::Release => None,
        })
    }

    /// The value at an instant; none where the tag moves by its own shape, which `own`
    /// has the value of.
    pub(super) fn at(&self, time: SystemTime, own: impl Fn(SystemTime) -> f64) -> Option<f64> {
        let since = time.duration_since(self.begun).ok()?;
        let happened = self.events.partition_point(|(at, _)| *at <= since);
        let mut way: Option<Way> = None;
        for &(at, event) in &self.events[..happened] {
            way = match event {
                CourseEvent::Release => None,
                CourseEvent::Value { value, over } => {
                    let from = way.map_or_else(|| own(self.begun + at), |way| way.at(at));
                    Some(Way { from, value, at, over })
                }
            };
        }
        way.map(|way| way.at(since))
    }
}

/// From a value to another.
#[derive(Clone, Copy)]
struct Way {
    from: f64,
    value: f64,
    at: Duration,
    over: Duration,
}

impl Way {
    fn at(self, since: Duration) -> f64 {
        let Self { from, value, at, over } = self;
        let gone = since.saturating_sub(at);
        if gone >= over {
            return value;
        }
        from + (value - from) * gone.as_secs_f64() / over.as_secs_f64()
    }
}

#[cfg(test)]
#[path = "course_tests.rs"]
mod tests;
