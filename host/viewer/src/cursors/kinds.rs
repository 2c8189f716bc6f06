//! What instances show: a mesh, or proxies that stand for it.

use std::collections::HashMap;
use std::sync::Arc;

use busbar_geometry::CollapseStacks;
use busbar_scene::{Detail, ThetaPolicy};

use super::Place;
use crate::load::{LoadedModel, MeshProxy};

/// The first cursor that is none of the mesh: from here on its proxies are numbered.
pub(super) const FIRST_PROXY: u32 = 1 << 31;

/// A mesh as instances show it.
pub(super) struct Kind {
    pub(super) model: u32,
    pub(super) mesh: u32,
    /// Index of its policy.
    pub(super) policy: u32,
    /// Metres to a unit of the mesh, at most.
    pub(super) metres: f32,
    /// Of the mesh, the finest first.
    pub(super) proxies: Option<Arc<[MeshProxy]>>,
    /// By level of the policy, once it was asked for: many instances come to the same.
    pub(super) standings: Vec<Option<Standing>>,
}

/// Where instances are wanted at a level of the policy.
#[derive(Clone, Copy)]
pub(super) struct Standing {
    pub(super) theta: f64,
    /// The mesh's own cursor there.
    pub(super) own: u32,
    /// That of the proxy which may stand for it.
    pub(super) proxy: Option<u32>,
}

impl Kind {
    pub(super) fn at(&self, cursor: u32) -> Place {
        let proxy = cursor.checked_sub(FIRST_PROXY).zip(self.proxies.as_ref());
        match proxy.and_then(|(index, proxies)| proxies.get(index as usize)) {
            Some(&MeshProxy { model, mesh, .. }) => {
                Place { model: model as usize, mesh: mesh as usize, cursor: 0 }
            }
            None => Place { model: self.model as usize, mesh: self.mesh as usize, cursor },
        }
    }

    pub(super) fn standing_at(
        &mut self,
        level: u32,
        policies: &[ThetaPolicy],
        models: &[LoadedModel],
    ) -> Standing {
        let known = self.standings.get(level as usize).copied().flatten();
        known.unwrap_or_else(|| {
            let standing = self.find_standing(policies[self.policy as usize].detail(level), models);
            let levels = self.standings.len().max(level as usize + 1);
            self.standings.resize(levels, None);
            self.standings[level as usize] = Some(standing);
            standing
        })
    }

    fn find_standing(&self, detail: Detail, models: &[LoadedModel]) -> Standing {
        let stacks = self.stacks(models);
        let (theta, proxy) = match detail {
            Detail::Theta(theta) => (theta, None),
            Detail::Error(metres) => {
                let error = metres / f64::from(self.metres);
                let cursor = stacks.cursor_for_error(error as f32);
                let theta = f64::from(cursor) / f64::from(stacks.position_count().max(1));
                (theta, self.proxy_within(error))
            }
        };
        Standing { theta, own: stacks.cursor_for_theta(theta), proxy }
    }

    /// The cursor of the coarsest proxy with at most this error, in units of the mesh.
    fn proxy_within(&self, error: f64) -> Option<u32> {
        let proxies = self.proxies.as_ref()?;
        let within = proxies.partition_point(|proxy| proxy.error <= error);
        Some(FIRST_PROXY + within.checked_sub(1)? as u32)
    }

    pub(super) fn stacks<'a>(&self, models: &'a [LoadedModel]) -> &'a CollapseStacks {
        &models[self.model as usize].stacks[self.mesh as usize]
    }
}

/// Kinds that are known, by what makes them.
#[derive(Default)]
pub(super) struct Kinds {
    pub(super) all: Vec<Kind>,
    known: HashMap<[u32; 4], u32>,
}

impl Kinds {
    pub(super) fn number(&mut self, kind: Kind) -> u32 {
        let Kind { model, mesh, policy, metres, .. } = kind;
        *self.known.entry([model, mesh, policy, metres.to_bits()]).or_insert_with(|| {
            self.all.push(kind);
            self.all.len() as u32 - 1
        })
    }
}
