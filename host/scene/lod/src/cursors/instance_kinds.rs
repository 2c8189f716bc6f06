//! Kinds of instances: the same mesh, policy and scale share cursors and proxies.

use std::collections::HashMap;
use std::sync::Arc;

use busbar_geometry::CollapseStacks;

use super::cursor_state::MeshCursor;
use crate::proxies::MeshProxy;
use crate::theta_policy::{Detail, ThetaPolicy};

/// The first cursor that is none of the mesh: from here on its proxies are numbered.
pub(super) const FIRST_PROXY: u32 = 1 << 31;

/// A mesh as instances show it.
pub(super) struct InstanceKind {
    pub(super) model: u32,
    pub(super) mesh: u32,
    /// Collapse stacks of the mesh.
    pub(super) stacks: Arc<CollapseStacks>,
    /// Index of its policy.
    pub(super) policy: u32,
    /// Metres to a unit of the mesh, at most.
    pub(super) metres: f32,
    /// Proxies of the mesh, the finest first.
    pub(super) proxies: Option<Arc<[MeshProxy]>>,
    /// Cursors by policy level, computed at the first use.
    pub(super) level_cursors: Vec<Option<LevelCursors>>,
}

/// Wanted cursors at a level of the policy.
#[derive(Clone, Copy)]
pub(super) struct LevelCursors {
    pub(super) theta: f64,
    /// The mesh's own cursor there.
    pub(super) own: u32,
    /// Cursor of the proxy that may replace the mesh.
    pub(super) proxy: Option<u32>,
}

impl InstanceKind {
    pub(super) fn at(&self, cursor: u32) -> MeshCursor {
        let proxy = cursor.checked_sub(FIRST_PROXY).zip(self.proxies.as_ref());
        match proxy.and_then(|(index, proxies)| proxies.get(index as usize)) {
            Some(&MeshProxy { model, mesh, .. }) => {
                MeshCursor { model: model as usize, mesh: mesh as usize, cursor: 0 }
            }
            None => MeshCursor { model: self.model as usize, mesh: self.mesh as usize, cursor },
        }
    }

    pub(super) fn cursors_at_level(
        &mut self,
        level: u32,
        policies: &[ThetaPolicy],
    ) -> LevelCursors {
        let known = self.level_cursors.get(level as usize).copied().flatten();
        known.unwrap_or_else(|| {
            let cursors = self.find_cursors(policies[self.policy as usize].detail(level));
            let levels = self.level_cursors.len().max(level as usize + 1);
            self.level_cursors.resize(levels, None);
            self.level_cursors[level as usize] = Some(cursors);
            cursors
        })
    }

    fn find_cursors(&self, detail: Detail) -> LevelCursors {
        let stacks = &self.stacks;
        let (theta, proxy) = match detail {
            Detail::Theta(theta) => (theta, None),
            Detail::Error(metres) => {
                let error = metres / f64::from(self.metres);
                let cursor = stacks.cursor_for_error(error as f32);
                let theta = f64::from(cursor) / f64::from(stacks.position_count().max(1));
                (theta, self.proxy_for_error(error))
            }
        };
        LevelCursors { theta, own: stacks.cursor_for_theta(theta), proxy }
    }

    /// The cursor of the coarsest proxy with at most this error, in units of the mesh.
    fn proxy_for_error(&self, error: f64) -> Option<u32> {
        let proxies = self.proxies.as_ref()?;
        let within = proxies.partition_point(|proxy| proxy.error <= error);
        Some(FIRST_PROXY + within.checked_sub(1)? as u32)
    }
}

/// Kinds that are known, by what makes them.
#[derive(Default)]
pub(super) struct InstanceKinds {
    pub(super) all: Vec<InstanceKind>,
    known: HashMap<[u32; 4], u32>,
}

impl InstanceKinds {
    /// Returns the index of the kind with a key: model, mesh, policy, and bits of the scale.
    pub(super) fn index_of(&mut self, key: [u32; 4], kind: impl FnOnce() -> InstanceKind) -> u32 {
        *self.known.entry(key).or_insert_with(|| {
            self.all.push(kind());
            self.all.len() as u32 - 1
        })
    }
}
