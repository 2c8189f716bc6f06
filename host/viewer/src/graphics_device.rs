//! Whether there is a device to draw with.

use busbar_renderer::{RenderError, Renderer, RendererOptions};

/// The device that a view is drawn with where nobody chooses another one.
///
/// # Errors
/// When there is no Vulkan loader, driver, fitting device or, if asked for, validation layer;
/// each says what to install.
pub fn graphics_device(validation: bool) -> Result<String, RenderError> {
    let options = RendererOptions { validation, ..RendererOptions::default() };
    Renderer::headless(options, [16; 2]).map(|renderer| renderer.device_name().to_owned())
}
