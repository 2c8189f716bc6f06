//! The keys, on the screen.

use egui::{Align2, Context, Grid, Key, RichText, Sense, Ui, Window, vec2};

use crate::{origin_mark, theme};

/// Points: all lines fit from the first frame on.
const WIDTH: f32 = 420.0;

/// Gestures and keys with their effects, in groups; the book's page on the window has the same
/// table.
const HELP: [(&str, &[(&str, &str)]); 5] = [
    (
        "Camera",
        &[
            ("drag", "turn; on foot and in the air, look around"),
            ("Shift or right drag", "move sideways"),
            ("wheel", "nearer and farther; in the air, speed"),
            ("C", "orbit, walk, fly"),
            ("W A S D, arrows", "walk and fly; Q and E: down and up; Shift: faster"),
            ("O", "orthographic, perspective"),
            ("F5, F6, F7", "from the top, the front, the side"),
        ],
    ),
    (
        "Views",
        &[
            ("F, double click", "frame everything"),
            ("Shift+F", "frame the selection"),
            ("1 to 9", "go to a view"),
            ("Ctrl+1 to 9", "store a view"),
        ],
    ),
    (
        "Equipment",
        &[
            ("click", "select"),
            ("Ctrl and drag", "select all that shows in a rectangle"),
            ("M", "measure between clicks on surfaces"),
            ("Ctrl+F", "search; arrows and Enter go to what is found"),
            ("PgUp, PgDn", "scroll the faceplate"),
            ("Esc", "end measuring; clear the selection, close the faceplate"),
        ],
    ),
    (
        "Alarms",
        &[
            ("F8", "go to the next unacknowledged alarm"),
            ("F9", "acknowledge the chosen alarm"),
            ("F10, Shift+F10", "shelve it for 30 minutes; unshelve it"),
            ("F3", "alarm list"),
        ],
    ),
    (
        "Window",
        &[
            ("F1, ?", "these keys"),
            ("F2", "panels"),
            ("Ctrl+T, D, P", "tags, display, plugins"),
            ("N", "dark theme, light theme"),
        ],
    ),
];

/// Shows the key help while it is open.
pub(crate) fn show(context: &Context, shown: &mut bool) {
    let asked = |input: &egui::InputState| {
        input.key_pressed(Key::F1) || input.key_pressed(Key::Questionmark)
    };
    if !context.egui_wants_keyboard_input() && context.input(asked) {
        *shown = !*shown;
    }
    let window = Window::new("Keys").open(shown).collapsible(false).resizable(false);
    window.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(context, |ui| {
        ui.set_min_width(WIDTH);
        Grid::new("keys").num_columns(2).spacing([18.0, 3.0]).show(ui, |ui| {
            for (group, keys) in HELP {
                ui.label(RichText::new(group).strong());
                ui.end_row();
                for (key, does) in keys {
                    ui.label(*key);
                    ui.label(RichText::new(*does).color(theme::palette(context).weak_text));
                    ui.end_row();
                }
            }
            origins(ui);
        });
    });
}

/// Lists the origin marks with their meanings.
fn origins(ui: &mut Ui) {
    ui.label(RichText::new("Values that are not live").strong());
    ui.end_row();
    for words in &origin_mark::ORIGINS {
        let size = vec2(origin_mark::size(ui.painter(), words.origin).x, origin_mark::HEIGHT + 2.0);
        let (place, _) = ui.allocate_exact_size(size, Sense::hover());
        origin_mark::paint(ui.painter(), place.center(), Align2::CENTER_CENTER, words.origin);
        let band = words.band.map_or_else(String::new, |band| format!("; band: {band}"));
        let meaning = format!("{}{band}", words.meaning);
        ui.label(RichText::new(meaning).color(theme::palette(ui.ctx()).weak_text));
        ui.end_row();
    }
}
