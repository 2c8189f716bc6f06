//! The life of a link: connect, poll, fail, wait, again.

use std::collections::VecDeque;
use std::time::Duration;

use busbar_plugin_sdk::{Host, LinkState, LogLevel, Reason, Sample, SampleSink};
use tokio::time::{Instant, sleep, sleep_until};
use tokio_modbus::ExceptionCode;

use crate::address::Point;
use crate::backoff::Backoff;
use crate::connection::{Connection, LinkFault, Reply, describe};
use crate::decode::decode;
use crate::plan::{Block, plan, plan_of};
use crate::settings::Config;

/// Splits of refused blocks in one poll of a group; the rest waits for the
/// next, so that one bad table does not hold up the others.
const MAX_SPLITS_PER_POLL: usize = 32;
/// How long refused cells are left alone before they are asked for again.
const REFUSED_RETRY: Duration = Duration::from_secs(30);
/// Refused blocks that are asked for again in one poll of a group.
const MAX_RETRIES_PER_POLL: usize = 4;
/// Longest time after which a group with split blocks is planned anew; it
/// doubles from [`REFUSED_RETRY`] as long as that is of no use.
const MAX_REPLAN_PAUSE: Duration = Duration::from_secs(600);
/// Tags that one log line names.
const MAX_TAGS_IN_MESSAGE: usize = 5;

pub(crate) struct Session {
    config: Config,
    points: Vec<Point>,
    sink: SampleSink,
    host: Host,
    backoff: Backoff,
}

/// What a connection knows of a poll group.
struct Group {
    period: Duration,
    due: Instant,
    /// Whether this connection has served a whole poll.
    is_polled: bool,
    /// Together with those refused they hold all points of the group.
    blocks: Vec<Block>,
    /// In order of `retry_at`.
    refused: VecDeque<Refused>,
    /// When to join again what was split, for the device may have changed its
    /// mind.
    replan_at: Option<Instant>,
    replan_pause: Duration,
}

struct Refused {
    block: Block,
    retry_at: Instant,
}

/// One poll of a group under way.
struct Poll {
    queue: VecDeque<(Block, Origin)>,
    /// The blocks before the group was planned anew; else empty.
    former: Vec<Block>,
    splits_left: usize,
    /// Whether a block that was refused has answered.
    has_recovered: bool,
}

/// Why a block is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Origin {
    Known,
    Replanned,
    /// It was refused before.
    Retry,
}

/// What an exception says of the tags of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// Some of the cells do not exist.
    SomeRefused,
    /// None of them can be read.
    AllRefused,
    /// Not now.
    Unavailable(Reason),
}

impl Session {
    pub(crate) fn new(config: Config, points: Vec<Point>, sink: SampleSink, host: Host) -> Self {
        let backoff =
            Backoff::new(config.reconnect_min, config.reconnect_max, fastrand::Rng::new());
        Self { config, points, sink, host, backoff }
    }

    /// Serves the tags for ever; drop the future to end it.
    pub(crate) async fn run(mut self) {
        self.publish_all(Reason::NotConnected);
        self.report(LinkState::Connecting, "connecting");
        loop {
            let Err(fault) = self.serve_link().await;
            self.publish_all(Reason::Communication);
            let delay = self.backoff.next_delay();
            let message = format!("{fault}; next try in {:.1} s", delay.as_secs_f64());
            self.report(LinkState::Down, &message);
            sleep(delay).await;
        }
    }

    /// Polls over one connection until it fails.
    async fn serve_link(&mut self) -> Result<std::convert::Infallible, LinkFault> {
        let mut connection = Connection::open(&self.config).await?;
        // Planned anew: the device may have been replaced in between.
        let mut groups = self.groups();
        let mut up = false;
        loop {
            let Some(group) = groups.iter_mut().min_by_key(|group| group.due) else {
                return std::future::pending().await;
            };
            sleep_until(group.due).await;
            self.poll(&mut connection, group, &mut up).await?;
            group.due = next_due(group.due, group.period, Instant::now());
            group.is_polled = true;
            // Not before: a peer that answers once and closes is no success.
            if groups.iter().all(|group| group.is_polled) {
                self.backoff.reset();
            }
        }
    }

    fn groups(&self) -> Vec<Group> {
        let periods = self.config.group_periods.iter().enumerate();
        periods
            .map(|(index, &period)| Group::new(period, plan(&self.points, index)))
            .filter(|group| !group.blocks.is_empty())
            .collect()
    }

    async fn poll(
        &mut self,
        connection: &mut Connection,
        group: &mut Group,
        up: &mut bool,
    ) -> Result<(), LinkFault> {
        let mut poll = group.begin_poll(&self.points, Instant::now());
        while let Some((block, origin)) = poll.queue.pop_front() {
            let reply = connection.read(&block).await?;
            if !std::mem::replace(up, true) {
                self.report(LinkState::Up, "connected");
            }
            if let Reply::Exception(exception) = reply {
                self.heed(exception, block, origin, group, &mut poll);
            } else {
                self.publish_values(&block, &reply);
                poll.has_recovered |= origin == Origin::Retry;
                group.blocks.push(block);
            }
        }
        for refused in &group.refused {
            self.publish_bad(&refused.block, Reason::Configuration);
        }
        group.end_poll(&poll, Instant::now());
        Ok(())
    }

    /// Does with a block what the device's exception asks for.
    fn heed(
        &self,
        exception: ExceptionCode,
        block: Block,
        origin: Origin,
        group: &mut Group,
        poll: &mut Poll,
    ) {
        match verdict(exception) {
            Verdict::Unavailable(reason) => {
                self.publish_bad(&block, reason);
                group.blocks.push(block);
            }
            Verdict::SomeRefused if let Some((left, right)) = block.split(&self.points) => {
                if poll.splits_left > 0 {
                    poll.splits_left -= 1;
                    poll.queue.push_front((right, origin));
                    poll.queue.push_front((left, origin));
                } else if origin == Origin::Replanned {
                    poll.fall_back(&block, &self.points);
                } else {
                    // Nobody asks for the halves before the next poll.
                    self.publish_bad(&block, Reason::Configuration);
                    group.blocks.extend([left, right]);
                }
            }
            Verdict::SomeRefused | Verdict::AllRefused => {
                if origin != Origin::Retry {
                    self.log_refusal(&block, exception);
                }
                group.refuse(block);
            }
        }
    }

    fn publish_values(&self, block: &Block, reply: &Reply) {
        let sample = |&index: &usize| {
            let point = &self.points[index];
            let first = usize::from(point.first - block.first);
            let value = reply
                .cells(first, usize::from(point.count))
                .ok_or(Reason::Configuration)
                .and_then(|cells| decode(&point.decoding, cells));
            match value {
                Ok(value) => Sample::good(point.tag, value),
                Err(reason) => Sample::bad(point.tag, reason),
            }
        };
        let samples: Vec<_> = block.points.iter().map(sample).collect();
        self.sink.publish(&samples);
    }

    fn publish_bad(&self, block: &Block, reason: Reason) {
        let samples: Vec<_> =
            block.points.iter().map(|&index| Sample::bad(self.points[index].tag, reason)).collect();
        self.sink.publish(&samples);
    }

    fn publish_all(&self, reason: Reason) {
        let samples: Vec<_> =
            self.points.iter().map(|point| Sample::bad(point.tag, reason)).collect();
        self.sink.publish(&samples);
    }

    fn report(&self, state: LinkState, message: &str) {
        let message = format!("{}: {message}", self.config.endpoint());
        self.sink.report_link(state, &message);
    }

    fn log_refusal(&self, block: &Block, exception: ExceptionCode) {
        let ids: Vec<_> = block
            .points
            .iter()
            .take(MAX_TAGS_IN_MESSAGE)
            .map(|&index| format!("'{}'", self.points[index].id))
            .collect();
        let more = block.points.len() - ids.len();
        let message = format!(
            "{}: the device refused {} ({exception}), asked for by tag {}{}; \
             correct the address, or configure the device",
            self.config.endpoint(),
            describe(block),
            ids.join(", "),
            if more > 0 { format!(" and {more} more") } else { String::new() }
        );
        self.host.log(LogLevel::Warning, &message);
    }
}

impl Group {
    fn new(period: Duration, blocks: Vec<Block>) -> Self {
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

    /// Takes what is to be asked for now.
    fn begin_poll(&mut self, points: &[Point], now: Instant) -> Poll {
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
    fn end_poll(&mut self, poll: &Poll, now: Instant) {
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

    fn refuse(&mut self, block: Block) {
        let retry_at = Instant::now() + REFUSED_RETRY;
        self.refused.push_back(Refused { block, retry_at });
    }
}

impl Poll {
    /// Asks for the points of a block as before they were planned anew: that
    /// the device has answered, so no tag turns bad for a try to save requests.
    fn fall_back(&mut self, block: &Block, points: &[Point]) {
        for former in &self.former {
            if let Some(piece) = former.within(block, points) {
                self.queue.push_front((piece, Origin::Known));
            }
        }
    }
}

/// By the Modbus Application Protocol Specification V1.1b3, 7.
fn verdict(exception: ExceptionCode) -> Verdict {
    match exception {
        ExceptionCode::IllegalFunction => Verdict::AllRefused,
        // Devices that take fewer cells a request than the protocol allows
        // answer with an illegal value, and want smaller requests.
        ExceptionCode::IllegalDataAddress | ExceptionCode::IllegalDataValue => Verdict::SomeRefused,
        ExceptionCode::GatewayPathUnavailable
        | ExceptionCode::GatewayTargetDevice
        | ExceptionCode::Acknowledge
        | ExceptionCode::ServerDeviceBusy => Verdict::Unavailable(Reason::Communication),
        _ => Verdict::Unavailable(Reason::Unknown),
    }
}

/// The next multiple of the period after `now`: polls do not drift, and those
/// missed are left out.
fn next_due(due: Instant, period: Duration, now: Instant) -> Instant {
    let late = now.saturating_duration_since(due);
    let missed = late.as_nanos() / period.as_nanos().max(1);
    let steps = u32::try_from(missed).unwrap_or(u32::MAX).saturating_add(1);
    due + period.saturating_mul(steps)
}

#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
