//! Proxies of single meshes that are shown often.
//!
//! A mesh goes down by its own collapses, and those leave a lattice hundreds of triangles
//! wherever it is ([`busbar_geometry::CollapseStacks::thinned`]). From some error on, what is
//! left is thinned out as the proxies of groups are, once for all that show the mesh.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use busbar_geometry::{CollapseStacks, Mesh};
use busbar_scene::{Detail, SceneGraph, Sight, ThetaPolicy};
use rayon::prelude::*;

use super::materials::Materials;
use super::{GREATEST_SHARE, ISLAND_ERRORS, LoadedModel, Policies, uncollapsed};

/// The fewest instances of a mesh that are worth its proxies.
const MIN_INSTANCES: usize = 2;
/// The most proxies of a mesh.
const MAX_LEVELS: usize = 8;
/// The most triangles that all of a scene have together: some 25 MB.
const MAX_TRIANGLES: u64 = 1 << 18;
/// By how much what a proxy shows may differ from what the mesh does, as a share. In a group
/// others stand for what is left out; here nothing does.
const MAX_DIFFERENCE: f32 = 0.1;

/// What a mesh is shown as from some error on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshProxy {
    /// Index of the model that it is in, and its own in there.
    pub(crate) model: u32,
    pub(crate) mesh: u32,
    /// In units of the mesh that it stands for.
    pub(crate) error: f64,
}

/// The proxies of meshes, by the indices of model and mesh, the finest first.
pub(crate) type MeshProxies = HashMap<(u32, u32), Arc<[MeshProxy]>>;

/// Makes the proxies of all meshes that are worth it; those of a model become one that comes
/// after the other models.
pub(super) fn build(
    graph: &SceneGraph,
    policies: Policies<'_>,
    models: &mut Vec<LoadedModel>,
) -> MeshProxies {
    let mut shown: BTreeMap<(u32, u32), (usize, &ThetaPolicy)> = BTreeMap::new();
    for instance in graph.instances() {
        let policy = policies.of(&instance);
        if matches!(policy, ThetaPolicy::ScreenError(_)) {
            shown.entry((instance.model.0, instance.mesh)).or_insert((0, policy)).0 += 1;
        }
    }
    shown.retain(|_, (count, _)| *count >= MIN_INSTANCES);
    let shown: Vec<_> = shown.into_iter().collect();
    let mut made_of: BTreeMap<u32, Vec<(u32, Vec<(Mesh, f64)>)>> = BTreeMap::new();
    let of_meshes: Vec<_> = shown
        .into_par_iter()
        .map(|((model, mesh), (_, policy))| {
            let stacks = &models[model as usize].stacks[mesh as usize];
            (model, (mesh, all_of(stacks, policy)))
        })
        .collect();
    of_meshes.into_iter().for_each(|(model, made)| made_of.entry(model).or_default().push(made));
    let mut left = MAX_TRIANGLES;
    let mut proxies = MeshProxies::new();
    for (model, of_meshes) in made_of {
        let mut whole = ProxyModel::default();
        for (mesh, made) in of_meshes {
            let taken = whole.take(&models[model as usize], made, models.len(), &mut left);
            if !taken.is_empty() {
                proxies.insert((model, mesh), taken.into());
            }
        }
        if !whole.meshes.is_empty() {
            models.push(whole.into_model());
        }
    }
    proxies
}

/// The proxies of a mesh, the finest first, each with its error.
fn all_of(stacks: &CollapseStacks, policy: &ThetaPolicy) -> Vec<(Mesh, f64)> {
    let shown = area_of(stacks.mesh());
    let mut made: Vec<(Mesh, f64)> = Vec::new();
    let coarsest = policy.level(Sight { distance: f32::MAX, pixel: f32::MAX }, None);
    for level in 1..=coarsest {
        let Detail::Error(error) = policy.detail(level) else { break };
        let own = stacks.live_triangles(stacks.cursor_within(error as f32));
        let least = made.last().map_or(own, |(finer, _)| own.min(finer.triangles.len() as u64));
        let most = least as f64 * GREATEST_SHARE;
        if most < 1.0 || made.len() == MAX_LEVELS {
            break;
        }
        let squares = f64::from(shown) / (ISLAND_ERRORS * error).powi(2);
        if squares > most {
            // Each triangle shows something.
            continue;
        }
        let mesh = thinned(stacks, error).filter(|mesh| mesh.triangles.len() as f64 <= most);
        made.extend(mesh.map(|mesh| (mesh, error)));
    }
    made
}

/// The mesh at an error in its own units, thinned out; `None` where it would show more or less
/// for it.
fn thinned(stacks: &CollapseStacks, error: f64) -> Option<Mesh> {
    let (mesh, left) = stacks.from_cursor(stacks.cursor_within(error as f32)).ok()?;
    let shown = area_of(&mesh);
    let thinned = CollapseStacks::build(mesh, &left).thinned((ISLAND_ERRORS * error) as f32).ok()?;
    ((area_of(&thinned) - shown).abs() <= MAX_DIFFERENCE * shown).then_some(thinned)
}

/// Of its surface: a quarter, as what an eye somewhere sees in the mean.
fn area_of(mesh: &Mesh) -> f32 {
    let area = |&triangle: &[u32; 3]| {
        let [a, b, c] =
            mesh.corner_positions(triangle).map(|position| mesh.positions[position as usize]);
        (b - a).cross(c - a).length() * 0.5
    };
    0.25 * mesh.triangles.iter().map(area).sum::<f32>()
}

/// The proxies of the meshes of a model, in the making.
#[derive(Default)]
struct ProxyModel {
    meshes: Vec<Mesh>,
    materials: Materials,
}

impl ProxyModel {
    /// Takes those of a mesh in, as many as there is room for, the coarsest first; it will have
    /// this index.
    fn take(
        &mut self,
        model: &LoadedModel,
        made: Vec<(Mesh, f64)>,
        index: usize,
        left: &mut u64,
    ) -> Vec<MeshProxy> {
        let mut taken = Vec::new();
        for (mut mesh, error) in made.into_iter().rev() {
            let of_sections = mesh.sections.iter();
            let materials: Option<Vec<u32>> = of_sections
                .map(|section| self.materials.of_section(model, section.material))
                .collect();
            let rest = left.checked_sub(mesh.triangles.len() as u64);
            let (Some(materials), Some(rest)) = (materials, rest) else { break };
            for (section, material) in mesh.sections.iter_mut().zip(materials) {
                section.material = Some(material);
            }
            *left = rest;
            taken.push(MeshProxy { model: index as u32, mesh: self.meshes.len() as u32, error });
            self.meshes.push(mesh);
        }
        taken.reverse();
        taken
    }

    fn into_model(self) -> LoadedModel {
        let stacks = self.meshes.into_iter().map(|mesh| Arc::new(uncollapsed(mesh)));
        LoadedModel {
            stacks: stacks.collect(),
            materials: self.materials.merged.into(),
            ..LoadedModel::default()
        }
    }
}
