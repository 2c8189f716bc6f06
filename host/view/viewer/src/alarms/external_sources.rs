//! Alarms that other systems decide on, beside those decided here.

use super::*;

impl AlarmService {
    /// Takes the alarms that external systems have reported.
    pub(crate) fn take_sources(&mut self, scene: &LoadedScene) {
        if self.sources.step(scene) {
            self.note_instances(scene);
        }
    }

    /// Notes the instances of equipment that had no alarm before.
    pub(super) fn note_instances(&mut self, scene: &LoadedScene) {
        let nodes = self.sources.iter().filter_map(|(_, external)| external.node);
        let new: BTreeSet<NodeIndex> =
            nodes.filter(|node| !self.instances.contains_key(node)).collect();
        if !new.is_empty() {
            self.instances.extend(instances_of(&scene.graph, new.iter()));
        }
    }

    /// Colour on equipment in alarm where another system decides.
    pub(crate) fn external_tints(&self) -> &[ExternalAlarmTint] {
        &self.listing.external_tints
    }

    /// Id of an alarm.
    pub(crate) fn id_of(&self, alarm: AlarmHandle) -> Option<String> {
        let spec = self.table.set().spec(alarm).map(|spec| spec.id.clone());
        spec.or_else(|| self.sources.get(alarm).map(|(source, external)| external.id(source)))
    }

    /// States of the alarms that other systems decide on.
    pub(crate) fn external_states(&self) -> impl Iterator<Item = State> {
        self.sources.iter().map(|(_, external)| external.alarm.standing().state())
    }

    /// Returns the state of an own or external alarm.
    pub(super) fn state_of(&self, alarm: AlarmHandle) -> Option<State> {
        let own = self.table.status(alarm).map(|status| status.state);
        own.or_else(|| Some(self.sources.get(alarm)?.1.alarm.standing().state()))
    }
}
