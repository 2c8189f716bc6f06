//! States of all points: their samples for the host, and lines of the log about them.

use std::ops::Range;
use std::time::{Instant, SystemTime};

use busbar_plugin_sdk::{
    Host, LogLevel, MAX_TEXT_BYTES, Quality, Reason, Sample, SampleFlags, SampleSink, Value,
};

use source_units::UnitAgreement;

use crate::convert::Raw;
use crate::line_budget::LineBudget;
use crate::points::Point;

/// Samples that are published at once.
const MAX_BATCH: usize = 16 * 1024;
/// Samples of one message that are held until all of it is understood.
const MAX_HELD: usize = 256 * 1024;
/// Tags that one log line names.
const MAX_TAGS_IN_MESSAGE: usize = 5;

/// Points by their index, in order of their places.
pub(crate) struct PointStates {
    points: Vec<Point>,
    sink: SampleSink,
    host: Host,
    /// The broker, before each line of the log.
    name: String,
    batch: Vec<Sample>,
    /// Samples in `batch` from before the message that is held, while one is.
    held: Option<usize>,
    /// State of each point, by its index.
    states: Vec<PointState>,
    lines: LineBudget,
    pub(crate) ignored: Ignored,
}

/// State of a point in this connection: its last sample, and the faults that were logged.
#[derive(Clone, Copy, Debug, Default)]
struct PointState {
    /// True where the last sample was good or uncertain.
    is_usable: bool,
    is_misfit_told: bool,
    is_time_told: bool,
    told_units: [bool; 2],
    /// Relation of the unit that the source stated last to the tag's.
    unit: UnitAgreement,
}

/// Unit of a value, as its source states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StatedUnit<'a> {
    /// The source says nothing of a unit.
    Absent,
    Named(&'a str),
    /// A unit is promised, and no text stands in its place.
    Unreadable,
}

/// Quality, time and origin of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stamp {
    pub(crate) quality: Quality,
    pub(crate) source_time: Option<SystemTime>,
    pub(crate) flags: SampleFlags,
}

/// Counts of things that came since the connection was made and were not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ignored {
    /// Messages of topics that no tag names.
    pub(crate) topics: u64,
    /// Messages and metrics that are too long.
    pub(crate) too_long: u64,
    /// Payloads and metrics that cannot be read.
    pub(crate) malformed: u64,
    /// Retained messages that the settings, or Sparkplug, leave out.
    pub(crate) retained: u64,
    /// Values by an alias that has lost its meaning, or without a name and alias.
    pub(crate) aliases: u64,
}

impl PointStates {
    pub(crate) fn new(points: Vec<Point>, sink: SampleSink, host: Host, name: String) -> Self {
        let states = vec![PointState::default(); points.len()];
        let (batch, lines, ignored) = (Vec::new(), LineBudget::default(), Ignored::default());
        Self { points, sink, host, name, batch, held: None, states, lines, ignored }
    }

    /// Marks all points bad.
    pub(crate) fn mark_all(&mut self, reason: Reason) {
        self.mark(0..self.points.len(), reason);
    }

    /// Marks these points bad.
    pub(crate) fn mark(&mut self, points: Range<usize>, reason: Reason) {
        for index in points {
            let Some(point) = self.points.get(index) else { continue };
            let sample = Sample::bad(point.tag, reason);
            self.push(index, sample);
        }
    }

    /// Converts a payload value to the value of a point, with the quality that it has of its own;
    /// `None` where it does not fit.
    pub(crate) fn value_of(&self, index: usize, raw: Raw<'_>) -> Option<(Value, Quality)> {
        self.points.get(index)?.mapping.value_of(raw)
    }

    /// Takes the unit that the source states for the values of a point from now on, and tells,
    /// once in a connection, of one that is not the tag's.
    pub(crate) fn note_unit(&mut self, index: usize, stated: StatedUnit<'_>) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get_mut(index))
        else {
            return;
        };
        if !point.unit.is_known() {
            return;
        }
        let (agreement, stated) = match stated {
            StatedUnit::Absent => (UnitAgreement::Agrees, ""),
            StatedUnit::Named(unit) => (point.unit.compare([unit]), unit),
            StatedUnit::Unreadable => (point.unit.judge_unreadable(), "no text"),
        };
        // What contradicted does so until another unit can be read.
        let still_conflicts =
            agreement == UnitAgreement::Unreadable && state.unit == UnitAgreement::Conflicts;
        if !still_conflicts {
            state.unit = agreement;
        }
        let Some(remark) = point.unit.remark(agreement, stated) else { return };
        // One that contradicts is told though another one was.
        let told = &mut state.told_units[usize::from(agreement == UnitAgreement::Conflicts)];
        if !std::mem::replace(told, true) {
            let text = format!("tag '{}': {remark}", point.id);
            self.tell(LogLevel::Warning, &text);
        }
    }

    /// Takes a value of the point's type with the quality that it has of its own; one in a unit
    /// that is not the tag's is bad.
    pub(crate) fn take_value(
        &mut self,
        index: usize,
        (value, own): (Value, Quality),
        stamp: Stamp,
    ) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get(index)) else {
            return;
        };
        let Stamp { quality, source_time, flags } = stamp;
        if state.unit == UnitAgreement::Conflicts {
            let sample = Sample::bad(point.tag, Reason::Configuration);
            return self.push(index, Sample { source_time, flags, ..sample });
        }
        let (value, quality) = (Some(value), state.unit.limit(quality).worst(own));
        self.push(index, Sample { tag: point.tag, value, quality, source_time, flags });
        if !own.is_good() {
            self.tell_text_doubt(index);
        }
    }

    /// Logs a text that was cut or is no UTF-8, once per tag and connection.
    fn tell_text_doubt(&mut self, index: usize) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get_mut(index))
        else {
            return;
        };
        if !std::mem::replace(&mut state.is_misfit_told, true) {
            let text = format!(
                "tag '{}': what came is a text of more than {MAX_TEXT_BYTES} bytes or no UTF-8, \
                 so that it is uncertain: correct its source",
                point.id
            );
            self.tell(LogLevel::Warning, &text);
        }
    }

    /// Takes the word of the source that there is no value now.
    pub(crate) fn take_null(&mut self, index: usize, stamp: Stamp) {
        let Some(point) = self.points.get(index) else { return };
        let Stamp { source_time, flags, .. } = stamp;
        let sample = Sample { source_time, flags, ..Sample::bad(point.tag, Reason::Sensor) };
        self.push(index, sample);
    }

    /// Takes a sign that something was sent which cannot be a value of the point, whose
    /// type or address is at fault: bad.
    pub(crate) fn take_misfit(&mut self, index: usize, what: &str) {
        self.mark(index..index + 1, Reason::Configuration);
        self.tell_misfit(index, what);
    }

    /// Publishes that a newer value could not be read. The last value turns uncertain, or stays
    /// bad, until one can be read.
    pub(crate) fn take_unusable(&mut self, index: usize, what: &str) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get(index)) else {
            return;
        };
        let reason = Reason::Configuration;
        let quality =
            if state.is_usable { Quality::Uncertain(reason) } else { Quality::Bad(reason) };
        let sample = Sample { quality, ..Sample::bad(point.tag, reason) };
        self.push(index, sample);
        self.tell_misfit(index, what);
    }

    fn tell_misfit(&mut self, index: usize, what: &str) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get_mut(index))
        else {
            return;
        };
        if !std::mem::replace(&mut state.is_misfit_told, true) {
            let id = &point.id;
            let text = format!(
                "tag '{id}': what came is {what}, which does not fit: correct the tag's type or \
                 address, or its source"
            );
            self.tell(LogLevel::Warning, &text);
        }
    }

    /// Logs an unusable source time, once per tag and connection; `seen` describes what came in its
    /// place.
    pub(crate) fn tell_time(&mut self, index: usize, seen: impl FnOnce() -> String) {
        let (Some(point), Some(state)) = (self.points.get(index), self.states.get_mut(index))
        else {
            return;
        };
        if !std::mem::replace(&mut state.is_time_told, true) {
            let text = format!(
                "tag '{}': its source time is {}, so its values are uncertain (source time)",
                point.id,
                seen()
            );
            self.tell(LogLevel::Warning, &text);
        }
    }

    /// Moves the time on by which lines of the log are limited.
    pub(crate) fn advance(&mut self, now: Instant) {
        self.lines.advance(now);
    }

    /// Writes a line, as long as there were not too many of late.
    pub(crate) fn tell(&mut self, level: LogLevel, text: &str) {
        if let Some(remark) = self.lines.take() {
            self.log(level, &format!("{text}{remark}"));
        }
    }

    pub(crate) fn log(&self, level: LogLevel, text: &str) {
        self.host.log(level, &format!("{}: {text}", self.name));
    }

    /// `tag 'a'`, `tags 'a', 'b' and 7 more`.
    pub(crate) fn list(&self, points: &[usize]) -> String {
        let named = points.iter().take(MAX_TAGS_IN_MESSAGE);
        let ids: Vec<&str> =
            named.filter_map(|index| self.points.get(*index)).map(|point| &*point.id).collect();
        let more = points.len() - ids.len();
        let tags = if points.len() == 1 { "tag" } else { "tags" };
        let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("{tags} '{}'{rest}", ids.join("', '"))
    }

    /// Holds back all further samples until [`PointStates::release`] or [`PointStates::flush`].
    pub(crate) fn hold(&mut self) {
        self.held = Some(self.batch.len());
    }

    /// Drops the samples since [`PointStates::hold`] that are not published yet.
    pub(crate) fn drop_held(&mut self) {
        self.batch.truncate(self.held.unwrap_or(self.batch.len()));
    }

    /// Ends [`PointStates::hold`] and keeps the samples that came since.
    pub(crate) fn release(&mut self) {
        self.held = None;
        if self.batch.len() >= MAX_BATCH {
            self.flush();
        }
    }

    /// Publishes all samples that have come.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
        self.held = self.held.map(|_| 0);
    }

    /// Begins a connection to the named broker and resets the counts and limits per connection.
    pub(crate) fn begin(&mut self, name: String) {
        self.name = name;
        for state in &mut self.states {
            *state = PointState { is_usable: state.is_usable, ..PointState::default() };
        }
        self.lines = LineBudget::default();
        self.ignored = Ignored::default();
    }

    /// Logs the counts of ignored messages at the end of a connection.
    pub(crate) fn log_ignored(&mut self) {
        let ignored = std::mem::take(&mut self.ignored);
        if ignored == Ignored::default() {
            return;
        }
        let Ignored { topics, too_long, malformed, retained, aliases } = ignored;
        self.log(
            LogLevel::Info,
            &format!(
                "left out in this connection: {topics} messages of topics that no tag names, \
                 {malformed} messages or metrics that cannot be read, {too_long} that are too \
                 long, {retained} retained; {aliases} values by unknown aliases"
            ),
        );
    }

    fn push(&mut self, index: usize, sample: Sample) {
        if let Some(state) = self.states.get_mut(index) {
            state.is_usable = !matches!(sample.quality, Quality::Bad(_));
        }
        self.batch.push(sample);
        let limit = if self.held.is_some() { MAX_HELD } else { MAX_BATCH };
        if self.batch.len() >= limit {
            self.flush();
        }
    }
}
