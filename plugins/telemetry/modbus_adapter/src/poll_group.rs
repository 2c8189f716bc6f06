//! Poll group of a connection: its blocks, their schedule and their retries.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use crate::address::Point;
use crate::plan::{Block, plan_of};

/// Most splits of refused blocks in one poll of a group. The rest waits for the next poll, so that
/// one bad table does not hold up the others.
const MAX_SPLITS_PER_POLL: usize = 32;
/// Time after which refused cells are asked for again.
const REFUSED_RETRY: Duration = Duration::from_secs(30);
/// Refused blocks that are asked for again in one poll of a group.
pub(crate) const MAX_RETRIES_PER_POLL: usize = 4;
/// Longest time after which a group with split blocks is planned anew; it
/// doubles from [`REFUSED_RETRY`] as long as that is of no use.
const MAX_REPLAN_PAUSE: Duration = Duration::from_secs(600);

/// Poll group as one connection knows it: its blocks, those refused, and when it is due.
pub(crate) struct Group {
    pub(crate) period: Duration,
    pub(crate) due: Instant,
    /// True once this connection has served a whole poll.
    pub(crate) is_polled: bool,
    /// Together with those refused they hold all points of the group.
    pub(crate) blocks: Vec<Block>,
    /// In order of `retry_at`.
    pub(crate) refused: VecDeque<Refused>,
    /// Time at which split blocks are joined again, since the device may take them now.
    pub(crate) replan_at: Option<Instant>,
    pub(crate) replan_pause: Duration,
}

pub(crate) struct Refused {
    pub(crate) block: Block,
    pub(crate) retry_at: Instant,
}

/// One poll of a group under way.
pub(crate) struct Poll {
    pub(crate) queue: VecDeque<(Block, Origin)>,
    /// The blocks before the group was planned anew; else empty.
    pub(crate) former: Vec<Block>,
    pub(crate) splits_left: usize,
    /// True where a block that was refused has answered.
    pub(crate) has_recovered: bool,
}

/// Reason why a block is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Origin {
    Known,
    Replanned,
    /// Block that was refused before.
    Retry,
}

impl Group {
    pub(crate) fn new(period: Duration, blocks: Vec<Block>) -> Self {
        Self {
            period,
            due: Instant::now(),
            is_polled: false,
            blocks,
            refused: VecDeque::new(),
            replan_at: None,
            replan_pause: REFUSED_RETRY,
        }
    }

    /// Takes the blocks that are due in this poll.
    pub(crate) fn begin_poll(&mut self, points: &[Point], now: Instant) -> Poll {
        let mut blocks = std::mem::take(&mut self.blocks);
        let mut former = Vec::new();
        let mut origin = Origin::Known;
        if self.replan_at.take_if(|at| *at <= now).is_some() {
            let wanted = blocks.iter().flat_map(|block| &block.points).copied().collect();
            former = std::mem::replace(&mut blocks, plan_of(points, wanted));
            origin = Origin::Replanned;
        }
        let mut queue: VecDeque<_> = blocks.into_iter().map(|block| (block, origin)).collect();
        queue.extend(self.take_due(now).into_iter().map(|block| (block, Origin::Retry)));
        Poll { queue, former, splits_left: MAX_SPLITS_PER_POLL, has_recovered: false }
    }

    /// Settles when to plan anew.
    pub(crate) fn end_poll(&mut self, poll: &Poll, now: Instant) {
        if poll.splits_left < MAX_SPLITS_PER_POLL {
            if self.replan_at.is_none() {
                self.replan_at = Some(now + self.replan_pause);
                self.replan_pause = self.replan_pause.saturating_mul(2).min(MAX_REPLAN_PAUSE);
            }
        } else if !poll.former.is_empty() {
            self.replan_pause = REFUSED_RETRY;
        }
        if poll.has_recovered {
            // Once for all that recover together, as far as that can wait.
            let has_due = self.refused.front().is_some_and(|refused| refused.retry_at <= now);
            let at = if has_due { now + REFUSED_RETRY } else { now };
            self.replan_at = Some(self.replan_at.map_or(at, |planned| planned.min(at)));
        }
    }

    /// Takes refused blocks whose time has come.
    fn take_due(&mut self, now: Instant) -> Vec<Block> {
        let due = self
            .refused
            .iter()
            .take(MAX_RETRIES_PER_POLL)
            .take_while(|refused| refused.retry_at <= now)
            .count();
        self.refused.drain(..due).map(|refused| refused.block).collect()
    }

    pub(crate) fn refuse(&mut self, block: Block) {
        let retry_at = Instant::now() + REFUSED_RETRY;
        self.refused.push_back(Refused { block, retry_at });
    }
}

impl Poll {
    /// Queues the former blocks in place of a newly planned one that failed. The device has
    /// answered those, so no tag turns bad for an attempt to save requests.
    pub(crate) fn fall_back(&mut self, block: &Block, points: &[Point]) {
        for former in &self.former {
            if let Some(piece) = former.within(block, points) {
                self.queue.push_front((piece, Origin::Known));
            }
        }
    }
}

/// Returns the next multiple of the period after `now`: polls do not drift, and missed ones are
/// left out.
pub(crate) fn next_due(due: Instant, period: Duration, now: Instant) -> Instant {
    let late = now.saturating_duration_since(due);
    let missed = late.as_nanos() / period.as_nanos().max(1);
    let steps = u32::try_from(missed).unwrap_or(u32::MAX).saturating_add(1);
    due + period.saturating_mul(steps)
}
