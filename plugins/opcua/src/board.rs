//! The tags of a server: their last values, and what is told of them.

use std::time::{Duration, Instant, SystemTime};

use async_opcua::types::{DataValue, StatusCode, Variant};
use busbar_plugin_sdk::{Host, LogLevel, Quality, Reason, Sample, SampleSink, Value};

use crate::convert::{quality_of, time_of, value_of};
use crate::fault::in_words;
use crate::mirror::Mirror;
use crate::points::Points;

/// Tags that are named in the log for one kind of fault, a connection.
const MAX_NAMED: usize = 10;
/// A value is confirmed as soon as this share of its freshness is over.
const CONFIRMED_AFTER: u32 = 4;
/// A value whose source time is older than this share of its freshness when it comes is
/// confirmed at once.
const OLD_AFTER: u32 = 2;

/// Samples of values, and values that go on.
pub(crate) struct Board {
    points: Points,
    last: Vec<Last>,
    batch: Vec<Sample>,
    /// Faults named since the connection was made.
    named: usize,
    confirm: bool,
    sink: SampleSink,
    host: Host,
    /// The server's alarms, where they are mirrored.
    mirror: Option<Mirror>,
}

/// What was told of a tag.
#[derive(Clone, Copy, Default)]
struct Last {
    /// A value that may be confirmed, with its quality.
    value: Option<(Value, Quality)>,
    told: Option<Instant>,
}

impl Board {
    pub(crate) fn new(points: Points, confirm: bool, sink: SampleSink, host: Host) -> Self {
        let last = vec![Last::default(); points.all.len()];
        Self { points, last, batch: Vec::new(), named: 0, confirm, sink, host, mirror: None }
    }

    /// The same with all alarms of the server.
    pub(crate) fn with_mirror(self, mirror: Option<Mirror>) -> Self {
        Self { mirror, ..self }
    }

    pub(crate) fn mirror(&self) -> Option<&Mirror> {
        self.mirror.as_ref()
    }

    pub(crate) fn points(&self) -> &Points {
        &self.points
    }

    /// No tag has a value, for this reason.
    pub(crate) fn lose(&mut self, reason: Reason) {
        self.last.fill(Last::default());
        self.batch.clear();
        self.named = 0;
        self.sink.publish_bad(self.points.tags(), reason);
        self.tell_mirror("its conditions are not known yet");
    }

    /// The alarms are as they last were, for this reason.
    pub(crate) fn tell_mirror(&self, why: &str) {
        if let Some(mirror) = &self.mirror {
            mirror.lose(why);
        }
    }

    /// Takes what a server reports of an item.
    pub(crate) fn take(&mut self, item: usize, value: &DataValue, now: Instant, wall: SystemTime) {
        let points = self.points.items.get(item).map(|item| item.points.len()).unwrap_or_default();
        for place in 0..points {
            let index = self.points.items[item].points[place];
            self.take_for(index, value, now, wall);
        }
    }

    fn take_for(&mut self, index: usize, data: &DataValue, now: Instant, wall: SystemTime) {
        let point = &self.points.all[index];
        let quality = quality_of(data.status.unwrap_or(StatusCode::Good));
        let source_time = data.source_timestamp.as_ref().and_then(time_of);
        let variant = data.value.as_ref().filter(|value| !value.is_empty());
        let mut sample = Sample { tag: point.tag, value: None, quality, source_time };
        match variant.map(|variant| value_of(point, variant)) {
            Some(Ok(value)) => sample.value = Some(value),
            // Nobody knows what it would be.
            None if !matches!(quality, Quality::Bad(_)) => {
                sample.quality = Quality::Bad(Reason::Unknown);
            }
            None => {}
            Some(Err(what)) => {
                if !matches!(quality, Quality::Bad(_)) {
                    sample.quality = Quality::Bad(Reason::Configuration);
                }
                let text = format!("tag '{}': {what}", point.id);
                self.name(LogLevel::Warning, &text);
            }
        }
        self.put(index, sample, now, wall);
    }

    fn put(&mut self, index: usize, sample: Sample, now: Instant, wall: SystemTime) {
        self.batch.push(sample);
        let is_kept = !matches!(sample.quality, Quality::Bad(_));
        let kept = sample.value.filter(|_| is_kept).map(|value| (value, sample.quality));
        self.last[index] = Last { value: kept, told: Some(now) };
        let age = sample.source_time.and_then(|time| wall.duration_since(time).ok());
        let limit = self.points.all[index].freshness / OLD_AFTER;
        if self.confirm && age.is_some_and(|age| age > limit) {
            self.confirm_one(index, now);
        }
    }

    /// The subscription of these items lives, and reported no change of them.
    pub(crate) fn confirm(&mut self, items: std::ops::Range<usize>, now: Instant) {
        if !self.confirm {
            return;
        }
        for item in items {
            for place in 0..self.points.items[item].points.len() {
                self.confirm_due(self.points.items[item].points[place], now);
            }
        }
    }

    /// The same for all conditions: their events come by one subscription.
    pub(crate) fn confirm_conditions(&mut self, now: Instant) {
        for condition in 0..self.points.conditions.len() {
            for place in 0..self.points.conditions[condition].points.len() {
                let (index, _) = self.points.conditions[condition].points[place];
                // An event is told once; what it said holds until the next one.
                self.confirm_due(index, now);
            }
        }
    }

    fn confirm_due(&mut self, index: usize, now: Instant) {
        let due = self.points.all[index].freshness / CONFIRMED_AFTER;
        let told = self.last[index].told;
        if told.is_some_and(|told| now.saturating_duration_since(told) >= due) {
            self.confirm_one(index, now);
        }
    }

    /// Takes what an event says of a condition.
    pub(crate) fn take_event(
        &mut self,
        condition: usize,
        (time, quality, fields): (&Variant, &Variant, &[Variant]),
        now: Instant,
        wall: SystemTime,
    ) {
        let status = match quality {
            Variant::StatusCode(status) => *status,
            _ => StatusCode::Good,
        };
        let quality = quality_of(status);
        let source_time = match time {
            Variant::DateTime(time) => time_of(time),
            _ => None,
        };
        for (index, field) in self.points.conditions[condition].points.clone() {
            let point = &self.points.all[index];
            let value = field.value(point.kind, fields);
            let mut sample = Sample { tag: point.tag, value, quality, source_time };
            if value.is_none() {
                sample.quality = Quality::Bad(Reason::Configuration);
                let text = format!("tag '{}': the condition has no {field:?}", point.id);
                self.name(LogLevel::Warning, &text);
            }
            self.put(index, sample, now, wall);
        }
    }

    /// All conditions of interest were told: those of `known` that were not are neither
    /// active nor to be acknowledged.
    pub(crate) fn end_refresh(&mut self, known: &[bool], now: Instant, wall: SystemTime) {
        for (condition, is_known) in known.iter().enumerate() {
            let Some(condition) = self.points.conditions.get(condition) else { return };
            for (index, field) in condition.points.clone() {
                let tag = self.points.all[index].tag;
                let value = field.of_no_interest();
                if !is_known || value.is_none() || self.last[index].told.is_some() {
                    continue;
                }
                let quality = Quality::Good;
                self.put(index, Sample { tag, value, quality, source_time: None }, now, wall);
            }
        }
    }

    /// The server does not tell of conditions.
    pub(crate) fn refuse_conditions(&mut self, what: &str, status: StatusCode) {
        let conditions = self.points.conditions.iter().flat_map(|condition| &condition.points);
        let tags: Vec<_> = conditions.map(|(index, _)| self.points.all[*index].tag).collect();
        self.batch.extend(tags.into_iter().map(|tag| Sample::bad(tag, Reason::Configuration)));
        let words = format!("conditions: {what}: {}", in_words(status));
        self.tell_mirror(&words);
        self.name(LogLevel::Warning, &words);
        self.flush();
    }

    /// A condition has no node, and no event may ever name it.
    pub(crate) fn miss_condition(&mut self, condition: usize) {
        let (node, points) = {
            let condition = &self.points.conditions[condition];
            (condition.node.to_string(), condition.points.clone())
        };
        for (index, _) in points {
            let point = &self.points.all[index];
            let text = format!("tag '{}': the server has no condition {node}", point.id);
            self.batch.push(Sample::bad(point.tag, Reason::Configuration));
            self.name(LogLevel::Warning, &text);
        }
    }

    /// Its source time is that of its last change, and orders nothing any more: what is
    /// known is that the value is so now.
    fn confirm_one(&mut self, index: usize, now: Instant) {
        let last = &mut self.last[index];
        let Some((value, quality)) = last.value else { return };
        last.told = Some(now);
        let tag = self.points.all[index].tag;
        self.batch.push(Sample { tag, value: Some(value), quality, source_time: None });
    }

    /// The server does not serve an item.
    pub(crate) fn refuse(&mut self, item: usize, status: StatusCode) {
        let Some(refused) = self.points.items.get(item) else { return };
        let quality = match quality_of(status) {
            Quality::Bad(reason) => reason,
            _ => Reason::Configuration,
        };
        let points = refused.points.clone();
        let node = refused.node.to_string();
        for index in points {
            self.last[index] = Last::default();
            self.batch.push(Sample::bad(self.points.all[index].tag, quality));
            let text =
                format!("tag '{}': node {node}: {}", self.points.all[index].id, in_words(status));
            self.name(LogLevel::Warning, &text);
        }
    }

    /// Says what is wrong with a tag, as long as there are not too many.
    fn name(&mut self, level: LogLevel, text: &str) {
        self.named += 1;
        match self.named.cmp(&(MAX_NAMED + 1)) {
            std::cmp::Ordering::Less => self.host.log(level, text),
            std::cmp::Ordering::Equal => {
                self.host.log(level, "further tags are not named until the next connection");
            }
            std::cmp::Ordering::Greater => {}
        }
    }

    /// Hands on what came.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    /// The shortest freshness of a tag.
    pub(crate) fn min_freshness(&self) -> Option<Duration> {
        self.points.all.iter().map(|point| point.freshness).min()
    }
}

#[cfg(test)]
#[path = "board_tests.rs"]
mod tests;
