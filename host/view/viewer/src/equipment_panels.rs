//! Equipment panels: the tree of equipment, the list of tags, and the faceplate of the selected
//! device.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_scene::NodeIndex;
use busbar_site::{IndexRemap, RecordStore, Site};
use busbar_tags::{SourceTime, TagHandle};

use crate::equipment_tree::{EquipmentTree, EquipmentTreeRows};
use crate::faceplate::{self, NodeAttachments, OpenFaceplate};
use crate::site_definition::remapped;
use crate::tag_filter::TagFilter;
use busbar_scene_loader::LoadedScene;

/// State of the panels that list equipment and tags.
pub(crate) struct EquipmentPanels {
    tree: EquipmentTree,
    tag_filter: TagFilter,
    attachments: NodeAttachments,
    /// Faceplate of the selected equipment; none unless exactly one is selected.
    faceplate: Option<OpenFaceplate>,
    /// Time span of the trends.
    trend_span: Duration,
}

impl EquipmentPanels {
    /// Creates the panels of a scene without a faceplate.
    pub(crate) fn new(scene: &LoadedScene) -> Self {
        let attachments = NodeAttachments::new(scene);
        Self {
            tree: EquipmentTree::new(&scene.graph, &scene.equipment, &attachments.nodes()),
            tag_filter: TagFilter::default(),
            attachments,
            faceplate: None,
            trend_span: faceplate::FIRST_SPAN,
        }
    }

    /// Adapts tree and tag list to a reloaded scene; closes the faceplate and returns it.
    pub(crate) fn reload(
        &mut self,
        scene: &LoadedScene,
        remap: &IndexRemap,
    ) -> Option<OpenFaceplate> {
        let next = Self { trend_span: self.trend_span, ..Self::new(scene) };
        let before = std::mem::replace(self, next);
        self.tree.search(before.tree.query(), &scene.graph, &scene.equipment);
        self.tree.inherit(&before.tree, |node| remapped(remap, node));
        self.tag_filter = before.tag_filter.for_scene(scene);
        before.faceplate
    }

    /// Shows in the open faceplate the trends that another showed, of the values that it has.
    pub(crate) fn keep_trends(&mut self, before: Option<&OpenFaceplate>, remap: &IndexRemap) {
        if let (Some(now), Some(before)) = (&mut self.faceplate, before) {
            now.keep_trends(before, remap.tags());
        }
    }

    /// Follows a selection: reveals a single piece of equipment in the tree, and opens the faceplate
    /// of its device.
    pub(crate) fn follow_selection(
        &mut self,
        selection: &BTreeSet<NodeIndex>,
        scene: &LoadedScene,
        site: &Site,
    ) {
        let one = selection.first().copied().filter(|_| selection.len() == 1);
        let device = one.map(|node| scene.equipment.device_of(&scene.graph, node));
        self.tree.select(one, device);
        if self.faceplate.as_ref().map(|faceplate| faceplate.device) == device {
            return;
        }
        self.faceplate = device.map(|device| {
            OpenFaceplate::open(scene, &self.attachments, &self.tree, site.history(), device)
        });
    }

    /// Updates the records of the faceplate.
    pub(crate) fn look_up_records(&mut self, records: &RecordStore, now: SourceTime) {
        if let Some(faceplate) = &mut self.faceplate {
            faceplate.records.look_up(records, now);
        }
    }

    /// Searches the tree for names.
    pub(crate) fn search_equipment(&mut self, query: &str, scene: &LoadedScene) {
        self.tree.search(query, &scene.graph, &scene.equipment);
    }

    /// Opens or closes a branch of the tree.
    pub(crate) fn toggle_branch(&mut self, entry: u32) {
        self.tree.toggle(entry);
    }

    /// Lists the tags that match a query.
    pub(crate) fn filter_tags(&mut self, query: &str, scene: &LoadedScene) {
        self.tag_filter.filter(query, scene);
    }

    /// Shows the trend of a tag in the faceplate, or hides it.
    pub(crate) fn toggle_trend(&mut self, tag: TagHandle) {
        if let Some(faceplate) = &mut self.faceplate {
            faceplate.toggle_trend(tag);
        }
    }

    /// Sets the time span of the trends.
    pub(crate) fn set_trend_span(&mut self, span: Duration) {
        self.trend_span = span;
    }

    /// Returns the time span of the trends.
    pub(crate) fn trend_span(&self) -> Duration {
        self.trend_span
    }

    /// Returns the faceplate; none unless exactly one piece of equipment is selected.
    pub(crate) fn faceplate(&self) -> Option<&OpenFaceplate> {
        self.faceplate.as_ref()
    }

    /// Returns the filter of the tag list.
    pub(crate) fn tag_filter(&self) -> &TagFilter {
        &self.tag_filter
    }

    /// Returns the tree as rows.
    pub(crate) fn tree_rows<'a>(&'a self, scene: &'a LoadedScene) -> EquipmentTreeRows<'a> {
        EquipmentTreeRows { tree: &self.tree, graph: &scene.graph, equipment: &scene.equipment }
    }

    /// Returns the number of rows of the tree.
    pub(crate) fn tree_len(&self) -> usize {
        self.tree.len()
    }
}
