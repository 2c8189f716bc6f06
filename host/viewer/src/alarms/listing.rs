//! Which alarms are shown, in which order, and where: worked out whenever something
//! happens, not each frame.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use busbar_alarms::{AlarmHandle, AlarmSource, AlarmTable, Priority};
use busbar_plugin_host::{OverlayTint, Severity};
use busbar_scene::NodeIndex;

/// Marks in the scene, the most urgent first.
const MAX_BEACONS: usize = 200;

/// What is shown of a table.
#[derive(Debug, Default)]
pub(super) struct Listing {
    revision: Option<u64>,
    /// Annunciated ones: by priority, then the newest first.
    pub(super) alarms: Vec<AlarmHandle>,
    /// Those that are held back.
    pub(super) held: Vec<AlarmHandle>,
    /// The first of `alarms` that nobody has acknowledged.
    pub(super) most_urgent: Option<AlarmHandle>,
    /// What is in alarm at equipment, the most urgent first.
    pub(super) places: Vec<(NodeIndex, Place)>,
    pub(super) tints: Vec<OverlayTint>,
    /// Equipment in unacknowledged alarm, and whether that changed.
    unacknowledged: BTreeSet<NodeIndex>,
    has_changed: bool,
}

/// The alarms at a piece of equipment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) priority: Priority,
    pub(super) is_unacknowledged: bool,
    /// Whether none of them is certain.
    pub(super) is_doubtful: bool,
    pub(super) count: usize,
}

impl Listing {
    pub(super) fn update(&mut self, table: &AlarmTable, nodes: &[Option<NodeIndex>]) {
        if self.revision.replace(table.revision()) == Some(table.revision()) {
            return;
        }
        let mut ranked = Vec::new();
        let mut places: BTreeMap<NodeIndex, Place> = BTreeMap::new();
        let mut unacknowledged = BTreeSet::new();
        self.held.clear();
        self.tints.clear();
        self.most_urgent = None;
        for alarm in table.open() {
            let (Some(status), Some(spec)) = (table.status(alarm), table.set().spec(alarm)) else {
                continue;
            };
            if !status.state.is_annunciated() {
                self.held.push(alarm);
                continue;
            }
            let is_unacknowledged = status.state.is_unacknowledged();
            ranked.push((spec.priority, Reverse(status.occurred), alarm, is_unacknowledged));
            let Some(node) = nodes.get(alarm.0 as usize).copied().flatten() else { continue };
            if is_unacknowledged {
                unacknowledged.insert(node);
            }
            let own = Place {
                priority: spec.priority,
                is_unacknowledged,
                is_doubtful: !status.is_certain,
                count: 1,
            };
            places.entry(node).and_modify(|place| place.join(own)).or_insert(own);
            if let (true, AlarmSource::Tag { watch, .. }) =
                (status.standing.is_active, &spec.source)
            {
                let severity = match spec.priority {
                    Priority::Critical | Priority::High => Severity::Alarm,
                    Priority::Medium | Priority::Low => Severity::Warning,
                };
                self.tints.push(OverlayTint { node: node.0, tag: watch.tag, severity });
            }
        }
        ranked.sort_unstable_by_key(|&(priority, occurred, alarm, _)| (priority, occurred, alarm));
        let urgent = ranked.iter().find(|(.., is_unacknowledged)| *is_unacknowledged);
        self.most_urgent = urgent.map(|(_, _, alarm, _)| *alarm);
        self.alarms.clear();
        self.alarms.extend(ranked.iter().map(|(_, _, alarm, _)| *alarm));
        self.places = places.into_iter().collect();
        self.places.sort_by_key(|(_, place)| (place.priority, !place.is_unacknowledged));
        self.places.truncate(MAX_BEACONS);
        self.has_changed |= unacknowledged != self.unacknowledged;
        self.unacknowledged = unacknowledged;
    }

    /// Equipment in unacknowledged alarm, if that changed since it was last asked for.
    pub(super) fn take_unacknowledged(&mut self) -> Option<&BTreeSet<NodeIndex>> {
        std::mem::take(&mut self.has_changed).then_some(&self.unacknowledged)
    }
}

impl Place {
    fn join(&mut self, other: Self) {
        self.priority = self.priority.min(other.priority);
        self.is_unacknowledged |= other.is_unacknowledged;
        self.is_doubtful &= other.is_doubtful;
        self.count += other.count;
    }
}
