//! Camera panel: navigation modes, standard views, named cameras and bookmarks.

use egui::Ui;

use crate::{CameraMode, Command, StandardView, ViewModel};

/// Modes with what their keys are.
const MODES: [(CameraMode, &str, &str); 3] = [
    (CameraMode::Orbit, "Orbit", "Drag turns about what is looked at, the wheel goes nearer. C"),
    (
        CameraMode::Walk,
        "Walk",
        "On foot: W A S D or arrows, drag to look around, Shift is faster. C",
    ),
    (
        CameraMode::Fly,
        "Fly",
        "W A S D or arrows, Q down, E up, drag to look around; the wheel sets the speed, Shift \
         is faster. C",
    ),
];

const STANDARD_VIEWS: [(StandardView, &str, &str); 3] = [
    (StandardView::Top, "Top", "F5"),
    (StandardView::Front, "Front", "F6"),
    (StandardView::Right, "Side", "F7"),
];

pub(crate) fn show(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    let navigation = model.navigation;
    ui.horizontal_wrapped(|ui| {
        for (mode, name, keys) in MODES {
            let button = ui.selectable_label(mode == navigation.mode, name);
            if button.on_hover_text(keys).clicked() {
                commands.push(Command::SetCameraMode(mode));
            }
        }
        if navigation.mode == CameraMode::Fly {
            ui.label(format!("{:.1} m/s", navigation.speed));
        }
        ui.separator();
        let mut orthographic = navigation.orthographic;
        let hint = "No perspective: all is as large as it is, however far. O";
        if ui.checkbox(&mut orthographic, "Orthographic").on_hover_text(hint).changed() {
            commands.push(Command::SetOrthographic(orthographic));
        }
    });
    ui.horizontal_wrapped(|ui| {
        if ui.button("Fit").on_hover_text("F").clicked() {
            commands.push(Command::FitAll);
        }
        if model.selected.is_some() && ui.button("Fit selection").on_hover_text("Shift+F").clicked()
        {
            commands.push(Command::FitSelection);
        }
        for (side, name, key) in STANDARD_VIEWS {
            if ui.button(name).on_hover_text(key).clicked() {
                commands.push(Command::UseStandardView(side));
            }
        }
        for camera in &model.cameras {
            let number = model.bookmarks.iter().find(|b| b.name.as_ref() == Some(camera));
            let button = ui.button(camera);
            let button = match number {
                Some(bookmark) => button.on_hover_text(bookmark.number.to_string()),
                None => button,
            };
            if button.clicked() {
                commands.push(Command::UseCamera(camera.clone()));
            }
        }
        for bookmark in model.bookmarks.iter().filter(|bookmark| bookmark.name.is_none()) {
            let number = bookmark.number;
            let hint = format!("Stored with Ctrl+{number}; {number} goes there");
            if ui.button(format!("View {number}")).on_hover_text(hint).clicked() {
                commands.push(Command::GoToBookmark(number));
            }
        }
    });
}
