//! Alarm listing: displayed alarms in order of priority and by equipment, updated at each change.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use busbar_alarms::{AlarmHandle, AlarmSource, AlarmTable, Priority};
use busbar_plugin_host::{OverlayTint, Severity};
use busbar_scene::NodeIndex;
use busbar_tags::{Origin, SourceTime};

use super::external_alarms::ExternalSources;

/// Marks in the scene, the most urgent first.
const MAX_ALARM_MARKERS: usize = 200;

/// Listing of the alarms in display order.
#[derive(Debug, Default)]
pub(super) struct AlarmListing {
    /// Revisions of the alarm table and of the external sources.
    revision: Option<(u64, u64)>,
    /// Annunciated ones: by priority, then the newest first.
    pub(super) alarms: Vec<AlarmHandle>,
    /// Suppressed alarms: shelved, suppressed by design, out of service.
    pub(super) held: Vec<AlarmHandle>,
    /// First unacknowledged alarm of `alarms`.
    pub(super) most_urgent: Option<AlarmHandle>,
    /// Equipment in alarm, the most urgent first.
    pub(super) places: Vec<(NodeIndex, EquipmentAlarms)>,
    pub(super) tints: Vec<OverlayTint>,
    pub(super) external_tints: Vec<ExternalAlarmTint>,
    /// Unacknowledged and annunciated alarms of external systems, by priority.
    pub(super) external_counts: [[usize; 2]; 4],
    /// Equipment in alarm, and whether that changed.
    in_alarm: EquipmentInAlarm,
    has_changed: bool,
}

/// Equipment in alarm, by node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct EquipmentInAlarm {
    pub(super) unacknowledged: BTreeSet<NodeIndex>,
    pub(super) all: BTreeSet<NodeIndex>,
}

/// The alarms at a piece of equipment.
#[derive(Clone, Copy, Debug)]
pub(super) struct EquipmentAlarms {
    pub(super) priority: Priority,
    pub(super) is_unacknowledged: bool,
    /// True if none of its alarms is certain.
    pub(super) is_uncertain: bool,
    pub(super) count: usize,
    /// Origins of the values by which they came.
    pub(super) origin: Origin,
}

/// Colour on equipment in alarm, where another system decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ExternalAlarmTint {
    pub(crate) node: NodeIndex,
    pub(crate) severity: Severity,
    /// True if the source's report is current and good.
    pub(crate) is_certain: bool,
}

/// Collector of alarms for a listing.
#[derive(Default)]
struct AlarmCollector {
    ranked: Vec<RankedAlarm>,
    places: BTreeMap<NodeIndex, EquipmentAlarms>,
    in_alarm: EquipmentInAlarm,
}

/// An annunciated alarm: by priority, then the newest first.
type RankedAlarm = (Priority, Reverse<Option<SourceTime>>, AlarmHandle, bool);

impl AlarmCollector {
    fn add(
        &mut self,
        ranked: RankedAlarm,
        node: Option<NodeIndex>,
        is_certain: bool,
        origin: Origin,
    ) {
        let (priority, _, _, is_unacknowledged) = ranked;
        self.ranked.push(ranked);
        let Some(node) = node else { return };
        self.in_alarm.all.insert(node);
        if is_unacknowledged {
            self.in_alarm.unacknowledged.insert(node);
        }
        let is_uncertain = !is_certain;
        let own = EquipmentAlarms { priority, is_unacknowledged, is_uncertain, count: 1, origin };
        self.places.entry(node).and_modify(|place| place.join(own)).or_insert(own);
    }
}

impl AlarmListing {
    pub(super) fn update(
        &mut self,
        table: &AlarmTable,
        nodes: &[Option<NodeIndex>],
        sources: &ExternalSources,
    ) {
        let revision = (table.revision(), sources.revision);
        if self.revision.replace(revision) == Some(revision) {
            return;
        }
        let mut collector = AlarmCollector::default();
        self.held.clear();
        self.list_own(table, nodes, &mut collector);
        self.list_external(sources, &mut collector);
        let AlarmCollector { mut ranked, places, in_alarm } = collector;
        ranked.sort_unstable_by_key(|&(priority, occurred, alarm, _)| (priority, occurred, alarm));
        let urgent = ranked.iter().find(|(.., is_unacknowledged)| *is_unacknowledged);
        self.most_urgent = urgent.map(|(_, _, alarm, _)| *alarm);
        self.alarms.clear();
        self.alarms.extend(ranked.iter().map(|(_, _, alarm, _)| *alarm));
        self.places = places.into_iter().collect();
        self.places.sort_by_key(|(_, place)| (place.priority, !place.is_unacknowledged));
        self.places.truncate(MAX_ALARM_MARKERS);
        self.has_changed |= in_alarm != self.in_alarm;
        self.in_alarm = in_alarm;
    }

    fn list_own(
        &mut self,
        table: &AlarmTable,
        nodes: &[Option<NodeIndex>],
        collector: &mut AlarmCollector,
    ) {
        self.tints.clear();
        for alarm in table.open() {
            let (Some(status), Some(spec)) = (table.status(alarm), table.set().spec(alarm)) else {
                continue;
            };
            if !status.state.is_annunciated() {
                self.held.push(alarm);
                continue;
            }
            let node = nodes.get(alarm.0 as usize).copied().flatten();
            let is_unacknowledged = status.state.is_unacknowledged();
            let ranked = (spec.priority, Reverse(status.occurred), alarm, is_unacknowledged);
            collector.add(ranked, node, status.is_certain, status.origin);
            if let (Some(node), true, AlarmSource::Tag { trigger, .. }) =
                (node, status.standing.is_active, &spec.source)
            {
                let severity = severity(spec.priority);
                self.tints.push(OverlayTint { node: node.0, tag: trigger.tag, severity });
            }
        }
    }

    /// Lists the alarms of external sources. Cleared alarms that a source still reports are listed,
    /// too.
    fn list_external(&mut self, sources: &ExternalSources, collector: &mut AlarmCollector) {
        self.external_tints.clear();
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
            collector.add(ranked, external.node, is_certain, Origin::LIVE);
            if let Some(node) = external.node.filter(|_| standing.is_active) {
                let severity = severity(priority);
                self.external_tints.push(ExternalAlarmTint { node, severity, is_certain });
            }
        }
    }

    /// Takes the equipment in alarm if it has changed since the last call.
    pub(super) fn take_in_alarm(&mut self) -> Option<&EquipmentInAlarm> {
        std::mem::take(&mut self.has_changed).then_some(&self.in_alarm)
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
