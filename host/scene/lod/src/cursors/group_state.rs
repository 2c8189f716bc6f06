//! State of a group: whether it is drawn as one, and whether it wants to be.

use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use std::sync::Arc;

use busbar_scene::SceneGraph;

use super::cursor_state::InstanceCursor;
use crate::proxies::HlodGroup;

/// A group, and how it is drawn.
pub(super) struct HlodState {
    /// Range of the group's instances.
    pub(super) instances: Range<usize>,
    /// Index of the first group after those within this one.
    pub(super) after: usize,
    pub(super) base_error: f64,
    /// Models of its instances, shared by groups that look the same.
    pub(super) models: Arc<[u32]>,
    pub(super) wants_merge: bool,
    pub(super) is_merged: bool,
}

impl HlodState {
    pub(super) fn all(groups: &[HlodGroup], graph: &SceneGraph) -> Vec<Self> {
        let mut models: HashMap<u32, Arc<[u32]>> = HashMap::new();
        let state = |HlodGroup { group, after, base_error, .. }: &HlodGroup| {
            let instances = group.instances.start as usize..group.instances.end as usize;
            let models = models.entry(group.kind).or_insert_with(|| {
                let of = instances.clone().map(|index| graph.instance(index).model.0);
                of.collect::<BTreeSet<u32>>().into_iter().collect()
            });
            Self {
                instances,
                after: *after as usize,
                base_error: *base_error,
                models: Arc::clone(models),
                wants_merge: false,
                is_merged: false,
            }
        };
        groups.iter().map(state).collect()
    }

    /// Reports whether the group is merged and stays merged.
    pub(super) fn stays_merged(&self) -> bool {
        self.is_merged && self.wants_merge
    }
}

impl InstanceCursor {
    /// Creates the cursor of a group that is not merged.
    pub(super) fn for_proxy(kind: u32, hlod: &HlodGroup) -> Self {
        let mut proxy = Self::new(kind, Some(hlod.group.bounds), 0);
        proxy.hide();
        proxy
    }
}
