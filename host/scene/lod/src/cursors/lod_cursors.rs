//! Cursors of all instances: construction, and the operator's and the program's settings.

use std::collections::BTreeSet;
use std::sync::Arc;

use busbar_geometry::CollapseStacks;
use busbar_scene::{MeshInstance, SceneGraph, max_scale_factor};

use super::active_morphs::{ActiveMorphs, MorphBudget};
use super::cursor_state::{EVERYWHERE, InstanceCursor, MeshCursor};
use super::group_state::HlodState;
use super::instance_kinds::{InstanceKind, InstanceKinds};
use super::reported_drawing::ReportedDrawing;
use crate::lod_camera::LodCamera;
use crate::proxies::Proxies;
use crate::theta_policy::{InstancePolicies, ThetaPolicy};

/// The cursors of all mesh instances of a scene, in the order of its graph.
pub struct LodCursors {
    /// The models', then those of placements.
    pub(super) policies: Vec<ThetaPolicy>,
    /// A theta for all instances of a model, instead of their policies.
    pub(super) manual_theta: Vec<Option<f64>>,
    pub(super) scale: f64,
    pub(super) kinds: Vec<InstanceKind>,
    /// The graph's, then those of the groups' proxies.
    pub(super) instances: Vec<InstanceCursor>,
    /// Number of instances of the graph.
    pub(super) own: usize,
    pub(super) groups: Vec<HlodState>,
    /// Camera of the last choice; none while all must be chosen again.
    pub(super) eye: Option<LodCamera>,
    /// Instances in full detail, whatever their policies say.
    pub(super) full_detail: BTreeSet<usize>,
    /// Instances that are elsewhere than proxies show them: their groups are not drawn as one.
    pub(super) displaced: BTreeSet<usize>,
    /// Instances that must be seen, which proxies may leave out: neither are their groups.
    pub(super) individual: BTreeSet<usize>,
    /// Factor on the screen errors that policies permit, at least 1.
    pub(super) coarseness: f32,
    /// Instances that are not at their wanted cursors, or are morphing.
    pub(super) moving: Vec<usize>,
    pub(super) morphs: ActiveMorphs,
    /// Instances shown at another cursor than in the last frame.
    pub(super) moved: Vec<usize>,
    pub(super) reported: ReportedDrawing,
    /// True once all instances were shown at their wanted cursors.
    pub(super) has_settled: bool,
    /// True if the counts by model are outdated.
    pub(super) has_changed: bool,
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

    pub(super) fn kind_of(&self, instance: &InstanceCursor) -> &InstanceKind {
        &self.kinds[instance.kind as usize]
    }

    pub(super) fn place(&self, instance: &InstanceCursor, cursor: u32) -> MeshCursor {
        self.kind_of(instance).at(cursor)
    }

    /// Returns the number of instances that are not at their wanted cursors.
    pub fn waiting_count(&self) -> usize {
        self.moving.len()
    }
}
