//! Rate-limited log lines that count every event, reported at once or together.

use std::time::{Duration, Instant};

/// Shortest time between two lines; events in between are reported together at its end.
pub const TELL_INTERVAL: Duration = Duration::from_secs(1);

/// Counter of events of one kind since a connection was made.
///
/// ```
/// use std::time::{Duration, Instant};
/// use busbar_link::Notices;
///
/// let (mut notices, now) = (Notices::default(), Instant::now());
/// notices.note("a message of 3 bytes".into());
/// assert_eq!(notices.take_due(now).unwrap().count, 1);
/// notices.note("a message of 5 bytes".into());
/// assert_eq!(notices.take_due(now), None);
/// let notice = notices.take_due(now + Duration::from_secs(1)).unwrap();
/// assert_eq!((notice.last.as_str(), notice.total), ("a message of 5 bytes", 2));
/// ```
#[derive(Debug, Default)]
pub struct Notices {
    total: u64,
    untold: u64,
    last: String,
    not_before: Option<Instant>,
}

/// Events that a log line reports now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// Description of the last event.
    pub last: String,
    /// Events since the line before.
    pub count: u64,
    /// Events since the connection was made.
    pub total: u64,
}

impl Notices {
    /// Counts an event, with its description.
    pub fn note(&mut self, what: String) {
        self.total += 1;
        self.untold += 1;
        self.last = what;
    }

    /// Takes the events to be reported now, if any.
    pub fn take_due(&mut self, now: Instant) -> Option<Notice> {
        let is_due = self.untold > 0 && self.not_before.is_none_or(|at| at <= now);
        is_due.then(|| {
            self.not_before = Some(now + TELL_INTERVAL);
            self.take()
        })
    }

    /// Takes the events that were not reported yet, regardless of the last line, and resets the
    /// counts.
    pub fn take_rest(&mut self) -> Option<Notice> {
        let rest = (self.untold > 0).then(|| self.take());
        *self = Self::default();
        rest
    }

    /// Returns the count of all events, and the last.
    pub fn summary(&self) -> (u64, &str) {
        (self.total, &self.last)
    }

    /// Instant at which [`Notices::take_due`] has something.
    pub fn deadline(&self) -> Option<Instant> {
        self.not_before.filter(|_| self.untold > 0)
    }

    fn take(&mut self) -> Notice {
        let count = std::mem::take(&mut self.untold);
        Notice { last: self.last.clone(), count, total: self.total }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_is_told_and_no_two_lines_are_close() {
        let (mut notices, start) = (Notices::default(), Instant::now());
        let (mut told, mut lines) = (0, 0);
        for millis in 0..5000 {
            let now = start + Duration::from_millis(millis);
            notices.note(format!("event {millis}"));
            if let Some(notice) = notices.take_due(now) {
                assert_eq!(notice.last, format!("event {millis}"));
                (told, lines) = (told + notice.count, lines + 1);
                assert_eq!(notice.total, told);
            }
            assert_eq!(notices.deadline().is_some(), told <= millis);
        }
        assert_eq!(lines, 5);
        let rest = notices.take_rest().unwrap();
        assert_eq!((told + rest.count, rest.total), (5000, 5000));
        assert_eq!((notices.take_rest(), notices.deadline()), (None, None));
    }
}
