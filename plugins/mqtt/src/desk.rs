//! What messages of all kinds end at: the points, their samples, and what the log is told.

use std::ops::Range;
use std::time::SystemTime;

use busbar_plugin_sdk::{Host, LogLevel, Quality, Reason, Sample, SampleSink};

use crate::convert::{Raw, name_of};
use crate::points::Point;

/// Samples that are published at once.
const MAX_BATCH: usize = 16 * 1024;
/// Lines about single tags and messages, a connection.
const MAX_LINES: usize = 50;
/// Tags that one log line names.
const MAX_TAGS_IN_MESSAGE: usize = 5;

/// Points by their index, in order of their places.
pub(crate) struct Desk {
    points: Vec<Point>,
    sink: SampleSink,
    host: Host,
    /// The broker, before each line of the log.
    name: String,
    batch: Vec<Sample>,
    /// By point: whether it was told that what came does not fit.
    is_misfit_told: Vec<bool>,
    lines: usize,
    pub(crate) ignored: Ignored,
}

/// What came since the connection was made and was not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ignored {
    /// Messages of topics that no tag names.
    pub(crate) topics: u64,
    /// Messages and metrics that are too long.
    pub(crate) too_long: u64,
    /// Payloads that cannot be read.
    pub(crate) malformed: u64,
    /// Historical values.
    pub(crate) historical: u64,
    /// Retained messages that the settings leave out.
    pub(crate) retained: u64,
    /// Values by an alias that nothing stands behind any more.
    pub(crate) aliases: u64,
}

impl Desk {
    pub(crate) fn new(points: Vec<Point>, sink: SampleSink, host: Host, name: String) -> Self {
        let is_misfit_told = vec![false; points.len()];
        let (batch, ignored) = (Vec::new(), Ignored::default());
        Self { points, sink, host, name, batch, is_misfit_told, lines: 0, ignored }
    }

    /// All points have no value, and why.
    pub(crate) fn mark_all(&mut self, reason: Reason) {
        self.mark(0..self.points.len(), reason);
    }

    /// These points have no value, and why.
    pub(crate) fn mark(&mut self, points: Range<usize>, reason: Reason) {
        for index in points {
            let Some(point) = self.points.get(index) else { continue };
            let sample = Sample::bad(point.tag, reason);
            self.push(sample);
        }
    }

    /// A value came.
    pub(crate) fn take(
        &mut self,
        index: usize,
        raw: Raw<'_>,
        quality: Quality,
        source_time: Option<SystemTime>,
    ) {
        let Some(point) = self.points.get(index) else { return };
        match point.mapping.value_of(raw) {
            Some(value) => {
                let sample = Sample { tag: point.tag, value: Some(value), quality, source_time };
                self.push(sample);
            }
            None => self.take_misfit(index, name_of(raw)),
        }
    }

    /// The source says that there is no value now.
    pub(crate) fn take_null(&mut self, index: usize, source_time: Option<SystemTime>) {
        let Some(point) = self.points.get(index) else { return };
        let sample = Sample { source_time, ..Sample::bad(point.tag, Reason::Sensor) };
        self.push(sample);
    }

    /// What came cannot be a value of the point.
    pub(crate) fn take_misfit(&mut self, index: usize, what: &str) {
        let Some(point) = self.points.get(index) else { return };
        let sample = Sample::bad(point.tag, Reason::Configuration);
        let text = format!(
            "tag '{}': what came is {what}, which does not fit: correct the tag's type or address",
            point.id
        );
        self.push(sample);
        self.tell_of_point(index, &text);
    }

    /// Tells something of a point, once a connection.
    pub(crate) fn tell_of_point(&mut self, index: usize, text: &str) {
        let Some(is_told) = self.is_misfit_told.get_mut(index) else { return };
        if !std::mem::replace(is_told, true) {
            self.tell(LogLevel::Warning, text);
        }
    }

    /// Writes a line, as long as there were not too many since the connection was made.
    pub(crate) fn tell(&mut self, level: LogLevel, text: &str) {
        self.lines += 1;
        if self.lines < MAX_LINES {
            self.log(level, text);
        } else if self.lines == MAX_LINES {
            self.log(level, "more is not told in this connection");
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

    /// Publishes what came.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    /// A connection begins.
    pub(crate) fn begin(&mut self, name: String) {
        self.name = name;
        self.is_misfit_told.fill(false);
        self.lines = 0;
        self.ignored = Ignored::default();
    }

    /// A connection has ended.
    pub(crate) fn log_ignored(&mut self) {
        let ignored = std::mem::take(&mut self.ignored);
        if ignored == Ignored::default() {
            return;
        }
        let Ignored { topics, too_long, malformed, historical, retained, aliases } = ignored;
        self.log(
            LogLevel::Info,
            &format!(
                "left out in this connection: {topics} messages of topics that no tag names, \
                 {malformed} that cannot be read, {too_long} messages or metrics that are too \
                 long, {retained} retained; {historical} historical values, {aliases} by unknown \
                 aliases"
            ),
        );
    }

    fn push(&mut self, sample: Sample) {
        self.batch.push(sample);
        if self.batch.len() >= MAX_BATCH {
            self.flush();
        }
    }
}
