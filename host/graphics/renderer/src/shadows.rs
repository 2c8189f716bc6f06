//! Shadow map of the sun, redrawn only when its contents changed.

use busbar_gpu::{
    BindGroupLayout, Binding, Format, Gpu, Image, ImageDescription, ImageKind,
    MAX_FRAMES_IN_FLIGHT, Recorder, Sampler, Viewport,
};
use glam::Mat4;

use crate::batch::DrawPhase;
use crate::draw_reduction::NoReduction;
use crate::frame_buffers::FrameBuffers;
use crate::instance_buckets::InstanceBuckets;
use crate::instance_culling::{CullView, VisibleInstances};
use crate::model::GpuModel;
use crate::morph::Morpher;
use crate::pipelines::PipelineVariants;
use crate::scene_pass::{SceneDrawer, Sections};
use crate::sun_view::{MAP_TEXELS, SunView};
use crate::{Frame, InstanceSource, ModelHandle, RenderError, SectionPlane};

/// Data that decides the shadow of an instance.
#[derive(Clone, Copy, PartialEq)]
struct ShadowCaster {
    model: ModelHandle,
    mesh: u32,
    cursor: u32,
    world_from_mesh: Mat4,
}

/// Contents of the shadow map.
#[derive(Default)]
struct ShadowMapState {
    /// Revision of the retained list that casters come from, if any.
    revision: Option<u64>,
    sun: Option<SunView>,
    section: Option<SectionPlane>,
    casters: Vec<ShadowCaster>,
}

/// Shadow map with its buffers and draw plan.
pub(crate) struct Shadows {
    map: Image,
    sampler: Sampler,
    streams: Vec<FrameBuffers>,
    buckets: InstanceBuckets,
    plan: VisibleInstances,
    shown: Option<ShadowMapState>,
}

impl Shadows {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        let map = Image::new(
            gpu,
            ImageDescription {
                name: "shadow map",
                kind: ImageKind::SampledTarget,
                format: Format::Depth32,
                size: [MAP_TEXELS; 2],
            },
        )?;
        let (sampler, buckets) = (Sampler::with_depth_comparison(gpu)?, InstanceBuckets::default());
        Ok(Self {
            map,
            sampler,
            streams: Vec::new(),
            buckets,
            plan: VisibleInstances::default(),
            shown: None,
        })
    }

    /// Returns the bindings of the shadow map and its sampler.
    pub(crate) fn bindings(&self) -> [Binding<'_>; 2] {
        [Binding::Texture(&self.map), Binding::Sampler(&self.sampler)]
    }

    /// Invalidates the contents of the map.
    pub(crate) fn invalidate(&mut self) {
        self.shown = None;
        self.buckets.invalidate();
    }

    /// Reports whether the map must be drawn for this frame, and records its next contents.
    fn is_outdated(&mut self, frame: &Frame<'_>, sun: Option<SunView>) -> bool {
        let revision = match frame.instances {
            InstanceSource::Listed(_) => None,
            InstanceSource::Retained(list) => Some(list.revision()),
        };
        let casters = || {
            frame.instances.iter().map(|drawn| ShadowCaster {
                model: drawn.model,
                mesh: drawn.mesh,
                cursor: drawn.cursor,
                world_from_mesh: drawn.world_from_mesh,
            })
        };
        if let Some(shown) = &self.shown
            && (shown.sun, shown.section) == (sun, frame.section)
            && (revision.is_some() && shown.revision == revision
                || casters().eq(shown.casters.iter().copied()))
        {
            return false;
        }
        let mut shown = self.shown.take().unwrap_or_default();
        (shown.sun, shown.section, shown.revision) = (sun, frame.section, revision);
        shown.casters.clear();
        shown.casters.extend(casters());
        self.shown = Some(shown);
        true
    }

    /// Draws the map if its contents are outdated, and prepares it for sampling. Returns whether it
    /// was drawn. The frame's meshes are resolved.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        layout: &BindGroupLayout,
        shading: &PipelineVariants,
        inputs: MeshPassInputs<'_>,
        frame: &Frame<'_>,
        sun: Option<SunView>,
    ) -> Result<bool, RenderError> {
        let is_outdated = self.is_outdated(frame, sun);
        if is_outdated {
            self.draw(recorder, layout, shading, inputs, frame)?;
        }
        recorder.prepare_sampling(&[&self.map]);
        Ok(is_outdated)
    }

    fn draw(
        &mut self,
        recorder: &mut Recorder<'_>,
        layout: &BindGroupLayout,
        shading: &PipelineVariants,
        inputs: MeshPassInputs<'_>,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let Some(sun) = self.shown.as_ref().and_then(|shown| shown.sun) else {
            // Nothing shades anything.
            drop(recorder.depth_pass(&self.map)?);
            return Ok(());
        };
        while self.streams.len() < MAX_FRAMES_IN_FLIGHT {
            self.streams.push(FrameBuffers::new(recorder.gpu(), layout, &self.bindings())?);
        }
        let seen = Frame { camera: sun.camera, ..*frame };
        let view = CullView::new(&sun.camera.clip_from_world(), None);
        self.buckets.update(inputs.models, frame.instances)?;
        self.plan.fill(inputs.models, &self.buckets, &[], &view)?;
        let slot = recorder.slot();
        let size = [MAP_TEXELS as f32; 2];
        let bindings = [Binding::Texture(&self.map), Binding::Sampler(&self.sampler)];
        let stream = &mut self.streams[slot];
        let viewport = Viewport { origin: [0.0; 2], size };
        let uniform = crate::uniform::frame_uniform(&seen, viewport, None);
        stream.write(recorder.gpu(), (layout, &bindings), &uniform, &self.plan)?;
        let drawer = SceneDrawer {
            models: inputs.models,
            cache: inputs.cache,
            plan: &self.plan,
            frame_group: &stream.group,
            instances: &stream.instances,
            feature_resources: inputs.feature_resources,
            // Else it would be drawn anew each frame of a change.
            morpher: None,
            phase: DrawPhase::Second,
            more: None,
            reduction: &NoReduction,
            shows_backs: true,
        };
        let mut pass = recorder.depth_pass(&self.map)?;
        drawer.draw(&mut pass, shading, Sections::Opaque)?;
        Ok(())
    }
}

/// Scene data that a separate pass over the meshes needs.
#[derive(Clone, Copy)]
pub(crate) struct MeshPassInputs<'a> {
    pub(crate) models: &'a [Option<GpuModel>],
    pub(crate) cache: &'a crate::index_cache::IndexCache,
    pub(crate) feature_resources: &'a crate::features::FeatureResources,
    pub(crate) morpher: &'a Morpher,
}
