//! Proxies of single meshes that are shown often.
//!
//! Edge collapses leave a lattice with hundreds of triangles at any distance. A mesh that is small
//! in the picture is therefore simplified stochastically
//! ([`CollapseStacks::simplified_stochastically`]), once for all its instances.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use busbar_geometry::{CollapseStacks, Mesh};
use busbar_scene::SceneGraph;
use rayon::prelude::*;

use super::mean_materials::Materials;
use super::{GREATEST_SHARE, ISLAND_ERRORS, ProxyModel, SourceModel, uncollapsed};
use crate::theta_policy::{Detail, InstancePolicies, ThetaPolicy, ViewMetrics};

/// The fewest instances of a mesh that are worth its proxies.
const MIN_INSTANCES: usize = 2;
/// The most proxies of a mesh.
const MAX_LEVELS: usize = 8;
/// The most triangles that all of a scene have together: some 12 MB.
const MAX_TRIANGLES: u64 = 1 << 17;
/// Largest radius of a mesh shown as a proxy, in errors. Half a pixel of error gives 24 pixels; a
/// larger mesh would visibly change its shape.
const MAX_RADIUS: f64 = 48.0;
/// Largest relative difference in projected area between proxy and mesh.
const MAX_DIFFERENCE: f32 = 0.1;

/// Proxy of a mesh from a certain error on.
#[derive(Clone, Copy, Debug)]
pub struct MeshProxy {
    /// Index of the model that the proxy is in.
    pub model: u32,
    /// Index of the proxy mesh in that model.
    pub mesh: u32,
    /// Error in units of the original mesh.
    pub error: f64,
}

/// Proxy mesh with its error.
type ProxyMesh = (Mesh, f64);

/// The proxies of meshes, by the indices of model and mesh, the finest first.
pub type MeshProxies = HashMap<(u32, u32), Arc<[MeshProxy]>>;

/// Makes the proxies of all meshes that are worth it; those of a model become one that comes
/// after the other models.
pub(super) fn build(
    graph: &SceneGraph,
    policies: &InstancePolicies,
    models: &[SourceModel<'_>],
    proxy_models: &mut Vec<ProxyModel>,
) -> MeshProxies {
    let mut shown: BTreeMap<(u32, u32), (usize, &ThetaPolicy)> = BTreeMap::new();
    for instance in graph.instances() {
        let policy = policies.for_instance(&instance);
        if matches!(policy, ThetaPolicy::ScreenError(_)) {
            shown.entry((instance.model.0, instance.mesh)).or_insert((0, policy)).0 += 1;
        }
    }
    shown.retain(|_, (count, _)| *count >= MIN_INSTANCES);
    let shown: Vec<_> = shown.into_iter().collect();
    let mut of_meshes: Vec<((u32, u32), Vec<ProxyMesh>)> = shown
        .into_par_iter()
        .map(|(of, (_, policy))| {
            let (model, mesh) = of;
            (of, all_of(&models[model as usize].stacks[mesh as usize], policy))
        })
        .collect();
    let mut left = MAX_TRIANGLES;
    let mut proxies = MeshProxies::new();
    for of_model in of_meshes.chunk_by_mut(|((one, _), _), ((next, _), _)| one == next) {
        let mut whole = MeshProxyBuilder::default();
        for (of, built) in of_model {
            let (built, index) = (std::mem::take(built), models.len() + proxy_models.len());
            let source = (of.0, models[of.0 as usize]);
            let taken = whole.take(source, built, index, &mut left);
            if !taken.is_empty() {
                proxies.insert(*of, taken.into());
            }
        }
        if !whole.meshes.is_empty() {
            proxy_models.push(whole.into_model());
        }
    }
    proxies
}

/// Builds the proxies of a mesh, the finest first, each with its error. Slender meshes have none:
/// they are widened below a pixel.
fn all_of(stacks: &CollapseStacks, policy: &ThetaPolicy) -> Vec<ProxyMesh> {
    let Some(bounds) = stacks.mesh().bounds().filter(|_| stacks.slender_points().is_empty()) else {
        return Vec::new();
    };
    let least_error = f64::from(bounds.radius()) / MAX_RADIUS;
    let shown = area_of(stacks.mesh());
    let mut built: Vec<ProxyMesh> = Vec::new();
    let coarsest =
        policy.level(ViewMetrics { distance: f32::MAX, meters_per_pixel: f32::MAX }, None);
    for level in 1..=coarsest {
        let Detail::Error(error) = policy.detail(level) else { break };
        let own = stacks.live_triangles(stacks.cursor_for_error(error as f32));
        let least = built.last().map_or(own, |(finer, _)| own.min(finer.triangles.len() as u64));
        let most = least as f64 * GREATEST_SHARE;
        if most < 1.0 || built.len() == MAX_LEVELS {
            break;
        }
        let squares = f64::from(shown) / (ISLAND_ERRORS * error).powi(2);
        if squares > most || error < least_error {
            // It is large in the picture, or each triangle shows something.
            continue;
        }
        let mesh = thinned(stacks, error).filter(|mesh| mesh.triangles.len() as f64 <= most);
        built.extend(mesh.map(|mesh| (mesh, error)));
    }
    built
}

/// The mesh at an error in its own units, thinned out; `None` where it would show more or less
/// for it.
fn thinned(stacks: &CollapseStacks, error: f64) -> Option<Mesh> {
    let (mesh, left) = stacks.baked_at_cursor(stacks.cursor_for_error(error as f32)).ok()?;
    let shown = area_of(&mesh);
    let thinned = CollapseStacks::build(mesh, &left)
        .simplified_stochastically((ISLAND_ERRORS * error) as f32)
        .ok()?;
    ((area_of(&thinned) - shown).abs() <= MAX_DIFFERENCE * shown).then_some(thinned)
}

/// Returns the mean projected area of a mesh: a quarter of its surface.
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
struct MeshProxyBuilder {
    meshes: Vec<Mesh>,
    materials: Materials,
}

impl MeshProxyBuilder {
    /// Takes those of a mesh in, as many as there is room for, the coarsest first; it will have
    /// this index.
    fn take(
        &mut self,
        source: (u32, SourceModel<'_>),
        built: Vec<ProxyMesh>,
        index: usize,
        left: &mut u64,
    ) -> Vec<MeshProxy> {
        let mut taken = Vec::new();
        for (mut mesh, error) in built.into_iter().rev() {
            let of_sections = mesh.sections.iter();
            let materials: Option<Vec<u32>> = of_sections
                .map(|section| self.materials.of_section(source, section.material))
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

    fn into_model(self) -> ProxyModel {
        let stacks = self.meshes.into_iter().map(|mesh| Arc::new(uncollapsed(mesh)));
        ProxyModel { stacks: stacks.collect(), materials: self.materials.merged.into() }
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{CollapseSequence, RawPrimitive, weld};
    use busbar_scene::{
        Material, Model, ModelIndex, ModelNode, Placement, TextureRef, Transform, Wrap,
    };
    use glam::{DMat4, DVec3, Vec3};

    use super::*;
    use crate::screen_error::ScreenError;

    fn policy() -> ThetaPolicy {
        ThetaPolicy::ScreenError(ScreenError::new(0.5, 0.1))
    }

    /// A rack of bars of a metre, a centimetre wide, without collapses: none goes away by them.
    fn rack(bars: u32) -> Mesh {
        let mut rack = RawPrimitive { material: Some(1), ..RawPrimitive::default() };
        for bar in 0..bars {
            let first = rack.positions.len() as u32;
            let corner = |corner: u32| {
                let [x, y, z] = [0, 1, 2].map(|axis| (corner >> axis & 1) as f32);
                Vec3::new(x, 0.01 * y, 0.01 * z) + Vec3::Y * (0.05 * bar as f32)
            };
            rack.positions.extend((0..8).map(corner));
            let sides = [
                [1, 3, 7, 5],
                [0, 4, 6, 2],
                [2, 6, 7, 3],
                [0, 1, 5, 4],
                [4, 5, 7, 6],
                [0, 2, 3, 1],
            ];
            rack.triangles.extend(sides.iter().flat_map(|&[a, b, c, d]| {
                [[a, b, c], [a, c, d]].map(|triangle| triangle.map(|corner: u32| first + corner))
            }));
        }
        weld(&[rack]).unwrap().0
    }

    /// A model without textures.
    fn source(model: &ProxyModel) -> SourceModel<'_> {
        SourceModel { stacks: &model.stacks, materials: &model.materials, textures: &[] }
    }

    /// A rack so often in a row, and its model.
    fn racks(count: usize, policy: ThetaPolicy) -> (MeshProxies, Vec<ProxyModel>) {
        let node = ModelNode {
            name: "rack".into(),
            parent: None,
            parent_from_node: DMat4::IDENTITY,
            mesh: Some(0),
        };
        let model = Model { meshes: vec![rack(40)], nodes: vec![node], ..Model::default() };
        let placement = |number: usize| Placement {
            id: number.to_string(),
            parent: None,
            transform: Transform { translation: DVec3::X * number as f64, ..Transform::default() },
            model: Some(ModelIndex(0)),
            theta: None,
        };
        let placements: Vec<_> = (0..count).map(placement).collect();
        let graph = SceneGraph::build(&placements, std::slice::from_ref(&model)).unwrap();
        let mesh = rack(40);
        let none = CollapseSequence::empty(mesh.positions.len() as u32);
        let material = Material {
            base_color: [0.5, 0.25, 1.0, 1.0],
            base_color_texture: Some(TextureRef { texture: 0, wrap: [Wrap::Repeat; 2] }),
            ..Default::default()
        };
        let mut models = vec![ProxyModel {
            stacks: vec![Arc::new(CollapseStacks::build(mesh, &none))],
            materials: vec![Material::default(), material].into(),
        }];
        let mut built = Vec::new();
        let policies = InstancePolicies { of_models: vec![policy], of_placements: [].into() };
        let proxies = build(&graph, &policies, &[source(&models[0])], &mut built);
        models.extend(built);
        (proxies, models)
    }

    #[test]
    fn each_proxy_of_a_repeated_mesh_has_far_fewer_triangles_and_the_same_surface() {
        let (proxies, models) = racks(2, policy());
        let of_rack = &proxies[&(0, 0)];
        assert!(!of_rack.is_empty());
        let own = models[0].stacks[0].mesh();
        let (mut triangles, mut error) = (own.triangles.len(), 0.0);
        for proxy in of_rack.iter() {
            let mesh = models[proxy.model as usize].stacks[proxy.mesh as usize].mesh();
            assert!(mesh.triangles.len() as f64 <= triangles as f64 * GREATEST_SHARE);
            assert!(proxy.error > error && proxy.error * MAX_RADIUS >= 1.0);
            let surface = area_of(mesh) / area_of(own);
            assert!((surface - 1.0).abs() <= MAX_DIFFERENCE, "{surface}");
            (triangles, error) = (mesh.triangles.len(), proxy.error);
        }
        // With the colours of the model, seen from afar.
        let of_proxy = &models[of_rack[0].model as usize];
        assert_eq!(of_proxy.materials.len(), 1, "the mesh has no other");
        let material = &of_proxy.materials[0];
        assert_eq!(
            (material.base_color[..3].to_vec(), &material.base_color_texture),
            (vec![0.5, 0.25, 1.0], &None)
        );
    }

    #[test]
    fn single_instances_and_other_policies_have_no_proxies() {
        for (proxies, models) in [racks(1, policy()), racks(9, ThetaPolicy::Fixed(0.5))] {
            assert!(proxies.is_empty());
            assert_eq!(models.len(), 1);
        }
    }

    #[test]
    fn proxies_beyond_the_memory_limit_are_left_out_finest_first() {
        let built =
            all_of(&CollapseStacks::build(rack(40), &CollapseSequence::empty(320)), &policy());
        let coarsest = built.last().unwrap().0.triangles.len() as u64;
        let mut left = coarsest + 1;
        let model = SourceModel { stacks: &[], materials: &[], textures: &[] };
        let error = built.last().unwrap().1;
        let taken = MeshProxyBuilder::default().take((0, model), built, 7, &mut left);
        assert_eq!(
            taken.iter().map(|proxy| (proxy.model, proxy.error)).collect::<Vec<_>>(),
            [(7, error)]
        );
        assert_eq!(left, 1);
    }
}
