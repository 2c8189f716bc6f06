//! Index remap: maps the tag and node indices held by running plugins to those of the reloaded
//! scene.

use std::sync::Arc;

use busbar_plugin_host::OverlayPicture;
use busbar_scene::NodeIndex;
use busbar_tags::{HandleRemap, TagHandle};

use busbar_scene_loader::LoadedScene;

/// No tag has this number.
const NO_TAG: TagHandle = TagHandle(u32::MAX);

/// Map from the tag and node indices of one scene to those of another.
#[derive(Clone, Debug, Default)]
pub(crate) struct IndexRemap {
    pub(crate) tags: HandleRemap,
    nodes: HandleRemap,
}

impl IndexRemap {
    /// Builds the map between two scenes; with the same nodes it maps tags alone.
    pub(crate) fn between(before: &LoadedScene, after: &LoadedScene, same_nodes: bool) -> Self {
        let tags = match Arc::ptr_eq(&before.tags, &after.tags) {
            true => HandleRemap::default(),
            false => HandleRemap::between_tag_sets(&before.tags, &after.tags),
        };
        let nodes = match same_nodes {
            true => HandleRemap::default(),
            false => {
                let ids = (0..before.graph.node_count() as u32)
                    .map(|index| before.graph.node(NodeIndex(index)).id());
                let found: Vec<Option<u32>> =
                    ids.map(|id| Some(after.graph.find(&id)?.0)).collect();
                HandleRemap::new(found.into_iter())
            }
        };
        Self { tags, nodes }
    }

    /// Returns the composition: this map, then the next.
    pub(crate) fn then(&self, next: &Self) -> Self {
        Self { tags: self.tags.then(&next.tags), nodes: self.nodes.then(&next.nodes) }
    }

    /// Returns the present index of a node; none if the node is gone.
    pub(crate) fn node(&self, NodeIndex(old): NodeIndex) -> Option<NodeIndex> {
        self.nodes.index(old).map(NodeIndex)
    }

    /// Maps a picture to the present indices; entries of removed tags or nodes are dropped.
    pub(crate) fn picture(&self, picture: &Arc<OverlayPicture>) -> Arc<OverlayPicture> {
        if self.tags.is_identity() && self.nodes.is_identity() {
            return Arc::clone(picture);
        }
        let mut now = OverlayPicture::clone(picture);
        let remap = |node: &mut u32, tag: &mut TagHandle| {
            let found = self.nodes.index(*node).zip(self.tags.tag(*tag));
            found.map(|found| (*node, *tag) = found).is_some()
        };
        now.lines.retain_mut(|line| remap(&mut line.node, &mut line.tag));
        now.tints.retain_mut(|tint| remap(&mut tint.node, &mut tint.tag));
        let remap = |tag: &mut TagHandle| {
            let found = self.tags.tag(*tag);
            found.map(|found| *tag = found).is_some()
        };
        now.states.retain_mut(|state| remap(&mut state.tag));
        now.quantities.retain_mut(|quantity| remap(&mut quantity.tag));
        // A verdict that rests on a tag that is gone is taken back.
        now.verdicts.map_tags(|tag| self.tags.tag(tag).unwrap_or(NO_TAG));
        Arc::new(now)
    }
}
