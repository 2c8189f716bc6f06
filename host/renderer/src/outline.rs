//! Outlines of what is hovered over and selected.

use std::ops::Range;

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, Blend, ClearColor, DepthAfter, Format, Gpu, Image,
    ImageDescription, ImageKind, MAX_FRAMES_IN_FLIGHT, Pipeline, Recorder, Start, Targets,
};
use busbar_shaders::{FrameUniform, OUTLINE};

use crate::batch::{Part, Plan};
use crate::layer::{Layer, ready};
use crate::model::GpuModel;
use crate::pick::ID_FORMAT;
use crate::pipelines::{Layouts, MaskShading};
use crate::recipe::screen_pipeline;
use crate::roster::Roster;
use crate::scene_pass::{SceneDrawer, Sections};
use crate::shadows::Drawn;
use crate::sight::Sight;
use crate::stream::{FrameStream, MAX_FEATURE_HIGHLIGHTS};
use crate::targets::{Mask, SceneTargets, whole};
use crate::{DrawInstance, Frame, Instances, Outlined, RenderError};

/// As `TILE` of the shader.
const TILE_PIXELS: u32 = 8;

/// What draws them; made when something is outlined for the first time.
pub(crate) struct Outlines {
    mask: MaskShading,
    section_mask: Option<MaskShading>,
    tiles: Pipeline,
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
        let lines = ("outline", OUTLINE, c"outline_main");
        let over = (gpu.picture_format(), Blend::Over);
        let streams = (0..MAX_FRAMES_IN_FLIGHT)
            .map(|_| FrameStream::new(gpu, &layouts.frame, more))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            mask: MaskShading::new(gpu, layouts, false)?,
            section_mask: None,
            tiles: screen_pipeline(gpu, tiles, &groups[..2], (ID_FORMAT, Blend::Replace))?,
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
        let stream = &mut self.streams[recorder.slot()];
        stream.write(recorder.gpu(), (&layouts.frame, more), uniform, &self.plan)?;
        let frame_group = &self.streams[recorder.slot()].group;
        let size = targets.size();
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
        let mut pass = recorder.pass(&cleared, whole(size))?;
        drawer.draw(&mut pass, &shading.faces, Sections::All)?;
        if let Some(edges) = &shading.edges {
            // What is thinner than a pixel has edges.
            drawer.draw(&mut pass, edges, Sections::All)?;
        }
        drop(pass);
        recorder.sample(&[&mask.layer.image]);
        let groups: [&BindGroup; 3] = [frame_group, &mask.layer.group, &mask.tiles.group];
        recorder.screen_pass(&mask.tiles.image, false, &self.tiles, &groups[..2])?;
        recorder.sample(&[&mask.tiles.image]);
        Ok(recorder.screen_pass(&targets.picture, true, &self.lines, &groups)?)
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
    let tiles = size.map(|pixels| pixels.div_ceil(TILE_PIXELS));
    let kind = ImageKind::Target { samples: 1 };
    let format = Format::Depth32;
    Ok(Mask {
        layer: Layer::new(gpu, layout, ("outline mask", ID_FORMAT), size)?,
        tiles: Layer::new(gpu, layout, ("outline tiles", ID_FORMAT), tiles)?,
        depth: Image::new(gpu, ImageDescription { name: "outline depth", kind, format, size })?,
    })
}
