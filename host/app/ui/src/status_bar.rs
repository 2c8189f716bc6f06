//! The line at the bottom.

use egui::{Align, Align2, Color32, Label, Layout, Rect, RichText, TextStyle, Ui, vec2};

use crate::model_panel::thousands;
use crate::{ValueMark, ViewModel, theme};

/// Longest fault text in the status bar, characters; the tooltip has the whole text.
const MAX_FAULT_LINE: usize = 400;
/// Least width of a selection that is cut, points.
const MIN_SELECTED_WIDTH: f32 = 90.0;
/// Width of a separator with the space around it, points.
const PART_GAP: f32 = 24.0;
/// Points between the clock and the edge of the scene, and around its digits.
const CLOCK_MARGIN: f32 = 8.0;
const CLOCK_PADDING: f32 = 4.0;

pub(crate) fn show(ui: &mut Ui, model: &ViewModel) {
    let status = &model.status;
    if let Some(fault) = &status.fault {
        show_fault(ui, fault);
    }
    let selected = model.selected.as_deref().unwrap_or("Nothing selected");
    let selected = model.measuring.as_deref().unwrap_or(selected);
    let [shown, full] = [status.triangles, status.triangles_full].map(thousands);
    let triangles = format!("{shown} of {full} triangles");
    let counts =
        format!("{} good, {} uncertain, {} bad", status.good, status.uncertain, status.bad);
    let quality = format!("tags: {counts}");
    ui.horizontal(|ui| {
        let clock = status.clock.as_deref();
        let texts = clock.into_iter().chain([&*quality]);
        let certain: f32 = texts.map(|text| width(ui, text) + PART_GAP).sum();
        // From the first to be left out to the last.
        let optional = [&*status.device, &*triangles].map(|text| width(ui, text));
        let room = ui.available_width();
        let fit = fit(room - certain, width(ui, selected), optional);
        if let Some(clock) = clock {
            ui.label(RichText::new(clock).strong());
            ui.separator();
        }
        if let Some(most) = fit.selected {
            let size = vec2(most, ui.available_height());
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
                ui.add(Label::new(selected).truncate()).on_hover_text(selected);
            });
            ui.separator();
        } else if fit.shows_selected {
            ui.label(selected);
            ui.separator();
        }
        let [shows_device, shows_triangles] = fit.shows;
        if shows_triangles {
            ui.label(triangles);
            ui.separator();
        }
        ui.label(if certain <= room { quality } else { counts });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if shows_device {
                ui.label(&status.device);
            }
        });
    });
}

/// Parts of the line that a window has room for, beside clock and qualities.
struct LineFit {
    /// Width that the selection is cut to, points; none where it is shown whole or not at all.
    selected: Option<f32>,
    shows_selected: bool,
    /// Reports by optional part whether it is shown.
    shows: [bool; 2],
}

/// Chooses the parts for a room in points: the last optional parts first, then the selection, cut
/// where it is longer. `optional` has the widths of the optional parts.
fn fit(room: f32, selected: f32, optional: [f32; 2]) -> LineFit {
    let mut room = room - selected.min(MIN_SELECTED_WIDTH) - PART_GAP;
    let mut shows = [false; 2];
    for (shows, width) in shows.iter_mut().zip(optional).rev() {
        *shows = width + PART_GAP <= room;
        if *shows {
            room -= width + PART_GAP;
        }
    }
    let most = room + selected.min(MIN_SELECTED_WIDTH);
    LineFit {
        selected: (room >= 0.0 && most < selected).then_some(most),
        shows_selected: room >= 0.0,
        shows,
    }
}

/// Width of a text in the line, points.
fn width(ui: &Ui, text: &str) -> f32 {
    let font = TextStyle::Body.resolve(ui.style());
    ui.painter().layout_no_wrap(text.to_owned(), font, Color32::WHITE).size().x
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

#[cfg(test)]
#[path = "status_bar_tests.rs"]
mod tests;
