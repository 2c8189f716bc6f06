//! Renderer options that a configuration asks for.

use busbar_config::QualityConfig;
use busbar_renderer::{Quality, RendererOptions};
use busbar_scene_loader::LoadedScene;

/// Returns the renderer options of the configuration. An open quality becomes `Low` on a software
/// rasterizer, except in headless views.
pub fn renderer_options(scene: &LoadedScene) -> RendererOptions {
    let view = &scene.config.view;
    let quality = match view.quality {
        Some(QualityConfig::Low) => Quality::Low,
        Some(QualityConfig::Medium) | None => Quality::Medium,
        Some(QualityConfig::High) => Quality::High,
    };
    let with_samples = |quality: Quality| (quality, view.samples.unwrap_or(quality.samples()));
    let (quality, samples) = with_samples(quality);
    let on_software_rasterizer = view.quality.is_none().then(|| with_samples(Quality::Low));
    RendererOptions { quality, samples, on_software_rasterizer, validation: false }
}
