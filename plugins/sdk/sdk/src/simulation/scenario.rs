//! Scenario of a tag: ramps to values, and release, in the order of time.

use std::time::{Duration, SystemTime};

use crate::Error;

/// Events of one tag, at most.
const MAX_EVENTS: usize = 10_000;

/// Scenario events of a tag, in the order of time.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario {
    begun: SystemTime,
    events: Vec<(Duration, ScenarioEvent)>,
}

/// Scenario event of a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScenarioEvent {
    /// Ramp to a value, in the tag's unit, where the tag then stays.
    Value {
        /// Target value of the ramp.
        value: f64,
        /// Duration of the linear ramp.
        over: Duration,
    },
    /// Release: the tag follows its own shape again.
    Release,
}

impl Scenario {
    /// Creates a scenario without events, counted from an instant.
    pub fn new(begun: SystemTime) -> Self {
        Self { begun, events: Vec::new() }
    }

    /// Appends an event at a time after the begin.
    ///
    /// # Errors
    /// [`Error::settings`] for what would come before what was added last, and for more
    /// than 10,000 events.
    pub fn push(&mut self, at: Duration, event: ScenarioEvent) -> Result<(), Error> {
        if self.events.last().is_some_and(|(last, _)| *last > at) {
            return Err(Error::settings("the events of a tag are not in the order of time"));
        }
        if self.events.len() >= MAX_EVENTS {
            return Err(Error::settings(format!("a tag has more than {MAX_EVENTS} events")));
        }
        self.events.push((at, event));
        Ok(())
    }

    /// Returns the target values, with the durations of their ramps.
    pub(super) fn values(&self) -> impl Iterator<Item = (f64, Duration)> + '_ {
        self.events.iter().filter_map(|(_, event)| match *event {
            ScenarioEvent::Value { value, over } => Some((value, over)),
            ScenarioEvent::Release => None,
        })
    }

    /// Returns the value at an instant; none where the tag follows its own shape, whose value `own`
    /// returns.
    pub(super) fn at(&self, time: SystemTime, own: impl Fn(SystemTime) -> f64) -> Option<f64> {
        let since = time.duration_since(self.begun).ok()?;
        let happened = self.events.partition_point(|(at, _)| *at <= since);
        let mut way: Option<Way> = None;
        for &(at, event) in &self.events[..happened] {
            way = match event {
                ScenarioEvent::Release => None,
                ScenarioEvent::Value { value, over } => {
                    let from = way.map_or_else(|| own(self.begun + at), |way| way.at(at));
                    Some(Way { from, value, at, over })
                }
            };
        }
        way.map(|way| way.at(since))
    }
}

/// Linear ramp from one value to another.
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
#[path = "scenario_tests.rs"]
mod tests;
