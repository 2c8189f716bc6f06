//! Mirror of a server's alarm conditions, for the host to show (OPC 10000-9).
//!
//! Events report single conditions; a refresh reports all that are of interest, and those that it
//! leaves out are removed. Known conditions stay while the server is lost, with the reason.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use async_opcua::types::{NodeId, StatusCode, Variant};
use busbar_plugin_sdk::{
    AlarmReport, MAX_SOURCE_ALARM_TEXT, MAX_SOURCE_ALARMS, SourceAlarm, ValueKind,
};

use crate::conditions::{Field, Told};
use crate::convert::{quality_of, time_of};

/// Conditions that are kept; the most severe of them are reported.
const MAX_KEPT: usize = 20_000;
/// Highest severity of an event, the most urgent one (OPC 10000-5, 6.4.2).
const MAX_SEVERITY: u16 = 1000;
/// Longest reason for the loss of the server, bytes.
const MAX_REASON_BYTES: usize = 512;

/// Alarm state shared by the server's thread, which updates it, and the host, which polls it.
#[derive(Clone)]
pub(crate) struct Mirror(Arc<Mutex<State>>);

struct State {
    revision: u64,
    heard: Option<Instant>,
    /// Reason for which the conditions are not current; none while they are.
    fault: Option<String>,
    kept: BTreeMap<String, Kept>,
    /// True once a refresh was complete: before that the conditions are unknown, not absent.
    is_told: bool,
    /// Number of the last refresh, and number of refreshes that have not ended.
    round: u64,
    open_rounds: u32,
    /// Reason for which conditions are left out; none where all are read.
    unreadable: Option<&'static str>,
}

struct Kept {
    alarm: SourceAlarm,
    /// Number of the refresh round in which the condition was last reported.
    round: u64,
}

impl Default for Mirror {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(State {
            revision: 1,
            heard: None,
            fault: Some("not connected yet".to_owned()),
            kept: BTreeMap::new(),
            is_told: false,
            round: 0,
            open_rounds: 0,
            unreadable: None,
        })))
    }
}

impl Mirror {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Marks the known conditions as no longer current, for a reason.
    pub(crate) fn lose(&self, why: &str) {
        let mut state = self.state();
        state.fault = Some(line(why, MAX_REASON_BYTES));
        state.open_rounds = 0;
    }

    /// Notes that the subscription of events is alive.
    pub(crate) fn confirm(&self) {
        self.state().heard = Some(Instant::now());
    }

    /// Begins a refresh, in which the server reports all conditions of interest.
    pub(crate) fn begin_refresh(&self) {
        let mut state = self.state();
        state.round += 1;
        state.open_rounds += 1;
        state.unreadable = None;
    }

    /// Ends a refresh: conditions that it left out are of no interest and are removed (OPC 10000-9,
    /// 5.5.7).
    pub(crate) fn end_refresh(&self) {
        let mut state = self.state();
        state.open_rounds = state.open_rounds.saturating_sub(1);
        if state.open_rounds > 0 {
            return;
        }
        let (count, round) = (state.kept.len(), state.round);
        state.kept.retain(|_, kept| kept.round == round);
        if state.kept.len() != count {
            state.revision += 1;
        }
        (state.heard, state.is_told) = (Some(Instant::now()), true);
        state.fault = state.unreadable.map(str::to_owned);
    }

    /// Takes an event of a condition, whose id refers to these namespaces.
    pub(crate) fn take(&self, namespaces: &[String], condition: &NodeId, told: &Told<'_>) {
        let Some(alarm) = alarm_of(namespaces, condition, told) else { return };
        let mut state = self.state();
        let round = state.round;
        if !is_retained(told) {
            let gone = state.kept.remove(&alarm.id).is_some();
            state.revision += u64::from(gone);
            return;
        }
        let is_new = !state.kept.contains_key(&alarm.id);
        if alarm.id.len() > MAX_SOURCE_ALARM_TEXT {
            state.refuse("a condition has an id of more than 512 bytes, and is left out");
        } else if is_new && state.kept.len() >= MAX_KEPT {
            state.refuse("more than 20,000 conditions are of interest: the rest is left out");
        } else {
            state.revision += 1;
            state.kept.insert(alarm.id.clone(), Kept { alarm, round });
        }
    }

    /// Returns the report to the host, with the alarms where they are newer than `known_revision`.
    pub(crate) fn report(&self, known_revision: u64) -> AlarmReport {
        let state = self.state();
        let is_news = state.is_told && state.revision != known_revision;
        let alarms = is_news.then(|| state.most_severe());
        AlarmReport {
            revision: state.revision,
            heard_millis: state.heard.map(|heard| heard.elapsed().as_millis() as u64),
            fault: state.fault.clone(),
            left_out: state.kept.len().saturating_sub(MAX_SOURCE_ALARMS) as u64,
            alarms,
        }
    }
}

impl State {
    /// Marks the mirror as incomplete, so not current, for a reason.
    fn refuse(&mut self, why: &'static str) {
        self.unreadable = Some(why);
        self.fault = Some(why.to_owned());
    }

    fn most_severe(&self) -> Vec<SourceAlarm> {
        let mut alarms: Vec<&SourceAlarm> = self.kept.values().map(|kept| &kept.alarm).collect();
        alarms.sort_by_key(|alarm| std::cmp::Reverse(alarm.severity));
        alarms.into_iter().take(MAX_SOURCE_ALARMS).cloned().collect()
    }
}

/// Converts an event to an alarm; none where its condition is no alarm, such as a dialog.
fn alarm_of(namespaces: &[String], condition: &NodeId, told: &Told<'_>) -> Option<SourceAlarm> {
    let is = |field: Field| told.is(field);
    let is_active = is(Field::ActiveState)?;
    let quality = match told.quality {
        Variant::StatusCode(status) => *status,
        _ => StatusCode::Good,
    };
    let at = match told.time {
        Variant::DateTime(time) => time_of(time),
        _ => None,
    };
    let severity = match told.value(Field::Severity, ValueKind::I64) {
        Some(busbar_plugin_sdk::Value::I64(severity)) => severity as u16,
        // A mandatory field that is missing hides nothing.
        _ => MAX_SEVERITY,
    };
    let source = match (text(told.source_name()), told.source_node()) {
        (name, Variant::NodeId(node)) if name.is_empty() => id_of(namespaces, node),
        (name, _) => name,
    };
    Some(SourceAlarm {
        id: id_of(namespaces, condition),
        name: text(told.condition_name()),
        source: line(&source, MAX_SOURCE_ALARM_TEXT),
        message: text(told.message()),
        severity: severity.clamp(1, MAX_SEVERITY),
        is_active,
        is_unacknowledged: is(Field::AckedState) == Some(false),
        is_unconfirmed: is(Field::ConfirmedState) == Some(false),
        is_shelved: is(Field::ShelvingState) == Some(true),
        is_suppressed: is(Field::SuppressedState) == Some(true),
        is_out_of_service: is(Field::OutOfServiceState) == Some(true),
        unix_nanos: at.and_then(unix_nanos),
        quality: quality_of(quality).level(),
    })
}

/// Reports whether a condition is of interest. Without Retain it is while it is active or
/// unacknowledged.
fn is_retained(told: &Told<'_>) -> bool {
    let waits =
        told.is(Field::ActiveState) == Some(true) || told.is(Field::AckedState) == Some(false);
    told.is(Field::Retain).unwrap_or(waits)
}

/// Returns a node's id by the URI of its namespace, whose index may change with a restart.
fn id_of(namespaces: &[String], node: &NodeId) -> String {
    let by_number = node.to_string();
    let uri = namespaces.get(usize::from(node.namespace)).filter(|_| node.namespace > 0);
    match (uri, by_number.split_once(';')) {
        (Some(uri), Some((_, rest))) => {
            let uri = uri.replace('%', "%25").replace(';', "%3B");
            line(&format!("nsu={uri};{rest}"), usize::MAX)
        }
        _ => line(&by_number, usize::MAX),
    }
}

fn text(variant: &Variant) -> String {
    match variant {
        Variant::String(text) => line(text.as_ref(), MAX_SOURCE_ALARM_TEXT),
        Variant::LocalizedText(text) => line(text.text.as_ref(), MAX_SOURCE_ALARM_TEXT),
        _ => String::new(),
    }
}

/// Truncates a text to one line of at most `max_bytes` bytes.
fn line(text: &str, max_bytes: usize) -> String {
    let printable = |c: char| if c.is_control() { ' ' } else { c };
    let mut line: String = text.chars().map(printable).collect();
    line.truncate(line.floor_char_boundary(max_bytes));
    line
}

fn unix_nanos(time: SystemTime) -> Option<i64> {
    i64::try_from(time.duration_since(UNIX_EPOCH).ok()?.as_nanos()).ok()
}

#[cfg(test)]
#[path = "mirror_tests.rs"]
mod tests;
