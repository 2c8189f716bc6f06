//! Proxy meshes (HLOD): simplified meshes that stand for distant groups of equipment.
//!
//! A hundred substations then cost a hundred draws, not a hundred thousand. A group has proxies for
//! several errors, in which stochastic simplification
//! ([`CollapseStacks::simplified_stochastically`]) keeps few of many small islands. To the cursors,
//! the proxies of a group are groups within each other.

mod mean_materials;
mod mesh_proxies;

use std::collections::HashMap;
use std::sync::Arc;

use busbar_geometry::{CollapseSequence, CollapseStacks, MergePart, Mesh, merge};
use busbar_scene::{Material, MeshInstance, SceneGraph, Texture, max_scale_factor};
use glam::Mat4;
use rayon::prelude::*;

use self::mean_materials::Materials;
pub use self::mesh_proxies::{MeshProxies, MeshProxy};
use crate::instance_groups::{Group, find_groups, first_group_after};
use crate::theta_policy::{Detail, InstancePolicies, ThetaPolicy, ViewMetrics};

/// The most triangles that a proxy has for each mesh instance that it stands for: where
/// there are more, what an instance costs by itself is little beside them.
const MAX_TRIANGLES_PER_INSTANCE: u64 = 176;
/// The most that all proxies of a scene have together: some 100 MB.
const MAX_PROXY_TRIANGLES: u64 = 1 << 20;
/// The most levels of the policy that a group has proxies for, and one within another, which
/// is drawn as one with that before it is much farther away.
const MAX_LEVELS: usize = 12;
const MAX_INNER_LEVELS: usize = 8;
/// Largest share of the previous proxy's triangles that the next one may have.
const GREATEST_SHARE: f64 = 0.7;
/// Islands that show less than a square with a side of so many errors are thinned out: where
/// an error may be half a pixel, two.
const ISLAND_ERRORS: f64 = 4.0;
/// Share of a proxy's error that collapses may take. Collapse errors are root mean squares; no
/// point deviates by more than twice as much.
const COLLAPSES_SHARE: f64 = 0.5;
/// A proxy of no more triangles is the last.
const FEWEST_TRIANGLES: u64 = 64;

/// A group that can be drawn as one mesh, its proxy.
#[derive(Clone, Debug)]
pub struct HlodGroup {
    /// Shared by all of its proxies.
    pub group: Arc<Group>,
    /// Index of the first group after those within this one, counted once a proxy.
    pub after: u32,
    /// Index of the proxy, a model with one mesh in the group's own space.
    pub model: usize,
    /// Geometric error of the proxy, metres.
    pub base_error: f64,
    /// Policy of all instances with levels of detail.
    pub policy: Arc<ThetaPolicy>,
}

/// Proxy meshes of groups and of single meshes.
#[derive(Default)]
pub struct Proxies {
    /// Groups of instances, one entry for each proxy, outer groups first.
    pub groups: Vec<HlodGroup>,
    /// Proxies of repeated meshes.
    pub of_meshes: MeshProxies,
}

/// Meshes of a model with their appearance, from which proxies are made.
#[derive(Clone, Copy, Debug)]
pub struct SourceModel<'a> {
    /// Collapse stacks of the meshes.
    pub stacks: &'a [Arc<CollapseStacks>],
    /// Materials of the meshes' sections.
    pub materials: &'a [Material],
    /// Textures of the materials.
    pub textures: &'a [Texture],
}

/// Model that consists of proxy meshes.
#[derive(Debug)]
pub struct ProxyModel {
    /// Meshes, whose stacks have no collapses.
    pub stacks: Vec<Arc<CollapseStacks>>,
    /// Materials of the meshes' sections, without textures.
    pub materials: Arc<[Material]>,
}

impl Proxies {
    /// Builds the proxies of the instances that follow the screen-space error, and the models
    /// that they are in. Their model indices continue those of `models`.
    pub fn build(
        graph: &SceneGraph,
        policies: &InstancePolicies,
        models: &[SourceModel<'_>],
    ) -> (Self, Vec<ProxyModel>) {
        let mut built = Vec::new();
        let groups = build_groups(graph, policies, models, &mut built);
        let of_meshes = mesh_proxies::build(graph, policies, models, &mut built);
        (Self { groups, of_meshes }, built)
    }
}

/// Finds groups, and makes their proxies.
fn build_groups(
    graph: &SceneGraph,
    policies: &InstancePolicies,
    models: &[SourceModel<'_>],
    proxy_models: &mut Vec<ProxyModel>,
) -> Vec<HlodGroup> {
    // A proxy goes down by one policy: the first such one.
    let follows = |policy: &&ThetaPolicy| matches!(policy, ThetaPolicy::ScreenError(_));
    let Some(policy) = graph.instances().map(|i| policies.for_instance(&i)).find(follows) else {
        return Vec::new();
    };
    let may = |other: &ThetaPolicy| other == policy || matches!(other, ThetaPolicy::Fixed(_));
    let groups = find_groups(graph, |instance| may(policies.for_instance(instance)));
    let mut kinds: Vec<u32> = groups.iter().map(|group| group.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let built: Vec<Vec<Proxy>> = kinds
        .par_iter()
        .map(|&kind| {
            let group = &groups[kind as usize];
            let is_inner = groups[..kind as usize].iter().any(|outer| outer.after > kind);
            let max_levels = if is_inner { MAX_INNER_LEVELS } else { MAX_LEVELS };
            Proxy::all_of(graph, group, (policy, max_levels), policies, models)
        })
        .collect();
    let mut left = MAX_PROXY_TRIANGLES;
    let mut proxies: HashMap<u32, Vec<(usize, f64)>> = HashMap::new();
    for (kind, built) in kinds.into_iter().zip(built) {
        for proxy in built.into_iter().rev() {
            let Some(rest) = left.checked_sub(proxy.triangles()) else { break };
            left = rest;
            let index = models.len() + proxy_models.len();
            proxies.entry(kind).or_default().push((index, proxy.error));
            proxy_models.push(proxy.into_model());
        }
    }
    order_groups(groups, &proxies, policy)
}

/// The groups that have proxies, once for each, the coarsest outermost.
fn order_groups(
    groups: Vec<Group>,
    proxies: &HashMap<u32, Vec<(usize, f64)>>,
    policy: &ThetaPolicy,
) -> Vec<HlodGroup> {
    let policy = Arc::new(policy.clone());
    let mut kept = Vec::new();
    for group in groups.into_iter().map(Arc::new) {
        kept.extend(proxies.get(&group.kind).into_iter().flatten().map(|&(model, base_error)| {
            let (group, policy) = (Arc::clone(&group), Arc::clone(&policy));
            HlodGroup { group, after: 0, model, base_error, policy }
        }));
    }
    let starts: Vec<u32> = kept.iter().map(|hlod| hlod.group.instances.start).collect();
    for HlodGroup { group, after, .. } in &mut kept {
        *after = first_group_after(&starts, group.instances.end);
    }
    kept
}

/// A proxy in the making.
struct Proxy {
    mesh: Mesh,
    materials: Arc<[Material]>,
    error: f64,
}

impl Proxy {
    /// The proxies of a group, the finest first; none where it has too many materials, or
    /// nothing is to be seen of it from afar.
    fn all_of(
        graph: &SceneGraph,
        group: &Group,
        (policy, max_levels): (&ThetaPolicy, usize),
        policies: &InstancePolicies,
        models: &[SourceModel<'_>],
    ) -> Vec<Self> {
        let group_from_world = group.world_from_group.inverse();
        let members: Vec<GroupMember<'_>> = group
            .instances
            .clone()
            .map(|index| {
                let instance = graph.instance(index as usize);
                let world_from_mesh = graph.world_from_mesh(&instance);
                let placed =
                    (group_from_world * world_from_mesh, max_scale_factor(&world_from_mesh));
                GroupMember::new(&instance, policies.for_instance(&instance), group, placed, models)
            })
            .collect();
        MergedGroup::merge(&members, policy)
            .map_or_else(Vec::new, |whole| whole.proxies(policy, max_levels))
    }

    fn triangles(&self) -> u64 {
        self.mesh.triangles.len() as u64
    }

    fn into_model(self) -> ProxyModel {
        ProxyModel { stacks: vec![Arc::new(uncollapsed(self.mesh))], materials: self.materials }
    }
}

/// A mesh that stays as it is.
fn uncollapsed(mesh: Mesh) -> CollapseStacks {
    let nothing_collapses = CollapseSequence::empty(mesh.positions.len() as u32);
    CollapseStacks::build(mesh, &nothing_collapses)
}

/// All meshes of a group, merged into one with a common collapse sequence.
struct MergedGroup {
    stacks: CollapseStacks,
    materials: Vec<Material>,
    /// The level at which it was put together.
    level: u32,
}

impl MergedGroup {
    fn merge(members: &[GroupMember<'_>], policy: &ThetaPolicy) -> Option<Self> {
        let (level, error) = finest(members, policy)?;
        let mut materials = Materials::default();
        let of_sections: Vec<Vec<u32>> =
            members.iter().map(|member| materials.of_sections(member)).collect::<Option<_>>()?;
        let parts: Vec<MergePart<'_>> = members
            .iter()
            .zip(&of_sections)
            .map(|(member, materials)| member.part(error, materials))
            .collect();
        let (mesh, sequence) = merge(&parts, materials.merged.len() as u32).ok()?;
        let stacks = CollapseStacks::build(mesh, &sequence);
        Some(Self { stacks, materials: materials.merged, level })
    }

    /// Builds one proxy a level, where it has considerably fewer triangles than the one before.
    fn proxies(self, policy: &ThetaPolicy, max_levels: usize) -> Vec<Proxy> {
        let materials: Arc<[Material]> = self.materials.into();
        let mut proxies: Vec<Proxy> = Vec::new();
        let mut most_triangles = u64::MAX;
        for level in (self.level..).take(max_levels) {
            let Detail::Error(error) = policy.detail(level) else { break };
            let Some(mesh) = thinned(&self.stacks, error) else { break };
            let proxy = Proxy { mesh, materials: Arc::clone(&materials), error };
            let triangles = proxy.triangles();
            if triangles <= most_triangles {
                most_triangles = (triangles as f64 * GREATEST_SHARE) as u64;
                proxies.push(proxy);
            }
            if triangles <= FEWEST_TRIANGLES {
                break;
            }
        }
        proxies
    }
}

/// The mesh at an error of so many metres, few islands of it for many that are small beside
/// that.
fn thinned(stacks: &CollapseStacks, error: f64) -> Option<Mesh> {
    let (mesh, left) =
        stacks.baked_at_cursor(stacks.cursor_for_error((error * COLLAPSES_SHARE) as f32)).ok()?;
    let stacks = CollapseStacks::build(mesh, &left);
    let mesh = stacks.simplified_stochastically((ISLAND_ERRORS * error) as f32).ok()?;
    (!mesh.triangles.is_empty()).then_some(mesh)
}

/// A mesh instance of a group, in the group's space.
struct GroupMember<'a> {
    /// Index of its model, and the model.
    model: (u32, SourceModel<'a>),
    stacks: &'a CollapseStacks,
    /// Cursor of an instance with a fixed theta.
    fixed_cursor: Option<u32>,
    transform: Mat4,
    stretch: f32,
    /// Index of its node, and of its first feature, relative to the group's.
    feature: u32,
    first_feature: Option<u32>,
}

impl<'a> GroupMember<'a> {
    fn new(
        instance: &MeshInstance,
        policy: &ThetaPolicy,
        group: &Group,
        (transform, stretch): (Mat4, f32),
        models: &[SourceModel<'a>],
    ) -> Self {
        let model = models[instance.model.0 as usize];
        let stacks = &model.stacks[instance.mesh as usize];
        Self {
            model: (instance.model.0, model),
            stacks,
            fixed_cursor: match policy {
                ThetaPolicy::Fixed(theta) => Some(stacks.cursor_for_theta(*theta)),
                _ => None,
            },
            transform,
            stretch,
            feature: instance.node.0 - group.nodes.start,
            first_feature: instance.first_feature.map(|first| first.0 - group.nodes.start),
        }
    }

    fn cursor_for_error(&self, metres: f64) -> u32 {
        let own = metres * COLLAPSES_SHARE / f64::from(self.stretch);
        let within = || self.stacks.cursor_for_error(own as f32);
        self.fixed_cursor.unwrap_or_else(within)
    }

    fn part<'b>(&'b self, base_error: f64, materials: &'b [u32]) -> MergePart<'b> {
        MergePart {
            stacks: self.stacks,
            cursors: self.cursor_for_error(base_error)
                ..self.fixed_cursor.unwrap_or(self.stacks.collapse_count()),
            transform: self.transform,
            stretch: self.stretch,
            materials,
            first_feature: self.first_feature,
            feature: self.feature,
        }
    }
}

/// The policy's finest level, and its error, at which the members have few enough
/// triangles and yet some.
fn finest(members: &[GroupMember<'_>], policy: &ThetaPolicy) -> Option<(u32, f64)> {
    let max_triangles = members.len() as u64 * MAX_TRIANGLES_PER_INSTANCE;
    // Many members show the same mesh at the same size.
    let mut counted: HashMap<(*const CollapseStacks, u32), u64> = HashMap::new();
    let coarsest =
        policy.level(ViewMetrics { distance: f32::MAX, meters_per_pixel: f32::MAX }, None);
    for level in 0..=coarsest {
        let Detail::Error(metres) = policy.detail(level) else { return None };
        let triangles: u64 = members
            .iter()
            .map(|member| {
                let (stacks, cursor) = (member.stacks, member.cursor_for_error(metres));
                let live = || stacks.live_triangles(cursor);
                *counted.entry((std::ptr::from_ref(stacks), cursor)).or_insert_with(live)
            })
            .sum();
        if triangles <= max_triangles {
            return (triangles > 0).then_some((level, metres));
        }
    }
    None
}
