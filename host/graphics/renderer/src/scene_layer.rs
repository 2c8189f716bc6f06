//! Scene layer: the image of the scene without panels, kept while the scene rests, so that a frame
//! in which panels alone change costs a copy in place of the scene's passes.

use busbar_geometry::Bounds;
use busbar_gpu::{Format, Gpu, GpuError, Image, ImageArea, ImageDescription, ImageKind, Recorder};

use crate::density_planes::DensityPlane;
use crate::{CameraView, Frame, FrameStats, Ground, InstanceSource, OutlinedObject, SectionPlane};

/// All that the image of a scene depends on, panels aside. Equal content gives an equal image.
#[derive(Clone, Debug)]
struct SceneContent {
    parts: ContentParts,
    object_highlights: Vec<[f32; 4]>,
    outlined: Vec<OutlinedObject>,
    planes: Vec<DensityPlane>,
}

/// Parts of the content that are compared without a look at lists.
#[derive(Clone, Copy, Debug, PartialEq)]
struct ContentParts {
    size: [u32; 2],
    camera: CameraView,
    /// Revision of the draw list.
    instances: u64,
    wireframe: bool,
    background: [f32; 3],
    ground: Option<Ground>,
    fog_distance: Option<f32>,
    shadow_bounds: Option<Bounds>,
    section: Option<SectionPlane>,
    /// Revision of lines and faces; none without any.
    polylines: Option<u64>,
    pixels_per_point: f32,
    /// Size of the scene's image, which is scaled to the picture.
    scene_size: [u32; 2],
}

impl ContentParts {
    /// Returns the parts of a frame; none where its instances have no revision.
    fn from_frame(frame: &Frame<'_>, size: [u32; 2]) -> Option<Self> {
        let InstanceSource::Retained(list) = frame.instances else { return None };
        Some(Self {
            size,
            camera: frame.camera,
            instances: list.revision(),
            wireframe: frame.wireframe,
            background: frame.background,
            ground: frame.ground,
            fog_distance: frame.fog_distance,
            shadow_bounds: frame.shadow_bounds,
            section: frame.section,
            polylines: frame.polylines.map(|lines| lines.revision),
            pixels_per_point: frame.overlay.map_or(1.0, |overlay| overlay.pixels_per_point),
            scene_size: frame.scene_size(size),
        })
    }
}

/// Kept image of the scene, and the content that was drawn last.
#[derive(Default)]
pub(crate) struct SceneLayer {
    /// Content of the scene in the last picture; none where that is not known.
    content: Option<SceneContent>,
    /// Statistics of drawing that content.
    stats: FrameStats,
    image: Option<Image>,
    /// True while the image shows the content.
    is_kept: bool,
}

impl SceneLayer {
    /// Reports whether the last picture showed the scene of a frame.
    pub(crate) fn shows(&self, frame: &Frame<'_>, size: [u32; 2]) -> bool {
        self.difference(frame, size).is_none()
    }

    /// Returns the name of the first part in which a frame's scene differs from that of the last
    /// picture; none where it does not differ.
    pub(crate) fn difference(&self, frame: &Frame<'_>, size: [u32; 2]) -> Option<&'static str> {
        let (Some(content), Some(parts)) = (&self.content, ContentParts::from_frame(frame, size))
        else {
            return Some("all");
        };
        let before = &content.parts;
        let planes = frame.polylines.map_or(&[][..], |lines| lines.planes);
        let is_same = [
            ("size", (before.size, before.pixels_per_point) == (size, parts.pixels_per_point)),
            ("camera", before.camera == parts.camera),
            ("resolution", before.scene_size == parts.scene_size),
            ("instances", before.instances == parts.instances),
            ("highlights", content.object_highlights == frame.object_highlights),
            ("lines", before.polylines == parts.polylines && content.planes == planes),
            ("outlines", content.outlined == frame.outlined),
            ("surroundings", *before == parts),
        ];
        is_same.into_iter().find_map(|(name, is_same)| (!is_same).then_some(name))
    }

    /// Reports whether the image of the content is kept.
    pub(crate) fn is_kept(&self) -> bool {
        self.is_kept
    }

    /// Returns the statistics of a frame with the scene of the last picture.
    pub(crate) fn stats(&self) -> FrameStats {
        let nothing = FrameStats::default();
        FrameStats {
            is_scene_kept: true,
            depth_wait_millis: nothing.depth_wait_millis,
            occlusion_millis: nothing.occlusion_millis,
            resolve_millis: nothing.resolve_millis,
            resolved: nothing.resolved,
            shadows_drawn: nothing.shadows_drawn,
            waiting: nothing.waiting,
            ..self.stats
        }
    }

    /// Forgets the content: the picture is undefined, or what it is made of has changed.
    pub(crate) fn forget(&mut self) {
        (self.content, self.is_kept) = (None, false);
    }

    /// Notes that the scene of a frame was drawn. The image is kept once a second frame has the
    /// same content: one that changes in each frame is never copied.
    pub(crate) fn note_drawn(
        &mut self,
        recorder: &mut Recorder<'_>,
        frame: &Frame<'_>,
        picture: &Image,
        stats: FrameStats,
    ) -> Result<(), GpuError> {
        let rests = self.shows(frame, picture.size());
        self.stats = stats;
        if rests {
            let image = self.image(recorder.gpu(), picture.format(), picture.size())?;
            recorder.copy_image(picture, &image, ImageArea::whole(picture))?;
            self.is_kept = true;
            return Ok(());
        }
        self.is_kept = false;
        self.content = ContentParts::from_frame(frame, picture.size()).map(|parts| SceneContent {
            parts,
            object_highlights: frame.object_highlights.to_vec(),
            outlined: frame.outlined.to_vec(),
            planes: frame.polylines.map_or_else(Vec::new, |lines| lines.planes.to_vec()),
        });
        Ok(())
    }

    /// Copies a part of the kept image into the picture. Returns false where none is kept.
    pub(crate) fn restore(
        &self,
        recorder: &mut Recorder<'_>,
        picture: &Image,
        area: ImageArea,
    ) -> Result<bool, GpuError> {
        let Some(image) = self.image.as_ref().filter(|_| self.is_kept) else { return Ok(false) };
        recorder.copy_image(image, picture, area)?;
        Ok(true)
    }

    /// Returns an image of this format and size, made now if there is none.
    fn image(&mut self, gpu: &Gpu, format: Format, size: [u32; 2]) -> Result<Image, GpuError> {
        let fits = |image: &Image| (image.format(), image.size()) == (format, size);
        let image = match self.image.take().filter(fits) {
            Some(image) => image,
            None => {
                let kind = ImageKind::Target { samples: 1 };
                Image::new(gpu, ImageDescription { name: "scene layer", kind, format, size })?
            }
        };
        self.image = Some(image.clone());
        Ok(image)
    }
}
