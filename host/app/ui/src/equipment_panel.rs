//! The equipment as a tree, with search as one types.

use egui::{Align2, Color32, Pos2, Response, Sense, Shape, Stroke, Ui, Vec2, vec2};

use crate::search_field::SearchField;
use crate::shortcuts::Tab;
use crate::{Command, EquipmentRow, EquipmentRows, theme};

/// Height of a row, points.
const ROW_HEIGHT: f32 = 18.0;
/// Points to the right for each step down.
const INDENT: f32 = 14.0;
/// Width of the arrow before a branch, points.
const ARROW_WIDTH: f32 = 16.0;

/// The equipment panel between frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct EquipmentPanel {
    pub(crate) search: SearchField,
    /// Selected row of the last frame.
    selected: Option<usize>,
}

impl EquipmentPanel {
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        rows: &dyn EquipmentRows,
        commands: &mut Vec<Command>,
    ) {
        let step = ROW_HEIGHT + ui.spacing().item_spacing.y;
        let hint = format!("Id, alias or name ({})", Tab::Equipment.shortcut());
        let (has_changed, keys) = self.search.show(ui, "equipment search", &hint, rows.len(), step);
        if has_changed {
            commands.push(Command::SearchEquipment(self.search.query.clone()));
        }
        ui.weak(count(rows, &self.search.query));
        self.follow_selection(rows, step);
        if !rows.is_empty() && (keys.enters || keys.opens.is_some()) {
            let row = rows.row(self.search.cursor.min(rows.len() - 1));
            if keys.enters {
                commands.push(Command::Reveal(row.id));
            } else if row.is_open.is_some() && row.is_open != keys.opens {
                commands.push(Command::ToggleBranch(row.entry));
            }
        }
        let has_cursor = ui.memory(|memory| memory.has_focus(egui::Id::new("equipment search")));
        let cursor = has_cursor.then_some(self.search.cursor);
        let area = self.search.area("equipment");
        let shown = area.show_rows(ui, ROW_HEIGHT, rows.len(), |ui, shown| {
            for index in shown {
                show_row(ui, &rows.row(index), cursor == Some(index), commands);
            }
        });
        self.search.note(shown.state.offset.y, shown.inner_rect.height());
    }

    /// Scrolls to equipment that was selected elsewhere.
    fn follow_selection(&mut self, rows: &dyn EquipmentRows, step: f32) {
        let selected = rows.selected();
        if selected != self.selected {
            self.selected = selected;
            if let Some(row) = selected {
                self.search.go_to(row, step);
            }
        }
    }
}

fn count(rows: &dyn EquipmentRows, query: &str) -> String {
    match (query.trim().is_empty(), rows.is_truncated(), rows.len()) {
        (true, ..) => format!("{} pieces of equipment", rows.total()),
        (false, true, found) => format!("more than {found} of {}: type on", rows.total()),
        (false, false, 0) => format!("none of {}", rows.total()),
        (false, false, found) => format!("{found} of {}", rows.total()),
    }
}

fn show_row(ui: &mut Ui, row: &EquipmentRow, has_cursor: bool, commands: &mut Vec<Command>) {
    let size = vec2(ui.available_width(), ROW_HEIGHT);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let palette = theme::palette(ui.ctx());
    let painter = ui.painter().with_clip_rect(rect.intersect(ui.clip_rect()));
    if row.is_selected {
        painter.rect_filled(rect, 2.0, palette.list_selection);
    }
    if has_cursor || response.hovered() {
        let line = Stroke::new(1.0, if has_cursor { palette.text } else { palette.border });
        painter.rect_stroke(rect, 2.0, line, egui::StrokeKind::Inside);
    }
    let left = rect.left() + f32::from(row.depth) * INDENT;
    if let Some(is_open) = row.is_open {
        let center = egui::pos2(left + ARROW_WIDTH * 0.5, rect.center().y);
        painter.add(arrow(center, is_open, palette.weak_text));
    }
    let font = theme::value_font();
    let at = egui::pos2(left + ARROW_WIDTH, rect.center().y);
    let label = painter.text(at, Align2::LEFT_CENTER, &row.label, font.clone(), palette.text);
    let more = match (&row.within, row.name.is_empty()) {
        (Some(within), true) => format!("in {within}"),
        (Some(within), false) => format!("{}, in {within}", row.name),
        (None, _) => row.name.clone(),
    };
    if !more.is_empty() {
        let at = egui::pos2(label.right() + 10.0, rect.center().y);
        painter.text(at, Align2::LEFT_CENTER, more, theme::small_font(), palette.weak_text);
    }
    handle_click(row, left, &response, commands);
    response.on_hover_ui(|ui| {
        ui.label(&row.id);
        for alias in [&row.name].into_iter().chain(&row.aliases).filter(|name| !name.is_empty()) {
            ui.weak(alias);
        }
    });
}

/// A click on the arrow opens, one elsewhere goes there.
fn handle_click(row: &EquipmentRow, left: f32, response: &Response, commands: &mut Vec<Command>) {
    if !response.clicked() {
        return;
    }
    let is_at_arrow = |at: Pos2| at.x < left + ARROW_WIDTH;
    let at_arrow = response.interact_pointer_pos().is_some_and(is_at_arrow);
    commands.push(match row.is_open.is_some() && at_arrow {
        true => Command::ToggleBranch(row.entry),
        false => Command::Reveal(row.id.clone()),
    });
}

/// An arrow to the right, or down where the branch is open.
fn arrow(center: Pos2, is_open: bool, color: Color32) -> Shape {
    let corners = [vec2(-3.0, -4.0), vec2(3.5, 0.0), vec2(-3.0, 4.0)];
    let turn = |corner: Vec2| if is_open { vec2(-corner.y, corner.x) } else { corner };
    let points = corners.into_iter().map(|corner| center + turn(corner)).collect();
    Shape::convex_polygon(points, color, Stroke::NONE)
}
