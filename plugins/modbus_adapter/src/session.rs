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
use crate::plan::{Block, plan};
use crate::settings::Config;

/// Splits of refused blocks in one poll of a group; the rest waits for the
/// next, so that one bad table does not hold up the others.
const MAX_SPLITS_PER_POLL: usize = 32;
/// How long refused cells are left alone before they are asked for again.
const REFUSED_RETRY: Duration = Duration::from_secs(30);
/// Refused blocks that are asked for again in one poll of a group.
const MAX_RETRIES_PER_POLL: usize = 4;
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
    blocks: Vec<Block>,
    /// In order of `retry_at`.
    refused: VecDeque<Refused>,
}

struct Refused {
    block: Block,
    retry_at: Instant,
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
        }
    }

    fn groups(&self) -> Vec<Group> {
        let due = Instant::now();
        let group = |(index, &period): (usize, &Duration)| Group {
            period,
            due,
            blocks: plan(&self.points, index),
            refused: VecDeque::new(),
        };
        let mut groups: Vec<_> = self.config.group_periods.iter().enumerate().map(group).collect();
        groups.retain(|group| !group.blocks.is_empty());
        groups
    }

    async fn poll(
        &mut self,
        connection: &mut Connection,
        group: &mut Group,
        up: &mut bool,
    ) -> Result<(), LinkFault> {
        // Each with whether it was refused before.
        let mut queue: VecDeque<_> =
            std::mem::take(&mut group.blocks).into_iter().map(|block| (block, false)).collect();
        queue.extend(group.take_due(Instant::now()).into_iter().map(|block| (block, true)));
        let mut splits_left = MAX_SPLITS_PER_POLL;
        while let Some((block, is_retry)) = queue.pop_front() {
            let reply = connection.read(&block).await?;
            if !std::mem::replace(up, true) {
                self.backoff.reset();
                self.report(LinkState::Up, "connected");
            }
            let Reply::Exception(exception) = reply else {
                self.publish_values(&block, &reply);
                group.blocks.push(block);
                continue;
            };
            match verdict(exception) {
                Verdict::Unavailable(reason) => {
                    self.publish_bad(&block, reason);
                    group.blocks.push(block);
                }
                Verdict::SomeRefused if let Some((left, right)) = block.split(&self.points) => {
                    if splits_left > 0 {
                        splits_left -= 1;
                        queue.push_front((right, is_retry));
                        queue.push_front((left, is_retry));
                    } else {
                        group.blocks.extend([left, right]);
                    }
                }
                Verdict::SomeRefused | Verdict::AllRefused => {
                    if !is_retry {
                        self.log_refusal(&block, exception);
                    }
                    group.refuse(block);
                }
            }
        }
        for refused in &group.refused {
            self.publish_bad(&refused.block, Reason::Configuration);
        }
        Ok(())
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
mod tests {
    use super::*;

    #[test]
    fn polls_keep_their_beat() {
        let start = Instant::now();
        let at = |millis| start + Duration::from_millis(millis);
        let period = Duration::from_millis(100);
        assert_eq!(next_due(start, period, at(0)), at(100));
        assert_eq!(next_due(start, period, at(99)), at(100));
        assert_eq!(next_due(start, period, at(100)), at(200));
        assert_eq!(next_due(start, period, at(350)), at(400));
    }

    #[test]
    fn exceptions_say_who_is_at_fault() {
        let cases = [
            (1, Verdict::AllRefused),
            (2, Verdict::SomeRefused),
            (3, Verdict::SomeRefused),
            (4, Verdict::Unavailable(Reason::Unknown)),
            (6, Verdict::Unavailable(Reason::Communication)),
            (10, Verdict::Unavailable(Reason::Communication)),
            (11, Verdict::Unavailable(Reason::Communication)),
            (99, Verdict::Unavailable(Reason::Unknown)),
        ];
        for (code, expected) in cases {
            assert_eq!(verdict(ExceptionCode::new(code)), expected, "{code}");
        }
    }
}
