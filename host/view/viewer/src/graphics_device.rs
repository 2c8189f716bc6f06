//! Availability of a graphics device.

use busbar_renderer::{RenderError, Renderer, RendererOptions};

/// Returns the name of the default graphics device.
///
/// # Errors
/// When there is no Vulkan loader, driver, fitting device or, if asked for, validation layer;
/// each says what to install.
pub fn graphics_device(validation: bool) -> Result<String, RenderError> {
    let options = RendererOptions { validation, ..RendererOptions::default() };
    Renderer::headless(options, [16; 2]).map(|renderer| renderer.device_name().to_owned())
}
