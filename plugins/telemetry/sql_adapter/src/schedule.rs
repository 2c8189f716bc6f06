//! Schedule of the queries by their periods.

use std::time::{Duration, Instant};

/// Next run of each query. A late one runs once, not once for each missed time.
pub(crate) struct Schedule {
    /// `None` where it runs no more in this connection.
    due: Vec<Option<Instant>>,
    periods: Vec<Option<Duration>>,
}

impl Schedule {
    /// All queries that are used are due now; `None` is no period: once a connection.
    pub(crate) fn new(
        periods: impl IntoIterator<Item = Option<Duration>>,
        is_used: impl Fn(usize) -> bool,
        now: Instant,
    ) -> Self {
        let periods: Vec<_> = periods.into_iter().collect();
        let due = (0..periods.len()).map(|query| is_used(query).then_some(now)).collect();
        Self { due, periods }
    }

    /// The query that is due first, and when.
    pub(crate) fn next(&self) -> Option<(usize, Instant)> {
        let due = self.due.iter().enumerate();
        due.filter_map(|(query, due)| Some((query, (*due)?))).min_by_key(|(_, due)| *due)
    }

    /// A query has begun at this time.
    pub(crate) fn note_run(&mut self, query: usize, now: Instant) {
        self.due[query] = self.periods[query].zip(self.due[query]).map(|(period, due)| {
            let next = due + period;
            if next > now { next } else { now + period }
        });
    }

    /// A query is to run at this time at the latest, though it had run for the last time.
    pub(crate) fn bring_forward(&mut self, query: usize, at: Instant) {
        self.due[query] = Some(self.due[query].map_or(at, |due| due.min(at)));
    }

    /// A query is not to run for a while.
    pub(crate) fn put_off(&mut self, query: usize, until: Instant) {
        self.due[query] = self.due[query].map(|due| due.max(until));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn each_query_keeps_its_period() {
        let start = Instant::now();
        let mut schedule = Schedule::new([Some(SECOND), Some(2 * SECOND), None], |_| true, start);
        let mut runs = Vec::new();
        while let Some((query, due)) = schedule.next().filter(|(_, due)| *due < start + 5 * SECOND)
        {
            schedule.note_run(query, due);
            runs.push((query, (due - start).as_secs()));
        }
        let first = [(0, 0), (1, 0), (2, 0), (0, 1), (0, 2), (1, 2), (0, 3)];
        runs.sort_by_key(|(query, at)| (*at, *query));
        assert_eq!(runs[..first.len()], first);
        assert_eq!(runs.iter().filter(|(query, _)| *query == 2).count(), 1);
    }

    #[test]
    fn a_late_query_does_not_catch_up() {
        let start = Instant::now();
        let mut schedule = Schedule::new([Some(SECOND)], |_| true, start);
        schedule.note_run(0, start + 10 * SECOND);
        assert_eq!(schedule.next(), Some((0, start + 11 * SECOND)));
    }

    #[test]
    fn what_nobody_uses_never_runs() {
        let start = Instant::now();
        assert_eq!(Schedule::new([Some(SECOND)], |_| false, start).next(), None);
    }

    #[test]
    fn one_that_is_brought_forward_runs_once() {
        let start = Instant::now();
        let mut schedule = Schedule::new([Some(10 * SECOND), None], |_| true, start);
        (0..2).for_each(|query| schedule.note_run(query, start));
        (0..2).for_each(|query| schedule.bring_forward(query, start + SECOND));
        for query in 0..2 {
            assert_eq!(schedule.next(), Some((query, start + SECOND)));
            schedule.note_run(query, start + SECOND);
        }
        assert_eq!(schedule.next(), Some((0, start + 11 * SECOND)));
    }

    #[test]
    fn one_that_is_put_off_waits() {
        let start = Instant::now();
        let mut schedule = Schedule::new([Some(SECOND)], |_| true, start);
        schedule.put_off(0, start + 9 * SECOND);
        assert_eq!(schedule.next(), Some((0, start + 9 * SECOND)));
    }
}
