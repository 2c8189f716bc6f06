//! The line at the bottom.

use egui::{Align, Layout, Ui};

use crate::ViewModel;
use crate::model_panel::thousands;

pub(crate) fn show(ui: &mut Ui, model: &ViewModel) {
    let status = &model.status;
    ui.horizontal(|ui| {
        let selected = model.selected.as_deref().unwrap_or("Nothing selected");
        ui.label(model.measuring.as_deref().unwrap_or(selected));
        ui.separator();
        ui.label(format!(
            "{} of {} triangles",
            thousands(status.triangles),
            thousands(status.triangles_full)
        ));
        ui.separator();
        ui.label(format!(
            "tags: {} good, {} uncertain, {} bad",
            status.good, status.uncertain, status.bad
        ));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(&status.device);
            ui.separator();
            let millis = ui.label(format!("{:.1} ms", status.frame_millis));
            if !status.gpu_millis.is_empty() {
                millis.on_hover_text(gpu_text(&status.gpu_millis));
            }
        });
    });
}

/// A line for each stage of a frame on the GPU.
fn gpu_text(stages: &[(&'static str, f64)]) -> String {
    let line = |(name, millis): &(&'static str, f64)| format!("GPU {name}: {millis:.2} ms");
    stages.iter().map(line).collect::<Vec<_>>().join("\n")
}
