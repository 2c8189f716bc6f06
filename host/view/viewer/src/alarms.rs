//! Presentation of the site's alarms: the list shown, the selected alarm, and the detail of
//! equipment in alarm.

mod external_text;
mod rows;
mod statistics;
mod text;

use std::collections::{BTreeSet, HashMap};
use std::time::Duration;

use busbar_alarms::{AlarmHandle, AlarmSet};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{ActionOutcome, AlarmService, EquipmentInAlarm, EquipmentNumber, Site};
use busbar_tags::Moment;
use busbar_types::AlarmAction;
use busbar_ui::AlarmList;

pub(crate) use self::rows::AlarmListRows;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::node_of;

/// Display time of the reason why an action was refused.
const REFUSAL_SHOWN_FOR: Duration = Duration::from_secs(10);

/// Presentation of the alarms in one view.
pub(crate) struct AlarmPresentation {
    selected: Option<AlarmHandle>,
    list: AlarmList,
    /// Last refusal of an action, and its moment.
    refusal: Option<(Moment, String)>,
    /// Instances of each piece of equipment that has an alarm.
    instances: HashMap<NodeIndex, Vec<usize>>,
    /// Equipment in alarm whose detail was last taken; none if it must be taken again.
    detailed: Option<EquipmentInAlarm>,
    /// Revision of the listing that `detailed` is of.
    revision: Option<(u64, u64)>,
}

impl AlarmPresentation {
    /// Creates the presentation of a scene's alarms.
    pub(crate) fn new(scene: &LoadedScene) -> Self {
        Self {
            selected: None,
            list: AlarmList::default(),
            refusal: None,
            instances: instances_of(&scene.graph, scene.alarms.nodes.iter().flatten()),
            detailed: Some(EquipmentInAlarm::default()),
            revision: None,
        }
    }

    /// Continues with the alarms of a reloaded scene and site.
    pub(crate) fn reload(&mut self, before: &AlarmSet, scene: &LoadedScene, site: &Site) {
        let next = Self { detailed: None, ..Self::new(scene) };
        let before_reload = std::mem::replace(self, next);
        let Some(service) = site.alarms() else { return };
        let now_of = |alarm: AlarmHandle| match before.spec(alarm) {
            Some(spec) => service.table().set().find(&spec.id),
            // Those of other systems keep their numbers.
            None => Some(alarm).filter(|alarm| service.sources().get(*alarm).is_some()),
        };
        self.selected = before_reload.selected.and_then(now_of);
        (self.list, self.refusal) = (before_reload.list, before_reload.refusal);
    }

    /// Returns the selected alarm.
    pub(crate) fn selected(&self) -> Option<AlarmHandle> {
        self.selected
    }

    /// Selects an alarm; none if the site does not know it.
    pub(crate) fn select(&mut self, alarm: AlarmHandle, site: &Site) {
        if let Some(service) = site.alarms() {
            self.selected = Some(alarm).filter(|alarm| service.is_known(*alarm));
        }
    }

    /// Shows one of the lists.
    pub(crate) fn show_list(&mut self, list: AlarmList, site: &Site) {
        if site.alarms().is_some() {
            self.list = list;
        }
    }

    /// Performs an operator's action; a refusal is shown for a while.
    pub(crate) fn act(
        &mut self,
        site: &mut Site,
        alarm: AlarmHandle,
        action: AlarmAction,
        operator: &str,
    ) {
        let Some(now) = site.alarms().map(AlarmService::now) else { return };
        match site.act_on_alarm(alarm, action, operator) {
            Ok(ActionOutcome::Performed) => self.refusal = None,
            Ok(ActionOutcome::Requested) => {}
            Err(refusal) => self.refusal = Some((now, refusal)),
        }
    }

    /// Returns the instances of equipment in unacknowledged alarm, which are drawn in full detail,
    /// and of equipment in any alarm, which are drawn individually; none if both are unchanged
    /// since the last call.
    pub(crate) fn changed_detail(
        &mut self,
        site: &Site,
        graph: &SceneGraph,
    ) -> Option<[BTreeSet<usize>; 2]> {
        let listing = site.alarms()?.listing();
        let (revision, in_alarm) = (listing.revision(), listing.in_alarm());
        if self.revision == revision && self.detailed.is_some() {
            return None;
        }
        self.revision = revision;
        if self.detailed.as_ref() == Some(in_alarm) {
            return None;
        }
        let is_new = |node: &NodeIndex| !self.instances.contains_key(node);
        let new: BTreeSet<NodeIndex> =
            in_alarm.all.iter().copied().map(node_of).filter(is_new).collect();
        if !new.is_empty() {
            self.instances.extend(instances_of(graph, new.iter()));
        }
        self.detailed = Some(in_alarm.clone());
        let instances = |equipment: &BTreeSet<EquipmentNumber>| {
            let nodes = equipment.iter().copied().map(node_of);
            nodes.filter_map(|node| self.instances.get(&node)).flatten().copied().collect()
        };
        Some([instances(&in_alarm.unacknowledged), instances(&in_alarm.all)])
    }

    /// Returns the current refusal, else the fault or the remark of the log.
    fn fault_text(&self, service: &AlarmService) -> Option<String> {
        let is_fresh = |at: Moment| service.now().since(at) < REFUSAL_SHOWN_FOR;
        let refusal = self.refusal.as_ref().filter(|(at, _)| is_fresh(*at));
        refusal.map(|(_, words)| words.clone()).or_else(|| service.log_fault())
    }
}

/// Returns the instances that show each of these nodes: those at it or below it; of a feature, the
/// one that it is a part of.
fn instances_of<'a>(
    graph: &SceneGraph,
    nodes: impl Iterator<Item = &'a NodeIndex>,
) -> HashMap<NodeIndex, Vec<usize>> {
    let mut found: HashMap<NodeIndex, Vec<usize>> = nodes.map(|&node| (node, Vec::new())).collect();
    for (index, instance) in graph.instances().enumerate() {
        let mut above = Some(instance.node);
        while let Some(node) = above {
            if let Some(instances) = found.get_mut(&node) {
                instances.push(index);
            }
            above = graph.node(node).parent();
        }
    }
    let mut of_features: HashMap<NodeIndex, Vec<NodeIndex>> = HashMap::new();
    for (&node, _) in found.iter().filter(|(_, instances)| instances.is_empty()) {
        if let Some(parent) = graph.node(node).parent() {
            of_features.entry(parent).or_default().push(node);
        }
    }
    for (index, instance) in graph.instances().enumerate() {
        for node in of_features.get(&instance.node).into_iter().flatten() {
            found.entry(*node).or_default().push(index);
        }
    }
    found
}
