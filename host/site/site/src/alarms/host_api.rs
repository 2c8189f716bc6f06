//! Interface of the alarm service to a host program: actions, standings, operator requests.

use std::collections::HashMap;

use busbar_alarms::{AlarmFlags, AlarmHandle, AlarmStatus};
use busbar_tags::{SourceTime, TagSet};
use busbar_types::{AlarmAction, AlarmState, Origin};

use super::AlarmService;

/// Largest number of requests for the host program; beyond it the oldest is dropped, and the
/// operator must press again.
const MAX_HOST_REQUESTS: usize = 256;

/// Alarm whose standing or origin has changed.
#[derive(Clone, Debug, PartialEq)]
pub struct ChangedAlarm {
    /// Id of the alarm.
    pub alarm: String,
    /// Present state, by the letters of IEC 62682.
    pub state: AlarmState,
    /// Present standing, from which a later viewer restores the alarm.
    pub standing: AlarmFlags,
    /// Time of the last change of state.
    pub since: SourceTime,
    /// Origins of the value or verdict by which it came or went last.
    pub origin: Origin,
    /// Reason of that verdict, with what is assumed; empty of an alarm on a tag.
    pub reason: String,
}

impl AlarmService {
    /// Routes operator requests on external alarms to the host program from now on.
    pub(crate) fn set_host(&mut self) {
        self.has_host = true;
    }

    pub(super) fn is_mirrored(&self, alarm: AlarmHandle) -> bool {
        let spec = self.table.set().spec(alarm);
        spec.map_or_else(|| self.sources.get(alarm).is_some(), |spec| spec.source.is_mirrored())
    }

    pub(super) fn request_from_host(&mut self, alarm: AlarmHandle, action: AlarmAction) {
        if self.host_requests.len() == MAX_HOST_REQUESTS {
            self.host_requests.pop_front();
        }
        self.host_requests.push_back((alarm, action));
    }

    /// Takes the operator requests since the last call, by alarm id.
    pub(crate) fn take_host_requests(&mut self) -> Vec<(String, AlarmAction)> {
        let host_requests = std::mem::take(&mut self.host_requests).into_iter();
        host_requests.filter_map(|(alarm, action)| Some((self.id_of(alarm)?, action))).collect()
    }

    /// Performs an action of the host program's operator.
    ///
    /// # Errors
    /// A text with the reason.
    pub(crate) fn act_by_id(
        &mut self,
        id: &str,
        action: AlarmAction,
        operator: &str,
    ) -> Result<(), String> {
        let alarm = self.table.set().find(id).ok_or_else(|| format!("there is no alarm '{id}'"))?;
        let done = self.perform(alarm, action, operator);
        done.map_err(|error| format!("alarm '{id}': {error}"))
    }

    /// Returns the alarms that differ from `known` in standing or origin, and updates `known`.
    pub fn changed_since(
        &self,
        known: &mut HashMap<AlarmHandle, (AlarmFlags, Origin)>,
    ) -> Vec<ChangedAlarm> {
        let mut changed = Vec::new();
        let closed = known.keys().copied().filter(|&alarm| {
            self.table.status(alarm).is_none_or(|status| status.state == AlarmState::Normal)
        });
        let closed: Vec<_> = closed.collect();
        for alarm in self.table.open().chain(closed) {
            let Some(status) = self.table.status(alarm) else { continue };
            let AlarmStatus { state, standing, origin, .. } = status;
            let before = match state {
                AlarmState::Normal => known.remove(&alarm),
                _ => known.insert(alarm, (standing, origin)),
            };
            let Some(spec) = self.table.set().spec(alarm) else { continue };
            if before != Some((standing, origin)) {
                changed.push(ChangedAlarm {
                    alarm: spec.id.clone(),
                    state,
                    standing,
                    since: status.since.unwrap_or(self.wall_clock),
                    origin,
                    reason: self.reason_of(alarm),
                });
            }
        }
        changed
    }

    /// Returns the reason of the verdict by which an alarm came or went last, with what is assumed;
    /// empty of an alarm on a tag.
    pub fn reason_of(&self, alarm: AlarmHandle) -> String {
        let mut reason = self.table.reason(alarm).unwrap_or_default().to_owned();
        let is_assumed = self.table.status(alarm).is_some_and(|status| status.is_assumed);
        if is_assumed && !reason.contains("assumed") {
            reason += if reason.is_empty() { "assumed" } else { "; assumed" };
        }
        reason
    }

    /// Restores the standings of a previous process before the first step, unless an audit log
    /// exists.
    pub(crate) fn restore(
        &mut self,
        standings: &[(String, AlarmFlags, SourceTime)],
        tags: &TagSet,
    ) {
        if self.log.is_none() {
            let ids = standings.iter().map(|(id, ..)| id.as_str());
            self.verdicts.add_known(ids, &mut self.table, tags);
            let standings =
                standings.iter().map(|(id, standing, at)| (id.as_str(), *standing, *at));
            self.table.restore(standings, 0, self.wall_clock);
            self.refresh();
        }
    }
}
