//! Selection of equipment, and the faceplate that it opens.

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
            let (tree, history) = (&self.equipment_tree, self.site.history());
            OpenFaceplate::open(&self.scene, &self.node_attachments, tree, history, device)
        });
    }

    /// Updates the records of the faceplate.
    pub(super) fn look_up_records(&mut self) {
        if let Some(faceplate) = &mut self.faceplate {
            faceplate.records.look_up(self.site.records(), wall_clock());
        }
    }
}
