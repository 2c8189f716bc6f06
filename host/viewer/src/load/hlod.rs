//! Hierarchical level of detail: groups of equipment that are drawn as one mesh where
//! they are far away. A hundred substations then cost a hundred draws, not a hundred
//! thousand.

use std::collections::HashMap;
use std::sync::Arc;

use busbar_geometry::{CollapseStacks, MergePart, merge};
use busbar_scene::{
    AlphaMode, Detail, Group, Material, MeshInstance, SceneGraph, Sight, Texture, ThetaPolicy,
    find_groups, first_after, greatest_stretch,
};
use glam::Mat4;
use rayon::prelude::*;

use super::LoadedModel;
use crate::color::linear_from_srgb;

/// The most triangles that a proxy has for each mesh instance that it stands for: where
/// there are more, what an instance costs by itself is little beside them.
const MAX_TRIANGLES_PER_INSTANCE: u64 = 128;
/// The most that all proxies of a scene have together: some 100 MB.
const MAX_PROXY_TRIANGLES: u64 = 1 << 20;
/// The most materials that a proxy may have: each is a draw call.
const MAX_PROXY_MATERIALS: usize = 64;

/// A group that can be drawn as one mesh, its proxy.
#[derive(Clone, Debug)]
pub(crate) struct HlodGroup {
    pub(crate) group: Group,
    /// Index of the proxy, a model with one mesh in the group's own space.
    pub(crate) model: usize,
    /// By how much the proxy differs at its finest from what it stands for, metres.
    pub(crate) base_error: f64,
    /// Of each of its instances that goes down.
    pub(crate) policy: ThetaPolicy,
}

/// Finds groups whose detail follows the error on the screen, and makes their proxies,
/// which come after the other models.
pub(super) fn build(
    graph: &SceneGraph,
    policies: &[ThetaPolicy],
    models: &mut Vec<LoadedModel>,
) -> Vec<HlodGroup> {
    // A proxy goes down by one policy: the first such one.
    let policies = Policies { placed: graph.policies(), of_models: policies };
    let follows = |policy: &&ThetaPolicy| matches!(policy, ThetaPolicy::ScreenError(_));
    let Some(policy) = graph.instances().iter().map(|i| policies.of(i)).find(follows) else {
        return Vec::new();
    };
    let may = |other: &ThetaPolicy| other == policy || matches!(other, ThetaPolicy::Fixed(_));
    let groups = find_groups(graph, |instance| may(policies.of(instance)));
    let mut kinds: Vec<u32> = groups.iter().map(|group| group.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let made: Vec<Option<Proxy>> = kinds
        .par_iter()
        .map(|&kind| Proxy::of(graph, &groups[kind as usize], policy, policies, models))
        .collect();
    let mut left = MAX_PROXY_TRIANGLES;
    let mut proxies = HashMap::new();
    for (kind, proxy) in kinds.into_iter().zip(made) {
        let Some(proxy) = proxy else { continue };
        let Some(rest) = left.checked_sub(proxy.triangles()) else { continue };
        left = rest;
        proxies.insert(kind, (models.len(), proxy.base_error));
        models.push(proxy.into_model());
    }
    keep(groups, &proxies, policy)
}

/// How the theta of mesh instances is chosen.
#[derive(Clone, Copy)]
struct Policies<'a> {
    /// Of placements, by the graph's index.
    placed: &'a [ThetaPolicy],
    /// Of models, where the placement has none.
    of_models: &'a [ThetaPolicy],
}

impl<'a> Policies<'a> {
    fn of(self, instance: &MeshInstance) -> &'a ThetaPolicy {
        match instance.theta {
            Some(theta) => &self.placed[theta.0 as usize],
            None => &self.of_models[instance.model.0 as usize],
        }
    }
}

/// The groups that have a proxy.
fn keep(
    groups: Vec<Group>,
    proxies: &HashMap<u32, (usize, f64)>,
    policy: &ThetaPolicy,
) -> Vec<HlodGroup> {
    let hlod = |group: Group| {
        let &(model, base_error) = proxies.get(&group.kind)?;
        Some(HlodGroup { group, model, base_error, policy: policy.clone() })
    };
    let mut kept: Vec<HlodGroup> = groups.into_iter().filter_map(hlod).collect();
    let starts: Vec<u32> = kept.iter().map(|hlod| hlod.group.instances.start).collect();
    for HlodGroup { group, .. } in &mut kept {
        group.after = first_after(&starts, group.instances.end);
    }
    kept
}

/// A proxy in the making.
struct Proxy {
    stacks: CollapseStacks,
    materials: Vec<Material>,
    base_error: f64,
}

impl Proxy {
    /// The proxy of a group; `None` where it has too many materials, or nothing is to
    /// be seen of it from afar.
    fn of(
        graph: &SceneGraph,
        group: &Group,
        policy: &ThetaPolicy,
        policies: Policies<'_>,
        models: &[LoadedModel],
    ) -> Option<Self> {
        let range = group.instances.start as usize..group.instances.end as usize;
        let instances = &graph.instances()[range];
        let group_from_world = group.world_from_group.inverse();
        let members: Vec<Member<'_>> = instances
            .iter()
            .map(|instance| {
                let world_from_mesh = graph.world_from_mesh(instance);
                let placed =
                    (group_from_world * world_from_mesh, greatest_stretch(&world_from_mesh));
                Member::of(instance, policies.of(instance), group, placed, models)
            })
            .collect();
        let base_error = base_error(&members, policy)?;
        let mut materials = Materials::default();
        let of_sections: Vec<Vec<u32>> =
            members.iter().map(|member| materials.of_sections(member)).collect::<Option<_>>()?;
        let parts: Vec<MergePart<'_>> = members
            .iter()
            .zip(&of_sections)
            .map(|(member, materials)| member.part(base_error, materials))
            .collect();
        let (mesh, sequence) = merge(&parts, materials.merged.len() as u32).ok()?;
        let stacks = CollapseStacks::build(mesh, &sequence);
        Some(Self { stacks, materials: materials.merged, base_error })
    }

    fn triangles(&self) -> u64 {
        self.stacks.mesh().triangles.len() as u64
    }

    fn into_model(self) -> LoadedModel {
        LoadedModel {
            name: String::new(),
            stacks: vec![Arc::new(self.stacks)],
            materials: self.materials.into(),
            ..LoadedModel::default()
        }
    }
}

/// A mesh instance of a group, in the group's space.
struct Member<'a> {
    model: &'a LoadedModel,
    stacks: &'a CollapseStacks,
    /// Where it stays from however far.
    held_at: Option<u32>,
    transform: Mat4,
    stretch: f32,
    /// Its node and its first feature's, counted from the group's.
    feature: u32,
    first_feature: Option<u32>,
}

impl<'a> Member<'a> {
    fn of(
        instance: &MeshInstance,
        policy: &ThetaPolicy,
        group: &Group,
        (transform, stretch): (Mat4, f32),
        models: &'a [LoadedModel],
    ) -> Self {
        let model = &models[instance.model.0 as usize];
        let stacks = &model.stacks[instance.mesh as usize];
        Self {
            model,
            stacks,
            held_at: match policy {
                ThetaPolicy::Fixed(theta) => Some(stacks.cursor_at(*theta)),
                _ => None,
            },
            transform,
            stretch,
            feature: instance.node.0 - group.nodes.start,
            first_feature: instance.first_feature.map(|first| first.0 - group.nodes.start),
        }
    }

    fn cursor_within(&self, metres: f64) -> u32 {
        let within = || self.stacks.cursor_within((metres / f64::from(self.stretch)) as f32);
        self.held_at.unwrap_or_else(within)
    }

    fn part<'b>(&'b self, base_error: f64, materials: &'b [u32]) -> MergePart<'b> {
        MergePart {
            stacks: self.stacks,
            cursors: self.cursor_within(base_error)
                ..self.held_at.unwrap_or(self.stacks.collapse_count()),
            transform: self.transform,
            stretch: self.stretch,
            materials,
            first_feature: self.first_feature,
            feature: self.feature,
        }
    }
}

/// The least error, of those of the policy's levels, at which the members have few
/// enough triangles and yet some.
fn base_error(members: &[Member<'_>], policy: &ThetaPolicy) -> Option<f64> {
    let max_triangles = members.len() as u64 * MAX_TRIANGLES_PER_INSTANCE;
    // Many members show the same mesh at the same size.
    let mut counted: HashMap<(*const CollapseStacks, u32), u64> = HashMap::new();
    let coarsest = policy.level(Sight { distance: f32::MAX, pixel: f32::MAX }, None);
    for level in 0..=coarsest {
        let Detail::Error(metres) = policy.detail(level) else { return None };
        let triangles: u64 = members
            .iter()
            .map(|member| {
                let (stacks, cursor) = (member.stacks, member.cursor_within(metres));
                let live = || stacks.live_triangles(cursor);
                *counted.entry((std::ptr::from_ref(stacks), cursor)).or_insert_with(live)
            })
            .sum();
        if triangles <= max_triangles {
            return (triangles > 0).then_some(metres);
        }
    }
    None
}

/// The materials of a proxy: those of its members, each once.
#[derive(Default)]
struct Materials {
    merged: Vec<Material>,
    /// By the models' addresses and their own numbers.
    known: HashMap<(*const LoadedModel, Option<u32>), u32>,
}

impl Materials {
    /// Of each section of a member's mesh; `None` where there are too many.
    fn of_sections(&mut self, member: &Member<'_>) -> Option<Vec<u32>> {
        let sections = member.stacks.mesh().sections.iter();
        sections.map(|section| self.of_section(member.model, section.material)).collect()
    }

    fn of_section(&mut self, model: &LoadedModel, material: Option<u32>) -> Option<u32> {
        let key = (std::ptr::from_ref(model), material);
        if let Some(&known) = self.known.get(&key) {
            return Some(known);
        }
        let own = material.and_then(|material| model.materials.get(material as usize));
        let far = own.map_or_else(Material::default, |own| seen_from_afar(own, &model.textures));
        let known = self.merged.iter().position(|merged| *merged == far);
        if known.is_none() && self.merged.len() >= MAX_PROXY_MATERIALS {
            return None;
        }
        let index = known.unwrap_or_else(|| {
            self.merged.push(far);
            self.merged.len() - 1
        });
        self.known.insert(key, index as u32);
        Some(index as u32)
    }
}

/// A material whose texture is less than a pixel: its mean colour.
fn seen_from_afar(material: &Material, textures: &[Texture]) -> Material {
    let texture = |reference: Option<busbar_scene::TextureRef>| {
        reference.and_then(|reference| textures.get(reference.texture as usize))
    };
    let [r, g, b, a] = texture(material.base_color_texture)
        .map_or([1.0; 4], |texture| mean(texture, linear_from_srgb));
    let color = material.base_color;
    let [_, green, blue, _] = texture(material.metallic_roughness_texture)
        .map_or([1.0; 4], |texture| mean(texture, share));
    let cuts = matches!(material.alpha, AlphaMode::Mask(_));
    Material {
        name: String::new(),
        base_color: [color[0] * r, color[1] * g, color[2] * b, color[3] * a],
        base_color_texture: None,
        metallic: material.metallic * blue,
        roughness: material.roughness * green,
        metallic_roughness_texture: None,
        // What is cut out in part would be there whole or not at all.
        alpha: if cuts && a < 1.0 { AlphaMode::Blend } else { material.alpha },
        ..material.clone()
    }
}

/// The mean of each channel: of colours as `decode` reads a byte, and of alpha.
fn mean(texture: &Texture, decode: fn(u8) -> f32) -> [f32; 4] {
    let values: [f64; 256] = std::array::from_fn(|byte| f64::from(decode(byte as u8)));
    let mut sums = [0.0_f64; 4];
    for &[r, g, b, a] in texture.rgba8.as_chunks::<4>().0 {
        for (sum, byte) in sums.iter_mut().zip([r, g, b]) {
            *sum += values[usize::from(byte)];
        }
        sums[3] += f64::from(share(a));
    }
    let pixels = (texture.rgba8.len() / 4).max(1) as f64;
    sums.map(|sum| (sum / pixels) as f32)
}

/// A byte as 0 to 1.
fn share(byte: u8) -> f32 {
    f32::from(byte) / 255.0
}
