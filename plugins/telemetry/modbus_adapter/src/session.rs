//! The life of a link: connect, poll, fail, wait, again.

use std::sync::Arc;

use busbar_link::{Backoff, Dial};
use busbar_plugin_sdk::{Host, LinkState, LogLevel, Reason, Sample, SampleSink};
use tokio::time::{Instant, sleep, sleep_until};
use tokio_modbus::ExceptionCode;

use crate::address::Point;
use crate::connection::{Connection, Connector, LinkFault, Reply, describe};
use crate::decode::decode;
use crate::exceptions::{ExceptionEffect, REFUSED, effect_of_exception};
use crate::plan::{Block, plan};
use crate::poll_group::{Group, Origin, Poll, next_due};
use crate::settings::Config;
use crate::units::Units;

/// Tags that one log line names.
const MAX_TAGS_IN_MESSAGE: usize = 5;

pub(crate) struct Session {
    config: Config,
    points: Vec<Point>,
    sink: SampleSink,
    host: Host,
    backoff: Backoff,
    connector: Connector,
}

/// Connection, and the state of the devices behind it.
struct Link {
    connection: Connection,
    units: Units,
    /// True once a device has answered.
    is_up: bool,
    /// True where a unit answered that had been silent.
    has_recovered: bool,
}

impl Session {
    pub(crate) fn new(
        config: Config,
        dial: Arc<dyn Dial>,
        points: Vec<Point>,
        sink: SampleSink,
        host: Host,
    ) -> Self {
        let backoff = Backoff::new(config.reconnect);
        let connector = Connector::new(&config, dial);
        Self { config, points, sink, host, backoff, connector }
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
        let mut link = self.connect().await?;
        // Planned anew: the device may have been replaced in between.
        let mut groups = self.groups();
        loop {
            let Some(group) = groups.iter_mut().min_by_key(|group| group.due) else {
                return std::future::pending().await;
            };
            sleep_until(group.due).await;
            self.poll(&mut link, group).await?;
            group.due = next_due(group.due, group.period, Instant::now());
            group.is_polled = true;
            // Not before: a peer that answers once and closes is no success.
            if groups.iter().all(|group| group.is_polled) {
                self.backoff.reset();
            }
            if std::mem::take(&mut link.has_recovered) {
                // Its tags of slower groups are bad too.
                groups.iter_mut().for_each(|group| group.due = Instant::now());
            }
        }
    }

    async fn connect(&self) -> Result<Link, LinkFault> {
        let connection = self.connector.open().await?;
        let units = Units::new(&self.points, self.config.reconnect);
        Ok(Link { connection, units, is_up: false, has_recovered: false })
    }

    fn groups(&self) -> Vec<Group> {
        let periods = self.config.group_periods.iter().enumerate();
        periods
            .map(|(index, &period)| Group::new(period, plan(&self.points, index)))
            .filter(|group| !group.blocks.is_empty())
            .collect()
    }

    async fn poll(&mut self, link: &mut Link, group: &mut Group) -> Result<(), LinkFault> {
        let mut poll = group.begin_poll(&self.points, Instant::now());
        while let Some((block, origin)) = poll.queue.pop_front() {
            if link.units.is_left_alone(block.unit, Instant::now()) {
                self.publish_bad(&block, Reason::Communication);
                group.blocks.push(block);
                continue;
            }
            let reply = link.connection.read(&block).await?;
            if let Reply::None(fault) = reply {
                self.note_silence(link, block.unit, fault)?;
                group.blocks.push(block);
                continue;
            }
            if let Reply::Exception(exception) = reply {
                self.note_exception(link, &block, exception);
                self.apply_exception(exception, block, origin, group, &mut poll);
            } else {
                self.note_answer(link, block.unit);
                self.publish_values(&block, &reply);
                poll.has_recovered |= origin == Origin::Retry;
                group.blocks.push(block);
            }
        }
        for refused in &group.refused {
            let is_silent = link.units.is_left_alone(refused.block.unit, Instant::now());
            let reason = if is_silent { Reason::Communication } else { REFUSED };
            self.publish_bad(&refused.block, reason);
        }
        group.end_poll(&poll, Instant::now());
        Ok(())
    }

    /// Notes that a device of a serial line did not answer: all of its tags turn bad, whatever
    /// their poll groups.
    fn note_silence(&self, link: &mut Link, unit: u8, fault: LinkFault) -> Result<(), LinkFault> {
        let of_unit = self.points.iter().filter(|point| point.unit == unit);
        self.sink.publish_bad(of_unit.map(|point| point.tag), Reason::Communication);
        let is_new = link.units.note_silence(unit, Instant::now());
        if link.units.are_all_silent() {
            return Err(fault);
        }
        if is_new {
            self.host.log(LogLevel::Warning, &format!("{}: {fault}", self.config.transport));
            self.report_units(link);
        }
        Ok(())
    }

    fn note_answer(&self, link: &mut Link, unit: u8) {
        let is_new = !std::mem::replace(&mut link.is_up, true);
        let has_recovered = link.units.note_answer(unit);
        link.has_recovered |= has_recovered;
        if is_new || has_recovered {
            self.report_units(link);
        }
    }

    /// Notes an exception. The unit's own counts as an answer. One of a gateway that cannot reach
    /// the unit makes all of its tags bad, whatever their poll groups.
    fn note_exception(&self, link: &mut Link, block: &Block, exception: ExceptionCode) {
        let unit = block.unit;
        let is_of_gateway = matches!(
            exception,
            ExceptionCode::GatewayPathUnavailable | ExceptionCode::GatewayTargetDevice
        );
        if is_of_gateway {
            let of_unit = self.points.iter().filter(|point| point.unit == unit);
            self.sink.publish_bad(of_unit.map(|point| point.tag), Reason::Communication);
            let is_first = !std::mem::replace(&mut link.is_up, true);
            if link.units.note_unreachable(unit) || is_first {
                self.report_units(link);
            }
        } else {
            self.note_answer(link, unit);
        }
        if matches!(effect_of_exception(exception), ExceptionEffect::Unavailable(_))
            && let Some(count) = link.units.count_exception(unit)
        {
            let times = if count == 1 { String::new() } else { format!(", {count} times so far") };
            let (transport, what) = (&self.config.transport, describe(block));
            let text =
                format!("{transport}: {exception} instead of {what}{times}; its tags are bad");
            self.host.log(LogLevel::Warning, &text);
        }
    }

    fn report_units(&self, link: &Link) {
        let state = if link.is_up { LinkState::Up } else { LinkState::Connecting };
        let text = link.units.silent().unwrap_or_else(|| "connected".into());
        self.report(state, &text);
    }

    /// Handles a block by the effect of the device's exception.
    fn apply_exception(
        &self,
        exception: ExceptionCode,
        block: Block,
        origin: Origin,
        group: &mut Group,
        poll: &mut Poll,
    ) {
        match effect_of_exception(exception) {
            ExceptionEffect::Unavailable(reason) => {
                self.publish_bad(&block, reason);
                group.blocks.push(block);
            }
            ExceptionEffect::SomeRefused if let Some((left, right)) = block.split(&self.points) => {
                if poll.splits_left > 0 {
                    poll.splits_left -= 1;
                    poll.queue.push_front((right, origin));
                    poll.queue.push_front((left, origin));
                } else if origin == Origin::Replanned {
                    poll.fall_back(&block, &self.points);
                } else {
                    // Nobody asks for the halves before the next poll.
                    self.publish_bad(&block, REFUSED);
                    group.blocks.extend([left, right]);
                }
            }
            ExceptionEffect::SomeRefused | ExceptionEffect::AllRefused => {
                if origin != Origin::Retry {
                    self.log_refusal(&block, exception);
                }
                group.refuse(block);
            }
        }
    }

    fn publish_values(&self, block: &Block, reply: &Reply) {
        self.sink.publish(&samples(&self.points, block, reply));
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
        let message = format!("{}: {message}", self.config.transport);
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
            self.config.transport,
            describe(block),
            ids.join(", "),
            if more > 0 { format!(" and {more} more") } else { String::new() }
        );
        self.host.log(LogLevel::Warning, &message);
    }
}

/// Returns the samples of a block's tags by an answer.
pub(crate) fn samples(points: &[Point], block: &Block, reply: &Reply) -> Vec<Sample> {
    let sample = |&index: &usize| {
        let point = &points[index];
        let first = usize::from(point.first - block.first);
        let value = reply
            .cells(first, usize::from(point.count))
            .ok_or(Reason::Configuration)
            .and_then(|cells| decode(&point.decoding, cells));
        match value {
            Ok((value, quality)) => Sample { quality, ..Sample::good(point.tag, value) },
            Err(reason) => Sample::bad(point.tag, reason),
        }
    };
    block.points.iter().map(sample).collect()
}

#[cfg(test)]
#[path = "session_matrix_tests.rs"]
mod matrix_tests;
#[cfg(test)]
#[path = "session_tests.rs"]
mod tests;
