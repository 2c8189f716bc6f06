//! Which object is at a pixel.

use busbar_gpu::{
    ClearColor, DepthAfter, Format, Gpu, GpuError, Image, ImageDescription, ImageKind, Targets,
    Viewport,
};

/// Object ids are 32-bit numbers.
pub(crate) const ID_FORMAT: Format = Format::R32Uint;

/// What stands where nothing was drawn.
const BACKGROUND: u32 = 0;

/// Where ids are drawn. For a single pixel the picture's viewport is moved so
/// that the pixel asked for falls onto it, and everything else is clipped.
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

    pub(crate) fn cleared(&self) -> Targets<'_> {
        Targets {
            color: &self.id,
            resolve: None,
            depth: &self.depth,
            depth_after: DepthAfter::Forgotten,
            clear: ClearColor::Number(BACKGROUND),
            undecoded: false,
        }
    }
}

/// Clip space over the picture, with the pixel at the origin.
pub(crate) fn around([x, y]: [u32; 2], size: [u32; 2]) -> Viewport {
    Viewport { origin: [-(x as f32), -(y as f32)], size: size.map(|pixels| pixels as f32) }
}

/// The objects of pixels that were read back.
pub(crate) fn objects_of(pixels: &[u8]) -> impl Iterator<Item = Option<u32>> {
    let (ids, _) = pixels.as_chunks();
    ids.iter().map(|&id| Some(u32::from_le_bytes(id)).filter(|&id| id != BACKGROUND))
}
