//! Render targets of a frame: colour, depth and the resolved picture.

use busbar_gpu::{
    BindGroupLayout, ClearColor, DepthStore, Format, Gpu, GpuError, Image, ImageDescription,
    ImageKind, LoadOp, RenderTargets, Viewport,
};

use crate::layer::{Layer, get_or_create};

/// Colour, depth and the finished picture, all of one size.
pub(crate) struct SceneTargets {
    /// Several samples a pixel; `None` with one, when the picture is drawn
    /// into directly.
    color: Option<Image>,
    depth: Image,
    pub(crate) picture: Image,
    /// Depth with one sample a pixel, where a pass asked for it.
    one_depth: Option<Layer>,
    /// Intermediate images that passes over the picture leave for each other.
    pub(crate) sky_visibility: Option<Layer>,
    pub(crate) mask: Option<OutlineMask>,
}

/// Mask of outlined objects, where there are any, and its depth.
pub(crate) struct OutlineMask {
    pub(crate) layer: Layer,
    pub(crate) tiles: Layer,
    pub(crate) edges: Layer,
    pub(crate) depth: Image,
}

impl SceneTargets {
    pub(crate) fn new(
        gpu: &Gpu,
        format: Format,
        samples: u32,
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let image = |name, format, samples| {
            let kind = match (format, samples) {
                (Format::Depth32, 1) => ImageKind::SampledTarget,
                _ => ImageKind::Target { samples },
            };
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
            one_depth: None,
            sky_visibility: None,
            mask: None,
        })
    }

    /// Returns the targets of a slot, made anew unless they have this size, pixels.
    pub(crate) fn fitting<'a>(
        slot: &'a mut Option<Self>,
        gpu: &Gpu,
        samples: u32,
        size: [u32; 2],
    ) -> Result<&'a mut Self, GpuError> {
        let targets = match slot.take() {
            Some(targets) if targets.size() == size => targets,
            _ => Self::new(gpu, gpu.picture_format(), samples, size)?,
        };
        Ok(slot.insert(targets))
    }

    /// Makes [`SceneTargets::depth`] if it is missing; `layout` is that of a single texture.
    pub(crate) fn ensure_depth(
        &mut self,
        gpu: &Gpu,
        layout: &BindGroupLayout,
    ) -> Result<(), GpuError> {
        let (size, depth, has_one) = (self.size(), &self.depth, self.color.is_none());
        get_or_create(&mut self.one_depth, || match has_one {
            true => Layer::from_image(layout, depth.clone()),
            false => Layer::new(gpu, layout, ("depth of one sample", Format::Depth32), size),
        })?;
        Ok(())
    }

    /// Returns the depth attachment, where a pixel has one sample.
    pub(crate) fn single_sample_depth(&self) -> Option<&Image> {
        self.color.is_none().then_some(&self.depth)
    }

    /// Returns the depth with one sample a pixel, once it is made and drawn.
    pub(crate) fn depth(&self) -> Option<&Layer> {
        self.one_depth.as_ref()
    }

    pub(crate) fn size(&self) -> [u32; 2] {
        self.picture.size()
    }

    /// Returns the targets, cleared to a background in linear light, whatever the encoding drawn.
    /// With `keeps_depth`, [`SceneTargets::depth`] is drawn as well.
    pub(crate) fn cleared(
        &self,
        background: [f32; 3],
        undecoded: bool,
        keeps_depth: bool,
    ) -> RenderTargets<'_> {
        let depth_store = match &self.one_depth {
            Some(one) if keeps_depth && self.color.is_some() => {
                DepthStore::ResolveFirstSample(&one.image)
            }
            Some(_) if keeps_depth => DepthStore::Store,
            _ => DepthStore::Discard,
        };
        let [r, g, b] = if undecoded { background.map(srgb_from_linear) } else { background };
        let resolve = self.color.as_ref().map(|_| &self.picture);
        RenderTargets {
            color: self.color.as_ref().unwrap_or(&self.picture),
            resolve,
            depth: &self.depth,
            depth_store,
            load: LoadOp::Clear(ClearColor::Linear([r, g, b, 1.0])),
            undecoded,
        }
    }
}

/// Returns the viewport of exactly the picture.
pub(crate) fn full_viewport(size: [u32; 2]) -> Viewport {
    Viewport { origin: [0.0; 2], size: size.map(|pixels| pixels as f32) }
}

/// Encodes linear light as sRGB (IEC 61966-2-1), both from 0 to 1.
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
