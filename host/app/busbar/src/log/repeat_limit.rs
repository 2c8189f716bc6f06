//! Rate limit of repeated log lines.

use std::collections::HashMap;
use std::fmt::{Debug, Write};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;

/// Equal lines that pass within [`WINDOW`].
const MAX_ALIKE: u32 = 10;
const WINDOW: Duration = Duration::from_secs(60);
/// Different lines that are counted; at this number all are forgotten.
const MAX_COUNTED: usize = 1_000;

/// Filter that drops lines repeated too often.
#[derive(Default)]
pub(super) struct RepeatLimit {
    said: Mutex<HashMap<u64, Said>>,
}

#[derive(Clone, Copy)]
struct Said {
    since: Instant,
    count: u32,
}

impl RepeatLimit {
    fn lets_through(&self, line: u64, now: Instant) -> bool {
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        if said.len() >= MAX_COUNTED && !said.contains_key(&line) {
            said.retain(|_, said| now.duration_since(said.since) < WINDOW);
            if said.len() >= MAX_COUNTED {
                said.clear();
            }
        }
        let own = said.entry(line).or_insert(Said { since: now, count: 0 });
        if now.duration_since(own.since) >= WINDOW {
            *own = Said { since: now, count: 0 };
        }
        own.count += 1;
        own.count <= MAX_ALIKE
    }
}

impl<S: Subscriber> Layer<S> for RepeatLimit {
    fn event_enabled(&self, event: &Event<'_>, _: Context<'_, S>) -> bool {
        let mut line = Line::default();
        event.record(&mut line);
        let mut hasher = DefaultHasher::new();
        (event.metadata().callsite(), &line.0).hash(&mut hasher);
        self.lets_through(hasher.finish(), Instant::now())
    }
}

/// Fields of an event as text.
#[derive(Default)]
struct Line(String);

impl Visit for Line {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        // Text takes whatever is written.
        let _ = write!(self.0, "{}={value:?};", field.name());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_again_and_again_is_said_a_few_times_a_while() {
        let (limit, start) = (RepeatLimit::default(), Instant::now());
        let said = |line, after: Duration| limit.lets_through(line, start + after);
        assert_eq!((0..100).filter(|_| said(1, Duration::ZERO)).count(), MAX_ALIKE as usize);
        assert!(said(2, Duration::ZERO), "another line");
        assert!(!said(1, WINDOW / 2));
        assert_eq!((0..100).filter(|_| said(1, WINDOW)).count(), MAX_ALIKE as usize);
        for line in 0..10 * MAX_COUNTED as u64 {
            said(line, WINDOW);
        }
        assert!(limit.said.lock().unwrap().len() <= MAX_COUNTED);
    }
}
