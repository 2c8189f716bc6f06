//! Ambient occlusion in screen space: contacts are darkened by the depth of the picture.

use busbar_gpu::{BindGroup, BindGroupLayout, Blend, Format, Gpu, GpuError, Pipeline, Recorder};
use busbar_shaders::AMBIENT_OCCLUSION;

use crate::layer::{Layer, get_or_create};
use crate::pipeline_description::screen_pipeline;
use crate::targets::SceneTargets;

/// Share of the sky that is seen, and distance to the eye's plane.
const SEEN_FORMAT: Format = Format::Rg16Float;

/// Works out and applies it.
pub(crate) struct AmbientOcclusion {
    estimate: Pipeline,
    apply: Pipeline,
}

impl AmbientOcclusion {
    pub(crate) fn new(
        gpu: &Gpu,
        frame: &BindGroupLayout,
        texture: &BindGroupLayout,
    ) -> Result<Self, GpuError> {
        let [estimate, apply] = [
            (c"ambient_occlusion_main", (SEEN_FORMAT, Blend::Replace), &[frame, texture][..]),
            (
                c"apply_main",
                (gpu.picture_format(), Blend::Multiply),
                &[frame, texture, texture][..],
            ),
        ]
        .map(|(entry, target, groups)| {
            screen_pipeline(gpu, ("ambient occlusion", AMBIENT_OCCLUSION, entry), groups, target)
        });
        Ok(Self { estimate: estimate?, apply: apply? })
    }

    /// Darkens contacts in the picture. Its depth must be drawn.
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
        get_or_create(&mut targets.sky_visibility, || {
            Layer::new(recorder.gpu(), texture, name, size)
        })?;
        let (Some(depth), Some(seen)) = (targets.depth(), &targets.sky_visibility) else {
            return Ok(());
        };
        recorder.prepare_sampling(&[&depth.image]);
        let groups = [frame_group, &depth.group];
        recorder.fullscreen_pass(&seen.image, false, &self.estimate, &groups)?;
        recorder.prepare_sampling(&[&seen.image]);
        let groups = [frame_group, &depth.group, &seen.group];
        recorder.fullscreen_pass(&targets.picture, true, &self.apply, &groups)
    }
}
