//! What is known of each point, and the samples that come of it.

use std::time::SystemTime;

use busbar_plugin_sdk::{Host, LogLevel, Quality, Reason, Sample, SampleSink, Value};
use iec61850_rs::proto::data::{self, Typed};

use crate::convert::{name_of, quality_of, time_of, value_of};
use crate::locate::{Share, follow};
use crate::points::{Point, Points};

/// Samples that are published at once.
const MAX_BATCH: usize = 4096;
/// Lines about single tags.
const MAX_TOLD: usize = 20;

/// Where values come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Origin {
    /// They are told because they changed, and not because they were asked for.
    pub(crate) is_change: bool,
    /// They are of the past.
    pub(crate) is_replayed: bool,
    /// When the server put them together.
    pub(crate) entry_time: Option<SystemTime>,
}

/// The time `t` beside a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Stamp {
    #[default]
    Absent,
    /// Of a clock that cannot be relied on, or never set.
    Untrusted,
    At(SystemTime),
}

/// A point.
#[derive(Clone, Copy, Debug, Default)]
struct State {
    value: Option<Value>,
    /// Nothing while it is not known.
    quality: Option<Quality>,
    /// The latest `t`, also of former connections.
    latest: Option<SystemTime>,
    stamp: Stamp,
    is_touched: bool,
    is_told: bool,
}

pub(crate) struct Board {
    points: Points,
    states: Vec<State>,
    sink: SampleSink,
    host: Host,
    /// What messages begin with.
    server: String,
    told: usize,
    touched: Vec<usize>,
    batch: Vec<Sample>,
}

impl Board {
    pub(crate) fn new(points: Points, sink: SampleSink, host: Host, server: String) -> Self {
        let states = vec![State::default(); points.all().len()];
        let (touched, batch) = (Vec::new(), Vec::new());
        Self { points, states, sink, host, server, told: 0, touched, batch }
    }

    pub(crate) fn points(&self) -> &Points {
        &self.points
    }

    /// Says of every tag that it has no value, and forgets all but times.
    pub(crate) fn reset(&mut self, reason: Reason) {
        self.flush();
        self.sink.publish_bad(self.points.all().iter().map(|point| point.tag), reason);
        for state in &mut self.states {
            (state.value, state.quality) = (None, None);
        }
    }

    /// Whether a point has a quality of its own is told by its type.
    pub(crate) fn note_type(&mut self, index: usize, has_quality: bool) {
        self.states[index].quality = (!has_quality).then_some(Quality::Good);
    }

    /// Takes what a variable has of a point; [`Board::commit`] publishes it.
    pub(crate) fn take(&mut self, index: usize, share: &Share, data: &data::Value) {
        let find = |path: &Option<Vec<usize>>| path.as_ref().map(|path| follow(data, path));
        let (value, quality, time) = (find(&share.value), find(&share.quality), find(&share.time));
        if let Some(value) = value {
            let fitting = value.and_then(|value| value_of(&self.points.all()[index], value));
            if fitting.is_none() {
                let found = value.map_or("missing in the answer", name_of);
                self.misfit(index, found);
                return;
            }
            self.states[index].value = fitting;
        }
        let state = &mut self.states[index];
        if let Some(quality) = quality {
            let read = quality.and_then(data::Value::as_quality).map(quality_of);
            state.quality = Some(read.unwrap_or(Quality::Bad(Reason::Configuration)));
        }
        if let Some(time) = time.flatten().and_then(data::Value::as_utc_time) {
            state.stamp = time_of(time).map_or(Stamp::Untrusted, Stamp::At);
        }
        if !std::mem::replace(&mut state.is_touched, true) {
            self.touched.push(index);
        }
    }

    /// Publishes what was taken.
    pub(crate) fn commit(&mut self, origin: Origin) {
        for index in std::mem::take(&mut self.touched) {
            let tag = self.points.all()[index].tag;
            let state = &mut self.states[index];
            state.is_touched = false;
            let source_time = state.source_time(origin);
            let mut quality = state.quality.unwrap_or(Quality::Uncertain(Reason::Unknown));
            // Of the past, and nobody can say how old.
            if origin.is_replayed && source_time.is_none() && quality.is_good() {
                quality = Quality::Uncertain(Reason::Unknown);
            }
            let value = state.value;
            if value.is_some() || !quality.is_good() {
                self.push(Sample { tag, value, quality, source_time });
            }
        }
    }

    /// A point has no value, for this reason.
    pub(crate) fn fail(&mut self, index: usize, reason: Reason) {
        self.states[index].value = None;
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
        self.tell(index, &format!("its value is {found}, which is no {kind:?}: {remedy}"));
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
    /// ago it became so. So a `t` is handed on where it is news.
    fn source_time(&mut self, origin: Origin) -> Option<SystemTime> {
        let stamp = std::mem::take(&mut self.stamp);
        let Stamp::At(time) = stamp else {
            let may_be_entry = origin.is_change || origin.is_replayed;
            let is_absent = stamp == Stamp::Absent;
            return origin.entry_time.filter(|_| is_absent && may_be_entry);
        };
        let before = self.latest;
        self.latest = before.max(Some(time));
        let is_later = before.is_none_or(|before| time > before);
        let is_news = is_later && (before.is_some() || origin.is_change);
        (origin.is_replayed || is_news).then_some(time)
    }
}

#[cfg(test)]
#[path = "board_tests.rs"]
mod tests;
