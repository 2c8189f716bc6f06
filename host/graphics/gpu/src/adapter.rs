//! Physical device selection by abilities, type and name.

use std::ffi::CStr;

use ash::{khr, vk};

use crate::error::vulkan_error;
use crate::instance::Instance;
use crate::surface::Surface;
use crate::{Format, GpuError};

/// Names the device to use, before the configuration does.
const OVERRIDE_VARIABLE: &str = "BUSBAR_DEVICE";
/// Setting of the configuration that names the device.
const CONFIGURED: &str = "view.device";

/// A physical device that can do the work.
pub(crate) struct Adapter {
    pub(crate) raw: vk::PhysicalDevice,
    pub(crate) name: String,
    pub(crate) queue_family: u32,
    pub(crate) limits: vk::PhysicalDeviceLimits,
    pub(crate) properties: vk::PhysicalDeviceProperties,
    pub(crate) can_draw_lines: bool,
    /// Many draw calls can be read from memory by one command.
    pub(crate) draws_indirectly: bool,
    /// Timestamp support of the queue.
    pub(crate) has_timestamps: bool,
    pub(crate) filters_depth: bool,
    /// Software rasterizer: the processor draws.
    pub(crate) is_software: bool,
    rank: u32,
}

impl Adapter {
    /// Chooses the best device: discrete, integrated, virtual, then software. A name in `wanted` or
    /// the environment restricts the choice.
    pub(crate) fn choose(
        instance: &Instance,
        surface: Option<&Surface>,
        wanted: Option<&str>,
    ) -> Result<Self, GpuError> {
        // SAFETY: the instance lives.
        let devices =
            unsafe { instance.raw.enumerate_physical_devices() }.map_err(|code| match code {
                vk::Result::ERROR_INITIALIZATION_FAILED => GpuError::NoDriver(code.to_string()),
                code => vulkan_error("listing devices")(code),
            })?;
        if devices.is_empty() {
            return Err(GpuError::NoDriver("no device found".to_owned()));
        }
        let devices = match requested_device(wanted) {
            Some(asked) => filter_by_name(instance, devices, asked)?,
            None => devices,
        };
        let mut refused = Vec::new();
        let mut usable = Vec::new();
        for device in devices {
            match Self::examine(instance, device, surface)? {
                Ok(adapter) => usable.push(adapter),
                Err(reason) => refused.push(reason),
            }
        }
        usable
            .into_iter()
            .min_by_key(|adapter| adapter.rank)
            .ok_or_else(|| GpuError::NoDevice(refused.join("; ")))
    }

    /// Examines a device; returns the adapter, or the reason why it will not do.
    fn examine(
        instance: &Instance,
        device: vk::PhysicalDevice,
        surface: Option<&Surface>,
    ) -> Result<Result<Self, String>, GpuError> {
        // SAFETY: `device` comes from this live instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(device) };
        let name = device_name(&properties);
        if let Some(missing) = missing_feature(instance, device, &properties, surface.is_some())? {
            return Ok(Err(format!("{name} lacks {missing}")));
        }
        let is_software = properties.device_type == vk::PhysicalDeviceType::CPU;
        let Some((queue_family, has_timestamps)) = queue_family(instance, device, surface)? else {
            return Ok(Err(format!("{name} has no queue that draws into this window")));
        };
        // SAFETY: as above.
        let features = unsafe { instance.raw.get_physical_device_features(device) };
        Ok(Ok(Self {
            raw: device,
            name,
            queue_family,
            limits: properties.limits,
            properties,
            can_draw_lines: features.fill_mode_non_solid == vk::TRUE,
            draws_indirectly: features.multi_draw_indirect == vk::TRUE
                && features.draw_indirect_first_instance == vk::TRUE,
            has_timestamps: has_timestamps && properties.limits.timestamp_period > 0.0,
            filters_depth: filters_depth(instance, device),
            is_software,
            rank: rank(properties.device_type),
        }))
    }
}

/// Reports whether samplers filter the results of depth comparisons.
fn filters_depth(instance: &Instance, device: vk::PhysicalDevice) -> bool {
    let format = Format::Depth32.vk();
    // SAFETY: `device` comes from this live instance.
    let found = unsafe { instance.raw.get_physical_device_format_properties(device, format) };
    found.optimal_tiling_features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
}

fn rank(kind: vk::PhysicalDeviceType) -> u32 {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        vk::PhysicalDeviceType::CPU => 3,
        _ => 4,
    }
}

fn device_name(properties: &vk::PhysicalDeviceProperties) -> String {
    properties
        .device_name_as_c_str()
        .map_or_else(|_| "unnamed device".to_owned(), |name| name.to_string_lossy().into_owned())
}

/// Returns the device asked for, and the place that asks; the environment takes precedence.
fn requested_device(wanted: Option<&str>) -> Option<(&'static str, String)> {
    let named = std::env::var(OVERRIDE_VARIABLE).ok().map(|name| (OVERRIDE_VARIABLE, name));
    named
        .filter(|(_, name)| !name.is_empty())
        .or_else(|| wanted.map(|name| (CONFIGURED, name.to_owned())))
}

/// Keeps the devices that a number or a part of a name names.
fn filter_by_name(
    instance: &Instance,
    devices: Vec<vk::PhysicalDevice>,
    (place, wanted): (&'static str, String),
) -> Result<Vec<vk::PhysicalDevice>, GpuError> {
    let name_of = |&device: &vk::PhysicalDevice| {
        // SAFETY: `device` comes from this live instance.
        device_name(&unsafe { instance.raw.get_physical_device_properties(device) })
    };
    let names: Vec<String> = devices.iter().map(name_of).collect();
    let named: Vec<_> = matching_devices(&names, &wanted)
        .into_iter()
        .filter_map(|index| devices.get(index).copied())
        .collect();
    if named.is_empty() {
        let numbered: Vec<_> =
            names.iter().enumerate().map(|(index, name)| format!("{index} \"{name}\"")).collect();
        return Err(GpuError::NoSuchDevice { place, wanted, available: numbered.join(", ") });
    }
    Ok(named)
}

/// Returns the devices of that number, or with that part in their names, whatever its case.
fn matching_devices(names: &[String], wanted: &str) -> Vec<usize> {
    if let Ok(index) = wanted.parse::<usize>()
        && index < names.len()
    {
        return vec![index];
    }
    let wanted = wanted.to_lowercase();
    (0..names.len()).filter(|&index| names[index].to_lowercase().contains(&wanted)).collect()
}

/// Returns the first required feature that the device lacks.
fn missing_feature(
    instance: &Instance,
    device: vk::PhysicalDevice,
    properties: &vk::PhysicalDeviceProperties,
    presents: bool,
) -> Result<Option<&'static str>, GpuError> {
    if properties.api_version < vk::API_VERSION_1_3 {
        return Ok(Some("Vulkan 1.3"));
    }
    let mut vulkan_12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut vulkan_13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features =
        vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan_12).push_next(&mut vulkan_13);
    // SAFETY: `device` comes from this live instance and knows Vulkan 1.3.
    let depth = unsafe {
        instance.raw.get_physical_device_features2(device, &mut features);
        instance.raw.get_physical_device_format_properties(device, vk::Format::D32_SFLOAT)
    };
    let robust = features.features.robust_buffer_access == vk::TRUE;
    let can_depth =
        depth.optimal_tiling_features.contains(vk::FormatFeatureFlags::DEPTH_STENCIL_ATTACHMENT);
    let needs = [
        (vulkan_12.timeline_semaphore == vk::TRUE, "timeline semaphores"),
        (vulkan_13.dynamic_rendering == vk::TRUE, "dynamic rendering"),
        (vulkan_13.synchronization2 == vk::TRUE, "synchronization2"),
        (robust, "robust buffer access"),
        (can_depth, "32-bit depth"),
        (!presents || has_extension(instance, device, khr::swapchain::NAME)?, "swapchains"),
    ];
    Ok(needs.into_iter().find(|(has, _)| !has).map(|(_, what)| what))
}

fn has_extension(
    instance: &Instance,
    device: vk::PhysicalDevice,
    wanted: &CStr,
) -> Result<bool, GpuError> {
    // SAFETY: `device` comes from this live instance.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(device) }
        .map_err(vulkan_error("listing device extensions"))?;
    Ok(extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(wanted)))
}

/// Finds a queue family that draws, computes and, with a surface, presents. Returns also whether it
/// writes timestamps. A device that draws has one that does both (Vulkan 1.3, 5.3.2).
fn queue_family(
    instance: &Instance,
    device: vk::PhysicalDevice,
    surface: Option<&Surface>,
) -> Result<Option<(u32, bool)>, GpuError> {
    // SAFETY: `device` comes from this live instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(device) };
    for (index, family) in families.iter().enumerate() {
        let index = index as u32;
        let presents = match surface {
            None => true,
            Some(surface) => surface.supports(device, index)?,
        };
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        if presents && family.queue_flags.contains(wanted) {
            return Ok(Some((index, family.timestamp_valid_bits > 0)));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::matching_devices;

    #[test]
    fn devices_are_chosen_by_number_or_part_of_their_name() {
        let names = ["NVIDIA RTX 4000", "Intel Arc", "llvmpipe (LLVM 15)"].map(String::from);
        let cases: [(&str, &[usize]); 7] = [
            ("1", &[1]),
            ("intel", &[1]),
            ("LLVMPIPE", &[2]),
            // No device 15 and no device 4000: parts of names.
            ("15", &[2]),
            ("4000", &[0]),
            ("a", &[0, 1]),
            ("radeon", &[]),
        ];
        for (wanted, expected) in cases {
            assert_eq!(matching_devices(&names, wanted), expected, "{wanted}");
        }
    }
}
