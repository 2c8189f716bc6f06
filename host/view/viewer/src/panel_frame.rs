//! Panels of one frame, from egui's output to the shapes that the renderer draws.

use busbar_config::ThemeConfig;
use busbar_renderer::EguiFrame;
use busbar_ui::Appearance;
use egui::epaint::Primitive;
use egui::{ClippedPrimitive, Context, FullOutput};

use busbar_scene_loader::LoadedScene;

/// Panels of one frame, laid out and tessellated.
pub(crate) struct PanelFrame {
    /// Output of egui without its shapes; empty where the panels of the last frame are kept.
    pub(crate) egui: FullOutput,
    /// True where the panels of the last frame are kept.
    pub(crate) is_kept: bool,
    pub(crate) primitives: Vec<ClippedPrimitive>,
}

impl PanelFrame {
    /// Tessellates the shapes of egui's output.
    pub(crate) fn new(context: &Context, mut egui: FullOutput) -> Self {
        let shapes = std::mem::take(&mut egui.shapes);
        let primitives = context.tessellate(shapes, egui.pixels_per_point);
        Self { egui, is_kept: false, primitives }
    }

    /// Keeps the panels of the last frame.
    pub(crate) fn kept(primitives: Vec<ClippedPrimitive>, pixels_per_point: f32) -> Self {
        let egui = FullOutput { pixels_per_point, ..FullOutput::default() };
        Self { egui, is_kept: true, primitives }
    }

    /// Returns the panels as the renderer takes them.
    pub(crate) fn as_overlay(&self) -> EguiFrame<'_> {
        EguiFrame {
            textures_delta: &self.egui.textures_delta,
            primitives: &self.primitives,
            pixels_per_point: self.egui.pixels_per_point,
        }
    }
}

/// Reports whether two frames' panels look the same.
pub(crate) fn are_same(before: &[ClippedPrimitive], now: &[ClippedPrimitive]) -> bool {
    let is_same = |(before, now): (&ClippedPrimitive, &ClippedPrimitive)| {
        let meshes = (&before.primitive, &now.primitive);
        before.clip_rect == now.clip_rect
            && matches!(meshes, (Primitive::Mesh(before), Primitive::Mesh(now)) if before == now)
    };
    before.len() == now.len() && before.iter().zip(now).all(is_same)
}

/// Returns the appearance of the panels; the font is moved out of the scene.
pub(crate) fn appearance_of(scene: &mut LoadedScene) -> Appearance {
    Appearance {
        is_dark: scene.config.view.theme == ThemeConfig::Dark,
        scale: scene.config.view.scale,
        font: scene.font.take().map(|font| font.to_vec()),
    }
}
