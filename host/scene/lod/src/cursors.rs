//! Cursors: chooses the collapse cursor of each instance and tracks the cursor shown.
//!
//! Each frame chooses a level of detail for instances whose policy depends on the camera, and thus
//! their *wanted* cursors. The *shown* cursor follows once the mesh there is ready, by geomorphing.
//! Moving a cursor pops or pushes collapses (S1 and S2 of the paper); no mesh is edited. A distant
//! group is drawn as its proxy mesh, which has a cursor of its own, instead of its instances.

mod draw_changes;
mod geomorphing;
mod group_merging;
mod instance_kinds;

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_geometry::{Bounds, CollapseStacks};
use busbar_scene::{MeshInstance, SceneGraph, max_scale_factor};
use glam::Vec3;

use self::draw_changes::ReportedDrawing;
use self::geomorphing::{ActiveMorphs, NO_TRANSITION};
pub use self::geomorphing::{Morph, MorphBudget};
use self::group_merging::HlodState;
use self::instance_kinds::{FIRST_PROXY, InstanceKind, InstanceKinds, LevelCursors};
use crate::lod_camera::LodCamera;
use crate::proxies::Proxies;
use crate::theta_policy::{InstancePolicies, ThetaPolicy, ViewMetrics, distance_to_bounds};

/// Cursor of an instance that is not shown.
const NOT_SHOWN: u32 = u32::MAX;
/// The level where the past plays no part.
const NO_LEVEL: u32 = u32::MAX;

const EVERYWHERE: Bounds = Bounds { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };

/// The cursors of all mesh instances of a scene, in the order of its graph.
pub struct LodCursors {
    /// The models', then those of placements.
    policies: Vec<ThetaPolicy>,
    /// A theta for all instances of a model, instead of their policies.
    manual_theta: Vec<Option<f64>>,
    scale: f64,
    kinds: Vec<InstanceKind>,
    /// The graph's, then those of the groups' proxies.
    instances: Vec<InstanceCursor>,
    /// Number of instances of the graph.
    own: usize,
    groups: Vec<HlodState>,
    /// Camera of the last choice; none while all must be chosen again.
    eye: Option<LodCamera>,
    /// Instances in full detail, whatever their policies say.
    full_detail: BTreeSet<usize>,
    /// Instances that are elsewhere than proxies show them: their groups are not drawn as one.
    displaced: BTreeSet<usize>,
    /// Instances that must be seen, which proxies may leave out: neither are their groups.
    individual: BTreeSet<usize>,
    /// Factor on the screen errors that policies permit, at least 1.
    coarseness: f32,
    /// Instances that are not at their wanted cursors, or are morphing.
    moving: Vec<usize>,
    morphs: ActiveMorphs,
    /// Instances shown at another cursor than in the last frame.
    moved: Vec<usize>,
    reported: ReportedDrawing,
    /// True once all instances were shown at their wanted cursors.
    has_settled: bool,
    /// True if the counts by model are outdated.
    has_changed: bool,
}

/// Drawn item: an instance of the graph or a merged group, by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DrawItem {
    /// Mesh instance of the scene graph.
    Instance(usize),
    /// Merged group, drawn as its proxy.
    Group(usize),
}

/// A mesh at a cursor, by the indices of model and mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MeshCursor {
    /// Index of the model.
    pub model: usize,
    /// Index of the mesh in its model.
    pub mesh: usize,
    /// Number of collapses that are applied to the mesh.
    pub cursor: u32,
}

/// Resource that an instance needs before its cursor moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LodRequest {
    /// Mesh at the cursor.
    Mesh(MeshCursor),
    /// Morph data of the finer mesh, to or from this cursor.
    Morph(MeshCursor),
}

/// Cursor state of an instance; a site has a hundred thousand of them.
struct InstanceCursor {
    /// Index of its kind.
    kind: u32,
    /// Level of the policy, or [`NO_LEVEL`].
    level: u32,
    /// World bounds, cached for each frame; infinite for a mesh without vertices.
    bounds: Bounds,
    /// Theta that the policy wants.
    theta: f64,
    wanted: u32,
    /// Cursor shown; during a morph, that of the finer mesh.
    shown: u32,
    /// Index of the way that it is on.
    transition: u32,
    /// Live triangles where it is shown.
    triangles: u32,
}

/// Level of detail of a model, summed over its instances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelDetail {
    /// Least and greatest theta wanted.
    pub theta: [f64; 2],
    /// True if policies choose theta instead of the operator.
    pub by_policy: bool,
    /// Entries to be collapsed.
    pub s1: u64,
    /// Number of collapsed entries.
    pub s2: u64,
    /// Number of live triangles.
    pub triangles: u64,
}

impl InstanceCursor {
    /// Creates the state of an instance in full detail.
    fn new(kind: u32, bounds: Option<Bounds>, triangles: u32) -> Self {
        let (level, theta, transition) = (NO_LEVEL, 0.0, NO_TRANSITION);
        let bounds = bounds.unwrap_or(EVERYWHERE);
        Self { kind, level, bounds, theta, wanted: 0, shown: 0, transition, triangles }
    }

    fn level(&self) -> Option<u32> {
        (self.level != NO_LEVEL).then_some(self.level)
    }
}

impl LodCursors {
    /// Creates the cursors of all instances in full detail. `models` has the meshes of all models,
    /// the proxies' last.
    pub fn new(
        graph: &SceneGraph,
        models: &[&[Arc<CollapseStacks>]],
        policies: &InstancePolicies,
        Proxies { groups, of_meshes }: &Proxies,
        scale: f64,
        morph_budget: MorphBudget,
    ) -> Self {
        let mut kinds = InstanceKinds::default();
        let mut instances = Vec::with_capacity(graph.instances().len() + groups.len());
        instances.extend(graph.instances().map(|instance| {
            let MeshInstance { model, mesh, .. } = instance;
            let metres = max_scale_factor(&graph.world_from_mesh(&instance));
            let policy = policies.index_for(&instance);
            let kind = kinds.index_of([model.0, mesh, policy, metres.to_bits()], || InstanceKind {
                model: model.0,
                mesh,
                stacks: Arc::clone(&models[model.0 as usize][mesh as usize]),
                policy,
                metres,
                proxies: of_meshes.get(&(model.0, mesh)).cloned(),
                level_cursors: Vec::new(),
            });
            let triangles = kinds.all[kind as usize].stacks.mesh().triangles.len() as u32;
            InstanceCursor::new(kind, graph.bounds_of_mesh(&instance), triangles)
        }));
        let own = instances.len();
        let mut policies = policies.to_vec();
        // All go down by one policy.
        policies.extend(groups.first().map(|group| ThetaPolicy::clone(&group.policy)));
        let policy = policies.len().saturating_sub(1) as u32;
        instances.extend(groups.iter().map(|group| {
            // Its errors are in metres already.
            let (model, metres) = (group.model as u32, 1.0_f32);
            let kind = kinds.index_of([model, 0, policy, metres.to_bits()], || InstanceKind {
                model,
                mesh: 0,
                stacks: Arc::clone(&models[group.model][0]),
                policy,
                metres,
                proxies: None,
                level_cursors: Vec::new(),
            });
            InstanceCursor::for_proxy(kind, group)
        }));
        Self {
            groups: HlodState::all(groups, graph),
            own,
            policies,
            manual_theta: vec![None; models.len()],
            scale,
            kinds: kinds.all,
            instances,
            eye: None,
            full_detail: BTreeSet::new(),
            displaced: BTreeSet::new(),
            individual: BTreeSet::new(),
            coarseness: 1.0,
            moving: Vec::new(),
            morphs: ActiveMorphs::new(morph_budget),
            moved: Vec::new(),
            reported: ReportedDrawing::nothing(),
            has_settled: false,
            has_changed: true,
        }
    }

    /// Inherits manual thetas and scales from the cursors of a previous scene. With the same
    /// instances, the sets of full-detail, displaced and individual ones are inherited, too.
    /// `model_before` returns the previous index of a model.
    pub fn inherit(
        &mut self,
        before: &Self,
        same_instances: bool,
        model_before: impl Fn(usize) -> Option<usize>,
    ) {
        for (model, manual_theta) in self.manual_theta.iter_mut().enumerate() {
            let was = model_before(model).and_then(|model| before.manual_theta.get(model));
            *manual_theta = was.copied().flatten();
        }
        (self.scale, self.coarseness) = (before.scale, before.coarseness);
        if same_instances {
            (self.full_detail, self.displaced) =
                (before.full_detail.clone(), before.displaced.clone());
            self.individual.clone_from(&before.individual);
        }
    }

    /// Gives all instances of a model this theta, whatever their policies and
    /// the scale say; `None` gives them back to their policies.
    pub fn set_manual_theta(&mut self, model: usize, theta: Option<f64>) {
        if let Some(manual_theta) = self.manual_theta.get_mut(model) {
            *manual_theta = theta.map(|theta| theta.clamp(0.0, 1.0));
            self.eye = None;
        }
    }

    /// Sets the factor on the thetas of all policies.
    pub fn set_scale(&mut self, scale: f64) {
        self.scale = scale;
        self.eye = None;
    }

    /// Lets the errors that policies bound show so many times over.
    pub fn set_coarseness(&mut self, coarseness: f32) {
        if self.coarseness != coarseness {
            self.coarseness = coarseness;
            self.eye = None;
        }
    }

    /// Shows these instances of the graph, by their indices, in full detail.
    pub fn set_full_detail(&mut self, instances: BTreeSet<usize>) {
        if self.full_detail != instances {
            self.full_detail = instances;
            self.eye = None;
        }
    }

    /// Shows these instances of the graph, by their indices, whatever else is shown as one.
    pub fn set_individual(&mut self, instances: BTreeSet<usize>) {
        if self.individual != instances {
            self.individual = instances;
            self.eye = None;
        }
    }

    /// Updates the bounds of moved instances, and the set of those that proxies would show at a
    /// wrong place.
    pub fn move_instances(
        &mut self,
        graph: &SceneGraph,
        moved: &[usize],
        displaced: &BTreeSet<usize>,
    ) {
        for &index in moved {
            let bounds = graph.bounds_of_mesh(&graph.instance(index));
            self.instances[index].bounds = bounds.unwrap_or(EVERYWHERE);
        }
        if self.displaced != *displaced {
            self.displaced.clone_from(displaced);
            self.eye = None;
        }
    }

    /// Returns the factor on the thetas of all policies.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Chooses the wanted cursors. Nothing is computed while the camera rests. With `settle`,
    /// groups are merged or split at once.
    pub fn choose_levels(&mut self, eye: LodCamera, settle: bool) {
        let settle = settle || !self.has_settled;
        let last = self.eye.replace(eye);
        if last == Some(eye) && !(settle && self.has_groups_to_change()) {
            return;
        }
        let forced = last.is_none();
        self.has_changed |= forced;
        let (mut index, mut group) = (0, 0);
        // Instances up to here are in a group that is drawn as one still.
        let mut covered = 0;
        while index < self.own {
            match self.groups.get(group).map(|state| (state.instances.clone(), state.after)) {
                Some((instances, after)) if instances.start == index => {
                    self.choose_group(group, eye, settle || index < covered);
                    if self.groups[group].stays_merged() {
                        (index, group) = (instances.end, after);
                    } else {
                        if self.groups[group].is_merged {
                            covered = covered.max(instances.end);
                        }
                        group += 1;
                    }
                }
                _ => {
                    self.choose_instance(index, eye, forced);
                    index += 1;
                }
            }
        }
    }

    fn choose_instance(&mut self, index: usize, eye: LodCamera, forced: bool) {
        let InstanceCursor { kind, shown, .. } = self.instances[index];
        let &InstanceKind { model, policy, .. } = &self.kinds[kind as usize];
        let forced = forced || shown == NOT_SHOWN;
        let pinned = self.full_detail.contains(&index).then_some(0.0);
        if let Some(theta) = pinned.or(self.manual_theta[model as usize]) {
            if forced {
                self.instances[index].level = NO_LEVEL;
                self.request_theta(index, theta);
            }
        } else if forced || self.policies[policy as usize].follows_camera() {
            let level = self.level_of(index, eye);
            if forced || self.instances[index].level != level {
                self.take_level(index, level);
            }
        }
    }

    /// The level of an instance by its policy.
    fn level_of(&self, index: usize, eye: LodCamera) -> u32 {
        let instance = &self.instances[index];
        let policy = self.kind_of(instance).policy;
        let distance = distance_to_bounds(eye.position, &instance.bounds);
        let pixel = eye.pixel_at(&instance.bounds, distance) * self.coarseness;
        self.policies[policy as usize]
            .level(ViewMetrics { distance, meters_per_pixel: pixel }, instance.level())
    }

    fn take_level(&mut self, index: usize, level: u32) {
        let instance = &mut self.instances[index];
        instance.level = level;
        let kind = &mut self.kinds[instance.kind as usize];
        let LevelCursors { theta, own, proxy } = kind.cursors_at_level(level, &self.policies);
        if self.scale == 1.0 {
            // A proxy may leave out what must be seen.
            let proxy = proxy.filter(|_| !self.individual.contains(&index));
            self.request_cursor(index, theta, proxy.unwrap_or(own));
        } else {
            self.request_theta(index, (theta * self.scale).clamp(0.0, 1.0));
        }
    }

    fn request_theta(&mut self, index: usize, theta: f64) {
        let cursor = self.kind_of(&self.instances[index]).stacks.cursor_for_theta(theta);
        self.request_cursor(index, theta, cursor);
    }

    /// Wants a theta, which is at this cursor.
    fn request_cursor(&mut self, index: usize, theta: f64, cursor: u32) {
        let instance = &mut self.instances[index];
        let is_as_before = theta == instance.theta && cursor == instance.wanted;
        if is_as_before && instance.shown != NOT_SHOWN {
            return;
        }
        let was_moving = instance.wanted != instance.shown || instance.transition != NO_TRANSITION;
        (instance.theta, instance.wanted) = (theta, cursor);
        self.has_changed = true;
        if !was_moving && instance.wanted != instance.shown {
            self.moving.push(index);
        }
    }

    /// Moves instances to their wanted cursors, or starts their morphs, where the required meshes
    /// are ready. With `settle`, and at the first call, all move at once. `now` is the frame's
    /// time, seconds.
    pub fn advance(&mut self, settle: bool, now: f64, is_ready: impl Fn(LodRequest) -> bool) {
        let settle = settle || !self.has_settled;
        self.has_settled = true;
        self.end_morphs(now, settle);
        let mut moving = std::mem::take(&mut self.moving);
        moving.retain(|&index| self.advance_instance(index, settle, &is_ready));
        self.moving = moving;
        self.has_changed |= !self.moved.is_empty();
        self.change_groups();
        self.note_morphing();
    }

    /// Advances an instance if possible; reports whether it has yet to arrive.
    fn advance_instance(
        &mut self,
        index: usize,
        settle: bool,
        is_ready: impl Fn(LodRequest) -> bool,
    ) -> bool {
        let instance = &self.instances[index];
        // It may have come back meanwhile.
        if instance.transition != NO_TRANSITION || instance.wanted == instance.shown {
            return instance.transition != NO_TRANSITION;
        }
        if !settle && !is_ready(LodRequest::Mesh(self.place(instance, instance.wanted))) {
            return true;
        }
        if settle || !self.morphs(instance) {
            self.show(index, instance.wanted);
            return false;
        }
        if is_ready(self.morph_request(instance)) {
            self.begin_morph(index);
        }
        true
    }

    fn kind_of(&self, instance: &InstanceCursor) -> &InstanceKind {
        &self.kinds[instance.kind as usize]
    }

    fn place(&self, instance: &InstanceCursor, cursor: u32) -> MeshCursor {
        self.kind_of(instance).at(cursor)
    }

    /// Returns the number of instances that are not at their wanted cursors.
    pub fn waiting_count(&self) -> usize {
        self.moving.len()
    }

    /// Returns the resources that instances wait for, with repetitions.
    pub fn waiting(&self) -> impl Iterator<Item = LodRequest> {
        let cursors = self.moving.iter().map(|&index| &self.instances[index]);
        cursors.filter(|instance| instance.transition == NO_TRANSITION).flat_map(|instance| {
            let transition = self.morphs(instance).then(|| self.morph_request(instance));
            [LodRequest::Mesh(self.place(instance, instance.wanted))].into_iter().chain(transition)
        })
    }

    /// Notes the live triangles of instances that moved, once they are drawn.
    pub fn count_moved(&mut self, triangles_at: impl Fn(MeshCursor) -> Option<u32>) {
        let Self { kinds, instances, moved, .. } = self;
        // A frame of a minimised window draws nothing.
        moved.retain(|&index| {
            let instance = &mut instances[index];
            if instance.shown == NOT_SHOWN {
                return false;
            }
            let triangles = triangles_at(kinds[instance.kind as usize].at(instance.shown));
            instance.triangles = triangles.unwrap_or(instance.triangles);
            triangles.is_none()
        });
    }

    /// Returns the detail of each model if it has changed since the last call.
    pub fn changed_detail(&mut self) -> Option<Vec<ModelDetail>> {
        if !std::mem::take(&mut self.has_changed) {
            return None;
        }
        let mut details: Vec<Option<ModelDetail>> = vec![None; self.manual_theta.len()];
        self.walk(0..self.own, 0, &mut |_, index| {
            let instance = &self.instances[index];
            let kind = self.kind_of(instance);
            let detail = details[kind.model as usize].get_or_insert(ModelDetail {
                theta: [instance.theta; 2],
                ..ModelDetail::default()
            });
            let [least, greatest] = detail.theta;
            detail.theta = [least.min(instance.theta), greatest.max(instance.theta)];
            let stacks = &kind.stacks;
            let is_own = instance.shown < FIRST_PROXY;
            let cursor =
                if is_own { instance.shown } else { stacks.cursor_for_theta(instance.theta) };
            detail.s1 += u64::from(stacks.collapse_count() - cursor);
            detail.s2 += u64::from(cursor);
            detail.triangles += u64::from(instance.triangles);
        });
        let with_source = |(detail, manual_theta): (Option<ModelDetail>, &Option<f64>)| {
            ModelDetail { by_policy: manual_theta.is_none(), ..detail.unwrap_or_default() }
        };
        Some(details.into_iter().zip(&self.manual_theta).map(with_source).collect())
    }
}

#[cfg(test)]
mod group_merging_tests;
#[cfg(test)]
mod tests;
