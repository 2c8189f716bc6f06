//! Transfers: staging uploads, mipmap generation and read-back.

use ash::vk;

use crate::format::PIXEL_BYTES;
use crate::image::ImageUse;
use crate::{
    Buffer, BufferArena, BufferSlice, BufferUsage, Format, Gpu, GpuError, Image, ImageArea,
    ImageDescription, ImageKind, Recorder,
};

/// Bytes that may wait in staging buffers before an upload waits for the GPU.
const MAX_STAGED_BYTES: u64 = 64 << 20;

impl Recorder<'_> {
    /// Uploads bytes into a new buffer on the device.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn upload_buffer(
        &mut self,
        name: &'static str,
        usage: BufferUsage,
        bytes: &[u8],
    ) -> Result<Buffer, GpuError> {
        let buffer = Buffer::on(self.device(), name, usage, bytes.len() as u64)?;
        let write = |into: &mut [u8]| into.copy_from_slice(bytes);
        self.fill(&buffer, 0, bytes.len() as u64, write)?;
        Ok(buffer)
    }

    /// Uploads bytes into a slice of an arena.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn upload_slice(
        &mut self,
        arena: &mut BufferArena,
        bytes: &[u8],
    ) -> Result<BufferSlice, GpuError> {
        let write = |into: &mut [u8]| into.copy_from_slice(bytes);
        self.upload_slice_with(arena, bytes.len() as u64, write)
    }

    /// Uploads bytes that `write` writes into a slice of an arena. The memory given to `write` has
    /// undefined contents.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn upload_slice_with(
        &mut self,
        arena: &mut BufferArena,
        bytes: u64,
        write: impl FnOnce(&mut [u8]),
    ) -> Result<BufferSlice, GpuError> {
        let slice = arena.allocate(self.device(), bytes)?;
        if !slice.buffer().is_host_visible() {
            // Draws of other parts count as reads of the whole buffer.
            let read = vk::MemoryBarrier2::default()
                .src_stage_mask(
                    vk::PipelineStageFlags2::VERTEX_INPUT | vk::PipelineStageFlags2::COMPUTE_SHADER,
                )
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER);
            self.barriers(&[], &[read]);
        }
        self.fill(slice.buffer(), slice.offset(), bytes, write)?;
        Ok(slice)
    }

    /// Has bytes written to a place in a buffer on the device, for all that reads it
    /// afterwards. The GPU must not use the place yet.
    fn fill(
        &mut self,
        buffer: &Buffer,
        offset: u64,
        bytes: u64,
        write: impl FnOnce(&mut [u8]),
    ) -> Result<(), GpuError> {
        if bytes == 0 {
            return Ok(());
        }
        if buffer.is_host_visible() {
            // Submitting makes it visible to the device (Vulkan specification, "Host Write
            // Ordering Guarantees").
            return buffer.write_with(offset, bytes, write);
        }
        let staging = self.stage(bytes, write)?;
        let region = [vk::BufferCopy::default().dst_offset(offset).size(bytes)];
        // SAFETY: the commands are being recorded; both buffers hold so many
        // bytes there and live until the submission is finished.
        unsafe {
            self.device().raw.cmd_copy_buffer(
                self.commands(),
                staging.raw(),
                buffer.raw(),
                &region,
            );
        }
        self.barriers(
            &[],
            &[vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(
                    vk::PipelineStageFlags2::VERTEX_INPUT
                        | vk::PipelineStageFlags2::VERTEX_SHADER
                        | vk::PipelineStageFlags2::FRAGMENT_SHADER
                        | vk::PipelineStageFlags2::COMPUTE_SHADER,
                )
                .dst_access_mask(
                    vk::AccessFlags2::INDEX_READ
                        | vk::AccessFlags2::VERTEX_ATTRIBUTE_READ
                        | vk::AccessFlags2::UNIFORM_READ
                        | vk::AccessFlags2::SHADER_STORAGE_READ
                        | vk::AccessFlags2::SHADER_STORAGE_WRITE,
                )],
        );
        Ok(())
    }

    /// Uploads a texture and generates its mipmaps. `pixels` are rows from the top, four bytes a
    /// pixel.
    ///
    /// # Errors
    /// When the pixels do not fill the size, or memory runs out.
    pub fn upload_texture(
        &mut self,
        name: &'static str,
        format: Format,
        size: [u32; 2],
        pixels: &[u8],
    ) -> Result<Image, GpuError> {
        let kind = ImageKind::Texture;
        self.upload_image(ImageDescription { name, kind, format, size }, pixels)
    }

    /// Uploads a texture without mipmaps, from pixels like those of [`Recorder::upload_texture`].
    ///
    /// # Errors
    /// Returns the errors of [`Recorder::upload_texture`].
    pub fn upload_flat_texture(
        &mut self,
        name: &'static str,
        format: Format,
        size: [u32; 2],
        pixels: &[u8],
    ) -> Result<Image, GpuError> {
        let kind = ImageKind::FlatTexture;
        self.upload_image(ImageDescription { name, kind, format, size }, pixels)
    }

    fn upload_image(
        &mut self,
        description: ImageDescription,
        pixels: &[u8],
    ) -> Result<Image, GpuError> {
        let [width, height] = description.size;
        let needed = u64::from(width) * u64::from(height) * PIXEL_BYTES;
        if pixels.len() as u64 != needed {
            return Err(GpuError::Misuse("a texture whose pixels do not fill its size"));
        }
        let image = Image::on(self.device(), description)?;
        let staging = self.stage(needed, |into| into.copy_from_slice(pixels))?;
        self.transition(&image, ImageUse::CopyTarget);
        self.copy_to_image(staging.raw(), &image);
        self.fill_levels(&image);
        Ok(image)
    }

    /// Shrinks each level into the next and leaves all to be sampled.
    fn fill_levels(&mut self, image: &Image) {
        let aspect = image.format().aspect();
        let last = image.levels() - 1;
        for level in 0..last {
            self.barrier(
                image.raw(),
                aspect,
                level..level + 1,
                ImageUse::CopyTarget,
                ImageUse::CopySource,
            );
            self.blit([(image, level), (image, level + 1)]);
        }
        if last > 0 {
            let shrunk = 0..last;
            self.barrier(image.raw(), aspect, shrunk, ImageUse::CopySource, ImageUse::Sampled);
        }
        self.barrier(image.raw(), aspect, last..last + 1, ImageUse::CopyTarget, ImageUse::Sampled);
        *image.usage() = ImageUse::Sampled;
    }

    fn stage(&mut self, size: u64, write: impl FnOnce(&mut [u8])) -> Result<Buffer, GpuError> {
        if self.staged_bytes > 0 && self.staged_bytes + size > MAX_STAGED_BYTES {
            self.flush()?;
        }
        let staging = Buffer::on(self.device(), "staging", BufferUsage::Staging, size)?;
        staging.write_with(0, size, write)?;
        self.staged_bytes += size;
        Ok(staging)
    }

    /// Copies a buffer written by a compute shader to where the CPU can read it.
    ///
    /// # Errors
    /// When memory runs out, or the buffer is none that is read back.
    pub fn download_buffer(&mut self, from: &Buffer) -> Result<Buffer, GpuError> {
        if from.usage() != BufferUsage::ComputeReadback {
            return Err(GpuError::Misuse("a read-back of a buffer that is not made for it"));
        }
        let buffer = Buffer::on(self.device(), "read-back", BufferUsage::Readback, from.size())?;
        let written = vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_READ);
        self.barriers(&[], &[written]);
        let region = [vk::BufferCopy::default().size(from.size())];
        // SAFETY: the commands are being recorded, outside any pass; both buffers hold so
        // many bytes and live until the submission is finished.
        unsafe {
            self.device().raw.cmd_copy_buffer(self.commands(), from.raw(), buffer.raw(), &region);
        }
        self.barriers(&[], &[host_read_barrier()]);
        Ok(buffer)
    }

    /// Copies a part of an image's depth to where the CPU can read it.
    ///
    /// # Errors
    /// When the image holds no depth that can be copied, or the part does not fit.
    pub fn copy_depth(
        &mut self,
        image: &Image,
        area: ImageArea,
        copy: &mut DepthCopy,
    ) -> Result<(), GpuError> {
        let [width, height] = area.size.map(u64::from);
        let fits =
            area.is_within(image.size()) && width * height * PIXEL_BYTES <= copy.buffer.size();
        if image.kind() != ImageKind::SampledTarget || image.format() != Format::Depth32 || !fits {
            return Err(GpuError::Misuse("a read-back of depth that is not there"));
        }
        self.transition(image, ImageUse::CopySource);
        copy.size = area.size;
        self.copy_from_image(image, area, copy.buffer.raw());
        self.barriers(&[], &[host_read_barrier()]);
        Ok(())
    }

    /// Copies an image of one sample to where the CPU can read it.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn download(&mut self, image: &Image) -> Result<Download, GpuError> {
        if image.kind() != (ImageKind::Target { samples: 1 }) {
            return Err(GpuError::Misuse("a read-back of an image that is no resolved target"));
        }
        let size = image.size();
        let bytes = u64::from(size[0]) * u64::from(size[1]) * PIXEL_BYTES;
        let buffer = Buffer::on(self.device(), "read-back", BufferUsage::Readback, bytes)?;
        self.transition(image, ImageUse::CopySource);
        self.copy_from_image(image, ImageArea::whole(image), buffer.raw());
        self.barriers(&[], &[host_read_barrier()]);
        Ok(Download { buffer, format: image.format() })
    }
}

/// Returns the barrier after which the host can read copied bytes.
fn host_read_barrier() -> vk::MemoryBarrier2<'static> {
    vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
        .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::HOST_READ)
}

/// Depth of a part of an image where the CPU can read it: room that is used again.
pub struct DepthCopy {
    buffer: Buffer,
    size: [u32; 2],
}

impl DepthCopy {
    /// Allocates room for the depth of an image of at most so many pixels; it is empty at first.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn new(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Self, GpuError> {
        let bytes = u64::from(width) * u64::from(height) * PIXEL_BYTES;
        let buffer = Buffer::new(gpu, "depth read-back", BufferUsage::Readback, bytes)?;
        Ok(Self { buffer, size: [0; 2] })
    }

    /// Returns width and height of the last copy, pixels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Passes the copied depths to `read`, rows from the top. The recorder must have been submitted
    /// and waited for.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn read_with(&self, read: impl FnOnce(&[f32])) -> Result<(), GpuError> {
        let [width, height] = self.size.map(|pixels| pixels as usize);
        let mut done = Err(GpuError::Misuse("depth that does not lie as numbers do"));
        self.buffer.read_whole_with(|bytes| {
            let depths = bytemuck::try_cast_slice(&bytes[..width * height * size_of::<f32>()]);
            if let Ok(depths) = depths {
                read(depths);
                done = Ok(());
            }
        })?;
        done
    }
}

/// Pixels that are being read back, complete once their recorder was submitted and waited for.
pub struct Download {
    buffer: Buffer,
    format: Format,
}

impl Download {
    /// Rows from the top, four bytes a pixel; colours in the order red, green,
    /// blue, alpha.
    ///
    /// # Errors
    /// When the buffer cannot be read.
    pub fn pixels(&self) -> Result<Vec<u8>, GpuError> {
        let mut bytes = self.buffer.read()?;
        if self.format == Format::Bgra8Srgb {
            bytes.chunks_exact_mut(PIXEL_BYTES as usize).for_each(|pixel| pixel.swap(0, 2));
        }
        Ok(bytes)
    }
}
