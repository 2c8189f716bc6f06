//! Intermediate images that one pass draws and another samples.

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, Format, Gpu, GpuError, Image, ImageDescription, ImageKind,
};

/// An image with the group that binds it alone.
pub(crate) struct Layer {
    pub(crate) image: Image,
    pub(crate) group: BindGroup,
}

impl Layer {
    /// Makes an image and its group; `layout` is that of a single texture.
    pub(crate) fn new(
        gpu: &Gpu,
        layout: &BindGroupLayout,
        (name, format): (&'static str, Format),
        size: [u32; 2],
    ) -> Result<Self, GpuError> {
        let kind = ImageKind::SampledTarget;
        let image = Image::new(gpu, ImageDescription { name, kind, format, size })?;
        Self::from_image(layout, image)
    }

    /// Binds an image that is there.
    pub(crate) fn from_image(layout: &BindGroupLayout, image: Image) -> Result<Self, GpuError> {
        let group = BindGroup::new(layout, &[Binding::Texture(&image)])?;
        Ok(Self { image, group })
    }
}

/// Returns the value in a slot, made now if there is none.
pub(crate) fn get_or_create<T, E>(
    slot: &mut Option<T>,
    make: impl FnOnce() -> Result<T, E>,
) -> Result<&mut T, E> {
    let made = match slot.take() {
        Some(there) => there,
        None => make()?,
    };
    Ok(slot.insert(made))
}
