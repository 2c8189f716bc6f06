//! The line at the bottom.

use egui::{Align, Layout, Ui};

use crate::StatusLine;
use crate::model_panel::thousands;

pub(crate) fn show(ui: &mut Ui, status: &StatusLine, selected: Option<&str>) {
    ui.horizontal(|ui| {
        ui.label(selected.unwrap_or("Nothing selected"));
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
            ui.label(format!("{:.1} ms", status.frame_millis));
        });
    });
}
