//! Rate limit of log lines: a token bucket.

use std::time::{Duration, Instant};

/// Lines that may be written at once.
const MAX_LINES: u32 = 50;
/// Time in which one more may be written.
const REFILL: Duration = Duration::from_secs(10);

/// Lines that may still be written about single tags and messages.
#[derive(Debug)]
pub(crate) struct LineBudget {
    left: u32,
    /// Lines that were not written since the last one.
    withheld: u64,
    refilled: Option<Instant>,
}

impl Default for LineBudget {
    fn default() -> Self {
        Self { left: MAX_LINES, withheld: 0, refilled: None }
    }
}

impl LineBudget {
    /// Refills the token bucket up to this time.
    pub(crate) fn advance(&mut self, now: Instant) {
        let since = *self.refilled.get_or_insert(now);
        let spans = now.saturating_duration_since(since).as_secs() / REFILL.as_secs();
        if spans > 0 {
            let spans = u32::try_from(spans).unwrap_or(u32::MAX).min(MAX_LINES);
            self.left = self.left.saturating_add(spans).min(MAX_LINES);
            self.refilled = Some(now);
        }
    }

    /// Takes leave for one line: a remark to end it with, or `None` if it is not to be
    /// written.
    pub(crate) fn take(&mut self) -> Option<String> {
        let Some(left) = self.left.checked_sub(1) else {
            self.withheld += 1;
            return None;
        };
        self.left = left;
        let before = std::mem::take(&mut self.withheld);
        let mut remark = String::new();
        if before > 0 {
            remark += &format!(" ({before} lines before this one were left out)");
        }
        if left == 0 {
            let seconds = REFILL.as_secs();
            remark += &format!(" (from here on one line every {seconds} s)");
        }
        Some(remark)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_left_out_and_counted_and_told_again_later() {
        let (mut budget, start) = (LineBudget::default(), Instant::now());
        budget.advance(start);
        let written: Vec<_> = (0..60).filter_map(|_| budget.take()).collect();
        assert_eq!(written.len(), 50);
        assert!(written[48].is_empty() && written[49].contains("one line every 10 s"));
        budget.advance(start + REFILL);
        let remark = budget.take().unwrap();
        assert!(remark.contains("10 lines before"), "{remark}");
        assert_eq!(budget.take(), None);
        budget.advance(start + REFILL * 1000);
        assert_eq!((0..60).filter_map(|_| budget.take()).count(), 50);
    }
}
