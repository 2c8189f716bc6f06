//! Models and all they are drawn with; records frames and picks.

mod near;

use std::time::Instant;

use busbar_gpu::{
    Arena, Binding, BufferUsage, DrawCount, Gpu, MAX_FRAMES_IN_FLIGHT, Recorder, Start, Targets,
};
use rayon::prelude::*;

pub(crate) use self::near::Near;
use crate::batch::{Part, Plan};
use crate::density::{Density, PlaneKit};
use crate::drawn_depth::DrawnDepth;
use crate::features::FeatureKit;
use crate::gathering::{self, Gathering};
use crate::ground::GroundKit;
use crate::index_cache::{IndexCache, IndexKey, MAX_CACHED_INDEX_BYTES};
use crate::layer::ready;
use crate::material::MaterialKit;
use crate::model::{GpuMesh, GpuModel};
use crate::morph::Morpher;
use crate::occlusion::Occlusion;
use crate::outline::Outlines;
use crate::pick::{PickTargets, PixelArea};
use crate::pipelines::{Layouts, Needed, Pipelines, Wireframe};
use crate::polylines::PolylineKit;
use crate::resolver::{Request, Resolved, ResolvedTriangles, Resolver};
use crate::roster::Roster;
use crate::scene_pass::{SceneDrawer, Sections};
use crate::shadows::{Drawn, Shadows, Sun};
use crate::sight::{Before, Hiding, Sight};
use crate::stream::FrameStream;
use crate::targets::{SceneTargets, whole};
use crate::uniform::frame_uniform;
use crate::{Frame, FrameStats, MeshAtCursor, Quality, RenderError, Wanted};

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
    /// Of all models.
    pub(crate) vertices: Arena,
    pub(crate) cache: IndexCache,
    pub(crate) resolver: Resolver,
    pub(crate) morpher: Morpher,
    pub(crate) kit: MaterialKit,
    pub(crate) feature_kit: FeatureKit,
    ground: GroundKit,
    layouts: Layouts,
    pipelines: Pipelines,
    /// At high quality.
    high: Option<High>,
    /// Once something was outlined.
    outlines: Option<Outlines>,
    /// Once there were any.
    polylines: Option<PolylineKit>,
    /// Once something was counted.
    pub(crate) density: Option<Density>,
    planes: Option<PlaneKit>,
    pub(crate) samples: u32,
    streams: Vec<FrameStream>,
    /// Those of frames and of picks.
    views: [View; 2],
    drawn_depth: DrawnDepth,
}

/// Who looks at the content.
#[derive(Clone, Copy)]
enum Viewing {
    Frame,
    Pick,
}

/// What is drawn in order, and what of it was seen last.
#[derive(Default)]
struct View {
    roster: Roster,
    plan: Plan,
    before: Before,
}

/// What high quality adds.
struct High {
    shadows: Shadows,
    occlusion: Occlusion,
}

impl High {
    fn new(gpu: &Gpu, layouts: &Layouts) -> Result<Self, RenderError> {
        let occlusion = Occlusion::new(gpu, &layouts.frame, &layouts.texture)?;
        Ok(Self { shadows: Shadows::new(gpu)?, occlusion })
    }
}

/// What frames bind after their own.
fn bindings_of(high: Option<&High>) -> Vec<Binding<'_>> {
    high.map_or_else(Vec::new, |high| high.shadows.bindings().to_vec())
}

impl Content {
    pub(crate) fn new(gpu: &mut Gpu, quality: Quality, samples: u32) -> Result<Self, RenderError> {
        let layouts = Layouts::new(gpu, quality)?;
        let pipelines = Pipelines::new(gpu, &layouts, quality, samples)?;
        let high = (quality == Quality::High).then(|| High::new(gpu, &layouts)).transpose()?;
        let more = bindings_of(high.as_ref());
        let streams = (0..=PICK_STREAM)
            .map(|_| FrameStream::new(gpu, &layouts.frame, &more))
            .collect::<Result<_, _>>()?;
        drop(more);
        Ok(Self {
            models: Vec::new(),
            vertices: Arena::new("vertices", BufferUsage::Vertex),
            cache: IndexCache::new(MAX_CACHED_INDEX_BYTES),
            resolver: Resolver::new()?,
            morpher: Morpher::default(),
            kit: MaterialKit::new(gpu, layouts.material.clone(), pipelines.undecoded)?,
            feature_kit: FeatureKit::new(gpu, layouts.features.clone())?,
            ground: GroundKit::new(gpu)?,
            layouts,
            pipelines,
            high,
            outlines: None,
            views: <[View; 2]>::default(),
            drawn_depth: DrawnDepth::default(),
            polylines: None,
            density: None,
            planes: None,
            samples,
            streams,
        })
    }

    /// Forgets all models and what was made of them.
    pub(crate) fn clear(&mut self) {
        self.models.clear();
        self.cache.drop_all();
        self.morpher.drop_all();
        self.resolver.drop_where(|_| true);
        self.forget_order();
    }

    /// Gives buffers back in which nothing is left.
    pub(crate) fn trim(&mut self) {
        self.vertices.trim();
        self.cache.trim();
    }

    /// What was recorded last never ran: images hold nothing.
    pub(crate) fn abandon_frame(&mut self) {
        self.cache.abandon_frame();
        // Among it may be what was never filled.
        self.morpher.drop_all();
        (self.polylines, self.planes) = (None, None);
        self.forget_layers();
    }

    /// Models are not what they were.
    pub(crate) fn forget_order(&mut self) {
        self.views.iter_mut().for_each(|view| view.roster.forget());
        self.forget_layers();
    }

    fn forget_layers(&mut self) {
        if let Some(high) = &mut self.high {
            high.shadows.forget();
        }
    }

    /// Asks for what frames will need, to be worked out beside them.
    pub(crate) fn request(&mut self, wanted: impl Iterator<Item = Wanted>) {
        let Self { models, cache, morpher, resolver, .. } = self;
        let missing = wanted.filter_map(|wanted| {
            let (Wanted::Mesh(at) | Wanted::Way(at)) = wanted;
            let (key, mesh) = find(models, &at)?;
            let (request, is_there) = match wanted {
                Wanted::Mesh(_) => (Request::Triangles(key), cache.get(key).is_some()),
                Wanted::Way(_) => (Request::Standing(key), morpher.is_ready(key)),
            };
            (!is_there).then_some((request, mesh.source()))
        });
        resolver.request(missing);
    }

    /// Uploads what was resolved beside the frames, as much as a frame may. Returns how
    /// many ways are among it.
    fn upload_resolved(&mut self, recorder: &mut Recorder<'_>) -> Result<u32, RenderError> {
        let (mut left, mut ways) = (u64::MAX, 0);
        while let Some((request, resolved)) = self.resolver.take(left) {
            // The first always fits.
            left = left.min(MAX_UPLOAD_BYTES_PER_FRAME);
            left = left.saturating_sub(resolved.bytes() + UPLOAD_OVERHEAD_BYTES);
            match resolved {
                Resolved::Triangles(triangles) if self.cache.get(request.key()).is_none() => {
                    self.cache.insert(recorder, request.key(), triangles)?;
                }
                Resolved::Standing(standing) if !self.morpher.is_ready(request.key()) => {
                    self.morpher.insert(recorder, &self.models, request.key(), &standing)?;
                    ways += 1;
                }
                _ => {}
            }
        }
        Ok(ways)
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
                missing.push((batch.key, &model.meshes[batch.key.mesh as usize]));
            }
        }
        for some in missing.chunks(MAX_RESOLVED_AT_ONCE) {
            let resolve = |&(key, mesh): &(IndexKey, &GpuMesh)| {
                (key, ResolvedTriangles::of(mesh.source(), key.cursor))
            };
            let resolved: Vec<_> = some.par_iter().map(resolve).collect();
            for (key, resolved) in resolved {
                self.cache.insert(recorder, key, resolved)?;
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
        (viewing, stream): (Viewing, usize),
        frame: &Frame<'_>,
        area: &PixelArea,
    ) -> Result<Plan, RenderError> {
        let _span = tracing::debug_span!("prepare").entered();
        let hides = self.hides(recorder, viewing, frame);
        let View { roster, plan, before } = &mut self.views[viewing as usize];
        let mut plan = std::mem::take(plan);
        let seen = area.clip_from_picture() * frame.camera.clip_from_world();
        roster.follow(&self.models, frame.instances)?;
        let mut sight = Sight::through(&seen);
        let drawn = (&*self.models, &self.cache, &*roster);
        let picture = (area.size, self.samples);
        before.find(drawn, hides.then_some(&frame.camera), picture);
        sight.before = before.seen();
        plan.fill(&self.models, roster, frame.object_highlights, &sight)?;
        if hides && self.samples == 1 {
            plan.put_near_first((&self.models, &self.cache), frame.camera.eye);
        }
        let needed = Needed {
            section: frame.section.is_some(),
            blended: self.models.iter().flatten().any(|model| model.blends),
            wireframe: frame.wireframe,
            pick: matches!(viewing, Viewing::Pick),
        };
        self.pipelines.ready(recorder.gpu(), &self.layouts, needed)?;
        let layout = (&self.layouts.frame, &*bindings_of(self.high.as_ref()));
        let uniform = frame_uniform(frame, area.viewport(), self.sun_of(frame).as_ref());
        self.streams[stream].write(recorder.gpu(), layout, &uniform, &plan)?;
        self.resolve_missing(recorder, &plan)?;
        for batch in &plan.batches {
            self.cache.touch(batch.key)?;
        }
        self.morpher.record(recorder, &self.models, &plan)?;
        Ok(plan)
    }

    /// Whether what is behind large faces is left out: where the processor draws, that takes
    /// less time than drawing it. A section and a wireframe are seen through, without
    /// perspective distances do not tell what is behind, and a pick draws next to nothing.
    fn hides(&self, recorder: &Recorder<'_>, viewing: Viewing, frame: &Frame<'_>) -> bool {
        let is_seen_through = frame.wireframe || frame.section.is_some();
        recorder.gpu().is_software()
            && matches!(viewing, Viewing::Frame)
            && !frame.camera.is_orthographic()
            && !is_seen_through
    }

    /// Makes room for what a part of a frame gathers.
    fn ready_gathering(
        &mut self,
        recorder: &Recorder<'_>,
        (plan, part): (&Plan, Part),
    ) -> Result<(), RenderError> {
        if !recorder.gpu().is_software() {
            return Ok(());
        }
        let hiding = self.hiding((plan, part));
        let gathered = plan.seen_in(part).filter_map(|batch| {
            Some(self.cache.get(batch.key)?.gathered(&batch, hiding)?.count_of(&batch))
        });
        let triangles = gathered.sum();
        let stream = &mut self.streams[recorder.slot()];
        gathering::ready(&mut stream.gathered, recorder.gpu(), triangles)
    }

    /// What tells what is hidden of a part of a frame: what was drawn before it, or large faces.
    fn hiding(&self, (plan, part): (&Plan, Part)) -> Option<Hiding<'_>> {
        match part {
            Part::Rest if plan.has_near => Some(Hiding::Drawn(&self.drawn_depth)),
            _ => self.views[Viewing::Frame as usize].before.seen().map(Hiding::Faces),
        }
    }

    /// The sun, where it casts shadows.
    fn sun_of(&self, frame: &Frame<'_>) -> Option<Sun> {
        self.high.as_ref()?;
        frame.shadow_bounds.filter(|_| !frame.wireframe).map(Sun::over)
    }

    /// Draws a part of a plan; of frames, some of it is gathered.
    fn drawer<'a>(
        &'a self,
        (plan, part): (&'a Plan, Part),
        stream: usize,
        frame: &Frame<'_>,
    ) -> SceneDrawer<'a> {
        let gathered = self.streams[stream].gathered.as_ref();
        let hiding = self.hiding((plan, part));
        SceneDrawer {
            models: &self.models,
            cache: &self.cache,
            plan,
            frame_group: &self.streams[stream].group,
            instances: &self.streams[stream].instances,
            feature_kit: &self.feature_kit,
            morpher: Some(&self.morpher),
            more: None,
            part,
            gathering: gathered.map(|buffer| Gathering::into(buffer, &frame.camera, hiding)),
            // Insides come to be seen.
            shows_backs: frame.section.is_some(),
        }
    }

    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &mut SceneTargets,
        frame: &Frame<'_>,
    ) -> Result<(FrameStats, Option<Near>), RenderError> {
        let resolving = Instant::now();
        let stream = recorder.slot();
        let ways = self.upload_resolved(recorder)?;
        let area = PixelArea::whole(targets.size());
        let mut plan = self.prepare(recorder, (Viewing::Frame, stream), frame, &area)?;
        recorder.end_stage("upload");
        let resolve_millis = millis_since(resolving);
        let _span = tracing::debug_span!("scene").entered();
        let shadows_drawn = self.record_shadows(recorder, frame)?;
        let near = self.record_near(recorder, targets, frame, &mut plan)?;
        self.ready_gathering(recorder, (&plan, Part::Rest))?;
        let occludes = self.high.is_some() && !frame.wireframe;
        let keeps_depth = occludes || !frame.outlined.is_empty();
        if keeps_depth {
            targets.ready_depth(recorder.gpu(), &self.layouts.texture)?;
        }
        self.ready_polylines(recorder, frame)?;
        let drawer = self.drawer((&plan, Part::Rest), stream, frame);
        let mut calls = self.record_scene(recorder, targets, frame, &drawer, keeps_depth)?;
        calls += near.map_or_else(DrawCount::default, |near| near.calls);
        let (triangles, seen_instances) = (drawer.triangles(), plan.seen_count());
        recorder.end_stage("scene");
        if let (true, Some(high)) = (occludes, &self.high) {
            let group = &self.streams[stream].group;
            high.occlusion.record(recorder, targets, &self.layouts.texture, group)?;
            recorder.end_stage("occlusion");
        }
        self.record_outlines(recorder, targets, frame)?;
        self.views[Viewing::Frame as usize].plan = plan;
        let stats = FrameStats {
            triangles,
            seen_instances,
            draw_calls: calls.draws,
            draw_commands: calls.commands,
            resolve_millis,
            resolved: self.cache.made() + ways,
            shadows_drawn,
            waiting: self.resolver.waiting() as u32,
            ..FrameStats::default()
        };
        Ok((stats, near))
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
        let cleared = targets.cleared_to(frame.background, undecoded, keeps_depth);
        let start = if drawer.plan.has_near { Start::Resumed } else { cleared.start };
        let slot = recorder.slot();
        let mut pass = recorder.pass(&Targets { start, ..cleared }, whole(targets.size()))?;
        let looks = self.pipelines.looks(frame.section.is_some());
        if let Some(Wireframe { fill, lines }) =
            looks.wireframe.as_ref().filter(|_| frame.wireframe)
        {
            let mut calls = drawer.draw(&mut pass, fill, Sections::All)?;
            if let Some(lines) = lines {
                calls += drawer.draw(&mut pass, lines, Sections::All)?;
            }
            return Ok(calls);
        }
        let mut calls = drawer.draw(&mut pass, &looks.opaque, Sections::Opaque)?;
        if let (Some(pipeline), Some(_)) = (&self.pipelines.ground, frame.ground) {
            self.ground.draw(&mut pass, pipeline, drawer.frame_group, drawer.instances)?;
            calls += DrawCount::ONE;
        }
        if let Some(blended) = &looks.blended {
            calls += drawer.draw_blended(&mut pass, blended, frame.camera.eye)?;
        }
        if let (Some(kit), Some(lines)) = (&self.polylines, &frame.polylines) {
            let group = drawer.frame_group;
            calls += kit.draw_faces(&mut pass, group, slot, lines)?;
            if let (Some(planes), Some(density)) = (&self.planes, &self.density) {
                let at = (slot, &kit.quads);
                calls += planes.draw(&mut pass, group, at, (density, lines.planes))?;
            }
            calls += kit.draw_strokes(&mut pass, group, slot, lines)?;
        }
        Ok(calls)
    }

    /// Makes what draws lines where there are any for the first time, and writes them.
    fn ready_polylines(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let Some(lines) = frame.polylines.as_ref().filter(|_| !frame.wireframe) else {
            return Ok(());
        };
        let target = (self.pipelines.target, self.pipelines.undecoded);
        let (layout, samples) = (&self.layouts.frame, self.samples);
        let kit =
            ready(&mut self.polylines, || PolylineKit::new(recorder, layout, target, samples))?;
        kit.write(recorder.gpu(), recorder.slot(), lines)?;
        let (Some(density), false) = (&self.density, lines.planes.is_empty()) else {
            return Ok(());
        };
        let layouts = (layout, density);
        let kit = ready(&mut self.planes, || PlaneKit::new(recorder, layouts, target, samples))?;
        kit.write(recorder.slot(), density, lines.planes)
    }

    fn record_shadows(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &Frame<'_>,
    ) -> Result<bool, RenderError> {
        let sun = self.sun_of(frame);
        let looks = self.pipelines.looks(frame.section.is_some());
        let (Some(high), Some(shading)) = (&mut self.high, &looks.shadow) else {
            return Ok(false);
        };
        if frame.wireframe {
            return Ok(false);
        }
        let drawn_with = Drawn {
            models: &self.models,
            cache: &self.cache,
            feature_kit: &self.feature_kit,
            morpher: &self.morpher,
        };
        let layout = &self.layouts.frame;
        let drawn = high.shadows.record(recorder, layout, shading, drawn_with, frame, sun)?;
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
        let more = bindings_of(self.high.as_ref());
        let layouts = &self.layouts;
        let outlines = ready(&mut self.outlines, || Outlines::new(recorder.gpu(), layouts, &more))?;
        let drawn_with = Drawn {
            models: &self.models,
            cache: &self.cache,
            feature_kit: &self.feature_kit,
            morpher: &self.morpher,
        };
        let uniform = frame_uniform(frame, whole(targets.size()), None);
        outlines.record(recorder, targets, (layouts, &more), drawn_with, (frame, &uniform))?;
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
        let plan = self.prepare(recorder, (Viewing::Pick, PICK_STREAM), frame, area)?;
        let drawer = self.drawer((&plan, Part::Rest), PICK_STREAM, frame);
        let mut pass = recorder.pass(&targets.cleared(), area.viewport())?;
        if let Some(pick) = &self.pipelines.looks(frame.section.is_some()).pick {
            drawer.draw(&mut pass, pick, Sections::All)?;
        }
        drop(pass);
        self.views[Viewing::Pick as usize].plan = plan;
        Ok(())
    }
}

/// The cache's key of a mesh at a cursor, and the mesh; `None` for what is
/// not there.
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
