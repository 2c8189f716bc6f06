//! State of each point, and the samples made from received values.

use std::time::SystemTime;

use busbar_plugin_sdk::{Host, LogLevel, Quality, Reason, Sample, SampleFlags, SampleSink, Value};
use iec61850_rs::proto::data::{self, Typed};
use source_units::{UnitAgreement, UnreadableUnit};

use crate::convert::{Stamp, name_of, origin_of, quality_of, stamp_of, value_of};
use crate::locate::{Share, follow};
use crate::points::{Point, Points};
use crate::units::StatedUnit;

/// Samples that are published at once.
const MAX_BATCH: usize = 4096;
/// Lines about single tags.
const MAX_TOLD: usize = 20;

/// Origin of received values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Origin {
    /// Marks values that are sent because they changed, not because they were requested.
    pub(crate) is_change: bool,
    /// Marks values of the past.
    pub(crate) is_replayed: bool,
    /// Time at which the server assembled the report.
    pub(crate) entry_time: Option<SystemTime>,
}

/// State of a point.
#[derive(Clone, Debug, Default)]
struct State {
    /// Value, and its quality apart from that of the server.
    value: Option<(Value, Quality)>,
    /// Nothing while it is not known.
    quality: Option<Quality>,
    /// Tells whether a quality of its own belongs to the value.
    has_quality: bool,
    /// Substituted, or under test, by the quality.
    origin: SampleFlags,
    /// The latest `t`, also of former connections.
    latest: Option<SystemTime>,
    /// Last timestamp `t` of the point.
    last: Option<SystemTime>,
    stamp: Stamp,
    /// Relation of the unit that the server states to the tag's.
    unit: UnitAgreement,
    /// Number of the last report of it: what was asked for before says less.
    reported: u64,
    is_touched: bool,
    is_told: bool,
}

pub(crate) struct PointStates {
    points: Points,
    states: Vec<State>,
    sink: SampleSink,
    host: Host,
    /// Prefix of messages that names the server.
    server: String,
    told: usize,
    touched: Vec<usize>,
    batch: Vec<Sample>,
    /// Number of the last report, or sign of one.
    reports: u64,
}

impl PointStates {
    pub(crate) fn new(points: Points, sink: SampleSink, host: Host, server: String) -> Self {
        let states = vec![State::default(); points.all().len()];
        let (touched, batch) = (Vec::new(), Vec::new());
        Self { points, states, sink, host, server, told: 0, touched, batch, reports: 0 }
    }

    pub(crate) fn points(&self) -> &Points {
        &self.points
    }

    /// Name of the server in messages.
    pub(crate) fn server(&self) -> &str {
        &self.server
    }

    /// Says of every tag that it has no value, and forgets all but times.
    pub(crate) fn reset(&mut self, reason: Reason) {
        self.flush();
        self.sink.publish_bad(self.points.all().iter().map(|point| point.tag), reason);
        for state in &mut self.states {
            (state.value, state.quality, state.origin) = (None, None, SampleFlags::LIVE);
            state.unit = UnitAgreement::Agrees;
        }
    }

    /// Records whether a point's type has a quality of its own.
    pub(crate) fn note_type(&mut self, index: usize, has_quality: bool) {
        let state = &mut self.states[index];
        state.has_quality = has_quality;
        state.quality = (!has_quality).then_some(Quality::Good);
    }

    /// Takes the unit that the server states for a point, and tells of one that is not the tag's.
    pub(crate) fn note_unit(&mut self, index: usize, stated: Result<StatedUnit, UnreadableUnit>) {
        let unit = &self.points.all()[index].unit;
        let (agreement, words) = match stated {
            Ok(stated) => (stated.compare(unit), stated.in_words()),
            Err(UnreadableUnit) => (unit.judge_unreadable(), "units are no integers".to_owned()),
        };
        let remark = unit.remark(agreement, &words);
        self.states[index].unit = agreement;
        if let Some(remark) = remark {
            self.tell(index, &remark);
        }
    }

    /// Number of what was reported so far; requests that are sent now see all of it.
    pub(crate) fn reports(&self) -> u64 {
        self.reports
    }

    /// Counts a report, before its values are taken.
    pub(crate) fn begin_report(&mut self) {
        self.reports += 1;
    }

    /// Notes that a point is in the report, so that answers to what was asked before it
    /// are of no use.
    pub(crate) fn note_reported(&mut self, index: usize) {
        self.states[index].reported = self.reports;
    }

    /// Reports whether an answer to a request that saw so many reports may be the older one.
    pub(crate) fn is_overtaken(&self, index: usize, reports: u64) -> bool {
        self.states[index].reported > reports
    }

    /// Something was reported of a point that could not be understood: it is bad until its
    /// value and quality come anew.
    pub(crate) fn distrust(&mut self, index: usize) {
        self.fail(index, Reason::Communication);
        let state = &mut self.states[index];
        state.quality = (!state.has_quality).then_some(Quality::Good);
        state.reported = self.reports;
    }

    /// Takes what a variable has of a point; [`PointStates::commit`] publishes it. Returns false where
    /// its value or quality is of another type.
    pub(crate) fn take(&mut self, index: usize, share: &Share, data: &data::Value) -> bool {
        let find = |path: &Option<Vec<usize>>| path.as_ref().map(|path| follow(data, path));
        let (value, quality, time) = (find(&share.value), find(&share.quality), find(&share.time));
        if let Some(value) = value {
            let fitting = value.and_then(|value| value_of(&self.points.all()[index], value));
            if fitting.is_none() {
                let found = value.map_or("missing in the answer", name_of);
                self.misfit(index, found);
                return false;
            }
            self.states[index].value = fitting;
        }
        let mut fits = true;
        let state = &mut self.states[index];
        if let Some(quality) = quality {
            let read = quality.and_then(data::Value::as_quality);
            let is_unreadable = Quality::Bad(Reason::Configuration);
            state.quality = Some(read.map_or(is_unreadable, quality_of));
            state.origin = read.map_or(SampleFlags::LIVE, origin_of);
            fits = read.is_some();
        }
        if let Some(time) = time {
            let read = time.and_then(data::Value::as_utc_time);
            state.stamp = read.map_or(Stamp::Unusable, stamp_of);
        }
        if !std::mem::replace(&mut state.is_touched, true) {
            self.touched.push(index);
        }
        fits
    }

    /// Publishes what was taken.
    pub(crate) fn commit(&mut self, origin: Origin) {
        for index in std::mem::take(&mut self.touched) {
            let tag = self.points.all()[index].tag;
            let state = &mut self.states[index];
            state.is_touched = false;
            let mut flags = state.origin;
            if origin.is_replayed {
                flags |= SampleFlags::BUFFERED;
            }
            let is_unusable = state.stamp == Stamp::Unusable;
            let source_time = state.source_time(origin);
            let mut quality = state.quality.unwrap_or(Quality::Uncertain(Reason::Unknown));
            // Of the past, and nobody can say how old.
            let is_of_any_age = origin.is_replayed && source_time.is_none();
            if is_unusable || is_of_any_age {
                flags |= SampleFlags::TIME_UNUSABLE;
            }
            if is_of_any_age && quality.is_good() {
                quality = Quality::Uncertain(Reason::SourceTime);
            }
            let has_other_unit = state.unit == UnitAgreement::Conflicts;
            let value = state.value.clone().filter(|_| !has_other_unit);
            let value = value.map(|(value, of_value)| {
                quality = quality.worst(of_value);
                value
            });
            // Where there is no value, none becomes uncertain.
            if value.is_some() || has_other_unit {
                quality = state.unit.limit(quality);
            }
            if let Some(Value::F64(number)) = &value
                && !number.is_finite()
                && !matches!(quality, Quality::Bad(_))
            {
                quality = Quality::Bad(Reason::NotFinite);
            }
            if value.is_some() || !quality.is_good() {
                self.push(Sample { tag, value, quality, source_time, flags });
            }
        }
    }

    /// A point has no value, for this reason.
    pub(crate) fn fail(&mut self, index: usize, reason: Reason) {
        let state = &mut self.states[index];
        (state.value, state.origin) = (None, SampleFlags::LIVE);
        self.push(Sample::bad(self.points.all()[index].tag, reason));
    }

    /// Tells what is wrong with a point, once.
    pub(crate) fn tell(&mut self, index: usize, what: &str) {
        let is_new = !std::mem::replace(&mut self.states[index].is_told, true);
        if is_new && self.told < MAX_TOLD {
            self.told += 1;
            let point = &self.points.all()[index];
            let text = format!("tag '{}' ({}): {what}", point.id, point.reference());
            self.log(LogLevel::Warning, &text);
        }
    }

    pub(crate) fn log(&self, level: LogLevel, text: &str) {
        self.host.log(level, &format!("{}: {text}", self.server));
    }

    /// Publishes what is ready.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    fn misfit(&mut self, index: usize, found: &str) {
        let Point { kind, .. } = self.points.all()[index];
        self.fail(index, Reason::Configuration);
        let remedy = "correct the tag's type or reference";
        self.tell(index, &format!("its value is {found}, which is no {}: {remedy}", kind.name()));
    }

    fn push(&mut self, sample: Sample) {
        self.batch.push(sample);
        if self.batch.len() >= MAX_BATCH {
            self.flush();
        }
    }
}

impl State {
    /// The source time of a sample. `t` is when the value changed last, and not how old it
    /// is: what a server tells when asked, or periodically, is as it is now, however long
    /// ago it became so. So a `t` is handed on where it is news: in a report of a change,
    /// also of a clock that was set back, or where it has advanced since the last reading.
    fn source_time(&mut self, origin: Origin) -> Option<SystemTime> {
        let stamp = std::mem::take(&mut self.stamp);
        let Stamp::At(time) = stamp else {
            let may_be_entry = origin.is_change || origin.is_replayed;
            let is_absent = stamp == Stamp::Absent;
            return origin.entry_time.filter(|_| is_absent && may_be_entry);
        };
        let before = self.latest;
        self.latest = before.max(Some(time));
        let is_other = self.last.replace(time) != Some(time);
        let has_advanced = before.is_some_and(|before| time > before);
        let has_changed = has_advanced || (origin.is_change && is_other);
        (origin.is_replayed || has_changed).then_some(time)
    }
}

#[cfg(test)]
#[path = "point_states_tests.rs"]
mod tests;
