//! Outlines of what is hovered over and selected.

use std::ops::Range;

use busbar_gpu::{
    Area, BindGroupLayout, Binding, Blend, ClearColor, DepthAfter, Format, Gpu, Image,
    ImageDescription, ImageKind, MAX_FRAMES_IN_FLIGHT, Pipeline, Recorder, Start, Targets,
};
use busbar_shaders::{FrameUniform, OUTLINE};

use crate::batch::{Part, Plan, mesh_at};
use crate::layer::{Layer, ready};
use crate::model::GpuModel;
use crate::pick::ID_FORMAT;
use crate::pipelines::{Layouts, MaskShading};
use crate::recipe::screen_pipeline;
use crate::roster::Roster;
use crate::scene_pass::{SceneDrawer, Sections};
use crate::screen_box::{ScreenBox, hull, pixels_of};
use crate::shadows::Drawn;
use crate::sight::{Sight, world_from_mesh};
use crate::stream::{FrameStream, MAX_FEATURE_HIGHLIGHTS};
use crate::targets::{Mask, SceneTargets, whole};
use crate::{CameraView, DrawInstance, Frame, Instances, Outlined, RenderError};

/// As `TILE` of the shader.
const TILE_PIXELS: u32 = 4;
/// Tiles that outlines reach at most, as `MAX_REACH` of the shader has it in pixels.
const REACH: u32 = 2;
/// Pixels around a box that what is in it may be drawn in: slender things and edges are drawn
/// a pixel wide.
const WIDENED: f32 = 2.0;

/// What draws them; made when something is outlined for the first time.
pub(crate) struct Outlines {
    mask: MaskShading,
    section_mask: Option<MaskShading>,
    tiles: Pipeline,
    edges: Pipeline,
    lines: Pipeline,
    streams: Vec<FrameStream>,
    roster: Roster,
    plan: Plan,
    /// The kinds of the objects 1, 2 and so on, as highlights.
    kinds: Vec<[f32; 4]>,
    /// What has one.
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
            .map(|_| FrameStream::new(gpu, &layouts.frame, more))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            mask: MaskShading::new(gpu, layouts, false)?,
            section_mask: None,
            tiles: screen_pipeline(gpu, tiles, &groups[..2], (ID_FORMAT, Blend::Replace))?,
            edges: screen_pipeline(gpu, edges, &groups, (ID_FORMAT, Blend::Replace))?,
            lines: screen_pipeline(gpu, lines, &groups, over)?,
            streams,
            roster: Roster::default(),
            plan: Plan::default(),
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
        drawn_with: Drawn<'_>,
        (frame, uniform): (&Frame<'_>, &FrameUniform),
    ) -> Result<(), RenderError> {
        self.choose(drawn_with.models, frame)?;
        let sight = Sight::through(&frame.camera.clip_from_world());
        self.roster.follow(drawn_with.models, Instances::Listed(&self.instances))?;
        self.plan.fill(drawn_with.models, &self.roster, &self.kinds, &sight)?;
        let size = targets.size();
        let Some(reached) = Reached::of((&self.plan, drawn_with.models), &frame.camera, size)
        else {
            return Ok(());
        };
        let stream = &mut self.streams[recorder.slot()];
        stream.write(recorder.gpu(), (&layouts.frame, more), uniform, &self.plan)?;
        let frame_group = &self.streams[recorder.slot()].group;
        ready(&mut targets.mask, || new_mask(recorder.gpu(), &layouts.texture, size))?;
        let (Some(scene_depth), Some(mask)) = (targets.depth(), &targets.mask) else {
            return Ok(());
        };
        let shading = match frame.section {
            None => &self.mask,
            Some(_) => {
                ready(&mut self.section_mask, || MaskShading::new(recorder.gpu(), layouts, true))?
            }
        };
        recorder.sample(&[&scene_depth.image]);
        let drawer = SceneDrawer {
            models: drawn_with.models,
            cache: drawn_with.cache,
            plan: &self.plan,
            frame_group,
            instances: &self.streams[recorder.slot()].instances,
            feature_kit: drawn_with.feature_kit,
            morpher: Some(drawn_with.morpher),
            part: Part::Rest,
            more: Some(&scene_depth.group),
            gathering: None,
            shows_backs: true,
        };
        let cleared = Targets {
            color: &mask.layer.image,
            resolve: None,
            depth: &mask.depth,
            depth_after: DepthAfter::Forgotten,
            start: Start::Cleared(ClearColor::Number(0)),
            undecoded: false,
        };
        let mut pass = recorder.pass_in(&cleared, whole(size), reached.looked_at())?;
        drawer.draw(&mut pass, &shading.faces, Sections::All)?;
        if let Some(edges) = &shading.edges {
            // What is thinner than a pixel has edges.
            drawer.draw(&mut pass, edges, Sections::All)?;
        }
        drop(pass);
        recorder.sample(&[&mask.layer.image]);
        let groups = |tiles| [frame_group, &mask.layer.group, tiles];
        let tiles = (&mask.tiles.image, reached.tiles());
        recorder.screen_pass_in(tiles, false, &self.tiles, &groups(&mask.tiles.group)[..2])?;
        recorder.sample(&[&mask.tiles.image]);
        let edges = (&mask.edges.image, reached.drawn_tiles());
        recorder.screen_pass_in(edges, false, &self.edges, &groups(&mask.tiles.group))?;
        recorder.sample(&[&mask.edges.image]);
        let picture = (&targets.picture, reached.drawn());
        Ok(recorder.screen_pass_in(picture, true, &self.lines, &groups(&mask.edges.group))?)
    }

    /// Lists the instances of which anything is outlined, and the kinds of objects.
    fn choose(
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
        for &Outlined { object, kind } in frame.outlined {
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

/// Where in a picture outlines may be: that of a few things is a small part of it, and a
/// rasteriser on the processor takes as long for all of it as for a scene.
struct Reached {
    /// Columns and rows of tiles that show anything of what is outlined.
    shown: [Range<u32>; 2],
    /// Of the picture, pixels.
    size: [u32; 2],
}

impl Reached {
    /// What a plan reaches; `None` where that is nothing.
    fn of(
        (plan, models): (&Plan, &[Option<GpuModel>]),
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
            tiles_of(&ScreenBox::of(&clip_from_mesh, &bounds), size)
        });
        let both = |one: [Range<u32>; 2], other: [Range<u32>; 2]| {
            [0, 1].map(|axis| hull(&one[axis], &other[axis]))
        };
        shown.reduce(both).map(|shown| Self { shown, size })
    }

    /// With so many more tiles around it.
    fn around(&self, more: u32) -> [Range<u32>; 2] {
        [0, 1].map(|axis| {
            let Range { start, end } = self.shown[axis];
            let most = self.size[axis].div_ceil(TILE_PIXELS);
            start.saturating_sub(more)..(end + more).min(most)
        })
    }

    fn pixels_around(&self, more: u32) -> Area {
        pixels_of(self.around(more).each_ref(), TILE_PIXELS, self.size)
    }

    fn tiles_around(&self, more: u32) -> Area {
        let [columns, rows] = self.around(more);
        let origin = [columns.start, rows.start];
        Area { origin, size: [columns.len() as u32, rows.len() as u32] }
    }

    /// Pixels that outlines are drawn in.
    fn drawn(&self) -> Area {
        self.pixels_around(REACH)
    }

    /// Tiles of these.
    fn drawn_tiles(&self) -> Area {
        self.tiles_around(REACH)
    }

    /// Tiles that are looked at where they are drawn.
    fn tiles(&self) -> Area {
        self.tiles_around(2 * REACH)
    }

    /// Pixels of those.
    fn looked_at(&self) -> Area {
        self.pixels_around(2 * REACH)
    }
}

/// The columns and rows of tiles that a box may show anything in, if there are any.
fn tiles_of(found: &ScreenBox, size: [u32; 2]) -> Option<[Range<u32>; 2]> {
    if found.nearest().is_some() {
        return found.tiles(size, TILE_PIXELS, WIDENED);
    }
    found.may_surround().then(|| size.map(|pixels| 0..pixels.div_ceil(TILE_PIXELS)))
}

/// The objects that are features of an instance, counted from 0.
fn features_of(models: &[Option<GpuModel>], drawn: &DrawInstance) -> Option<Range<usize>> {
    let first = (drawn.first_feature? as usize).checked_sub(1)?;
    let mesh = models.get(drawn.model.0 as usize)?.as_ref()?.meshes.get(drawn.mesh as usize)?;
    Some(first..first.checked_add(mesh.features.as_ref()?.count as usize)?)
}

fn new_mask(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    size: [u32; 2],
) -> Result<Mask, busbar_gpu::GpuError> {
    let layer = |name, size| Layer::new(gpu, layout, (name, ID_FORMAT), size);
    let tiles = size.map(|pixels| pixels.div_ceil(TILE_PIXELS));
    let kind = ImageKind::Target { samples: 1 };
    let format = Format::Depth32;
    Ok(Mask {
        layer: layer("outline mask", size)?,
        tiles: layer("outline tiles", tiles)?,
        edges: layer("outline edges", tiles)?,
        depth: Image::new(gpu, ImageDescription { name: "outline depth", kind, format, size })?,
    })
}
