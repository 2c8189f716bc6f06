//! First pass of two-pass occlusion culling: near instances and their depth.

use std::time::Instant;

use busbar_gpu::{DepthStore, DrawCount, Recorder, RenderTargets};

use super::SceneResources;
use crate::draw_plan::{DrawPhase, DrawPlan};
use crate::scene_pass::Sections;
use crate::targets::{SceneTargets, full_viewport};
use crate::{Frame, RenderError};

/// Result of the first pass of two-pass occlusion culling.
#[derive(Clone, Copy)]
pub(crate) struct FirstPass {
    pub(super) calls: DrawCount,
    /// Times when the device got the pass, and when it was finished.
    pub(crate) handed: Instant,
    pub(crate) there: Instant,
}

impl SceneResources {
    /// Draws the first phase, if the plan has one, waits for its depth, and removes occluded
    /// instances of the second phase.
    pub(super) fn record_first_pass(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &SceneTargets,
        frame: &Frame<'_>,
        plan: &mut DrawPlan,
    ) -> Result<Option<FirstPass>, RenderError> {
        let Some(depth) = targets.single_sample_depth().filter(|_| plan.has_first_phase) else {
            return Ok(None);
        };
        self.reserve_culled_indices(recorder, (plan, DrawPhase::First))?;
        let drawer = self.drawer((plan, DrawPhase::First), recorder.slot(), frame);
        let cleared = targets.cleared(frame.background, self.pipelines.undecoded, false);
        let kept = RenderTargets { depth_store: DepthStore::Store, ..cleared };
        let mut pass = recorder.pass(&kept, full_viewport(targets.size()))?;
        let mesh_pipelines = self.pipelines.mesh_pipelines(false);
        let calls = drawer.draw(&mut pass, &mesh_pipelines.opaque, Sections::Opaque)?;
        drop(pass);
        self.first_pass_depth.begin(&frame.camera, targets.size());
        plan.add_occlusion_queries(&self.models, &mut self.first_pass_depth);
        self.first_pass_depth.record(recorder, depth)?;
        recorder.end_stage("near");
        let handed = Instant::now();
        recorder.flush()?;
        let there = Instant::now();
        self.first_pass_depth.read_back()?;
        plan.remove_occluded(&self.models, &self.first_pass_depth);
        self.streams[recorder.slot()].write_instances(plan)?;
        Ok(Some(FirstPass { calls, handed, there }))
    }
}
