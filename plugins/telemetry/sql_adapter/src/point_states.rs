//! States of the tags between database and host: their last values, and what is logged of them.

use std::sync::Arc;

use busbar_plugin_sdk::{Host, LinkState, LogLevel, Quality, Reason, Sample, SampleSink};

use crate::answer::{QueryFault, Samples};
use crate::convert::TimeRules;
use crate::payload::{Payload, PayloadFault};
use crate::points::{Points, Shape};

/// Samples that are published at once.
pub(crate) const MAX_BATCH: usize = 4096;
/// Lines about tags whose values do not fit, until the connection ends.
const MAX_REMARKS: usize = 20;
/// Tags that one line names.
const MAX_TAGS_IN_LINE: usize = 5;
/// The longest text of a server or a library that is repeated, bytes.
const MAX_WORDS_BYTES: usize = 500;

pub(crate) struct PointStates {
    /// The database, for people.
    pub(crate) label: String,
    rules: TimeRules,
    queries: Vec<Query>,
    sink: SampleSink,
    host: Host,
    remarks: usize,
    /// Samples of notifications that are being read.
    batch: Vec<Sample>,
    ignored: Ignored,
}

struct Query {
    name: String,
    points: Arc<Points>,
    /// Fault of the query that was last reported.
    fault: Option<QueryFault>,
    /// By point: whether it was said what is wrong with it.
    is_told: Vec<bool>,
    /// True where it is to be asked anew: a notification could not be used.
    is_wanted: bool,
}

/// Notifications since the connection began that changed no tag.
#[derive(Clone, Copy, Debug, Default)]
struct Ignored {
    unknown: u64,
    malformed: u64,
}

impl PointStates {
    pub(crate) fn new(
        label: String,
        queries: impl IntoIterator<Item = (String, Points)>,
        rules: TimeRules,
        sink: SampleSink,
        host: Host,
    ) -> Self {
        let query = |(name, points): (String, Points)| {
            let is_told = vec![false; points.all.len()];
            Query { name, points: Arc::new(points), fault: None, is_told, is_wanted: false }
        };
        let queries = queries.into_iter().map(query).collect();
        let (batch, ignored) = (Vec::new(), Ignored::default());
        Self { label, rules, queries, sink, host, remarks: 0, batch, ignored }
    }

    /// Rules by which the times of its answers are read.
    pub(crate) fn time_rules(&self) -> TimeRules {
        self.rules.clone()
    }

    /// Reports whether any tag asks for a query.
    pub(crate) fn is_used(&self, query: usize) -> bool {
        !self.queries[query].points.all.is_empty()
    }

    /// The tags of a query, for reading its answer.
    pub(crate) fn points(&self, query: usize) -> Arc<Points> {
        Arc::clone(&self.queries[query].points)
    }

    /// Before the first connection.
    pub(crate) fn open(&self) {
        self.publish_all(Reason::NotConnected);
        self.sink.report_link(LinkState::Connecting, &format!("{}: connecting", self.label));
    }

    /// A connection was made; no tag has a value of it yet.
    pub(crate) fn note_connected(&mut self) {
        self.publish_all(Reason::NotConnected);
        for query in &mut self.queries {
            query.fault = None;
            query.is_told.fill(false);
            query.is_wanted = false;
        }
        (self.remarks, self.ignored) = (0, Ignored::default());
        self.sink.report_link(LinkState::Up, &format!("{}: connected", self.label));
    }

    /// A connection was lost, or could not be made.
    pub(crate) fn note_lost(&mut self, fault: &str, retry: std::time::Duration) {
        self.batch.clear();
        self.publish_all(Reason::Communication);
        let text = format!("{}: {fault}; next try in {:.1} s", self.label, retry.as_secs_f64());
        self.sink.report_link(LinkState::Down, &text);
        let Ignored { unknown, malformed } = std::mem::take(&mut self.ignored);
        if unknown + malformed > 0 {
            let text = format!(
                "notifications left out in this connection: {unknown} whose key no tag has, \
                 {malformed} malformed"
            );
            self.log(LogLevel::Info, &text);
        }
    }

    /// A query has ended.
    pub(crate) fn note_answer(&mut self, query: usize, outcome: Result<Samples, QueryFault>) {
        match outcome {
            Ok(samples) => self.take(query, samples),
            Err(fault) => self.fail(query, fault),
        }
    }

    fn take(&mut self, query: usize, samples: Samples) {
        let mut batch = Vec::with_capacity(samples.len().min(MAX_BATCH));
        let mut new_remarks = Vec::new();
        for (index, (sample, remark)) in samples.into_iter().enumerate() {
            batch.push(sample);
            if batch.len() == MAX_BATCH {
                self.sink.publish(&batch);
                batch.clear();
            }
            let is_told = &mut self.queries[query].is_told[index];
            match remark {
                None => *is_told = false,
                Some(remark) if !std::mem::replace(is_told, true) => {
                    new_remarks.push((index, remark));
                }
                Some(_) => {}
            }
        }
        self.sink.publish(&batch);
        self.tell(query, &new_remarks);
        if self.queries[query].fault.take().is_some() {
            let text = format!("query '{}' works again", self.queries[query].name);
            self.log(LogLevel::Info, &text);
            self.sink.report_link(LinkState::Up, &format!("{}: {text}", self.label));
        }
    }

    fn fail(&mut self, query: usize, fault: QueryFault) {
        let Query { name, points, fault: last, .. } = &mut self.queries[query];
        self.sink.publish_bad(points.tags(), fault.reason());
        if last.as_ref() == Some(&fault) {
            return;
        }
        let text = format!("query '{name}': {fault}");
        *last = Some(fault);
        self.log(LogLevel::Warning, &text);
        // The link is up, but operators read this where they look for what is wrong.
        self.sink.report_link(LinkState::Up, &format!("{}: {text}", self.label));
    }

    /// Says once what is wrong with tags; those with the same fault share a line.
    fn tell(&mut self, query: usize, remarks: &[(usize, String)]) {
        let mut lines: Vec<(&str, Vec<usize>)> = Vec::new();
        for (index, remark) in remarks {
            match lines.iter_mut().find(|(said, _)| said == remark) {
                Some((_, indices)) => indices.push(*index),
                None if self.remarks < MAX_REMARKS => {
                    self.remarks += 1;
                    lines.push((remark, vec![*index]));
                }
                None => {}
            }
        }
        let Query { name, points, .. } = &self.queries[query];
        for (remark, indices) in lines {
            let ids: Vec<_> = indices.iter().map(|&index| points.all[index].id.as_str()).collect();
            self.log(LogLevel::Warning, &format!("query '{name}', {}: {remark}", list(&ids)));
        }
    }

    /// A notification came for the keys of a query. Its samples go with the next
    /// [`PointStates::flush`] at the latest.
    pub(crate) fn note_notification(&mut self, query: usize, payload: &str) {
        let payload = match Payload::parse(payload) {
            Ok(payload) => payload,
            Err(fault) => return self.note_unusable(query, &fault),
        };
        let Shape::Long(by_key) = &self.queries[query].points.shape else {
            let what = "its query has columns, so that no key is a tag's".to_owned();
            return self.note_unusable(query, &PayloadFault { what, key: None });
        };
        let Some(indices) = by_key.get(payload.key()) else {
            self.ignored.unknown += 1;
            return;
        };
        let (mut remarks, mut is_wanted) = (Vec::new(), false);
        for &index in indices {
            let points = &self.queries[query].points;
            let (sample, remark) = payload.reading().sample(&points.all[index], &self.rules);
            // A remark on a value that is good needs no other answer.
            is_wanted |= remark.is_some() && !sample.quality.is_good();
            self.batch.push(sample);
            remarks.extend(remark.map(|remark| (index, remark)));
        }
        self.queries[query].is_wanted |= is_wanted;
        remarks.retain(|(index, _)| {
            !std::mem::replace(&mut self.queries[query].is_told[*index], true)
        });
        self.tell(query, &remarks);
        if self.batch.len() >= MAX_BATCH {
            self.flush();
        }
    }

    /// A notification that cannot be used never leaves the values before it as they were:
    /// its tag is bad; where nobody can tell whose it is, all tags of the query are
    /// uncertain. The query is asked anew.
    fn note_unusable(&mut self, query: usize, fault: &PayloadFault) {
        self.ignored.malformed += 1;
        let Query { name, points, is_wanted, .. } = &mut self.queries[query];
        *is_wanted = true;
        let doubt = Quality::Uncertain(Reason::Communication);
        let uncertain = |tag| Sample { quality: doubt, ..Sample::bad(tag, Reason::Communication) };
        match (&fault.key, &points.shape) {
            (Some(key), Shape::Long(by_key)) => {
                let named = by_key.get(key).into_iter().flatten();
                let bad =
                    |&index: &usize| Sample::bad(points.all[index].tag, Reason::Configuration);
                self.batch.extend(named.map(bad));
            }
            _ => self.batch.extend(points.tags().map(uncertain)),
        }
        let count = self.ignored.malformed;
        // One, ten, a hundred and so on.
        if count == 10_u64.pow(count.ilog10()) {
            let text = format!(
                "query '{name}': notifications that cannot be used so far: {count}; it is asked \
                 anew: {}",
                fault.what
            );
            self.log(LogLevel::Warning, &text);
            self.sink.report_link(LinkState::Up, &format!("{}: {text}", self.label));
        }
    }

    /// The queries that are to be asked anew, since the last call.
    pub(crate) fn take_wanted(&mut self) -> Vec<usize> {
        let take = |(index, query): (usize, &mut Query)| {
            std::mem::take(&mut query.is_wanted).then_some(index)
        };
        self.queries.iter_mut().enumerate().filter_map(take).collect()
    }

    /// Tells whether any query is to be asked anew.
    pub(crate) fn has_wanted(&self) -> bool {
        self.queries.iter().any(|query| query.is_wanted)
    }

    /// Tells whether the last answer to a query was a fault.
    pub(crate) fn has_failed(&self, query: usize) -> bool {
        self.queries[query].fault.is_some()
    }

    /// Publishes what notifications brought.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    pub(crate) fn log(&self, level: LogLevel, text: &str) {
        self.host.log(level, &format!("{}: {text}", self.label));
    }

    fn publish_all(&self, reason: Reason) {
        for query in &self.queries {
            self.sink.publish_bad(query.points.tags(), reason);
        }
    }
}

/// `tag 'a'`, `tags 'a', 'b' and 7 more`.
pub(crate) fn list(ids: &[&str]) -> String {
    let named = &ids[..ids.len().min(MAX_TAGS_IN_LINE)];
    let more = ids.len() - named.len();
    let tags = if ids.len() == 1 { "tag" } else { "tags" };
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{tags} '{}'{rest}", named.join("', '"))
}

/// Words of a server or a library, on one line and not too long.
pub(crate) fn shown(text: &str) -> String {
    let cut = &text[..text.floor_char_boundary(MAX_WORDS_BYTES)];
    let mut line: String = cut.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if cut.len() < text.len() {
        line.push('…');
    }
    line
}
