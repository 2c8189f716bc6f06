//! Last values of a server's tags, and the samples that the host gets of them.
//!
//! Suspect values may have changed since their last report. They are published as uncertain and not
//! confirmed until a new report arrives.

use std::ops::Range;
use std::time::{Duration, Instant, SystemTime};

use async_opcua::types::{DataValue, StatusCode};
use busbar_plugin_sdk::{
    Host, LogLevel, MAX_TEXT_BYTES, Quality, Reason, Sample, SampleFlags, SampleSink, Value,
};

use source_units::{UnitAgreement, UnreadableUnit};

use crate::convert::{origin_of, quality_of, source_time_of, value_of};
use crate::engineering_units::StatedUnit;
use crate::fault::in_words;
use crate::mirror::Mirror;
use crate::points::Points;
use crate::settings::{Config, SourceTime};

/// Tags that are named in the log for one kind of fault, a connection.
const MAX_NAMED: usize = 10;
/// A value is confirmed as soon as this share of its freshness is over.
const CONFIRMED_AFTER: u32 = 4;
/// A value whose source time is older than this share of its freshness when it comes is
/// confirmed at once.
const OLD_AFTER: u32 = 2;
/// Farthest that a source time is ahead of our clock and believed, as in the host.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(10);

/// Samples of values, and values that go on.
pub(crate) struct PointStates {
    pub(crate) points: Points,
    pub(crate) last: Vec<Last>,
    items: Vec<ItemState>,
    /// Relation of the unit that the server states to the tag's, by point.
    units: Vec<UnitAgreement>,
    /// True for each condition, by its index, that an event reported since the last refresh began.
    pub(crate) told_conditions: Vec<bool>,
    batch: Vec<Sample>,
    /// Faults named since the connection was made.
    named: usize,
    confirm: bool,
    pub(crate) source_time: SourceTime,
    /// Origin of all values: the server is in test mode.
    origin: SampleFlags,
    /// The server says that it does not serve as it should.
    is_server_doubtful: bool,
    /// Values that are taken now are not the newest: more is missing after them.
    pub(crate) is_more_missing: bool,
    sink: SampleSink,
    host: Host,
    /// The server's alarms, where they are mirrored.
    mirror: Option<Mirror>,
}

/// Last sample of a tag that the host was told.
#[derive(Clone, Default)]
pub(crate) struct Last {
    /// Value with its quality, where it may be confirmed.
    pub(crate) value: Option<(Value, Quality)>,
    source_time: Option<SystemTime>,
    flags: SampleFlags,
    pub(crate) told: Option<Instant>,
    /// True once the value was confirmed: published again as the current one.
    is_confirmed: bool,
    /// True where the value may have changed since it was published.
    pub(crate) is_suspect: bool,
}

/// Reports of one monitored item.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Reports {
    /// All of them came: the last one is the value.
    #[default]
    Complete,
    /// One may be lost: the value is read until the next one comes.
    Lost,
    /// There are none: the server refused the item.
    Refused,
}

#[derive(Clone, Copy, Default)]
struct ItemState {
    reports: Reports,
    /// The meaning of its values changed while it was watched: its unit, range, or type.
    has_new_meaning: bool,
}

impl PointStates {
    pub(crate) fn new(points: Points, config: &Config, sink: SampleSink, host: Host) -> Self {
        Self {
            last: vec![Last::default(); points.all.len()],
            items: vec![ItemState::default(); points.items.len()],
            units: vec![UnitAgreement::default(); points.all.len()],
            told_conditions: vec![false; points.conditions.len()],
            points,
            batch: Vec::new(),
            named: 0,
            confirm: config.confirm_unchanged,
            source_time: config.source_time,
            origin: SampleFlags::LIVE,
            is_server_doubtful: false,
            is_more_missing: false,
            sink,
            host,
            mirror: None,
        }
    }

    /// Adds the mirror of all alarms of the server.
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
        self.items.fill(ItemState::default());
        self.units.fill(UnitAgreement::default());
        self.told_conditions.fill(false);
        self.batch.clear();
        self.named = 0;
        (self.origin, self.is_server_doubtful) = (SampleFlags::LIVE, false);
        self.sink.publish_bad(self.points.tags(), reason);
        self.tell_mirror("its conditions are not known yet");
    }

    /// Marks the alarms of the mirror as no longer current, for a reason.
    pub(crate) fn tell_mirror(&self, why: &str) {
        if let Some(mirror) = &self.mirror {
            mirror.lose(why);
        }
    }

    /// Takes the state of the server: whether it says that it serves as it should, and
    /// the origin of all that it serves.
    pub(crate) fn set_server(
        &mut self,
        is_doubtful: bool,
        origin: SampleFlags,
        now: Instant,
        wall: SystemTime,
    ) {
        if (self.is_server_doubtful, self.origin) == (is_doubtful, origin) {
            return;
        }
        (self.is_server_doubtful, self.origin) = (is_doubtful, origin);
        for index in 0..self.last.len() {
            self.tell_anew(index, now, wall);
        }
    }

    /// Takes a report of an item, or the value that was read of it.
    pub(crate) fn take(&mut self, item: usize, value: &DataValue, now: Instant, wall: SystemTime) {
        let Some(state) = self.items.get_mut(item) else { return };
        state.reports = Reports::Complete;
        self.take_value(item, value, now, wall);
    }

    /// Takes the value that was read of an item; a report that came since is newer.
    pub(crate) fn take_read(
        &mut self,
        item: usize,
        value: &DataValue,
        now: Instant,
        wall: SystemTime,
    ) {
        if self.items.get(item).is_some_and(|state| state.reports == Reports::Lost) {
            self.take_value(item, value, now, wall);
        }
    }

    /// Takes the unit that the server states for the values of an item, and tells of one that is
    /// not the tag's.
    pub(crate) fn note_unit(&mut self, item: usize, unit: Result<&StatedUnit, &UnreadableUnit>) {
        let words = unit.map_or_else(|_| "of another type".to_owned(), StatedUnit::in_words);
        for place in 0..self.points.items[item].points.len() {
            let index = self.points.items[item].points[place];
            let point = &self.points.all[index];
            let agreement = match unit {
                Ok(unit) => point.unit.compare(unit.names()),
                Err(UnreadableUnit) => point.unit.judge_unreadable(),
            };
            let is_news = std::mem::replace(&mut self.units[index], agreement) != agreement;
            let remark = point.unit.remark(agreement, &words);
            if let Some(remark) = remark.filter(|_| is_news) {
                let text = format!("tag '{}': {remark}", point.id);
                self.name(LogLevel::Warning, &text);
            }
        }
    }

    fn take_value(&mut self, item: usize, value: &DataValue, now: Instant, wall: SystemTime) {
        let status = value.status.unwrap_or(StatusCode::Good);
        let is_changed = status.semantics_changed() || status.structure_changed();
        let is_named = is_changed && !self.items[item].has_new_meaning;
        self.items[item].has_new_meaning |= is_changed;
        for place in 0..self.points.items[item].points.len() {
            let index = self.points.items[item].points[place];
            if is_named {
                let text = format!(
                    "tag '{}': the server says that unit, range or type changed: check the tag, \
                     then reload",
                    self.points.all[index].id
                );
                self.name(LogLevel::Warning, &text);
            }
            if status.overflow() {
                let text = format!(
                    "tag '{}': the server dropped values between two publishing intervals",
                    self.points.all[index].id
                );
                self.name(LogLevel::Warning, &text);
            }
            self.take_for(index, item, value, now, wall);
        }
    }

    fn take_for(
        &mut self,
        index: usize,
        item: usize,
        data: &DataValue,
        now: Instant,
        wall: SystemTime,
    ) {
        let point = &self.points.all[index];
        let status = data.status.unwrap_or(StatusCode::Good);
        let (source_time, flags) = source_time_of(data.source_timestamp.as_ref(), self.source_time);
        let flags = flags | origin_of(status);
        let quality = quality_of(status);
        let mut sample = Sample { tag: point.tag, value: None, quality, source_time, flags };
        if self.units[index] == UnitAgreement::Conflicts {
            if !matches!(quality, Quality::Bad(_)) {
                sample.quality = Quality::Bad(Reason::Configuration);
            }
            return self.put(index, sample, now, wall);
        }
        let variant = data.value.as_ref().filter(|value| !value.is_empty());
        match variant.map(|variant| value_of(point, variant)) {
            Some(Ok((value, of_text))) => {
                sample.value = Some(value);
                sample.quality = quality.worst(of_text);
                if self.items[item].has_new_meaning && quality.is_good() {
                    sample.quality = Quality::Uncertain(Reason::Configuration);
                }
                sample.quality = self.units[index].limit(sample.quality);
                if !of_text.is_good() {
                    let id = &point.id;
                    let text =
                        format!("tag '{id}': a text of more than {MAX_TEXT_BYTES} bytes was cut");
                    self.name(LogLevel::Warning, &text);
                }
            }
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

    pub(crate) fn put(&mut self, index: usize, sample: Sample, now: Instant, wall: SystemTime) {
        let kept = sample.value.as_ref().filter(|_| !matches!(sample.quality, Quality::Bad(_)));
        self.last[index] = Last {
            value: kept.map(|value| (value.clone(), sample.quality)),
            source_time: sample.source_time,
            flags: sample.flags,
            told: Some(now),
            is_confirmed: false,
            is_suspect: self.is_more_missing,
        };
        let source_time = sample.source_time;
        self.push(sample, self.is_more_missing);
        let age = source_time.and_then(|time| wall.duration_since(time).ok());
        let limit = self.points.all[index].freshness / OLD_AFTER;
        if self.confirm && age.is_some_and(|age| age > limit) {
            self.confirm_one(index, now, wall);
        }
    }

    /// Adds a sample as it is known now: of a doubtful server, or suspect, it is not good.
    fn push(&mut self, mut sample: Sample, is_suspect: bool) {
        if (is_suspect || self.is_server_doubtful) && sample.quality.is_good() {
            sample.quality = Quality::Uncertain(Reason::Communication);
        }
        self.batch.push(sample.with_flags(self.origin));
    }

    pub(crate) fn push_bad(&mut self, index: usize, reason: Reason) {
        self.last[index] = Last::default();
        self.batch.push(Sample::bad(self.points.all[index].tag, reason));
    }

    /// Publishes the last value again, in its present state.
    fn tell(&mut self, index: usize) {
        let last = &self.last[index];
        let Some((value, quality)) = &last.value else { return };
        let sample = Sample {
            tag: self.points.all[index].tag,
            value: Some(value.clone()),
            quality: *quality,
            source_time: last.source_time.filter(|_| !last.is_confirmed),
            flags: last.flags,
        };
        let is_suspect = last.is_suspect;
        self.push(sample, is_suspect);
    }

    /// Publishes the last value as current, where it is and the settings confirm values; otherwise
    /// in its present state.
    fn tell_anew(&mut self, index: usize, now: Instant, wall: SystemTime) {
        let last = &self.last[index];
        let is_past = last.is_suspect || last.flags.contains(SampleFlags::HISTORICAL);
        if self.confirm && !is_past {
            self.confirm_one(index, now, wall);
        } else {
            self.tell(index);
        }
    }

    /// Marks a value as suspect: it may have changed since it was published.
    pub(crate) fn suspect_one(&mut self, index: usize) {
        if !std::mem::replace(&mut self.last[index].is_suspect, true) {
            self.tell(index);
        }
    }

    /// Notes that reports of these items are missing, which may still come.
    pub(crate) fn suspect(&mut self, items: Range<usize>) {
        for item in items {
            if self.items[item].reports != Reports::Refused {
                for place in 0..self.points.items[item].points.len() {
                    self.suspect_one(self.points.items[item].points[place]);
                }
            }
        }
    }

    /// Notes that reports of these items are lost: their values are to be read.
    pub(crate) fn suspect_lost(&mut self, items: Range<usize>) {
        self.suspect(items.clone());
        for state in self.items.get_mut(items).into_iter().flatten() {
            if state.reports != Reports::Refused {
                state.reports = Reports::Lost;
            }
        }
    }

    /// Notes that no report of these items is missing, so that unreported values did not change.
    pub(crate) fn restore(&mut self, items: Range<usize>, now: Instant, wall: SystemTime) {
        for item in items {
            if self.items[item].reports != Reports::Complete {
                continue;
            }
            for place in 0..self.points.items[item].points.len() {
                let index = self.points.items[item].points[place];
                if std::mem::take(&mut self.last[index].is_suspect) {
                    self.tell_anew(index, now, wall);
                }
            }
        }
    }

    /// Lists the items whose values are to be read: suspect ones, and those that no
    /// report confirms, as often as others are confirmed.
    pub(crate) fn items_to_read(&self, items: Range<usize>, now: Instant) -> Vec<usize> {
        let is_due = |index: &usize| {
            let last = &self.last[*index];
            last.is_suspect || self.confirm && last.value.is_some() && self.is_due(*index, now)
        };
        let is_wanted = |item: &usize| {
            self.items[*item].reports == Reports::Lost
                && self.points.items[*item].points.iter().any(is_due)
        };
        items.filter(is_wanted).collect()
    }

    /// Reports whether reports of one of these items are lost, and none came since.
    pub(crate) fn has_lost(&self, items: Range<usize>) -> bool {
        let states = self.items.get(items).unwrap_or_default();
        states.iter().any(|state| state.reports == Reports::Lost)
    }

    /// Confirms the values of items whose subscription is alive and reported no change.
    pub(crate) fn confirm(&mut self, items: Range<usize>, now: Instant, wall: SystemTime) {
        for item in items {
            if self.items[item].reports == Reports::Complete {
                for place in 0..self.points.items[item].points.len() {
                    self.confirm_due(self.points.items[item].points[place], now, wall);
                }
            }
        }
    }

    fn is_due(&self, index: usize, now: Instant) -> bool {
        let due = self.points.all[index].freshness / CONFIRMED_AFTER;
        let told = self.last[index].told;
        told.is_some_and(|told| now.saturating_duration_since(told) >= due)
    }

    pub(crate) fn confirm_due(&mut self, index: usize, now: Instant, wall: SystemTime) {
        if self.confirm && self.is_due(index, now) {
            self.confirm_one(index, now, wall);
        }
    }

    /// Repeats a tag's last value as current, without a source time, which would be that of its
    /// last change. An implausible source time stays marked as unusable.
    fn confirm_one(&mut self, index: usize, now: Instant, wall: SystemTime) {
        let last = &mut self.last[index];
        let Some((value, quality)) = last.value.clone() else { return };
        // What is of the past is not so now.
        if last.is_suspect || last.flags.contains(SampleFlags::HISTORICAL) {
            return;
        }
        (last.told, last.is_confirmed) = (Some(now), true);
        let mut flags = last.flags;
        if last.source_time.is_some_and(|time| time > wall + MAX_CLOCK_AHEAD) {
            flags |= SampleFlags::TIME_UNUSABLE;
        }
        let tag = self.points.all[index].tag;
        self.push(Sample { tag, value: Some(value), quality, source_time: None, flags }, false);
    }

    /// Marks the points of an item bad that the server refused.
    pub(crate) fn refuse(&mut self, item: usize, status: StatusCode) {
        self.refuse_in_words(item, status, &in_words(status));
    }

    /// Marks the points of a refused item bad, with a reason in words.
    pub(crate) fn refuse_in_words(&mut self, item: usize, status: StatusCode, why: &str) {
        let Some(refused) = self.points.items.get(item) else { return };
        self.items[item].reports = Reports::Refused;
        let reason = match quality_of(status) {
            Quality::Bad(reason) => reason,
            _ => Reason::Configuration,
        };
        let points = refused.points.clone();
        let node = refused.node.to_string();
        for index in points {
            self.push_bad(index, reason);
            let text = format!("tag '{}': node {node}: {why}", self.points.all[index].id);
            self.name(LogLevel::Warning, &text);
        }
    }

    /// Accepts an item that the server serves, which it may have refused before.
    pub(crate) fn accept(&mut self, item: usize) {
        if let Some(state) = self.items.get_mut(item) {
            state.reports = Reports::Complete;
        }
    }

    /// Logs a fault of a tag, up to a limit per connection.
    pub(crate) fn name(&mut self, level: LogLevel, text: &str) {
        self.named += 1;
        match self.named.cmp(&(MAX_NAMED + 1)) {
            std::cmp::Ordering::Less => self.host.log(level, text),
            std::cmp::Ordering::Equal => {
                self.host.log(level, "further tags are not named until the next connection");
            }
            std::cmp::Ordering::Greater => {}
        }
    }

    /// Publishes all samples of the batch.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    /// Returns the shortest freshness limit of all tags.
    pub(crate) fn min_freshness(&self) -> Option<Duration> {
        self.points.all.iter().map(|point| point.freshness).min()
    }
}

#[cfg(test)]
#[path = "point_states_tests.rs"]
mod tests;
