//! Values of tags that are states of alarm conditions, as events tell them.

use std::time::{Instant, SystemTime};

use async_opcua::types::{StatusCode, Variant};
use busbar_plugin_sdk::{LogLevel, Quality, Reason, Sample, SampleFlags};

use crate::conditions::Told;
use crate::convert::{origin_of, quality_of, source_time_of};
use crate::fault::in_words;
use crate::point_states::PointStates;

impl PointStates {
    /// Publishes the states of a condition that an event reports.
    pub(crate) fn take_event(
        &mut self,
        condition: usize,
        told: &Told<'_>,
        now: Instant,
        wall: SystemTime,
    ) {
        let (status, quality) = match told.quality {
            Variant::StatusCode(status) => (*status, quality_of(*status)),
            // Not every server tells the quality of its conditions.
            Variant::Empty => (StatusCode::Good, Quality::Good),
            _ => (StatusCode::Good, Quality::Uncertain(Reason::Unknown)),
        };
        // Every event has a time (OPC 10000-5, 6.4.2).
        let (source_time, flags) = match (told.time, self.source_time) {
            (Variant::DateTime(time), usage) => source_time_of(Some(time), usage),
            (_, crate::settings::SourceTime::Ignored) => (None, SampleFlags::LIVE),
            _ => (None, SampleFlags::TIME_UNUSABLE),
        };
        let flags = flags | origin_of(status);
        for (index, field) in self.points.conditions[condition].points.clone() {
            let point = &self.points.all[index];
            let value = field.value(point.kind, told.fields);
            let mut sample = Sample { tag: point.tag, value, quality, source_time, flags };
            if sample.value.is_none() {
                sample.quality = Quality::Bad(Reason::Configuration);
                let text = format!("tag '{}': the condition has no {field:?}", point.id);
                self.name(LogLevel::Warning, &text);
            }
            self.put(index, sample, now, wall);
        }
        self.told_conditions[condition] = true;
    }

    /// Begins a refresh: the values of all conditions are suspect until an event reports them
    /// again.
    pub(crate) fn begin_refresh(&mut self) {
        self.told_conditions.fill(false);
        for condition in 0..self.points.conditions.len() {
            for place in 0..self.points.conditions[condition].points.len() {
                self.suspect_one(self.points.conditions[condition].points[place].0);
            }
        }
    }

    /// Ends a refresh. Conditions without an event are neither active nor to be acknowledged, where
    /// they are `known`; their other fields are unknown.
    pub(crate) fn end_refresh(&mut self, known: &[bool], now: Instant, wall: SystemTime) {
        for condition in 0..self.points.conditions.len() {
            if self.told_conditions[condition] {
                continue;
            }
            for (index, field) in self.points.conditions[condition].points.clone() {
                let was_told = self.last[index].told.is_some();
                if !was_told && !known.get(condition).copied().unwrap_or_default() {
                    continue;
                }
                match field.of_no_interest() {
                    Some(value) => {
                        let sample = Sample::good(self.points.all[index].tag, value);
                        self.put(index, sample, now, wall);
                    }
                    None if was_told => self.push_bad(index, Reason::NotConnected),
                    None => {}
                }
            }
        }
    }

    /// Confirms the values of all conditions: their subscription is alive, and no event is missing.
    pub(crate) fn confirm_conditions(&mut self, now: Instant, wall: SystemTime) {
        for condition in 0..self.points.conditions.len() {
            for place in 0..self.points.conditions[condition].points.len() {
                let (index, _) = self.points.conditions[condition].points[place];
                // An event is told once; what it said holds until the next one.
                self.confirm_due(index, now, wall);
            }
        }
    }

    /// Marks all points of conditions bad, because the server reports no events.
    pub(crate) fn refuse_conditions(&mut self, what: &str, status: StatusCode) {
        for condition in 0..self.points.conditions.len() {
            for (index, _) in self.points.conditions[condition].points.clone() {
                self.push_bad(index, Reason::Configuration);
            }
        }
        let words = format!("conditions: {what}: {}", in_words(status));
        self.tell_mirror(&words);
        self.name(LogLevel::Warning, &words);
        self.flush();
    }

    /// Marks the points of a condition bad that has no node, or whose address means another node
    /// than before.
    pub(crate) fn miss_condition(&mut self, condition: usize, why: &str) {
        let (node, points) = {
            let condition = &self.points.conditions[condition];
            (condition.node.to_string(), condition.points.clone())
        };
        for (index, _) in points {
            self.push_bad(index, Reason::Configuration);
            let text = format!("tag '{}': condition {node}: {why}", self.points.all[index].id);
            self.name(LogLevel::Warning, &text);
        }
    }
}
