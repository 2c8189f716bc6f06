//! Alarm listing: displayed alarms in order of priority and by equipment, updated at each change.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use busbar_alarms::{AlarmHandle, AlarmSource, AlarmTable};
use busbar_overlay_picture::OverlayTint;
use busbar_tags::SourceTime;
use busbar_types::{Origin, Priority, Severity};

use super::external_alarms::ExternalSources;
use crate::equipment::EquipmentNumber;

/// Marks in the scene, the most urgent first.
const MAX_ALARM_MARKERS: usize = 200;

/// Listing of the alarms in display order.
#[derive(Debug, Default)]
pub struct AlarmListing {
    /// Revisions of the alarm table and of the external sources.
    revision: Option<(u64, u64)>,
    alarms: Vec<AlarmHandle>,
    held: Vec<AlarmHandle>,
    most_urgent: Option<AlarmHandle>,
    equipment: Vec<(EquipmentNumber, EquipmentAlarms)>,
    tints: Vec<OverlayTint>,
    judged_tints: Vec<JudgedAlarmTint>,
    external_counts: [[usize; 2]; 4],
    in_alarm: EquipmentInAlarm,
}

/// Equipment in alarm, marked in the scene or not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EquipmentInAlarm {
    /// Equipment with an unacknowledged alarm.
    pub unacknowledged: BTreeSet<EquipmentNumber>,
    /// Equipment with any annunciated alarm.
    pub all: BTreeSet<EquipmentNumber>,
}

/// Alarms at a piece of equipment.
#[derive(Clone, Copy, Debug)]
pub struct EquipmentAlarms {
    /// Highest priority of its alarms.
    pub priority: Priority,
    /// True if any of its alarms is unacknowledged.
    pub is_unacknowledged: bool,
    /// True if none of its alarms is certain.
    pub is_uncertain: bool,
    /// Number of its alarms.
    pub count: usize,
    /// Origins of the values by which the alarms came.
    pub origin: Origin,
}

/// Colour on equipment in alarm where an overlay or another system decides, and not a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JudgedAlarmTint {
    /// Equipment that is tinted.
    pub equipment: EquipmentNumber,
    /// Severity that decides on the colour.
    pub severity: Severity,
    /// True if the verdict is known, or the source's report current and good.
    pub is_certain: bool,
}

/// Collector of alarms for a listing.
#[derive(Default)]
struct AlarmCollector {
    ranked: Vec<RankedAlarm>,
    equipment: BTreeMap<EquipmentNumber, EquipmentAlarms>,
    in_alarm: EquipmentInAlarm,
}

/// An annunciated alarm: by priority, then the newest first.
type RankedAlarm = (Priority, Reverse<Option<SourceTime>>, AlarmHandle, bool);

impl AlarmCollector {
    fn add(
        &mut self,
        ranked: RankedAlarm,
        equipment: Option<EquipmentNumber>,
        is_certain: bool,
        origin: Origin,
    ) {
        let (priority, _, _, is_unacknowledged) = ranked;
        self.ranked.push(ranked);
        let Some(equipment) = equipment else { return };
        self.in_alarm.all.insert(equipment);
        if is_unacknowledged {
            self.in_alarm.unacknowledged.insert(equipment);
        }
        let is_uncertain = !is_certain;
        let own = EquipmentAlarms { priority, is_unacknowledged, is_uncertain, count: 1, origin };
        self.equipment.entry(equipment).and_modify(|all| all.join(own)).or_insert(own);
    }
}

impl AlarmListing {
    /// Returns the annunciated alarms: by priority, then the newest first.
    pub fn alarms(&self) -> &[AlarmHandle] {
        &self.alarms
    }

    /// Returns the suppressed alarms: shelved, suppressed by design, out of service.
    pub fn held(&self) -> &[AlarmHandle] {
        &self.held
    }

    /// Returns the first unacknowledged alarm in display order.
    pub fn most_urgent(&self) -> Option<AlarmHandle> {
        self.most_urgent
    }

    /// Returns the equipment to be marked in the scene, the most urgent first.
    pub fn equipment(&self) -> &[(EquipmentNumber, EquipmentAlarms)] {
        &self.equipment
    }

    /// Returns the colours on equipment with an active alarm of a tag.
    pub fn tints(&self) -> &[OverlayTint] {
        &self.tints
    }

    /// Returns the colours on equipment with an active alarm of an overlay or another system.
    pub fn judged_tints(&self) -> &[JudgedAlarmTint] {
        &self.judged_tints
    }

    /// Returns the unacknowledged and annunciated alarms of external systems, by priority.
    pub fn external_counts(&self) -> &[[usize; 2]; 4] {
        &self.external_counts
    }

    /// Returns all equipment in alarm.
    pub fn in_alarm(&self) -> &EquipmentInAlarm {
        &self.in_alarm
    }

    /// Returns the revision of the listing; none before the first update.
    pub fn revision(&self) -> Option<(u64, u64)> {
        self.revision
    }

    /// Lists the alarms anew if any has changed.
    pub(super) fn update(
        &mut self,
        table: &AlarmTable,
        equipment: &[Option<EquipmentNumber>],
        sources: &ExternalSources,
    ) {
        let revision = (table.revision(), sources.revision);
        if self.revision.replace(revision) == Some(revision) {
            return;
        }
        let mut collector = AlarmCollector::default();
        self.held.clear();
        self.list_own(table, equipment, &mut collector);
        self.list_external(sources, &mut collector);
        let AlarmCollector { mut ranked, equipment, in_alarm } = collector;
        ranked.sort_unstable_by_key(|&(priority, occurred, alarm, _)| (priority, occurred, alarm));
        let urgent = ranked.iter().find(|(.., is_unacknowledged)| *is_unacknowledged);
        self.most_urgent = urgent.map(|(_, _, alarm, _)| *alarm);
        self.alarms.clear();
        self.alarms.extend(ranked.iter().map(|(_, _, alarm, _)| *alarm));
        self.equipment = equipment.into_iter().collect();
        self.equipment.sort_by_key(|(_, alarms)| (alarms.priority, !alarms.is_unacknowledged));
        self.equipment.truncate(MAX_ALARM_MARKERS);
        self.in_alarm = in_alarm;
    }

    fn list_own(
        &mut self,
        table: &AlarmTable,
        equipment_of_alarms: &[Option<EquipmentNumber>],
        collector: &mut AlarmCollector,
    ) {
        self.tints.clear();
        self.judged_tints.clear();
        for alarm in table.open() {
            let (Some(status), Some(spec)) = (table.status(alarm), table.set().spec(alarm)) else {
                continue;
            };
            if !status.state.is_annunciated() {
                self.held.push(alarm);
                continue;
            }
            let equipment = equipment_of_alarms.get(alarm.0 as usize).copied().flatten();
            let is_unacknowledged = status.state.is_unacknowledged();
            let ranked = (spec.priority, Reverse(status.occurred), alarm, is_unacknowledged);
            collector.add(ranked, equipment, status.is_certain, status.origin);
            let Some(equipment) = equipment.filter(|_| status.standing.is_active) else { continue };
            let severity = severity(spec.priority);
            match &spec.source {
                AlarmSource::Tag { trigger, .. } => {
                    self.tints.push(OverlayTint { node: equipment.0, tag: trigger.tag, severity });
                }
                AlarmSource::Verdict { .. } => {
                    let is_certain = status.is_certain;
                    self.judged_tints.push(JudgedAlarmTint { equipment, severity, is_certain });
                }
                AlarmSource::Mirrored => {}
            }
        }
    }

    /// Lists the alarms of external sources. Cleared alarms that a source still reports are listed,
    /// too.
    fn list_external(&mut self, sources: &ExternalSources, collector: &mut AlarmCollector) {
        self.external_counts = Default::default();
        for (source, external) in sources.iter() {
            let standing = external.alarm.standing();
            let state = standing.state();
            if state.is_held() {
                self.held.push(external.number);
                continue;
            }
            let (priority, is_certain) = (external.priority, external.is_certain(source));
            let [unacknowledged, all] = &mut self.external_counts[priority as usize];
            *unacknowledged += usize::from(state.is_unacknowledged());
            *all += 1;
            let since = Reverse(external.alarm.since());
            let ranked = (priority, since, external.number, state.is_unacknowledged());
            collector.add(ranked, external.equipment, is_certain, Origin::LIVE);
            if let Some(equipment) = external.equipment.filter(|_| standing.is_active) {
                let severity = severity(priority);
                self.judged_tints.push(JudgedAlarmTint { equipment, severity, is_certain });
            }
        }
    }
}

impl EquipmentAlarms {
    fn join(&mut self, other: Self) {
        self.priority = self.priority.min(other.priority);
        self.is_unacknowledged |= other.is_unacknowledged;
        self.is_uncertain &= other.is_uncertain;
        self.count += other.count;
        self.origin |= other.origin;
    }
}

fn severity(priority: Priority) -> Severity {
    match priority {
        Priority::Critical | Priority::High => Severity::Alarm,
        Priority::Medium | Priority::Low => Severity::Warning,
    }
}
