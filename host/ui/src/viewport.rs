//! Mouse and keyboard over the 3D scene.

use egui::{Key, PointerButton, Sense, Ui};

use crate::Command;

/// Distance factor of one point of scrolling.
const ZOOM_PER_POINT: f32 = 0.998;

/// Turns input over the scene into commands: drag turns, drag with the right
/// or middle button (or shift) moves, the wheel zooms, a click picks, a double
/// click or `F` frames everything.
pub(crate) fn handle(ui: &mut Ui, commands: &mut Vec<Command>) {
    let response = ui.allocate_rect(ui.max_rect(), Sense::click_and_drag());
    let delta = response.drag_delta();
    let shift = ui.input(|i| i.modifiers.shift);
    if delta != egui::Vec2::ZERO {
        if response.dragged_by(PointerButton::Primary) && !shift {
            commands.push(Command::Orbit(delta));
        } else {
            commands.push(Command::Pan(delta));
        }
    }
    if response.hovered() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        if scroll != 0.0 || pinch != 1.0 {
            commands.push(Command::Zoom(ZOOM_PER_POINT.powf(scroll) / pinch));
        }
    }
    if response.double_clicked() {
        commands.push(Command::FitAll);
    } else if response.clicked()
        && let Some(position) = response.interact_pointer_pos()
    {
        commands.push(Command::Pick(position));
    }
    if !ui.ctx().egui_wants_keyboard_input() && ui.input(|i| i.key_pressed(Key::F)) {
        commands.push(Command::FitAll);
    }
}
