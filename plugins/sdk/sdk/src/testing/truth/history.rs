//! History of one tag: its truths, the messages that carried them, and its samples.

use std::collections::VecDeque;
use std::fmt::Write;
use std::time::{Duration, SystemTime};

use super::ShownTag;
use crate::{Sample, SampleFlags, TagSpec, Value};

/// Truths, and messages, of a tag that are kept; older ones are dropped.
const MAX_KEPT: usize = 4096;
/// Truths, messages and samples in the report of a fault, of each.
const MAX_TOLD: usize = 8;

/// Truth of a tag for a while.
#[derive(Clone, Debug)]
struct Truth {
    value: Option<Value>,
    since: Duration,
    /// Order and time of the next truth.
    until: Option<(u64, Duration)>,
}

/// Message that was sent, understandable or not.
#[derive(Clone, Debug)]
pub(super) struct Evidence {
    order: u64,
    /// Order of the instant at which it was sent.
    sent: u64,
    at: Duration,
    /// Description of a message that cannot be understood.
    sign: Option<String>,
}

/// Truth of one tag, and the plugin's samples of it.
pub(super) struct TagHistory {
    id: String,
    freshness: Duration,
    shown: ShownTag,
    /// Order of the sample whose value is shown.
    shown_order: u64,
    /// Reports whether the sample shown came out of a buffer.
    is_buffered: bool,
    truths: VecDeque<Truth>,
    evidence: VecDeque<Evidence>,
    /// Newest evidence that the plugin must have reacted to: the message sent last, and the last
    /// unreadable one.
    newest: Option<Evidence>,
    last_sign: Option<Evidence>,
    /// Order of the last evidence that the plugin must have reacted to.
    followed: u64,
    samples: VecDeque<(Duration, Sample)>,
}

impl Evidence {
    /// Creates evidence that arrives now, of a truth that was sent at an earlier instant, or now.
    pub(super) fn new(order: u64, sent: u64, at: Duration, sign: Option<&str>) -> Self {
        Self { order, sent: sent.min(order), at, sign: sign.map(str::to_owned) }
    }

    fn name(&self) -> &str {
        self.sign.as_deref().unwrap_or("a message with the truth")
    }
}

impl TagHistory {
    pub(super) fn new(spec: &TagSpec) -> Self {
        Self {
            id: spec.id.clone(),
            freshness: spec.freshness,
            shown: ShownTag::new(spec),
            shown_order: 0,
            is_buffered: false,
            truths: VecDeque::new(),
            evidence: VecDeque::new(),
            newest: None,
            last_sign: None,
            followed: 0,
            samples: VecDeque::new(),
        }
    }

    pub(super) fn shown(&self) -> &ShownTag {
        &self.shown
    }

    pub(super) fn truth(&self) -> Option<Value> {
        self.truths.back()?.value.clone()
    }

    pub(super) fn set_truth(&mut self, order: u64, now: Duration, value: Option<Value>) {
        if let Some(last) = self.truths.back_mut() {
            if last.value == value {
                return;
            }
            last.until = Some((order, now));
        }
        push(&mut self.truths, Truth { value, since: now, until: None }, MAX_KEPT);
    }

    pub(super) fn note(&mut self, evidence: Evidence) {
        push(&mut self.evidence, evidence, MAX_KEPT);
    }

    pub(super) fn take(&mut self, sample: &Sample, order: u64, now: Duration, wall: SystemTime) {
        if self.shown.take(sample, wall) {
            self.shown_order = order;
            self.is_buffered = sample.flags.contains(SampleFlags::BUFFERED);
        }
        push(&mut self.samples, (now, sample.clone()), MAX_TOLD);
    }

    /// Judges the tag: returns true where it is good, and rightly so; the fault where it must not
    /// be.
    pub(super) fn find_fault(
        &mut self,
        now: Duration,
        wall_clock: SystemTime,
        bound: Duration,
        delay: Duration,
    ) -> Result<bool, String> {
        self.follow_evidence(now, bound);
        self.forget(now, bound + delay);
        let (true, Some(value)) = (self.shown.quality(wall_clock).is_good(), self.shown.value())
        else {
            return Ok(false);
        };
        let Some(truth) = self.truths.iter().rfind(|truth| truth.value.as_ref() == Some(&value))
        else {
            return Err("is good with a value that was not true at any time of late".into());
        };
        if let Some((_, until)) = truth.until
            && now.saturating_sub(until) > self.freshness + bound + delay
        {
            let ago = now.saturating_sub(until);
            return Err(format!("is good with a value that ceased to be true {ago:.3?} ago"));
        }
        // What comes out of a buffer counts by its own time, as long as nothing newer follows.
        let is_of_past = |newest: &Evidence| self.is_buffered && newest.order < self.shown_order;
        if let Some(newest) = self.newest.as_ref().filter(|newest| !is_of_past(newest))
            && truth.until.is_some_and(|(order, _)| order < newest.sent)
        {
            let (ago, what) = (now.saturating_sub(newest.at), newest.name());
            return Err(format!("is good with a value that was old {ago:.3?} ago, with: {what}"));
        }
        if let Some(sign) = &self.last_sign
            && self.shown_order < sign.order
        {
            let (ago, what) = (now.saturating_sub(sign.at), sign.name());
            return Err(format!("is good and as it was before a sign {ago:.3?} ago: {what}"));
        }
        Ok(true)
    }

    /// Advances to evidence that the plugin must have reacted to by now.
    fn follow_evidence(&mut self, now: Duration, bound: Duration) {
        let first = self.evidence.partition_point(|evidence| evidence.order <= self.followed);
        for evidence in self.evidence.range(first..) {
            if evidence.at + bound > now {
                break;
            }
            self.followed = evidence.order;
            // A message with the truth says that what is shown may stay.
            self.last_sign = evidence.sign.is_some().then(|| evidence.clone());
            if self.newest.as_ref().is_none_or(|newest| newest.sent <= evidence.sent) {
                self.newest = Some(evidence.clone());
            }
        }
    }

    /// Drops all that no verdict needs any more.
    fn forget(&mut self, now: Duration, bound: Duration) {
        let is_due = |evidence: &Evidence| evidence.at + bound <= now;
        while self.evidence.len() > MAX_TOLD && self.evidence.get(1).is_some_and(is_due) {
            self.evidence.pop_front();
        }
        let limit = self.freshness + bound;
        let is_past =
            |truth: &Truth| truth.until.is_some_and(|(_, until)| now.saturating_sub(until) > limit);
        while self.truths.len() > MAX_TOLD && self.truths.front().is_some_and(is_past) {
            self.truths.pop_front();
        }
    }

    pub(super) fn tell(
        &self,
        story: &mut String,
        fault: &str,
        wall_clock: SystemTime,
        bound: Duration,
    ) {
        let (value, quality) = (self.shown.value(), self.shown.quality(wall_clock));
        let truth = self.truth();
        _ = write!(
            story,
            "({}) {fault}\n  shown {value:?}, {quality:?}; truth {truth:?}; bound {bound:?}, \
             freshness {:?}",
            self.id, self.freshness
        );
        let mut lines = Vec::new();
        for truth in self.truths.iter().rev().take(MAX_TOLD) {
            lines.push((truth.since, format!("truth {:?}", truth.value)));
        }
        for evidence in self.evidence.iter().rev().take(MAX_TOLD) {
            let text = match &evidence.sign {
                Some(sign) => format!("sign: {sign}"),
                None => "message with the truth".to_owned(),
            };
            lines.push((evidence.at, text));
        }
        for (at, sample) in &self.samples {
            let Sample { value, quality, source_time, flags, .. } = sample;
            let text = format!("sample {value:?}, {quality:?}, {source_time:?}, {flags:?}");
            lines.push((*at, text));
        }
        lines.sort_by_key(|(at, _)| *at);
        for (at, text) in lines {
            _ = write!(story, "\n  {at:>12.3?}  {text}");
        }
    }
}

fn push<T>(queue: &mut VecDeque<T>, item: T, limit: usize) {
    if queue.len() == limit {
        queue.pop_front();
    }
    queue.push_back(item);
}
