//! Alarms that come and go.

use std::time::Duration;

use busbar_tags::Moment;

/// An alarm that occurs so often within [`CHATTER_WINDOW`] chatters (IEC 62682; three a
/// minute is the usual figure, as in EEMUA 191).
pub const CHATTER_OCCURRENCES: usize = 3;
/// Window of chatter detection.
pub const CHATTER_WINDOW: Duration = Duration::from_secs(60);

/// The last occurrences of an alarm.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Chatter {
    /// Number of occurrences so far.
    pub(crate) count: u64,
    recent: [Moment; CHATTER_OCCURRENCES],
}

impl Chatter {
    pub(crate) fn record(&mut self, at: Moment) {
        self.recent[self.count as usize % CHATTER_OCCURRENCES] = at;
        self.count += 1;
    }

    /// Reports whether the last [`CHATTER_OCCURRENCES`] lie within the window before `now`.
    pub(crate) fn chatters(&self, now: Moment) -> bool {
        self.count >= CHATTER_OCCURRENCES as u64
            && self.recent.iter().all(|&at| now.since(at) <= CHATTER_WINDOW)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_within_a_minute_chatter_and_are_calm_a_minute_later() {
        let at = |seconds| Moment(0).after(Duration::from_secs(seconds));
        let mut chatter = Chatter::default();
        for seconds in [0, 50, 61] {
            chatter.record(at(seconds));
            assert!(!chatter.chatters(at(seconds)), "{seconds}");
        }
        chatter.record(at(100));
        assert!(chatter.chatters(at(110)));
        assert!(!chatter.chatters(at(111)));
    }
}
