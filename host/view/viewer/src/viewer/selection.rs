//! Selection of equipment, and the faceplate that it opens.

use busbar_tags::{TagHandle, ValueKind};

use super::*;

impl Viewer {
    /// Selects nodes; the faceplate is that of the one, if it is one.
    pub(super) fn select(&mut self, nodes: impl IntoIterator<Item = NodeIndex>) {
        self.selection = nodes.into_iter().take(MAX_SELECTED).collect();
        let LoadedScene { graph, equipment, .. } = &self.scene;
        let one = self.selection.first().copied().filter(|_| self.selection.len() == 1);
        let device = one.map(|node| equipment.device_of(graph, node));
        self.equipment_tree.select(one, device);
        if self.faceplate.as_ref().map(|faceplate| faceplate.device) == device {
            return;
        }
        self.faceplate = device.map(|device| {
            let (tree, history) = (&self.equipment_tree, &self.history);
            OpenFaceplate::open(&self.scene, &self.node_attachments, tree, history, device)
        });
    }

    /// Takes new records and updates those of the faceplate.
    pub(super) fn take_records(&mut self) {
        self.records.step(&self.scene);
        if let Some(faceplate) = &mut self.faceplate {
            faceplate.records.look_up(&self.records, wall_clock());
        }
    }
}

/// Histories of numbers: of tags at equipment first, of as many as are kept.
pub(super) fn history_of(scene: &LoadedScene) -> History {
    let is_number = |tag: &TagHandle| {
        let kind = scene.tags.spec(*tag).map(|spec| spec.kind);
        matches!(kind, Some(ValueKind::F64 | ValueKind::I64))
    };
    let bound = scene.bindings.iter().map(|binding| binding.tag);
    let all = (0..scene.tags.specs().len() as u32).map(TagHandle);
    History::new(bound.chain(all).filter(is_number))
}
