//! Models and all they are drawn with; records frames and picks.

use std::time::Instant;

use busbar_gpu::{Gpu, MAX_FRAMES_IN_FLIGHT, Recorder, Viewport};

use crate::batch::Plan;
use crate::features::FeatureKit;
use crate::index_cache::{IndexCache, MAX_CACHED_INDEX_BYTES};
use crate::material::MaterialKit;
use crate::model::GpuModel;
use crate::pick::PickTargets;
use crate::pipelines::{Layouts, Pipelines};
use crate::scene_pass::{SceneDrawer, Sections};
use crate::stream::FrameStream;
use crate::targets::{SceneTargets, whole};
use crate::{Frame, FrameStats, RenderError};

/// The stream of picks, after those of the frames in flight.
const PICK_STREAM: usize = MAX_FRAMES_IN_FLIGHT;

/// All that is drawn and what it is drawn with.
pub(crate) struct Content {
    pub(crate) models: Vec<Option<GpuModel>>,
    pub(crate) cache: IndexCache,
    pub(crate) kit: MaterialKit,
    pub(crate) feature_kit: FeatureKit,
    layouts: Layouts,
    pipelines: Pipelines,
    streams: Vec<FrameStream>,
}

impl Content {
    pub(crate) fn new(gpu: &mut Gpu, samples: u32) -> Result<Self, RenderError> {
        let layouts = Layouts::new(gpu)?;
        let pipelines = Pipelines::new(gpu, &layouts, gpu.picture_format(), samples)?;
        let streams = (0..=PICK_STREAM)
            .map(|_| FrameStream::new(gpu, &layouts.frame))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            models: Vec::new(),
            cache: IndexCache::new(MAX_CACHED_INDEX_BYTES),
            kit: MaterialKit::new(gpu, layouts.material.clone())?,
            feature_kit: FeatureKit::new(gpu, layouts.features.clone())?,
            layouts,
            pipelines,
            streams,
        })
    }

    /// Puts the frame in order, writes it for the GPU and resolves meshes at
    /// cursors that are new.
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        stream: usize,
        frame: &Frame<'_>,
    ) -> Result<Plan, RenderError> {
        let plan = Plan::of(&self.models, frame)?;
        let layout = &self.layouts.frame;
        self.streams[stream].write(
            recorder.gpu(),
            layout,
            &frame.camera,
            &plan.instances,
            &plan.feature_highlights,
        )?;
        for batch in &plan.batches {
            if let Some(model) = &self.models[batch.key.model as usize] {
                let stacks = &model.meshes[batch.key.mesh as usize].stacks;
                self.cache.require(recorder, batch.key, stacks)?;
            }
        }
        Ok(plan)
    }

    fn drawer<'a>(&'a self, plan: &'a Plan, stream: usize) -> SceneDrawer<'a> {
        SceneDrawer {
            models: &self.models,
            cache: &self.cache,
            plan,
            frame_group: &self.streams[stream].group,
            feature_kit: &self.feature_kit,
        }
    }

    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &SceneTargets,
        frame: &Frame<'_>,
    ) -> Result<FrameStats, RenderError> {
        let resolving = Instant::now();
        let stream = recorder.slot();
        let plan = self.prepare(recorder, stream, frame)?;
        let resolve_millis = millis_since(resolving);
        let drawer = self.drawer(&plan, stream);
        let pipelines = &self.pipelines;
        let mut pass =
            recorder.pass(&targets.cleared_to(frame.background), whole(targets.size()))?;
        let mut draw_calls = 0;
        if frame.wireframe {
            draw_calls += drawer.draw(&mut pass, &pipelines.wire_fill, Sections::All, false)?;
            if let Some(lines) = &pipelines.wire_lines {
                draw_calls += drawer.draw(&mut pass, lines, Sections::All, false)?;
            }
        } else {
            draw_calls += drawer.draw(&mut pass, &pipelines.opaque, Sections::Opaque, true)?;
            draw_calls += drawer.draw_blended(&mut pass, &pipelines.blended, frame.camera.eye)?;
        }
        Ok(FrameStats {
            triangles: drawer.triangles(),
            draw_calls,
            resolve_millis,
            ..FrameStats::default()
        })
    }

    pub(crate) fn record_pick(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &PickTargets,
        viewport: Viewport,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let plan = self.prepare(recorder, PICK_STREAM, frame)?;
        let drawer = self.drawer(&plan, PICK_STREAM);
        let mut pass = recorder.pass(&targets.cleared(), viewport)?;
        drawer.draw(&mut pass, &self.pipelines.pick, Sections::All, true)?;
        Ok(())
    }
}

pub(crate) fn millis_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
