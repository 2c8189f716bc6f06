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

    /// `background` in linear light, whatever the colours drawn are in.
    pub(crate) fn cleared_to(&self, background: [f32; 3], undecoded: bool) -> Targets<'_> {
        let [r, g, b] = if undecoded { background.map(srgb_from_linear) } else { background };
        let resolve = self.color.as_ref().map(|_| &self.picture);
        Targets {
            color: self.color.as_ref().unwrap_or(&self.picture),
            resolve,
            depth: &self.depth,
            clear: ClearColor::Linear([r, g, b, 1.0]),
            undecoded,
        }
    }
}

/// Clip space over exactly the picture.
pub(crate) fn whole(size: [u32; 2]) -> Viewport {
    Viewport { origin: [0.0; 2], size: size.map(|pixels| pixels as f32) }
}

/// Linear light as sRGB keeps it (IEC 61966-2-1), both from 0 to 1.
pub(crate) fn srgb_from_linear(light: f32) -> f32 {
    let light = light.clamp(0.0, 1.0);
    if light <= 0.003_130_8 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_encoded_by_the_standard() {
        assert_eq!(srgb_from_linear(0.0), 0.0);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-6);
        assert!((srgb_from_linear(0.502_886) * 255.0 - 188.0).abs() < 0.01);
        assert_eq!(srgb_from_linear(-1.0), 0.0);
    }
}
