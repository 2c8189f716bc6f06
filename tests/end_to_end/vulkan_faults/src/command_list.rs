//! Commands that may fail, their arguments after the handle, and their codes besides success
//! ("Return Codes" of the specification).

/// Invokes a macro with all commands: `name(argument: type, ...) [code, ...];`.
macro_rules! for_each_command {
    ($callback:ident) => {
        $callback! {
            vkEnumeratePhysicalDevices(count: P, devices: P) [HOST, DEVICE, INIT];
            vkEnumerateDeviceExtensionProperties(layer: P, count: P, properties: P) [HOST, DEVICE];
            vkGetPhysicalDeviceSurfaceSupportKHR(family: u32, surface: U, out: P) [HOST, DEVICE, SURFACE];
            vkGetPhysicalDeviceSurfaceCapabilitiesKHR(surface: U, out: P) [HOST, DEVICE, SURFACE];
            vkGetPhysicalDeviceSurfaceFormatsKHR(surface: U, count: P, out: P) [HOST, DEVICE, SURFACE];
            vkGetPhysicalDeviceSurfacePresentModesKHR(surface: U, count: P, out: P) [HOST, DEVICE, SURFACE];
            vkCreateXlibSurfaceKHR(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateXcbSurfaceKHR(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateWaylandSurfaceKHR(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateDebugUtilsMessengerEXT(info: P, allocation: P, out: P) [HOST];
            vkSetDebugUtilsObjectNameEXT(info: P) [HOST, DEVICE];
            vkQueueSubmit(count: u32, infos: P, fence: U) [HOST, DEVICE, LOST];
            vkQueueSubmit2(count: u32, infos: P, fence: U) [HOST, DEVICE, LOST];
            vkQueueWaitIdle() [HOST, DEVICE, LOST];
            vkDeviceWaitIdle() [HOST, DEVICE, LOST];
            vkAllocateMemory(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkMapMemory(memory: U, offset: U, size: U, flags: u32, out: P) [HOST, DEVICE, MAP];
            vkFlushMappedMemoryRanges(count: u32, ranges: P) [HOST, DEVICE];
            vkInvalidateMappedMemoryRanges(count: u32, ranges: P) [HOST, DEVICE];
            vkBindBufferMemory(buffer: U, memory: U, offset: U) [HOST, DEVICE];
            vkBindImageMemory(image: U, memory: U, offset: U) [HOST, DEVICE];
            vkCreateFence(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkResetFences(count: u32, fences: P) [DEVICE];
            vkGetFenceStatus(fence: U) [HOST, DEVICE, LOST];
            vkWaitForFences(count: u32, fences: P, all: u32, timeout: U) [HOST, DEVICE, LOST];
            vkCreateSemaphore(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkGetSemaphoreCounterValue(semaphore: U, out: P) [HOST, DEVICE, LOST];
            vkWaitSemaphores(info: P, timeout: U) [HOST, DEVICE, LOST];
            vkSignalSemaphore(info: P) [HOST, DEVICE];
            vkCreateQueryPool(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkGetQueryPoolResults(
                pool: U, first: u32, count: u32, size: usize, out: P, stride: U, flags: u32
            ) [NOT_READY, HOST, DEVICE, LOST];
            vkCreateBuffer(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateImage(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateImageView(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateShaderModule(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreatePipelineCache(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkGetPipelineCacheData(cache: U, size: P, out: P) [HOST, DEVICE];
            vkCreateGraphicsPipelines(cache: U, count: u32, infos: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateComputePipelines(cache: U, count: u32, infos: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreatePipelineLayout(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateSampler(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateDescriptorSetLayout(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkCreateDescriptorPool(info: P, allocation: P, out: P) [HOST, DEVICE, FRAGMENTATION];
            vkAllocateDescriptorSets(info: P, out: P) [HOST, DEVICE, FRAGMENTED, POOL];
            vkCreateCommandPool(info: P, allocation: P, out: P) [HOST, DEVICE];
            vkResetCommandPool(pool: U, flags: u32) [DEVICE];
            vkAllocateCommandBuffers(info: P, out: P) [HOST, DEVICE];
            vkBeginCommandBuffer(info: P) [HOST, DEVICE];
            vkEndCommandBuffer() [HOST, DEVICE];
            vkCreateSwapchainKHR(info: P, allocation: P, out: P) [HOST, DEVICE, LOST, SURFACE, IN_USE, INIT];
            vkGetSwapchainImagesKHR(swapchain: U, count: P, out: P) [HOST, DEVICE];
            vkAcquireNextImageKHR(
                swapchain: U, timeout: U, semaphore: U, fence: U, out: P
            ) [SUBOPTIMAL, HOST, DEVICE, LOST, OUT_OF_DATE, SURFACE];
            vkQueuePresentKHR(info: P) [SUBOPTIMAL, HOST, DEVICE, LOST, OUT_OF_DATE, SURFACE];
        }
    };
}

pub(crate) use for_each_command;
