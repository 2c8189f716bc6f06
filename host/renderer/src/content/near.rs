//! The part of a frame that is drawn before the rest.

use std::time::Instant;

use busbar_gpu::{DepthAfter, DrawCount, Recorder, Targets};

use super::Content;
use crate::batch::{Part, Plan};
use crate::scene_pass::Sections;
use crate::targets::{SceneTargets, whole};
use crate::{Frame, RenderError};

/// What is near, drawn before the rest.
#[derive(Clone, Copy)]
pub(crate) struct Near {
    pub(super) calls: DrawCount,
    /// When the device had it, and when it was there.
    pub(crate) handed: Instant,
    pub(crate) there: Instant,
}

impl Content {
    /// Draws what is near before the rest, if the plan has it so, waits for it, and leaves out
    /// what it hides.
    pub(super) fn record_near(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &SceneTargets,
        frame: &Frame<'_>,
        plan: &mut Plan,
    ) -> Result<Option<Near>, RenderError> {
        let Some(depth) = targets.own_depth().filter(|_| plan.has_near) else {
            return Ok(None);
        };
        self.ready_gathering(recorder, (plan, Part::Near))?;
        let drawer = self.drawer((plan, Part::Near), recorder.slot(), frame);
        let cleared = targets.cleared_to(frame.background, self.pipelines.undecoded, false);
        let kept = Targets { depth_after: DepthAfter::Kept, ..cleared };
        let mut pass = recorder.pass(&kept, whole(targets.size()))?;
        let looks = self.pipelines.looks(false);
        let calls = drawer.draw(&mut pass, &looks.opaque, Sections::Opaque)?;
        drop(pass);
        self.drawn_depth.begin(&frame.camera, targets.size());
        plan.ask_of_rest(&self.models, &mut self.drawn_depth);
        self.drawn_depth.record(recorder, depth)?;
        recorder.end_stage("near");
        let handed = Instant::now();
        recorder.flush()?;
        let there = Instant::now();
        self.drawn_depth.read()?;
        plan.leave_hidden(&self.models, &self.drawn_depth);
        self.streams[recorder.slot()].write_instances(plan)?;
        Ok(Some(Near { calls, handed, there }))
    }
}
