//! Models and all they are drawn with; records frames and picks.

use std::sync::Arc;
use std::time::Instant;

use busbar_geometry::CollapseStacks;
use busbar_gpu::{Gpu, MAX_FRAMES_IN_FLIGHT, Recorder};
use rayon::prelude::*;

use crate::batch::Plan;
use crate::features::FeatureKit;
use crate::frustum::Frustum;
use crate::ground::GroundKit;
use crate::index_cache::{IndexCache, IndexKey, MAX_CACHED_INDEX_BYTES};
use crate::material::MaterialKit;
use crate::model::GpuModel;
use crate::pick::{PickTargets, PixelArea};
use crate::pipelines::{Layouts, Pipelines};
use crate::resolver::{ResolvedTriangles, Resolver};
use crate::scene_pass::{SceneDrawer, Sections};
use crate::stream::FrameStream;
use crate::targets::{SceneTargets, whole};
use crate::{Frame, FrameStats, MeshAtCursor, Quality, RenderError};

/// Bytes of index buffers, resolved beside the frames, that one frame uploads;
/// one buffer always, so that each arrives.
pub const MAX_UPLOAD_BYTES_PER_FRAME: u64 = 4 << 20;

/// What an upload costs besides its bytes, in bytes.
const UPLOAD_OVERHEAD_BYTES: u64 = 32 << 10;

/// Meshes that are resolved at once, before they are uploaded, where a frame
/// cannot do without them.
const MAX_RESOLVED_AT_ONCE: usize = 32;

/// The stream of picks, after those of the frames in flight.
const PICK_STREAM: usize = MAX_FRAMES_IN_FLIGHT;

/// All that is drawn and what it is drawn with.
pub(crate) struct Content {
    pub(crate) models: Vec<Option<GpuModel>>,
    pub(crate) cache: IndexCache,
    pub(crate) resolver: Resolver,
    pub(crate) kit: MaterialKit,
    pub(crate) feature_kit: FeatureKit,
    ground: GroundKit,
    layouts: Layouts,
    pipelines: Pipelines,
    streams: Vec<FrameStream>,
    /// One a stream, kept for its room.
    plans: Vec<Plan>,
}

impl Content {
    pub(crate) fn new(gpu: &mut Gpu, quality: Quality, samples: u32) -> Result<Self, RenderError> {
        let layouts = Layouts::new(gpu)?;
        let pipelines = Pipelines::new(gpu, &layouts, quality, samples)?;
        let streams = (0..=PICK_STREAM)
            .map(|_| FrameStream::new(gpu, &layouts.frame))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            models: Vec::new(),
            cache: IndexCache::new(MAX_CACHED_INDEX_BYTES),
            resolver: Resolver::new()?,
            kit: MaterialKit::new(gpu, layouts.material.clone())?,
            feature_kit: FeatureKit::new(gpu, layouts.features.clone())?,
            ground: GroundKit::new(gpu)?,
            layouts,
            pipelines,
            plans: (0..=PICK_STREAM).map(|_| Plan::default()).collect(),
            streams,
        })
    }

    /// Forgets all models and what was made of them.
    pub(crate) fn clear(&mut self) {
        self.models.clear();
        self.cache.drop_all();
        self.resolver.drop_where(|_| true);
    }

    /// Asks for meshes at cursors, to be resolved beside the frames.
    pub(crate) fn request(&mut self, wanted: impl Iterator<Item = MeshAtCursor>) {
        let (models, cache) = (&self.models, &self.cache);
        let found = wanted.filter_map(|at| find(models, &at));
        self.resolver.request(found.filter(|(key, _)| cache.get(*key).is_none()));
    }

    /// Uploads what was resolved beside the frames, as much as a frame may.
    fn upload_resolved(&mut self, recorder: &mut Recorder<'_>) -> Result<(), RenderError> {
        let mut left = u64::MAX;
        while let Some((key, resolved)) = self.resolver.take(left) {
            // The first always fits.
            left = left.min(MAX_UPLOAD_BYTES_PER_FRAME);
            left = left.saturating_sub(resolved.bytes() + UPLOAD_OVERHEAD_BYTES);
            if self.cache.get(key).is_none() {
                self.cache.insert(recorder, key, &resolved)?;
            }
        }
        Ok(())
    }

    /// Resolves what the frame cannot do without, on all cores.
    fn resolve_missing(
        &mut self,
        recorder: &mut Recorder<'_>,
        plan: &Plan,
    ) -> Result<(), RenderError> {
        let mut missing = Vec::new();
        for batch in &plan.batches {
            let is_new = missing.last().is_none_or(|(key, _)| *key != batch.key);
            if let (true, None, Some(model)) =
                (is_new, self.cache.get(batch.key), &self.models[batch.key.model as usize])
            {
                missing.push((batch.key, &model.meshes[batch.key.mesh as usize].stacks));
            }
        }
        for some in missing.chunks(MAX_RESOLVED_AT_ONCE) {
            let resolve = |&(key, stacks): &(IndexKey, &Arc<CollapseStacks>)| {
                (key, ResolvedTriangles::of(stacks, key.cursor))
            };
            let resolved: Vec<_> = some.par_iter().map(resolve).collect();
            for (key, resolved) in resolved {
                self.cache.insert(recorder, key, &resolved)?;
                self.cache.touch(key)?;
            }
        }
        Ok(())
    }

    /// Puts the frame in order, writes it for the GPU and resolves what is
    /// missing.
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        stream: usize,
        frame: &Frame<'_>,
        area: &PixelArea,
    ) -> Result<Plan, RenderError> {
        let _span = tracing::debug_span!("prepare").entered();
        let mut plan = std::mem::take(&mut self.plans[stream]);
        let seen = area.clip_from_picture() * frame.camera.clip_from_world();
        plan.fill(&self.models, frame, &Frustum::of(&seen))?;
        let layout = &self.layouts.frame;
        self.streams[stream].write(
            recorder.gpu(),
            layout,
            (frame, area.picture),
            &plan.instances,
            &plan.feature_highlights,
        )?;
        self.resolve_missing(recorder, &plan)?;
        for batch in &plan.batches {
            self.cache.touch(batch.key)?;
        }
        Ok(plan)
    }

    fn drawer<'a>(&'a self, plan: &'a Plan, stream: usize) -> SceneDrawer<'a> {
        SceneDrawer {
            models: &self.models,
            cache: &self.cache,
            plan,
            frame_group: &self.streams[stream].group,
            instances: &self.streams[stream].instances,
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
        self.upload_resolved(recorder)?;
        let plan = self.prepare(recorder, stream, frame, &PixelArea::whole(targets.size()))?;
        recorder.end_stage("upload");
        let resolve_millis = millis_since(resolving);
        let _span = tracing::debug_span!("scene").entered();
        let drawer = self.drawer(&plan, stream);
        let pipelines = &self.pipelines;
        let undecoded = pipelines.undecoded && !frame.wireframe;
        let cleared = targets.cleared_to(frame.background, undecoded);
        let mut pass = recorder.pass(&cleared, whole(targets.size()))?;
        let mut draw_calls = 0;
        if frame.wireframe {
            draw_calls += drawer.draw(&mut pass, &pipelines.wire_fill, Sections::All)?;
            if let Some(lines) = &pipelines.wire_lines {
                draw_calls += drawer.draw(&mut pass, lines, Sections::All)?;
            }
        } else {
            draw_calls += drawer.draw(&mut pass, &pipelines.opaque, Sections::Opaque)?;
            if let (Some(pipeline), Some(_)) = (&pipelines.ground, frame.ground) {
                let stream = &self.streams[stream];
                self.ground.draw(&mut pass, pipeline, &stream.group, &stream.instances)?;
                draw_calls += 1;
            }
            draw_calls += drawer.draw_blended(&mut pass, &pipelines.blended, frame.camera.eye)?;
        }
        let triangles = drawer.triangles();
        drop(pass);
        recorder.end_stage("scene");
        self.plans[stream] = plan;
        Ok(FrameStats {
            triangles,
            draw_calls,
            resolve_millis,
            resolved: self.cache.made(),
            waiting: self.resolver.waiting() as u32,
            ..FrameStats::default()
        })
    }

    pub(crate) fn record_pick(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &PickTargets,
        area: &PixelArea,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let plan = self.prepare(recorder, PICK_STREAM, frame, area)?;
        let drawer = self.drawer(&plan, PICK_STREAM);
        let mut pass = recorder.pass(&targets.cleared(), area.viewport())?;
        drawer.draw(&mut pass, &self.pipelines.pick, Sections::All)?;
        drop(pass);
        self.plans[PICK_STREAM] = plan;
        Ok(())
    }
}

/// The cache's key of a mesh at a cursor, and its stacks; `None` for what is
/// not there.
pub(crate) fn find<'a>(
    models: &'a [Option<GpuModel>],
    at: &MeshAtCursor,
) -> Option<(IndexKey, &'a Arc<CollapseStacks>)> {
    let model = models.get(at.model.0 as usize)?.as_ref()?;
    let stacks = &model.meshes.get(at.mesh as usize)?.stacks;
    let cursor = at.cursor.min(stacks.collapse_count());
    Some((IndexKey { model: at.model.0, mesh: at.mesh, cursor }, stacks))
}

pub(crate) fn millis_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
