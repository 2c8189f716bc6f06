//! Alarms of a site: their table with the verdicts of overlays, their audit log, and the alarms of
//! external systems.

mod alarm_listing;
mod external_alarms;
mod host_api;
mod notifications;
mod reload;
mod verdict_alarms;

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use busbar_alarms::{AlarmHandle, AlarmRecord, AlarmTable};
use busbar_audit_log::{AuditLog, RecoveredLog};
use busbar_config::AlarmHandlingConfig;
use busbar_tags::{Change, Moment, Snapshot, SourceTime, TagSet};
use busbar_types::{AlarmAction, AlarmState, Origin};

pub use self::alarm_listing::{AlarmListing, EquipmentAlarms, EquipmentInAlarm, JudgedAlarmTint};
pub use self::external_alarms::{ExternalAlarm, ExternalSource, ExternalSources};
pub use self::host_api::ChangedAlarm;
pub(crate) use self::notifications::NotifierHealth;
use self::notifications::{AlarmView, Notifications};
use self::verdict_alarms::VerdictAlarms;
pub(crate) use self::verdict_alarms::VerdictValues;
use crate::definition::SiteDefinition;
use crate::equipment::{EquipmentDirectory, EquipmentNumber};
use crate::overlay_instance::OverlayInstance;

/// Newest log records that are kept for display.
const MAX_LOG_TAIL: usize = 200;
/// Actions of operators that wait for the disk.
const MAX_PENDING_ACTIONS: usize = 10_000;

/// Alarms of a site.
pub struct AlarmService {
    table: AlarmTable,
    /// Alarms of the table that follow verdicts of overlays.
    verdicts: VerdictAlarms,
    /// Alarms that other systems decide on.
    sources: ExternalSources,
    /// Changes for plugins that tell people of alarms.
    notifications: Notifications,
    log: Option<AuditLog>,
    /// Reason why there is no log, or remarks from opening it.
    log_remark: Option<String>,
    listing: AlarmListing,
    /// Equipment of each alarm, by the alarm's handle.
    equipment: Vec<Option<EquipmentNumber>>,
    /// Alarms of templates, by equipment.
    of_templates: BTreeMap<EquipmentNumber, Vec<AlarmHandle>>,
    /// Operator actions whose records are not on the disk yet.
    pending: VecDeque<PendingAction>,
    tail: VecDeque<AlarmRecord>,
    /// True if a host program receives the operator's requests for its alarms.
    has_host: bool,
    /// Requests that the host program has not received yet.
    host_requests: VecDeque<(AlarmHandle, AlarmAction)>,
    now: Moment,
    wall_clock: SourceTime,
}

/// An action that is done once its record is on the disk.
struct PendingAction {
    alarm: AlarmHandle,
    number: u64,
    /// The state that is shown till then.
    before: AlarmState,
}

/// Outcome of an operator's action that was not refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionOutcome {
    /// Action changed the alarm here.
    Performed,
    /// Action was passed on to the host program, which decides on the alarm.
    Requested,
}

impl AlarmService {
    /// Creates the alarms of a site; none if none is configured. Only if `logs` is set, the audit
    /// log is written. An unusable log does not hide the alarms.
    pub(crate) fn new(site: &SiteDefinition, logs: bool, wall_clock: SourceTime) -> Option<Self> {
        let SiteDefinition { alarms, alarm_templates, alarm_equipment, config, audit_log, .. } =
            site;
        let has_own = !alarms.specs().is_empty() || !alarm_templates.is_empty();
        if !has_own && config.alarm_handling.sources.is_empty() {
            return None;
        }
        let longest = longest_shelf(&config.alarm_handling);
        let now = Moment::now();
        let mut table = AlarmTable::new(alarms.clone(), longest, now);
        let mut verdicts = verdict_alarms(site, &table);
        let rules = audit_log.clone().filter(|_| logs);
        let (mut log, mut tail) = (None, VecDeque::new());
        let log_remark = match rules.map(AuditLog::open) {
            None if logs && has_own => {
                Some("no audit log: name one in \"alarm_handling\"".to_owned())
            }
            None => None,
            Some(Err(error)) => {
                tracing::error!("{error}");
                Some(error.to_string())
            }
            Some(Ok((opened, found))) => {
                let RecoveredLog { open, tail: records, last_number, remarks } = found;
                verdicts.add_known(open.keys().map(String::as_str), &mut table, &site.tags);
                let last = open.values().map(|r| (r.alarm.as_str(), r.standing, r.time));
                table.restore(last, last_number, wall_clock);
                (log, tail) = (Some(opened), records);
                (!remarks.is_empty()).then(|| format!("the audit log: {}", remarks.join("; ")))
            }
        };
        tail.drain(..tail.len().saturating_sub(MAX_LOG_TAIL));
        Some(Self {
            equipment: alarm_equipment.to_vec(),
            of_templates: BTreeMap::new(),
            verdicts,
            sources: ExternalSources::start(site),
            notifications: Notifications::default(),
            table,
            log,
            log_remark,
            listing: AlarmListing::default(),
            pending: VecDeque::new(),
            tail,
            has_host: false,
            host_requests: VecDeque::new(),
            now,
            wall_clock,
        })
    }

    /// Returns the table of the configured alarms.
    pub fn table(&self) -> &AlarmTable {
        &self.table
    }

    /// Returns the alarms that other systems decide on.
    pub fn sources(&self) -> &ExternalSources {
        &self.sources
    }

    /// Returns the alarms in display order, and by equipment.
    pub fn listing(&self) -> &AlarmListing {
        &self.listing
    }

    /// Returns the newest records of the audit log, the oldest first.
    pub fn log_tail(&self) -> &VecDeque<AlarmRecord> {
        &self.tail
    }

    /// Returns the moment of the last step.
    pub fn now(&self) -> Moment {
        self.now
    }

    /// Returns the wall-clock time of the last step.
    pub fn wall_clock(&self) -> SourceTime {
        self.wall_clock
    }

    /// Reports whether a host program decides on mirrored and external alarms.
    pub fn has_host(&self) -> bool {
        self.has_host
    }

    /// Notes a change of a tag as it comes.
    #[inline]
    pub(crate) fn note(&mut self, change: &Change) {
        self.table.note(change);
    }

    /// Takes the alarms that external systems have reported.
    pub(crate) fn take_sources(&mut self, directory: &dyn EquipmentDirectory) {
        self.sources.step(directory);
    }

    /// Takes the verdicts of the overlays' last pictures for the next step.
    pub(crate) fn take_verdicts(
        &mut self,
        overlays: &[OverlayInstance],
        values: VerdictValues<'_>,
        directory: &dyn EquipmentDirectory,
    ) {
        self.verdicts.judge(&mut self.table, overlays, values, directory);
        self.place_new(directory);
    }

    /// Finds the equipment of alarms that came to the table.
    fn place_new(&mut self, directory: &dyn EquipmentDirectory) {
        let first = self.equipment.len();
        for (spec, handle) in self.table.set().specs().iter().zip(0..).skip(first) {
            let equipment = spec.equipment.as_deref().and_then(|id| directory.find(id));
            self.equipment.push(equipment);
            if let Some(equipment) = equipment {
                self.of_templates.entry(equipment).or_default().push(AlarmHandle(handle));
            }
        }
    }

    /// Steps the alarm table by the tags, appends records to the log, and updates the listing.
    pub(crate) fn step(&mut self, tags: Snapshot<'_>, now: Moment, wall_clock: SourceTime) {
        (self.now, self.wall_clock) = (now, wall_clock);
        let Self { table, log, tail, notifications, .. } = self;
        table.step(tags, now, wall_clock, |record| {
            notifications.note(&record);
            append_record(log.as_mut(), tail, record);
        });
        self.refresh();
    }

    /// Starts to hand over changes to the plugins that tell people of alarms.
    pub(crate) fn start_notifications(&mut self, site: &SiteDefinition) {
        self.notifications = Notifications::start(site, self.now, self.wall_clock);
    }

    /// Hands over the changes since the last call.
    pub(crate) fn hand_over(&mut self, tags: &TagSet, directory: &dyn EquipmentDirectory) {
        let Self { table, sources, equipment, notifications, now, wall_clock, .. } = self;
        let (now, wall_clock) = (*now, *wall_clock);
        let view = AlarmView { table, sources, equipment, directory, tags, now, wall_clock };
        notifications.hand_over(view);
    }

    /// Returns the health of a plugin that tells of alarms.
    pub(crate) fn notifier_health(&self, name: &str) -> Option<&NotifierHealth> {
        self.notifications.health(name)
    }

    /// Flushes the log, drops actions that are on the disk, and updates the listing.
    fn refresh(&mut self) {
        if let Some(log) = &mut self.log {
            log.flush();
            let durable = log.durable();
            self.pending.retain(|pending| pending.number > durable);
        }
        self.listing.update(&self.table, &self.equipment, &self.sources);
    }

    /// Performs an operator's action, or requests it from the host program that decides on the
    /// alarm.
    pub(crate) fn act(
        &mut self,
        alarm: AlarmHandle,
        action: AlarmAction,
        operator: &str,
    ) -> Result<ActionOutcome, String> {
        if self.has_host && self.is_mirrored(alarm) {
            self.request_from_host(alarm, action);
            return Ok(ActionOutcome::Requested);
        }
        if let Some((source, _)) = self.sources.get(alarm) {
            return Err(format!("'{}' decides on this alarm: act on it there", source.name()));
        }
        self.perform(alarm, action, operator).map(|()| ActionOutcome::Performed)
    }

    fn perform(
        &mut self,
        alarm: AlarmHandle,
        action: AlarmAction,
        operator: &str,
    ) -> Result<(), String> {
        if self.log.as_ref().is_some_and(|log| !log.keeps_up()) {
            return Err("the audit log does not keep up: wait, or check its disk".to_owned());
        }
        if self.pending.len() >= MAX_PENDING_ACTIONS {
            return Err("too many actions wait for the audit log: check its disk".to_owned());
        }
        let before = self.table.status(alarm).map(|status| status.state);
        let record =
            self.table.perform(alarm, action, operator).map_err(|error| error.to_string())?;
        if let Some(before) = before.filter(|_| self.log.is_some()) {
            self.pending.push_back(PendingAction { alarm, number: record.number, before });
        }
        self.notifications.note(&record);
        append_record(self.log.as_mut(), &mut self.tail, record);
        self.refresh();
        Ok(())
    }

    /// Sets an alarm of the host's to a state.
    pub(crate) fn mirror(
        &mut self,
        id: &str,
        state: AlarmState,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<(), String> {
        let alarm = self.table.set().find(id).ok_or_else(|| format!("there is no alarm '{id}'"))?;
        let record = self.table.mirror(alarm, state, until, operator);
        if let Some(record) = record.map_err(|error| format!("'{id}': {error}"))? {
            self.notifications.note(&record);
            append_record(self.log.as_mut(), &mut self.tail, record);
        }
        self.refresh();
        Ok(())
    }

    /// Returns the state of a configured alarm that an operator sees, and whether an action still
    /// waits for the disk. Until its record is there, the state before the action is shown.
    pub fn shown_state(&self, alarm: AlarmHandle, state: AlarmState) -> (AlarmState, bool) {
        let pending = self.pending.iter().find(|pending| pending.alarm == alarm);
        pending.map_or((state, false), |pending| (pending.before, true))
    }

    /// Returns the fault of the audit log, or else the equipment without an alarm for want of room,
    /// or else the remark from opening the log.
    pub fn log_fault(&self) -> Option<String> {
        let fault = self.log.as_ref().and_then(AuditLog::fault);
        let without_alarm = || match self.verdicts.left_out() {
            0 => None,
            count => Some(format!("{count} pieces of equipment have no alarm: too many alarms")),
        };
        fault.or_else(without_alarm).or_else(|| self.log_remark.clone())
    }

    /// Returns the alarms at a piece of equipment that follow an overlay on all its equipment.
    pub fn of_templates_at(&self, equipment: EquipmentNumber) -> &[AlarmHandle] {
        self.of_templates.get(&equipment).map_or(&[], Vec::as_slice)
    }

    /// Reports whether an alarm is configured or reported by an external system.
    pub fn is_known(&self, alarm: AlarmHandle) -> bool {
        self.table.set().spec(alarm).is_some() || self.sources.get(alarm).is_some()
    }

    /// Returns the id of a configured or external alarm.
    pub fn id_of(&self, alarm: AlarmHandle) -> Option<String> {
        let spec = self.table.set().spec(alarm).map(|spec| spec.id.clone());
        spec.or_else(|| self.sources.get(alarm).map(|(source, external)| external.id(source)))
    }

    /// Returns the state of a configured or external alarm.
    pub fn state_of(&self, alarm: AlarmHandle) -> Option<AlarmState> {
        let own = self.table.status(alarm).map(|status| status.state);
        own.or_else(|| Some(self.sources.get(alarm)?.1.alarm.standing().state()))
    }

    /// Returns the equipment of a configured or external alarm.
    pub fn equipment_of(&self, alarm: AlarmHandle) -> Option<EquipmentNumber> {
        match self.sources.get(alarm) {
            Some((_, external)) => external.equipment,
            None => self.equipment.get(alarm.0 as usize).copied().flatten(),
        }
    }
}

/// Returns the alarms of a table that follow verdicts of a site's overlays.
fn verdict_alarms(site: &SiteDefinition, table: &AlarmTable) -> VerdictAlarms {
    VerdictAlarms::new(&site.alarm_templates, table, |overlay| {
        let is_simulated = site.config.plugins.get(overlay).is_some_and(|of| of.simulated);
        if is_simulated { Origin::SIMULATED } else { Origin::LIVE }
    })
}

/// Returns the longest time that an alarm is shelved.
fn longest_shelf(handling: &AlarmHandlingConfig) -> Duration {
    handling.max_shelving
}

/// Appends a record to the log and to the displayed tail.
fn append_record(
    log: Option<&mut AuditLog>,
    tail: &mut VecDeque<AlarmRecord>,
    record: AlarmRecord,
) {
    if tail.len() == MAX_LOG_TAIL {
        tail.pop_front();
    }
    tail.push_back(record.clone());
    if let Some(log) = log {
        log.append(record);
    }
}
