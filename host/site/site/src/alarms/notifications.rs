//! Notifications: changes of alarms, handed to plugins that tell people who are not in the room.
//!
//! Changes are numbered within a run. Each plugin has a bounded queue and a thread of its own, so
//! that no step waits for a plugin. After a start of the site or of a plugin's process, and after
//! changes were lost, the plugin gets the list of all unacknowledged alarms.

mod handover;

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use busbar_alarms::{
    AlarmChange, AlarmHandle, AlarmNotification, AlarmRecord, AlarmSource, AlarmTable,
    MAX_STANDING_ALARMS, StandingAlarms,
};
use busbar_tags::{Moment, SourceTime, TagSet};
use busbar_types::{AlarmState, Origin, Value};

use self::handover::Handover;
pub(crate) use self::handover::NotifierHealth;
use super::external_alarms::{ExternalAlarm, ExternalSource, ExternalSources};
use crate::definition::SiteDefinition;
use crate::equipment::{EquipmentDirectory, EquipmentNumber};

/// Records of one step, and of actions since the step before.
const MAX_PENDING_RECORDS: usize = 10_000;
/// Time after the start of a site until its unacknowledged alarms are all known: values and
/// sources must have come.
const SETTLING: Duration = Duration::from_secs(30);

/// Notifications of a site; without plugins for them nothing is kept.
#[derive(Default)]
pub(super) struct Notifications {
    handovers: Vec<Handover>,
    /// Start of the run, nanoseconds since 1970-01-01 UTC.
    run: u64,
    /// Number of the last change.
    last_number: u64,
    pending: Vec<AlarmRecord>,
    /// AlarmState of each alarm of other systems, by its id.
    external: HashMap<String, AlarmState>,
    external_revision: Option<u64>,
    started: Option<Moment>,
    is_settled: bool,
}

/// AlarmState of a site that notifications are made of.
#[derive(Clone, Copy)]
pub(super) struct AlarmView<'a> {
    pub(super) table: &'a AlarmTable,
    pub(super) sources: &'a ExternalSources,
    /// Equipment of each configured alarm.
    pub(super) equipment: &'a [Option<EquipmentNumber>],
    pub(super) directory: &'a dyn EquipmentDirectory,
    pub(super) tags: &'a TagSet,
    pub(super) now: Moment,
    pub(super) wall_clock: SourceTime,
}

impl Notifications {
    /// Starts to hand over changes to all configured plugins.
    pub(super) fn start(site: &SiteDefinition, now: Moment, wall_clock: SourceTime) -> Self {
        let run = u64::try_from(wall_clock.0).unwrap_or(1).max(1);
        let entries = site.config.notifications.iter();
        let plugins = entries.filter_map(|entry| site.plugins.get(&entry.plugin));
        Self {
            handovers: plugins.map(|plugin| Handover::start(plugin, run)).collect(),
            run,
            started: Some(now),
            ..Self::default()
        }
    }

    /// Continues where the notifications of the former definition ended.
    pub(super) fn inherit(&mut self, before: Self) {
        if before.started.is_none() {
            return;
        }
        let Self { handovers, run, last_number, pending, external, started, is_settled, .. } =
            before;
        for mut old in handovers {
            old.end();
            if let Some(next) = self.handovers.iter().find(|next| next.name() == old.name()) {
                next.inherit(&old);
            }
        }
        self.handovers.iter().for_each(|handover| handover.set_run(run));
        (self.run, self.last_number, self.pending) = (run, last_number, pending);
        (self.external, self.started, self.is_settled) = (external, started, is_settled);
    }

    /// Returns the health of a plugin that tells of alarms.
    pub(super) fn health(&self, name: &str) -> Option<&NotifierHealth> {
        self.handovers.iter().find(|handover| handover.name() == name).map(Handover::health)
    }

    /// Notes a record, to be handed over at the end of the step.
    pub(super) fn note(&mut self, record: &AlarmRecord) {
        if self.handovers.is_empty() || AlarmChange::between(record.from, record.to).is_none() {
            return;
        }
        if self.pending.len() < MAX_PENDING_RECORDS {
            self.pending.push(record.clone());
        } else {
            self.handovers.iter().for_each(|handover| handover.lose(1));
        }
    }

    /// Hands over what was noted, and what changed of the alarms of other systems.
    pub(super) fn hand_over(&mut self, view: AlarmView<'_>) {
        if self.handovers.is_empty() {
            return;
        }
        let mut changes: Vec<AlarmNotification> = std::mem::take(&mut self.pending)
            .iter()
            .filter_map(|record| view.of_record(record))
            .collect();
        self.add_external(view, &mut changes);
        for mut change in changes {
            self.last_number += 1;
            change.number = self.last_number;
            let change = Arc::new(change);
            self.handovers.iter().for_each(|handover| handover.push(Arc::clone(&change)));
        }
        let settles = |started: Moment| view.now.since(started) >= SETTLING;
        if !self.is_settled && self.started.is_none_or(settles) {
            self.is_settled = true;
            self.handovers.iter().for_each(Handover::request_list);
        }
        for handover in &mut self.handovers {
            if handover.takes_list() {
                self.last_number += 1;
                handover.push_list(view.standing(self.last_number, self.is_settled));
            }
            handover.refresh_health();
        }
    }

    fn add_external(&mut self, view: AlarmView<'_>, changes: &mut Vec<AlarmNotification>) {
        if self.external_revision.replace(view.sources.revision) == Some(view.sources.revision) {
            return;
        }
        let mut gone = std::mem::take(&mut self.external);
        for (source, external) in view.sources.iter() {
            let (id, state) = (external.id(source), external.alarm.standing().state());
            let before = gone.remove(&id).unwrap_or_default();
            if let Some(change) = AlarmChange::between(before, state) {
                changes.push(view.of_external(source, external, change));
            }
            self.external.insert(id, state);
        }
        // What a source does not list any more is over there.
        for (id, before) in gone {
            if let Some(change) = AlarmChange::between(before, AlarmState::Normal) {
                changes.push(view.of_absent(id, change));
            }
        }
    }
}

impl AlarmView<'_> {
    fn of_record(&self, record: &AlarmRecord) -> Option<AlarmNotification> {
        let change = AlarmChange::between(record.from, record.to)?;
        let alarm = self.table.set().find(&record.alarm)?;
        let mut told = self.of_alarm(alarm, change)?;
        (told.state, told.time) = (record.to, record.time);
        if change == AlarmChange::Raised {
            told.occurred = record.time;
        }
        (told.operator, told.origin) = (record.operator.clone(), record.origin);
        Some(told)
    }

    /// Returns a configured alarm as it is now.
    fn of_alarm(&self, alarm: AlarmHandle, change: AlarmChange) -> Option<AlarmNotification> {
        let (spec, status) = (self.table.set().spec(alarm)?, self.table.status(alarm)?);
        let unit = match &spec.source {
            AlarmSource::Tag { trigger, .. } => self.tags.spec(trigger.tag).map(|tag| &*tag.unit),
            AlarmSource::Verdict { .. } | AlarmSource::Mirrored => None,
        };
        let since = status.since.unwrap_or(self.wall_clock);
        Some(AlarmNotification {
            number: 0,
            alarm: spec.id.clone(),
            change,
            state: status.state,
            priority: spec.priority,
            occurred: status.occurred.unwrap_or(since),
            time: since,
            place: self.place(self.equipment.get(alarm.0 as usize).copied().flatten()),
            group: spec.group.clone(),
            message: spec.message.clone(),
            consequence: spec.consequence.clone(),
            response: spec.response.clone(),
            operator: None,
            value: status.value.as_ref().map(|value| value_text(value, unit.unwrap_or_default())),
            origin: status.origin,
            is_certain: status.is_certain,
            source: None,
        })
    }

    fn of_external(
        &self,
        source: &ExternalSource,
        external: &ExternalAlarm,
        change: AlarmChange,
    ) -> AlarmNotification {
        let since = external.alarm.since().unwrap_or(self.wall_clock);
        AlarmNotification {
            number: 0,
            alarm: external.id(source),
            change,
            state: external.alarm.standing().state(),
            priority: external.priority,
            occurred: since,
            time: since,
            place: self.place(external.equipment),
            group: None,
            message: external.message().to_owned(),
            consequence: String::new(),
            response: String::new(),
            operator: None,
            value: None,
            origin: Origin::LIVE,
            is_certain: external.is_certain(source),
            source: Some(source.name().to_owned()),
        }
    }

    /// Returns an alarm of another system that is not listed there any more.
    fn of_absent(&self, id: String, change: AlarmChange) -> AlarmNotification {
        let source = id.split_once(':').map(|(source, _)| source.to_owned());
        AlarmNotification {
            number: 0,
            alarm: id,
            change,
            state: AlarmState::Normal,
            priority: Default::default(),
            occurred: self.wall_clock,
            time: self.wall_clock,
            place: Vec::new(),
            group: None,
            message: String::new(),
            consequence: String::new(),
            response: String::new(),
            operator: None,
            value: None,
            origin: Origin::LIVE,
            is_certain: true,
            source,
        }
    }

    /// Lists the unacknowledged alarms, the most urgent first.
    fn standing(&self, number: u64, is_settled: bool) -> StandingAlarms {
        let own = self.table.open().filter_map(|alarm| self.of_alarm(alarm, AlarmChange::Standing));
        let external = self
            .sources
            .iter()
            .map(|(source, external)| self.of_external(source, external, AlarmChange::Standing));
        let waits = |told: &AlarmNotification| told.state.is_unacknowledged();
        let mut alarms: Vec<_> = own.chain(external).filter(waits).collect();
        alarms.sort_by_key(|told| told.priority);
        let all_heard = self.sources.all().iter().all(ExternalSource::was_heard);
        let is_complete = is_settled && all_heard && alarms.len() <= MAX_STANDING_ALARMS;
        alarms.truncate(MAX_STANDING_ALARMS);
        StandingAlarms { number, alarms, is_complete }
    }

    fn place(&self, equipment: Option<EquipmentNumber>) -> Vec<String> {
        equipment.map(|number| self.directory.path(number)).unwrap_or_default()
    }
}

/// Returns a value for people, with its unit.
fn value_text(value: &Value, unit: &str) -> String {
    let text = match value {
        // Four digits are more than an instrument of a substation has.
        Value::F64(value) if value.is_finite() && value.abs() < 1e6 => {
            let digits = format!("{value:.3}");
            digits.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        Value::F64(value) => format!("{value:e}"),
        Value::Text(value) if value.as_str().is_empty() => "(empty)".to_owned(),
        Value::Text(value) => value.to_string(),
        Value::I64(value) => value.to_string(),
        Value::Bool(value) => value.to_string(),
        Value::DoublePoint(value) => value.to_string(),
    };
    if unit.is_empty() { text } else { format!("{text} {unit}") }
}
