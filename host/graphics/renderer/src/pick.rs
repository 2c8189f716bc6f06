//! Picking: object ids drawn into an integer target and read back.

use busbar_gpu::{
    ClearColor, DepthStore, Download, Format, Gpu, GpuError, Image, ImageArea, ImageDescription,
    ImageKind, LoadOp, RenderTargets, Submission, Viewport,
};
use glam::{Mat4, vec3};

/// Object ids are 32-bit numbers.
pub(crate) const ID_FORMAT: Format = Format::R32Uint;

/// Id of pixels without an object.
const BACKGROUND: u32 = 0;

/// Render targets of object ids. For a single pixel the picture's viewport is moved so that this
/// pixel falls onto the target, and everything else is clipped.
pub(crate) struct PickTargets {
    pub(crate) id: Image,
    depth: Image,
}

impl PickTargets {
    pub(crate) fn new(gpu: &Gpu, size: [u32; 2]) -> Result<Self, GpuError> {
        let image = |name, format| {
            let kind = ImageKind::Target { samples: 1 };
            Image::new(gpu, ImageDescription { name, kind, format, size })
        };
        Ok(Self {
            id: image("object id", ID_FORMAT)?,
            depth: image("pick depth", Format::Depth32)?,
        })
    }

    pub(crate) fn cleared(&self) -> RenderTargets<'_> {
        RenderTargets {
            color: &self.id,
            resolve: None,
            depth: &self.depth,
            depth_store: DepthStore::Discard,
            load: LoadOp::Clear(ClearColor::Integer(BACKGROUND)),
            undecoded: false,
        }
    }
}

/// Part of a picture, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelArea {
    /// Upper left pixel of the part.
    pub origin: [u32; 2],
    /// Width and height of the part.
    pub size: [u32; 2],
    /// Width and height of the whole picture.
    pub picture: [u32; 2],
}

impl PixelArea {
    /// Returns the area of a single pixel.
    pub fn pixel(pixel: [u32; 2], picture: [u32; 2]) -> Self {
        Self { origin: pixel, size: [1, 1], picture }
    }

    /// Returns the area of the whole picture.
    pub fn whole(picture: [u32; 2]) -> Self {
        Self { origin: [0, 0], size: picture, picture }
    }

    pub(crate) fn is_within(&self) -> bool {
        let Self { origin, size, picture } = *self;
        ImageArea { origin, size }.is_within(picture)
    }

    /// Returns the picture's viewport, moved so that this part falls onto the target.
    pub(crate) fn viewport(&self) -> Viewport {
        let origin = self.origin.map(|pixels| -(pixels as f32));
        Viewport { origin, size: self.picture.map(|pixels| pixels as f32) }
    }

    /// Returns the transform from the picture's clip space to that of this part, for culling.
    pub(crate) fn clip_from_picture(&self) -> Mat4 {
        let [x, y] = [0, 1].map(|axis| {
            let [origin, size, whole] =
                [self.origin, self.size, self.picture].map(|pixels| pixels[axis] as f32);
            (whole / size, (whole - 2.0 * origin - size) / size)
        });
        Mat4::from_translation(vec3(x.1, y.1, 0.0)) * Mat4::from_scale(vec3(x.0, y.0, 1.0))
    }
}

/// Object ids that are being read back.
pub(crate) struct PendingPick {
    pub(crate) submission: Submission,
    pub(crate) download: Download,
}

/// State of a pick that was begun.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PickState {
    /// None was begun, or its device was lost.
    None,
    /// The device works on it.
    Pending,
    /// The objects of the part's pixels, rows from the top; `None` for the background.
    Done(Vec<Option<u32>>),
}

/// Decodes the objects of pixels that were read back.
pub(crate) fn objects_of(pixels: &[u8]) -> impl Iterator<Item = Option<u32>> {
    let (ids, _) = pixels.as_chunks();
    ids.iter().map(|&id| Some(u32::from_le_bytes(id)).filter(|&id| id != BACKGROUND))
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_part_of_the_picture_is_a_part_of_clip_space() {
        let area = PixelArea { origin: [300, 10], size: [100, 40], picture: [400, 200] };
        assert!(area.is_within() && !PixelArea { origin: [301, 10], ..area }.is_within());
        assert!(!PixelArea { size: [0, 1], ..area }.is_within());
        let to_clip = |x: f32, y: f32| Vec3::new(x / 200.0 - 1.0, y / 100.0 - 1.0, 0.3);
        let matrix = area.clip_from_picture();
        for (pixel, expected) in [([300.0, 10.0], [-1.0, -1.0]), ([400.0, 50.0], [1.0, 1.0])] {
            let clip = matrix.project_point3(to_clip(pixel[0], pixel[1]));
            let [x, y] = expected;
            assert!(clip.distance(Vec3::new(x, y, 0.3)) < 1e-5, "{clip}");
        }
    }
}
