//! egui's painter.

use std::collections::HashMap;
use std::mem::ManuallyDrop;
use std::sync::Arc;

use ash::vk;
use egui::epaint::{ImageData, ImageDelta, Primitive};
use egui::{ColorImage, TextureId, TexturesDelta};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer};

use crate::device::Device;
use crate::{Format, Gpu, GpuError, MAX_FRAMES_IN_FLIGHT};

/// Paints egui's primitives over pictures of one format.
///
/// It draws into the undecoded view of the picture: egui's colours are sRGB
/// bytes and are meant to be blended as such.
pub struct Overlay {
    painter: ManuallyDrop<Renderer<GpuAllocator>>,
    device: Arc<Device>,
    /// What each texture holds. The painter's partial updates give the rest of
    /// a texture up, so that textures are always uploaded whole.
    images: HashMap<TextureId, Arc<ColorImage>>,
    /// Textures to free once a submission is finished.
    dying: Vec<(u64, TextureId)>,
}

impl Overlay {
    /// A painter for pictures of this format.
    ///
    /// # Errors
    /// When the format is no picture's, or memory runs out.
    pub fn new(gpu: &Gpu, format: Format) -> Result<Self, GpuError> {
        let device = Arc::clone(gpu.device());
        let color_attachment_format =
            format.undecoded().ok_or(GpuError::Misuse("panels over what is no picture"))?;
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: color_attachment_format.vk(),
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { in_flight_frames: MAX_FRAMES_IN_FLIGHT, ..Default::default() };
        let painter = Renderer::with_gpu_allocator(
            device.shared_allocator(),
            device.raw.clone(),
            mode,
            options,
        )
        .map_err(refused)?;
        Ok(Self {
            painter: ManuallyDrop::new(painter),
            device,
            images: HashMap::new(),
            dying: Vec::new(),
        })
    }

    /// Takes egui's new, changed and freed textures over. Call it before the
    /// frame that needs them begins, once for every delta that egui gives.
    ///
    /// # Errors
    /// When a texture is too large for the device, or memory runs out.
    pub fn update(&mut self, gpu: &mut Gpu, delta: &TexturesDelta) -> Result<(), GpuError> {
        self.free_finished()?;
        if !delta.set.is_empty() {
            // Frames in flight may still read what is replaced here.
            self.device.wait_for_all("the panels' textures")?;
        }
        for (&id, deltas) in &delta.set {
            for delta in deltas {
                self.merge(id, delta)?;
            }
            self.upload(gpu, id, deltas.last().map(|delta| delta.options))?;
        }
        // After the frame that is about to be recorded.
        let value = self.device.submitted() + 1;
        self.dying.extend(delta.free.iter().map(|&id| (value, id)));
        Ok(())
    }

    fn free_finished(&mut self) -> Result<(), GpuError> {
        let finished = self.device.finished()?;
        for (_, id) in self.dying.extract_if(.., |(value, _)| *value <= finished) {
            self.images.remove(&id);
            self.painter.free_texture(id).map_err(refused)?;
        }
        Ok(())
    }

    /// Applies a delta to what we know of the texture.
    fn merge(&mut self, id: TextureId, delta: &ImageDelta) -> Result<(), GpuError> {
        let ImageData::Color(patch) = &delta.image;
        let Some([left, top]) = delta.pos else {
            let limit = self.device.adapter.limits.max_image_dimension2_d;
            let [width, height] = patch.size;
            if width.max(height) > limit as usize {
                return Err(GpuError::TooLarge {
                    what: "a texture of the panels",
                    asked: width.max(height) as u64,
                    limit: u64::from(limit),
                });
            }
            self.images.insert(id, Arc::clone(patch));
            return Ok(());
        };
        let image = self
            .images
            .get_mut(&id)
            .ok_or_else(|| GpuError::Overlay(format!("{id:?} changes before it exists")))?;
        let image = Arc::make_mut(image);
        let [width, height] = patch.size;
        if left + width > image.size[0] || top + height > image.size[1] {
            return Err(GpuError::Overlay(format!("{id:?} changes beyond its edge")));
        }
        for (row, pixels) in patch.pixels.chunks_exact(width.max(1)).enumerate() {
            let start = (top + row) * image.size[0] + left;
            image.pixels[start..start + width].copy_from_slice(pixels);
        }
        Ok(())
    }

    fn upload(
        &mut self,
        gpu: &Gpu,
        id: TextureId,
        options: Option<egui::TextureOptions>,
    ) -> Result<(), GpuError> {
        let Some(image) = self.images.get(&id).filter(|image| !image.pixels.is_empty()) else {
            return Ok(());
        };
        let whole = ImageDelta::full(Arc::clone(image), options.unwrap_or_default());
        let pool = gpu.slots[MAX_FRAMES_IN_FLIGHT].pool;
        self.painter.set_texture(self.device.queue, pool, id, &whole).map_err(refused)
    }

    /// Records the painting, inside a pass over the undecoded view.
    pub(crate) fn record(
        &mut self,
        commands: vk::CommandBuffer,
        extent: vk::Extent2D,
        pixels_per_point: f32,
        primitives: &[egui::ClippedPrimitive],
    ) -> Result<(), GpuError> {
        if !(pixels_per_point.is_finite() && pixels_per_point > 0.0) {
            return Err(GpuError::Overlay(format!("{pixels_per_point} pixels per point")));
        }
        let has_triangles = primitives.iter().any(|primitive| {
            matches!(&primitive.primitive, Primitive::Mesh(mesh) if !mesh.indices.is_empty())
        });
        if !has_triangles {
            // The painter would make empty buffers, which Vulkan forbids.
            return Ok(());
        }
        self.painter.cmd_draw(commands, extent, pixels_per_point, primitives).map_err(refused)
    }
}

impl Drop for Overlay {
    fn drop(&mut self) {
        // On a hung device the painter stays; the device reports it.
        if let Err(error) = self.device.wait_for_all("closing the panels")
            && !matches!(error, GpuError::DeviceLost(_))
        {
            return;
        }
        // SAFETY: dropped once, here, and nothing drawn by it is in flight.
        unsafe { ManuallyDrop::drop(&mut self.painter) };
    }
}

fn refused(error: egui_ash_renderer::RendererError) -> GpuError {
    match error {
        egui_ash_renderer::RendererError::Vulkan(code) => crate::error::at("painting panels")(code),
        egui_ash_renderer::RendererError::GpuAllocator(error) => {
            crate::error::allocating("painting panels")(error)
        }
        error => GpuError::Overlay(error.to_string()),
    }
}
