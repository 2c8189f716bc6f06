//! The images a frame is drawn into.

use busbar_gpu::{
    ClearColor, Format, Gpu, GpuError, Image, ImageDescription, ImageKind, Targets, Viewport,
};

/// Colour, depth and the finished picture, all of one size.
pub(crate) struct SceneTargets {
    /// Several samples a pixel; `None` with one, when the picture is drawn
    /// into directly.
    color: Option<Image>,
    depth: Image,
    pub(crate) picture: Image,
}

impl SceneTargets {
    pub(crate) fn new(
        gpu: &Gpu,
        format: Format,
        samples: u32,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let image = |name, format, samples| {
            let kind = ImageKind::Target { samples };
            Image::new(gpu, ImageDescription { name, kind, format, size })
        };
        let color = match samples {
            1 => None,
            _ => Some(image("colour samples", format, samples)?),
        };
        Ok(Self {
            color,
            depth: image("depth", Format::Depth32, samples)?,
            picture: image("picture", format, 1)?,
        })
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.picture.size()
    }

    pub(crate) fn cleared_to(&self, [r, g, b]: [f32; 3]) -> Targets<'_> {
        let resolve = self.color.as_ref().map(|_| &self.picture);
        Targets {
            color: self.color.as_ref().unwrap_or(&self.picture),
            resolve,
            depth: &self.depth,
            clear: ClearColor::Linear([r, g, b, 1.0]),
        }
    }
}

/// Clip space over exactly the picture.
pub(crate) fn whole(size: [u32; 2]) -> Viewport {
    Viewport { origin: [0.0; 2], size: size.map(|pixels| pixels as f32) }
}
