//! Ambient occlusion: contact is darker, by the depth of the picture.

use busbar_gpu::{BindGroup, BindGroupLayout, Blend, Format, Gpu, GpuError, Pipeline, Recorder};
use busbar_shaders::OCCLUSION;

use crate::layer::{Layer, ready};
use crate::recipe::screen_pipeline;
use crate::targets::SceneTargets;

/// Share of the sky that is seen, and distance to the eye's plane.
const SEEN_FORMAT: Format = Format::Rg16Float;

/// Works out and applies it.
pub(crate) struct Occlusion {
    work_out: Pipeline,
    apply: Pipeline,
}

impl Occlusion {
    pub(crate) fn new(
        gpu: &Gpu,
        frame: &BindGroupLayout,
        texture: &BindGroupLayout,
    ) -> Result<Self, GpuError> {
        let [work_out, apply] = [
            (c"occlusion_main", (SEEN_FORMAT, Blend::Replace), &[frame, texture][..]),
            (
                c"apply_main",
                (gpu.picture_format(), Blend::Multiply),
                &[frame, texture, texture][..],
            ),
        ]
        .map(|(entry, target, groups)| {
            screen_pipeline(gpu, ("occlusion", OCCLUSION, entry), groups, target)
        });
        Ok(Self { work_out: work_out?, apply: apply? })
    }

    /// Darkens the picture where what it shows is in contact. Its depth is drawn.
    pub(crate) fn record(
        &self,
        recorder: &mut Recorder<'_>,
        targets: &mut SceneTargets,
        texture: &BindGroupLayout,
        frame_group: &BindGroup,
    ) -> Result<(), GpuError> {
        // At half the resolution: it is smooth anyway.
        let size = targets.size().map(|pixels| pixels.div_ceil(2));
        let name = ("seen sky", SEEN_FORMAT);
        ready(&mut targets.seen_sky, || Layer::new(recorder.gpu(), texture, name, size))?;
        let (Some(depth), Some(seen)) = (targets.depth(), &targets.seen_sky) else {
            return Ok(());
        };
        recorder.sample(&[&depth.image]);
        let groups = [frame_group, &depth.group];
        recorder.screen_pass(&seen.image, false, &self.work_out, &groups)?;
        recorder.sample(&[&seen.image]);
        let groups = [frame_group, &depth.group, &seen.group];
        recorder.screen_pass(&targets.picture, true, &self.apply, &groups)
    }
}
