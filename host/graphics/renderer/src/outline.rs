//! Outlines of hovered and selected objects: a mask pass and edge detection.

use std::ops::Range;

use busbar_culling::{ScreenBox, hull};
use busbar_gpu::{
    BindGroupLayout, Binding, Blend, ClearColor, DepthStore, Format, Gpu, Image, ImageArea,
    ImageDescription, ImageKind, LoadOp, MAX_FRAMES_IN_FLIGHT, Pipeline, Recorder, RenderTargets,
};
use busbar_shaders::{FrameUniform, OUTLINE};

use crate::batch::DrawPhase;
use crate::draw_reduction::NoReduction;
use crate::frame_buffers::{FrameBuffers, MAX_FEATURE_HIGHLIGHTS};
use crate::instance_buckets::InstanceBuckets;
use crate::instance_culling::{CullView, VisibleInstances, mesh_at};
use crate::instance_transform::world_from_mesh;
use crate::layer::{Layer, get_or_create};
use crate::model::GpuModel;
use crate::pick::ID_FORMAT;
use crate::pipeline_description::screen_pipeline;
use crate::pipelines::{Layouts, OutlineMaskPipelines};
use crate::scene_pass::{SceneDrawer, Sections};
use crate::shadows::MeshPassInputs;
use crate::targets::{OutlineMask, SceneTargets, full_viewport};
use crate::tile_pixels::tile_pixels;
use crate::{CameraView, DrawInstance, Frame, InstanceSource, OutlinedObject, RenderError};

/// Side of a tile in pixels, as `TILE` of the shader.
const TILE_PIXELS: u32 = 4;
/// Maximum reach of outlines in tiles; `MAX_REACH` of the shader is the same in pixels.
const REACH: u32 = 2;
/// Margin in pixels around a box: slender parts and edges are drawn at least a pixel wide.
const MARGIN_PIXELS: f32 = 2.0;

/// GPU resources of outlines, made on first use.
pub(crate) struct Outlines {
    mask: OutlineMaskPipelines,
    section_mask: Option<OutlineMaskPipelines>,
    tiles: Pipeline,
    edges: Pipeline,
    lines: Pipeline,
    streams: Vec<FrameBuffers>,
    buckets: InstanceBuckets,
    plan: VisibleInstances,
    /// Outline kinds of the objects 1, 2 and so on, as highlights.
    kinds: Vec<[f32; 4]>,
    /// Instances that have an outline.
    instances: Vec<DrawInstance>,
}

impl Outlines {
    pub(crate) fn new(
        gpu: &Gpu,
        layouts: &Layouts,
        more: &[Binding<'_>],
    ) -> Result<Self, RenderError> {
        let groups = [&layouts.frame, &layouts.texture, &layouts.texture];
        let tiles = ("outline tiles", OUTLINE, c"tile_main");
        let edges = ("outline edges", OUTLINE, c"edge_main");
        let lines = ("outline", OUTLINE, c"outline_main");
        let over = (gpu.picture_format(), Blend::Over);
        let streams = (0..MAX_FRAMES_IN_FLIGHT)
            .map(|_| FrameBuffers::new(gpu, &layouts.frame, more))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            mask: OutlineMaskPipelines::new(gpu, layouts, false)?,
            section_mask: None,
            tiles: screen_pipeline(gpu, tiles, &groups[..2], (ID_FORMAT, Blend::Replace))?,
            edges: screen_pipeline(gpu, edges, &groups, (ID_FORMAT, Blend::Replace))?,
            lines: screen_pipeline(gpu, lines, &groups, over)?,
            streams,
            buckets: InstanceBuckets::default(),
            plan: VisibleInstances::default(),
            kinds: Vec::new(),
            instances: Vec::new(),
        })
    }

    /// Draws the outlines over the picture, whose depth is drawn. The frame's meshes are
    /// resolved; `uniform` is the frame's.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        targets: &mut SceneTargets,
        (layouts, more): (&Layouts, &[Binding<'_>]),
        inputs: MeshPassInputs<'_>,
        (frame, uniform): (&Frame<'_>, &FrameUniform),
    ) -> Result<(), RenderError> {
        self.collect_outlined(inputs.models, frame)?;
        let view = CullView::new(&frame.camera.clip_from_world(), None);
        self.buckets.update(inputs.models, InstanceSource::Listed(&self.instances))?;
        self.plan.fill(inputs.models, &self.buckets, &self.kinds, &view)?;
        let size = targets.size();
        let Some(area) = OutlineArea::new((&self.plan, inputs.models), &frame.camera, size) else {
            return Ok(());
        };
        let stream = &mut self.streams[recorder.slot()];
        stream.write(recorder.gpu(), (&layouts.frame, more), uniform, &self.plan)?;
        let frame_group = &self.streams[recorder.slot()].group;
        get_or_create(&mut targets.mask, || new_mask(recorder.gpu(), &layouts.texture, size))?;
        let (Some(scene_depth), Some(mask)) = (targets.depth(), &targets.mask) else {
            return Ok(());
        };
        let shading = match frame.section {
            None => &self.mask,
            Some(_) => get_or_create(&mut self.section_mask, || {
                OutlineMaskPipelines::new(recorder.gpu(), layouts, true)
            })?,
        };
        recorder.prepare_sampling(&[&scene_depth.image]);
        let drawer = SceneDrawer {
            models: inputs.models,
            cache: inputs.cache,
            plan: &self.plan,
            frame_group,
            instances: &self.streams[recorder.slot()].instances,
            feature_resources: inputs.feature_resources,
            morpher: Some(inputs.morpher),
            phase: DrawPhase::Second,
            more: Some(&scene_depth.group),
            reduction: &NoReduction,
            shows_backs: true,
        };
        let cleared = RenderTargets {
            color: &mask.layer.image,
            resolve: None,
            depth: &mask.depth,
            depth_store: DepthStore::Discard,
            load: LoadOp::Clear(ClearColor::Integer(0)),
            undecoded: false,
        };
        let mut pass = recorder.pass_in(&cleared, full_viewport(size), area.mask_pixels())?;
        drawer.draw(&mut pass, &shading.faces, Sections::All)?;
        if let Some(edges) = &shading.edges {
            // What is thinner than a pixel has edges.
            drawer.draw(&mut pass, edges, Sections::All)?;
        }
        drop(pass);
        recorder.prepare_sampling(&[&mask.layer.image]);
        let groups = |tiles| [frame_group, &mask.layer.group, tiles];
        let tiles = (&mask.tiles.image, area.mask_tiles());
        recorder.fullscreen_pass_in(tiles, false, &self.tiles, &groups(&mask.tiles.group)[..2])?;
        recorder.prepare_sampling(&[&mask.tiles.image]);
        let edges = (&mask.edges.image, area.outline_tiles());
        recorder.fullscreen_pass_in(edges, false, &self.edges, &groups(&mask.tiles.group))?;
        recorder.prepare_sampling(&[&mask.edges.image]);
        let picture = (&targets.picture, area.outline_pixels());
        Ok(recorder.fullscreen_pass_in(picture, true, &self.lines, &groups(&mask.edges.group))?)
    }

    /// Collects the instances with an outlined object or feature, and the outline kinds of objects.
    fn collect_outlined(
        &mut self,
        models: &[Option<GpuModel>],
        frame: &Frame<'_>,
    ) -> Result<(), RenderError> {
        let last = frame.outlined.iter().map(|outlined| outlined.object as usize).max();
        let features = frame.instances.iter().filter_map(|drawn| features_of(models, drawn));
        let count = features.map(|range| range.end).chain(last).max().unwrap_or(0);
        if count > MAX_FEATURE_HIGHLIGHTS {
            let (asked, limit) = (count as u64, MAX_FEATURE_HIGHLIGHTS as u64);
            return Err(RenderError::TooMany { what: "objects with outlines", asked, limit });
        }
        self.kinds.clear();
        self.kinds.resize(count, [0.0; 4]);
        for &OutlinedObject { object, kind } in frame.outlined {
            let index = (object as usize).checked_sub(1);
            if let Some(slot) = index.and_then(|index| self.kinds.get_mut(index)) {
                *slot = [kind as u32 as f32, 0.0, 0.0, 1.0];
            }
        }
        let is_kind = |&[.., strength]: &[f32; 4]| strength > 0.0;
        let with_kinds = frame.instances.iter().filter_map(|drawn| {
            let index = (drawn.object as usize).checked_sub(1);
            let highlight = index.and_then(|index| self.kinds.get(index)).copied();
            let highlight = highlight.unwrap_or_default();
            let range = features_of(models, drawn);
            let of_features = range.and_then(|range| self.kinds.get(range));
            let shows = is_kind(&highlight) || of_features.is_some_and(|of| of.iter().any(is_kind));
            shows.then_some(DrawInstance { highlight, ..*drawn })
        });
        self.instances.clear();
        self.instances.extend(with_kinds);
        Ok(())
    }
}

/// Screen area that outlines may cover. Outlines cover a small part of a picture, and a software
/// rasterizer would need as long for all of it as for a scene.
struct OutlineArea {
    /// Columns and rows of tiles that outlined instances cover.
    shown: [Range<u32>; 2],
    /// Size of the picture in pixels.
    size: [u32; 2],
}

impl OutlineArea {
    /// Computes the area that instances cover; `None` where that is nothing.
    fn new(
        (plan, models): (&VisibleInstances, &[Option<GpuModel>]),
        camera: &CameraView,
        size: [u32; 2],
    ) -> Option<Self> {
        let clip_from_world = camera.clip_from_world();
        let boxes =
            plan.seen().filter_map(|batch| Some((batch, mesh_at(models, batch.key)?.bounds)));
        let instances = boxes.flat_map(|(batch, bounds)| {
            plan.instances[batch.range()].iter().map(move |instance| (instance, bounds))
        });
        let shown = instances.filter_map(|(instance, bounds)| {
            let clip_from_mesh = clip_from_world * world_from_mesh(instance);
            tiles_of(&ScreenBox::project(&clip_from_mesh, &bounds), size)
        });
        let both = |one: [Range<u32>; 2], other: [Range<u32>; 2]| {
            [0, 1].map(|axis| hull(&one[axis], &other[axis]))
        };
        shown.reduce(both).map(|shown| Self { shown, size })
    }

    /// Returns the tiles with so many more around them.
    fn around(&self, more: u32) -> [Range<u32>; 2] {
        [0, 1].map(|axis| {
            let Range { start, end } = self.shown[axis];
            let most = self.size[axis].div_ceil(TILE_PIXELS);
            start.saturating_sub(more)..(end + more).min(most)
        })
    }

    fn pixels_around(&self, more: u32) -> ImageArea {
        tile_pixels(self.around(more).each_ref(), TILE_PIXELS, self.size)
    }

    fn tiles_around(&self, more: u32) -> ImageArea {
        let [columns, rows] = self.around(more);
        let origin = [columns.start, rows.start];
        ImageArea { origin, size: [columns.len() as u32, rows.len() as u32] }
    }

    /// Returns the pixels that outlines are drawn in.
    fn outline_pixels(&self) -> ImageArea {
        self.pixels_around(REACH)
    }

    /// Returns the tiles that outlines are drawn in.
    fn outline_tiles(&self) -> ImageArea {
        self.tiles_around(REACH)
    }

    /// Tiles that are looked at where they are drawn.
    fn mask_tiles(&self) -> ImageArea {
        self.tiles_around(2 * REACH)
    }

    /// Returns the pixels of the mask.
    fn mask_pixels(&self) -> ImageArea {
        self.pixels_around(2 * REACH)
    }
}

/// Returns the columns and rows of tiles that a box may cover, if any.
fn tiles_of(found: &ScreenBox, size: [u32; 2]) -> Option<[Range<u32>; 2]> {
    if found.nearest().is_some() {
        return found.tiles(size, TILE_PIXELS, MARGIN_PIXELS);
    }
    found.may_surround().then(|| size.map(|pixels| 0..pixels.div_ceil(TILE_PIXELS)))
}

/// Returns the objects that are features of an instance, counted from 0.
fn features_of(models: &[Option<GpuModel>], drawn: &DrawInstance) -> Option<Range<usize>> {
    let first = (drawn.first_feature? as usize).checked_sub(1)?;
    let mesh = models.get(drawn.model.0 as usize)?.as_ref()?.meshes.get(drawn.mesh as usize)?;
    Some(first..first.checked_add(mesh.features.as_ref()?.count as usize)?)
}

fn new_mask(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    size: [u32; 2],
) -> Result<OutlineMask, busbar_gpu::GpuError> {
    let layer = |name, size| Layer::new(gpu, layout, (name, ID_FORMAT), size);
    let tiles = size.map(|pixels| pixels.div_ceil(TILE_PIXELS));
    let kind = ImageKind::Target { samples: 1 };
    let format = Format::Depth32;
    Ok(OutlineMask {
        layer: layer("outline mask", size)?,
        tiles: layer("outline tiles", tiles)?,
        edges: layer("outline edges", tiles)?,
        depth: Image::new(gpu, ImageDescription { name: "outline depth", kind, format, size })?,
    })
}
