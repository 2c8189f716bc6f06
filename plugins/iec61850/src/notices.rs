//! Rate-limited log lines that count every event: each is told, at once or gathered.

use std::time::{Duration, Instant};

/// Shortest time between two lines; events in between are told together at its end.
pub(crate) const TELL_INTERVAL: Duration = Duration::from_secs(1);

/// Events of one kind since the association was made.
#[derive(Debug, Default)]
pub(crate) struct Notices {
    total: u64,
    untold: u64,
    last: String,
    not_before: Option<Instant>,
}

/// Events that are to be told now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Notice {
    /// Description of the last event.
    pub(crate) last: String,
    /// Events since the line before.
    pub(crate) count: u64,
    /// Events since the association was made.
    pub(crate) total: u64,
}

impl Notices {
    /// Counts an event.
    pub(crate) fn note(&mut self, what: String) {
        self.total += 1;
        self.untold += 1;
        self.last = what;
    }

    /// Takes what is to be told now, if anything.
    pub(crate) fn take_due(&mut self, now: Instant) -> Option<Notice> {
        let is_due = self.untold > 0 && self.not_before.is_none_or(|at| at <= now);
        is_due.then(|| {
            self.not_before = Some(now + TELL_INTERVAL);
            self.take()
        })
    }

    /// Takes what was not told yet, whenever the last line was, and counts anew.
    pub(crate) fn take_rest(&mut self) -> Option<Notice> {
        let rest = (self.untold > 0).then(|| self.take());
        *self = Self::default();
        rest
    }

    /// Instant at which [`Notices::take_due`] has something.
    pub(crate) fn deadline(&self) -> Option<Instant> {
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
