//! The line at the bottom.

use egui::{Align, Align2, Label, Layout, Rect, RichText, Ui, vec2};

use crate::model_panel::thousands;
use crate::{ValueMark, ViewModel, theme};

/// Longest fault text in the status bar, characters; the tooltip has the whole text.
const MAX_FAULT_LINE: usize = 400;
/// Points between the clock and the edge of the scene, and around its digits.
const CLOCK_MARGIN: f32 = 8.0;
const CLOCK_PADDING: f32 = 4.0;

pub(crate) fn show(ui: &mut Ui, model: &ViewModel) {
    let status = &model.status;
    if let Some(fault) = &status.fault {
        show_fault(ui, fault);
    }
    ui.horizontal(|ui| {
        // Leftmost: a narrow window cuts off what is right.
        if let Some(clock) = &status.clock {
            ui.label(RichText::new(clock).strong());
            ui.separator();
        }
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

/// Paints the clock into the lower right corner of the scene, where the panels are hidden.
pub(crate) fn paint_clock(ui: &Ui, scene: Rect, model: &ViewModel) {
    let Some(clock) = model.status.clock.as_ref().filter(|_| model.status.keeps_clock) else {
        return;
    };
    let (painter, palette) = (ui.painter(), theme::palette(ui.ctx()));
    let text = painter.layout_no_wrap(clock.clone(), theme::value_font(), palette.text);
    let corner = scene.right_bottom() - vec2(CLOCK_MARGIN, CLOCK_MARGIN);
    let place =
        Align2::RIGHT_BOTTOM.anchor_size(corner, text.size() + vec2(2.0, 2.0) * CLOCK_PADDING);
    painter.rect_filled(place, 2.0, palette.background);
    painter.galley(place.min + vec2(CLOCK_PADDING, CLOCK_PADDING), text, palette.text);
}

/// Shows the fault that keeps the configuration file from being loaded.
fn show_fault(ui: &mut Ui, fault: &str) {
    let mark = ValueMark::Warning;
    let (ground, ink) = theme::background_and_text(ui.ctx(), &mark);
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
