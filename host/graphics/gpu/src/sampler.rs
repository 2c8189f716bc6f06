//! Samplers: filtering and address modes.

use std::sync::Arc;

use ash::vk;

use crate::deferred_destruction::DiscardedObject;
use crate::device::Device;
use crate::error::vulkan_error;
use crate::{Gpu, GpuError};

/// Address mode of a sampler outside 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AddressMode {
    /// Repeats the texture in tiles.
    Repeat,
    /// Clamps to the edge's colour.
    Clamp,
    /// Tiles, every other one mirrored.
    Mirror,
}

/// Sampler with linear filtering between pixels and levels; clones share it.
#[derive(Clone)]
pub struct Sampler(Arc<SamplerInner>);

struct SamplerInner {
    device: Arc<Device>,
    raw: vk::Sampler,
}

impl Sampler {
    /// Makes a sampler with an address mode along u and one along v.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn new(gpu: &Gpu, modes: [AddressMode; 2]) -> Result<Self, GpuError> {
        Self::create(gpu, modes, None)
    }

    /// Makes a depth comparison sampler. It returns the share of the nearest texels that pass: with
    /// reverse-Z, those that are not before the reference.
    ///
    /// # Errors
    /// When memory runs out.
    pub fn with_depth_comparison(gpu: &Gpu) -> Result<Self, GpuError> {
        Self::create(gpu, [AddressMode::Clamp; 2], Some(gpu.device().adapter.filters_depth))
    }

    /// Creates a sampler; `compares`: whether a comparison is filtered.
    fn create(
        gpu: &Gpu,
        [u, v]: [AddressMode; 2],
        compares: Option<bool>,
    ) -> Result<Self, GpuError> {
        let filter = match compares {
            Some(false) => vk::Filter::NEAREST,
            _ => vk::Filter::LINEAR,
        };
        let mode = |mode| match mode {
            AddressMode::Repeat => vk::SamplerAddressMode::REPEAT,
            AddressMode::Clamp => vk::SamplerAddressMode::CLAMP_TO_EDGE,
            AddressMode::Mirror => vk::SamplerAddressMode::MIRRORED_REPEAT,
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .compare_enable(compares.is_some())
            .compare_op(vk::CompareOp::GREATER_OR_EQUAL)
            .mipmap_mode(vk::SamplerMipmapMode::LINEAR)
            .address_mode_u(mode(u))
            .address_mode_v(mode(v))
            .address_mode_w(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .max_lod(vk::LOD_CLAMP_NONE);
        let device = Arc::clone(gpu.device());
        // SAFETY: the device lives; no optional feature is used.
        let raw = unsafe { device.raw.create_sampler(&info, None) }
            .map_err(vulkan_error("creating a sampler"))?;
        device.name(raw, "sampler");
        Ok(Self(Arc::new(SamplerInner { device, raw })))
    }

    pub(crate) fn raw(&self) -> vk::Sampler {
        self.0.raw
    }
}

impl Drop for SamplerInner {
    fn drop(&mut self) {
        self.device.discard(DiscardedObject::Sampler(self.raw));
    }
}
