//! egui panels, labels and viewport input: a view model in, commands out.
//!
//! Invariant: nothing here knows Vulkan, plugins or where a value comes from;
//! a panel never changes state, it asks by a [`Command`].

mod hatch;
mod labels;
mod model_panel;
mod plugin_panel;
mod status_bar;
mod tag_panel;
mod theme;
mod view_model;
mod viewport;

pub use view_model::{
    Command, Label, LabelLine, LinkLamp, Mark, ModelRow, PluginRow, StatusLine, TagRow, ViewModel,
};

use std::num::NonZeroUsize;

use egui::{CentralPanel, Context, Frame, FullOutput, Key, Panel, RawInput, Rect, ScrollArea};

/// Width of the side panel, points.
const SIDE_PANEL_WIDTH: f32 = 400.0;

/// The panels and their egui context.
pub struct Panels {
    context: Context,
    shown: bool,
}

/// What one pass over the panels gave.
pub struct PanelsOutput {
    /// What the operator asked for, in order.
    pub commands: Vec<Command>,
    /// Where the 3D scene is not covered by panels, points.
    pub viewport: Rect,
    /// Shapes and platform requests for whoever draws.
    pub egui: FullOutput,
}

impl Panels {
    /// Panels, shown or, for a bare picture, with labels only.
    pub fn new(shown: bool) -> Self {
        let context = Context::default();
        theme::apply(&context);
        // One pass a frame: commands must not count twice.
        context.options_mut(|options| options.max_passes = NonZeroUsize::MIN);
        Self { context, shown }
    }

    /// The egui context, for the platform glue and for tessellation.
    pub fn context(&self) -> &Context {
        &self.context
    }

    /// Runs one pass. `labels` gets the viewport and the commands so far, and
    /// gives the labels to paint: so they follow a camera that these commands
    /// move without lagging a frame behind.
    pub fn run(
        &mut self,
        input: RawInput,
        model: &ViewModel,
        mut labels: impl FnMut(Rect, &[Command]) -> Vec<Label>,
    ) -> PanelsOutput {
        let mut commands = Vec::new();
        let mut viewport = Rect::NOTHING;
        let mut shown = self.shown;
        let egui = self.context.run_ui(input, |ui| {
            commands.clear();
            if shown {
                Panel::bottom("status")
                    .show(ui, |ui| status_bar::show(ui, &model.status, model.selected.as_deref()));
                Panel::left("side")
                    .default_size(SIDE_PANEL_WIDTH)
                    .show(ui, |ui| side_panel(ui, model, &mut commands));
            }
            CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
                viewport = ui.max_rect();
                viewport::handle(ui, &mut commands);
                labels::paint(ui, &labels(viewport, &commands));
            });
            if !ui.ctx().egui_wants_keyboard_input() && ui.input(|i| i.key_pressed(Key::F2)) {
                shown = !shown;
            }
        });
        self.shown = shown;
        PanelsOutput { commands, viewport, egui }
    }
}

fn side_panel(ui: &mut egui::Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.heading("Models");
        model_panel::show(ui, model, commands);
        ui.add_space(8.0);
        ui.heading("Tags");
        tag_panel::show(ui, &model.tags, commands);
        ui.add_space(8.0);
        ui.heading("Plugins");
        plugin_panel::show(ui, &model.plugins);
    });
}
