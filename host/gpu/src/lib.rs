//! Vulkan instance, device, memory, swapchain and frames in flight
