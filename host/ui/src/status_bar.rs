//! The line at the bottom.

use egui::{Align, Label, Layout, RichText, Ui};

use crate::model_panel::thousands;
use crate::{Mark, ViewModel, theme};

/// Characters of a line of a fault; all of it is told where the pointer rests.
const MAX_FAULT_LINE: usize = 400;

pub(crate) fn show(ui: &mut Ui, model: &ViewModel) {
    let status = &model.status;
    if let Some(fault) = &status.fault {
        show_fault(ui, fault);
    }
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

/// What keeps the configuration on the disk from being shown, until it is mended.
fn show_fault(ui: &mut Ui, fault: &str) {
    let mark = Mark::Warning;
    let (ground, ink) = theme::ground_and_ink(ui.ctx(), &mark);
    // The first fault, and what helps.
    let first: Vec<&str> = fault.lines().take(2).map(str::trim).collect();
    let text =
        format!("{} Not loaded, shown as before: {}", theme::symbol(&mark), first.join("; "));
    let line: String = text.chars().take(MAX_FAULT_LINE).collect();
    let label = RichText::new(line).color(ink).background_color(ground);
    ui.add(Label::new(label).truncate()).on_hover_text(fault);
    ui.separator();
}

/// A line for each stage of a frame on the GPU.
fn gpu_text(stages: &[(&'static str, f64)]) -> String {
    let line = |(name, millis): &(&'static str, f64)| format!("GPU {name}: {millis:.2} ms");
    stages.iter().map(line).collect::<Vec<_>>().join("\n")
}
