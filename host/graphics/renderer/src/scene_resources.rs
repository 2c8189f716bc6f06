//! Scene resources: models, caches and pipelines, and the recording of frames and picks.

use std::time::Instant;

use busbar_density::DensityResources;
use busbar_geometry::Bounds;
use busbar_gpu::{
    Binding, BufferArena, BufferUsage, DepthStore, DrawCount, Gpu, GpuQueue, LoadOp,
    MAX_FRAMES_IN_FLIGHT, Recorder, RenderTargets,
};
use busbar_shaders::Instance;
use rayon::prelude::*;

use crate::ambient_occlusion::AmbientOcclusion;
use crate::batch::{DrawPhase, IndexKey};
use crate::density_planes::DensityPlaneResources;
use crate::draw_reduction::{DrawReduction, DrawnScene, NoReduction, ReducedView};
use crate::features::FeatureResources;
use crate::frame_buffers::FrameBuffers;
use crate::ground::GroundResources;
use crate::index_cache::{IndexCache, MAX_CACHED_INDEX_BYTES};
use crate::instance_buckets::InstanceBuckets;
use crate::instance_culling::{CullView, OcclusionQuery, VisibleInstances};
use crate::layer::get_or_create;
use crate::material::MaterialResources;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::Morpher;
use crate::outline::Outlines;
use crate::pick::{PickTargets, PixelArea};
use crate::pipelines::{Layouts, Pipelines, RequiredPipelines, Wireframe};
use crate::polylines::PolylineResources;
use crate::resolver::{Request, Resolved, ResolvedTriangles, Resolver};
use crate::scene_pass::{SceneDrawer, Sections};
use crate::shadows::{MeshPassInputs, Shadows};
use crate::sun_view::SunView;
use crate::targets::{SceneTargets, full_viewport};
use crate::uniform::frame_uniform;
use crate::{Frame, FrameStats, MeshAtCursor, Quality, RenderError, ResolveRequest};

/// Bytes of index buffers, resolved beside the frames, that one frame uploads;
/// one buffer always, so that each arrives.
pub const MAX_UPLOAD_BYTES_PER_FRAME: u64 = 4 << 20;

/// Overhead of an upload besides its bytes, in bytes.
const UPLOAD_OVERHEAD_BYTES: u64 = 32 << 10;

/// Meshes that are resolved at once, before they are uploaded, where a frame
/// cannot do without them.
const MAX_RESOLVED_AT_ONCE: usize = 32;

/// The stream of picks, after those of the frames in flight.
const PICK_STREAM: usize = MAX_FRAMES_IN_FLIGHT;

/// Models, caches and pipelines of a renderer.
pub(crate) struct SceneResources {
    pub(crate) models: Vec<Option<GpuModel>>,
    /// Vertices of all models.
    pub(crate) vertices: BufferArena,
    pub(crate) cache: IndexCache,
    pub(crate) resolver: Resolver,
    pub(crate) morpher: Morpher,
    pub(crate) material_resources: MaterialResources,
    pub(crate) feature_resources: FeatureResources,
    ground: GroundResources,
    layouts: Layouts,
    pipelines: Pipelines,
    /// Resources of high quality, if chosen.
    high: Option<HighQualityResources>,
    /// Once something was outlined.
    outlines: Option<Outlines>,
    /// Once there were any.
    polylines: Option<PolylineResources>,
    /// Once something was counted.
    pub(crate) density: Option<DensityResources>,
    planes: Option<DensityPlaneResources>,
    pub(crate) samples: u32,
    streams: Vec<FrameBuffers>,
    /// Views of frames and of picks.
    views: [ViewState; 2],
    /// Reduction of the draws of frames.
    reduction: Box<dyn DrawReduction>,
}

/// First pass of two-pass occlusion culling.
#[derive(Clone, Copy)]
pub(crate) struct FirstPass {
    calls: DrawCount,
    /// Times when the device got the pass, and when it was finished.
    pub(crate) handed: Instant,
    pub(crate) there: Instant,
}

/// Kind of view that is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ViewKind {
    Frame,
    Pick,
}

/// Sorted instances of a view, and those that are visible.
#[derive(Default)]
struct ViewState {
    buckets: InstanceBuckets,
    plan: VisibleInstances,
}

/// Resources that high quality adds.
struct HighQualityResources {
    shadows: Shadows,
    ambient_occlusion: AmbientOcclusion,
}

impl HighQualityResources {
    fn new(gpu: &Gpu, layouts: &Layouts) -> Result<Self, RenderError> {
        let ambient_occlusion = AmbientOcclusion::new(gpu, &layouts.frame, &layouts.texture)?;
        Ok(Self { shadows: Shadows::new(gpu)?, ambient_occlusion })
    }
}

/// Returns the bindings that frames need besides their own.
fn high_quality_bindings(high: Option<&HighQualityResources>) -> Vec<Binding<'_>> {
    high.map_or_else(Vec::new, |high| high.shadows.bindings().to_vec())
}

impl SceneResources {
    pub(crate) fn new(
        queue: &mut GpuQueue,
        (quality, samples): (Quality, u32),
        reduction: Box<dyn DrawReduction>,
    ) -> Result<Self, RenderError> {
        let gpu = &queue.gpu().clone();
        let layouts = Layouts::new(gpu, quality)?;
        let pipelines = Pipelines::new(gpu, &layouts, quality, samples)?;
        let high = (quality == Quality::High)
            .then(|| HighQualityResources::new(gpu, &layouts))
            .transpose()?;
        let more = high_quality_bindings(high.as_ref());
        let streams = (0..=PICK_STREAM)
            .map(|_| FrameBuffers::new(gpu, &layouts.frame, &more))
            .collect::<Result<_, _>>()?;
        drop(more);
        Ok(Self {
            models: Vec::new(),
            vertices: BufferArena::new("vertices", BufferUsage::Vertex),
            cache: IndexCache::new(MAX_CACHED_INDEX_BYTES),
            resolver: Resolver::new()?,
            morpher: Morpher::default(),
            material_resources: MaterialResources::new(
                queue,
                layouts.material.clone(),
                pipelines.undecoded,
            )?,
            feature_resources: FeatureResources::new(gpu, layouts.features.clone())?,
            ground: GroundResources::new(queue)?,
            layouts,
            pipelines,
            high,
            outlines: None,
            views: <[ViewState; 2]>::default(),
            reduction,
            polylines: None,
            density: None,
            planes: None,
            samples,
            streams,
        })
    }

    /// Drops all models and everything made of them.
    pub(crate) fn clear(&mut self) {
        self.models.clear();
        self.cache.drop_all();
        self.morpher.drop_all();
        self.resolver.cancel_where(|_| true);
        self.invalidate_order();
    }

    /// Releases empty buffers of the arenas.
    pub(crate) fn trim(&mut self) {
        self.vertices.trim();
        self.cache.trim();
    }

    /// Abandons the last recorded frame, which never ran: images are undefined.
    pub(crate) fn abandon_frame(&mut self) {
        self.cache.abandon_frame();
        // Among it may be what was never filled.
        self.morpher.drop_all();
        (self.polylines, self.planes) = (None, None);
        self.invalidate_shadow_map();
    }

    /// Invalidates the draw order after a change of models.
    pub(crate) fn invalidate_order(&mut self) {
        self.views.iter_mut().for_each(|view| view.buckets.invalidate());
        self.invalidate_shadow_map();
    }

    fn invalidate_shadow_map(&mut self) {
        if let Some(high) = &mut self.high {
            high.shadows.invalidate();
        }
    }

    /// Requests geometry of later frames from the resolver.
    pub(crate) fn request(&mut self, wanted: impl Iterator<Item = ResolveRequest>) {
        let Self { models, cache, morpher, resolver, reduction, .. } = self;
        let preparation = reduction.mesh_preparation();
        let missing = wanted.filter_map(|wanted| {
            let (ResolveRequest::Mesh(at) | ResolveRequest::MorphTarget(at)) = wanted;
            let (key, mesh) = find(models, &at)?;
            let (request, is_there) = match wanted {
                ResolveRequest::Mesh(_) => (Request::Triangles(key), cache.get(key).is_some()),
                ResolveRequest::MorphTarget(_) => {
                    (Request::MorphTarget(key), morpher.is_ready(key))
                }
            };
            (!is_there).then_some((request, mesh.source(preparation)))
        });
        resolver.request(missing);
    }

    /// Uploads resolved geometry, as much as a frame may. Returns the number of morph targets among
    /// it.
    fn upload_resolved(&mut self, recorder: &mut Recorder<'_>) -> Result<u32, RenderError> {
        let (mut left, mut morph_targets) = (u64::MAX, 0);
        while let Some((request, resolved)) = self.resolver.take_finished(left) {
            // The first always fits.
            left = left.min(MAX_UPLOAD_BYTES_PER_FRAME);
            left = left.saturating_sub(resolved.bytes() + UPLOAD_OVERHEAD_BYTES);
            match resolved {
                Resolved::Triangles(triangles) if self.cache.get(request.key()).is_none() => {
                    self.cache.insert(recorder, request.key(), triangles)?;
                }
                Resolved::MorphTarget(standing) if !self.morpher.is_ready(request.key()) => {
                    self.morpher.insert(recorder, &self.models, request.key(), &standing)?;
                    morph_targets += 1;
                }
                _ => {}
            }
        }
        Ok(morph_targets)
    }

    /// Resolves the meshes that the frame needs at once, on all cores.
    fn resolve_missing(
        &mut self,
        recorder: &mut Recorder<'_>,
        plan: &VisibleInstances,
    ) -> Result<(), RenderError> {
        let mut missing = Vec::new();
        for batch in &plan.batches {
            let is_new = missing.last().is_none_or(|(key, _)| *key != batch.key);
            if let (true, None, Some(model)) =
                (is_new, self.cache.get(batch.key), &self.models[batch.key.model as usize])
            {
                missing.push((batch.key, &model.meshes[batch.key.mesh as usize]));
            }
        }
        let preparation = self.reduction.mesh_preparation();
        for some in missing.chunks(MAX_RESOLVED_AT_ONCE) {
            let resolve = |&(key, mesh): &(IndexKey, &GpuMesh)| {
                (key, ResolvedTriangles::new(mesh.source(preparation), key.cursor))
            };
            let resolved: Vec<_> = some.par_iter().map(resolve).collect();
            for (key, resolved) in resolved {
                self.cache.insert(recorder, key, resolved)?;
                self.cache.mark_used(key)?;
            }
        }
        Ok(())
    }

    /// Prepares a frame: sorts and culls instances, writes buffers, and resolves missing meshes.
    fn prepare(
        &mut self,
        recorder: &mut Recorder<'_>,
        (kind, stream): (ViewKind, usize),
        frame: &Frame<'_>,
        area: &PixelArea,
    ) -> Result<VisibleInstances, RenderError> {
        let _span = tracing::debug_span!("prepare").entered();
        let ViewState { buckets, plan } = &mut self.views[kind as usize];
        let mut plan = std::mem::take(plan);
        let seen = area.clip_from_picture() * frame.camera.clip_from_world();
        buckets.update(&self.models, frame.instances)?;
        let drawn = DrawnScene { models: &self.models, cache: &self.cache, buckets };
        // A pick draws next to nothing.
        let is_reduced = kind == ViewKind::Frame;
        if is_reduced {
            let (camera, size, samples) = (&frame.camera, area.size, self.samples);
            let is_seen_through = frame.wireframe || frame.section.is_some();
            let view = ReducedView { camera, size, samples, is_seen_through };
            self.reduction.begin_frame(drawn, view);
        }
        let reduction = &*self.reduction;
        let is_occluded =
            |instance: &Instance, bounds: &Bounds| reduction.is_occluded(instance, bounds);
        let query: OcclusionQuery<'_> = &is_occluded;
        let view = CullView::new(&seen, (is_reduced && reduction.has_occluders()).then_some(query));
        plan.fill(&self.models, buckets, frame.object_highlights, &view)?;
        if is_reduced {
            reduction.assign_phases(drawn, &mut plan);
        }
        let needed = RequiredPipelines {
            section: frame.section.is_some(),
            blended: self.models.iter().flatten().any(|model| model.blends),
            wireframe: frame.wireframe,
            pick: matches!(kind, ViewKind::Pick),
        };
        self.pipelines.ensure(recorder.gpu(), &self.layouts, needed)?;
        let layout = (&self.layouts.frame, &*high_quality_bindings(self.high.as_ref()));
        let uniform = frame_uniform(frame, area.viewport(), self.sun_of(frame).as_ref());
        self.streams[stream].write(recorder.gpu(), layout, &uniform, &plan)?;
        self.resolve_missing(recorder, &plan)?;
        for batch in &plan.batches {
            self.cache.mark_used(batch.key)?;
        }
        self.morpher.record(recorder, &self.models, &plan)?;
        Ok(plan)
    }

    /// Returns the sun, where it casts shadows.
    fn sun_of(&self, frame: &Frame<'_>) -> Option<SunView> {
        self.high.as_ref()?;
        frame.shadow_bounds.filter(|_| !frame.wireframe).map(SunView::fit)
    }

    /// Makes the drawer of a phase.
    fn drawer<'a>(
        &'a self,
        (plan, phase): (&'a VisibleInstances, DrawPhase),
        stream: usize,
        frame: &Frame<'_>,
        reduction: &'a dyn DrawReduction,
    ) -> SceneDrawer<'a> {
        SceneDrawer {
            models: &self.models,
            cache: &self.cache,
            plan,
            frame_group: &self.streams[stream].group,
            instances: &self.streams[stream].instances,
            feature_resources: &self.feature_resources,
            morpher: Some(&self.morpher),
            more: None,
            phase,
            reduction,
            // Insides come to be seen.
            shows_backs: frame.section.is_some(),
        }
    }

    /// Draws the first phase, if the plan has one, and removes what it occludes of the second.
    fn record_first_pass(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &SceneTargets,
        frame: &Frame<'_>,
        plan: &mut VisibleInstances,
    ) -> Result<Option<FirstPass>, RenderError> {
        let Some(depth) = targets.single_sample_depth().filter(|_| plan.has_first_phase) else {
            return Ok(None);
        };
        self.reduction.begin_phase(recorder, &self.cache, (plan, DrawPhase::First))?;
        let drawer =
            self.drawer((plan, DrawPhase::First), recorder.slot(), frame, &*self.reduction);
        let cleared = targets.cleared(frame.background, self.pipelines.undecoded, false);
        let kept = RenderTargets { depth_store: DepthStore::Store, ..cleared };
        let mut pass = recorder.pass(&kept, full_viewport(targets.size()))?;
        let mesh_pipelines = self.pipelines.mesh_pipelines(false);
        let calls = drawer.draw(&mut pass, &mesh_pipelines.opaque, Sections::Opaque)?;
        drop(pass);
        let models = &self.models;
        let [handed, there] = self.reduction.end_first_phase(recorder, depth, models, plan)?;
        self.streams[recorder.slot()].write_instances(plan)?;
        Ok(Some(FirstPass { calls, handed, there }))
    }

    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &mut SceneTargets,
        frame: &Frame<'_>,
    ) -> Result<(FrameStats, Option<FirstPass>), RenderError> {
        let resolving = Instant::now();
        let stream = recorder.slot();
        let morph_targets = self.upload_resolved(recorder)?;
        let area = PixelArea::whole(targets.size());
        let mut plan = self.prepare(recorder, (ViewKind::Frame, stream), frame, &area)?;
        recorder.end_stage("upload");
        let resolve_millis = millis_since(resolving);
        let _span = tracing::debug_span!("scene").entered();
        let shadows_drawn = self.record_shadows(recorder, frame)?;
        let first_pass = self.record_first_pass(recorder, targets, frame, &mut plan)?;
        self.reduction.begin_phase(recorder, &self.cache, (&plan, DrawPhase::Second))?;
        let has_ambient_occlusion = self.high.is_some() && !frame.wireframe;
        let keeps_depth = has_ambient_occlusion || !frame.outlined.is_empty();
        if keeps_depth {
            targets.ensure_depth(recorder.gpu(), &self.layouts.texture)?;
        }
        self.prepare_polylines(recorder, frame)?;
        let drawer = self.drawer((&plan, DrawPhase::Second), stream, frame, &*self.reduction);
        let mut calls = self.record_scene(recorder, targets, frame, &drawer, keeps_depth)?;
        calls += first_pass.map_or_else(DrawCount::default, |first_pass| first_pass.calls);
        let (triangles, visible_instances) = (drawer.triangles(), plan.seen_count());
        recorder.end_stage("scene");
        if let (true, Some(high)) = (has_ambient_occlusion, &self.high) {
            let group = &self.streams[stream].group;
            high.ambient_occlusion.record(recorder, targets, &self.layouts.texture, group)?;
            recorder.end_stage("occlusion");
        }
        self.record_outlines(recorder, targets, frame)?;
        self.views[ViewKind::Frame as usize].plan = plan;
        let stats = FrameStats {
            triangles,
            visible_instances,
            draw_calls: calls.draws,
            draw_commands: calls.commands,
            resolve_millis,
            resolved: self.cache.made() + morph_targets,
            shadows_drawn,
            waiting: self.resolver.pending_count() as u32,
            ..FrameStats::default()
        };
        Ok((stats, first_pass))
    }

    fn record_scene(
        &self,
        recorder: &mut Recorder<'_>,
        targets: &SceneTargets,
        frame: &Frame<'_>,
        drawer: &SceneDrawer<'_>,
        keeps_depth: bool,
    ) -> Result<DrawCount, RenderError> {
        let undecoded = self.pipelines.undecoded && !frame.wireframe;
        let cleared = targets.cleared(frame.background, undecoded, keeps_depth);
        let load = if drawer.plan.has_first_phase { LoadOp::Load } else { cleared.load };
        let slot = recorder.slot();
        let mut pass =
            recorder.pass(&RenderTargets { load, ..cleared }, full_viewport(targets.size()))?;
        let mesh_pipelines = self.pipelines.mesh_pipelines(frame.section.is_some());
        if let Some(Wireframe { fill, lines }) =
            mesh_pipelines.wireframe.as_ref().filter(|_| frame.wireframe)
        {
            let mut calls = drawer.draw(&mut pass, fill, Sections::All)?;
            if let Some(lines) = lines {
                calls += drawer.draw(&mut pass, lines, Sections::All)?;
            }
            return Ok(calls);
        }
        let mut calls = drawer.draw(&mut pass, &mesh_pipelines.opaque, Sections::Opaque)?;
        if let (Some(pipeline), Some(_)) = (&self.pipelines.ground, frame.ground) {
            self.ground.draw(&mut pass, pipeline, drawer.frame_group, drawer.instances)?;
            calls += DrawCount::ONE;
        }
        if let Some(blended) = &mesh_pipelines.blended {
            calls += drawer.draw_blended(&mut pass, blended, frame.camera.eye)?;
        }
        if let (Some(material_resources), Some(lines)) = (&self.polylines, &frame.polylines) {
            let group = drawer.frame_group;
            calls += material_resources.draw_faces(&mut pass, group, slot, lines)?;
            if let (Some(planes), Some(density)) = (&self.planes, &self.density) {
                let at = (slot, &material_resources.quads);
                calls += planes.draw(&mut pass, group, at, (density, lines.planes))?;
            }
            calls += material_resources.draw_strokes(&mut pass, group, slot, lines)?;
        }
        Ok(calls)
    }

    /// Makes the resources of lines on first use, and writes the lines.
    fn prepare_polylines(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let Some(lines) = frame.polylines.as_ref().filter(|_| !frame.wireframe) else {
            return Ok(());
        };
        let target = (self.pipelines.target, self.pipelines.undecoded);
        let (layout, samples) = (&self.layouts.frame, self.samples);
        let material_resources = get_or_create(&mut self.polylines, || {
            PolylineResources::new(recorder, layout, target, samples)
        })?;
        material_resources.write(recorder.gpu(), recorder.slot(), lines)?;
        let (Some(density), false) = (&self.density, lines.planes.is_empty()) else {
            return Ok(());
        };
        let layouts = (layout, density);
        let material_resources = get_or_create(&mut self.planes, || {
            DensityPlaneResources::new(recorder, layouts, target, samples)
        })?;
        material_resources.write(recorder.slot(), density, lines.planes)
    }

    fn record_shadows(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &Frame<'_>,
    ) -> Result<bool, RenderError> {
        let sun = self.sun_of(frame);
        let mesh_pipelines = self.pipelines.mesh_pipelines(frame.section.is_some());
        let (Some(high), Some(shading)) = (&mut self.high, &mesh_pipelines.shadow) else {
            return Ok(false);
        };
        if frame.wireframe {
            return Ok(false);
        }
        let inputs = MeshPassInputs {
            models: &self.models,
            cache: &self.cache,
            feature_resources: &self.feature_resources,
            morpher: &self.morpher,
        };
        let layout = &self.layouts.frame;
        let drawn = high.shadows.record(recorder, layout, shading, inputs, frame, sun)?;
        recorder.end_stage("shadows");
        Ok(drawn)
    }

    fn record_outlines(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &mut SceneTargets,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        if frame.outlined.is_empty() {
            return Ok(());
        }
        let more = high_quality_bindings(self.high.as_ref());
        let layouts = &self.layouts;
        let outlines =
            get_or_create(&mut self.outlines, || Outlines::new(recorder.gpu(), layouts, &more))?;
        let inputs = MeshPassInputs {
            models: &self.models,
            cache: &self.cache,
            feature_resources: &self.feature_resources,
            morpher: &self.morpher,
        };
        let uniform = frame_uniform(frame, full_viewport(targets.size()), None);
        outlines.record(recorder, targets, (layouts, &more), inputs, (frame, &uniform))?;
        recorder.end_stage("outline");
        Ok(())
    }

    pub(crate) fn record_pick(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &PickTargets,
        area: &PixelArea,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let plan = self.prepare(recorder, (ViewKind::Pick, PICK_STREAM), frame, area)?;
        let drawer = self.drawer((&plan, DrawPhase::Second), PICK_STREAM, frame, &NoReduction);
        let mut pass = recorder.pass(&targets.cleared(), area.viewport())?;
        if let Some(pick) = &self.pipelines.mesh_pipelines(frame.section.is_some()).pick {
            drawer.draw(&mut pass, pick, Sections::All)?;
        }
        drop(pass);
        self.views[ViewKind::Pick as usize].plan = plan;
        Ok(())
    }
}

/// Finds the cache key of a mesh at a cursor, and the mesh; `None` for unknown ones.
pub(crate) fn find<'a>(
    models: &'a [Option<GpuModel>],
    at: &MeshAtCursor,
) -> Option<(IndexKey, &'a GpuMesh)> {
    let model = models.get(at.model.0 as usize)?.as_ref()?;
    let mesh = model.meshes.get(at.mesh as usize)?;
    let cursor = at.cursor.min(mesh.stacks.collapse_count());
    Some((IndexKey { model: at.model.0, mesh: at.mesh, cursor }, mesh))
}

pub(crate) fn millis_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}
