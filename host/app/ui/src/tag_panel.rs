//! The tag table: value, unit, quality, age.

use egui::{Align, Align2, Layout, RichText, Sense, Ui, UiBuilder, Vec2};

use crate::age::age_text;
use crate::search_field::SearchField;
use crate::shortcuts::Tab;
use crate::value_mark::whole_value;
use crate::{Command, TagRow, TagRows, ValueMark, origin_mark, quality_hatching, theme};

/// Height of a row, points.
const ROW_HEIGHT: f32 = 18.0;
/// Shares of the width: name, value, quality, age.
const COLUMNS: [f32; 4] = [0.36, 0.24, 0.26, 0.14];

/// Shows the tags that match the filter.
pub(crate) fn show(
    ui: &mut Ui,
    filter: &mut SearchField,
    tags: &dyn TagRows,
    commands: &mut Vec<Command>,
) {
    let step = ROW_HEIGHT + ui.spacing().item_spacing.y;
    let hint = format!("Tag, name or equipment ({})", Tab::Tags.shortcut());
    let (has_changed, keys) = filter.show(ui, "tag filter", &hint, tags.len(), step);
    if has_changed {
        commands.push(Command::FilterTags(filter.query.clone()));
    }
    if keys.enters && !tags.is_empty() {
        commands.extend(tags.row(filter.cursor.min(tags.len() - 1)).node.map(Command::Reveal));
    }
    ui.weak(count(tags));
    header(ui);
    let cursor = ui.memory(|memory| memory.has_focus(egui::Id::new("tag filter")));
    let cursor = cursor.then_some(filter.cursor);
    let shown = filter.area("tags").show_rows(ui, ROW_HEIGHT, tags.len(), |ui, shown| {
        for index in shown {
            let tag = tags.row(index);
            let response = row(ui, &tag);
            if cursor == Some(index) {
                let line = egui::Stroke::new(1.0, theme::palette(ui.ctx()).text);
                ui.painter().rect_stroke(response.rect, 2.0, line, egui::StrokeKind::Inside);
            }
            if let (true, Some(node)) = (response.clicked(), tag.node) {
                commands.push(Command::Focus(node));
            }
        }
    });
    filter.note(shown.state.offset.y, shown.inner_rect.height());
}

fn count(tags: &dyn TagRows) -> String {
    match (tags.is_truncated(), tags.len(), tags.total()) {
        (true, found, all) => format!("more than {found} of {all}: type on"),
        (false, found, all) if found == all => format!("{all} tags"),
        (false, found, all) => format!("{found} of {all} tags"),
    }
}

fn header(ui: &mut Ui) {
    let (rect, _) =
        ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW_HEIGHT), Sense::hover());
    for (index, title) in ["Tag", "Value", "Quality", "Age"].into_iter().enumerate() {
        cell(ui, rect, index, RichText::new(title).color(theme::palette(ui.ctx()).weak_text));
    }
}

fn row(ui: &mut Ui, tag: &TagRow) -> egui::Response {
    let (rect, response) =
        ui.allocate_exact_size(Vec2::new(ui.available_width(), ROW_HEIGHT), Sense::click());
    // The ground lies under value and quality, where the mark must show.
    let ground = column(rect, 1).union(column(rect, 2));
    quality_hatching::fill(ui.painter(), ground.shrink2(Vec2::new(0.0, 1.0)), &tag.mark);
    let (_, ink) = theme::background_and_text(ui.ctx(), &tag.mark);
    let value =
        if tag.unit.is_empty() { tag.value.clone() } else { format!("{} {}", tag.value, tag.unit) };
    cell(ui, rect, 0, RichText::new(&tag.id));
    cell(ui, rect, 1, RichText::new(value).color(ink));
    // Beside the value; the words of the quality give way, not the number.
    let origin_at = column(rect, 2).left_center() + Vec2::new(2.0, 0.0);
    let origin = origin_mark::paint(ui.painter(), origin_at, Align2::LEFT_CENTER, tag.origin);
    let quality = column(rect, 2).with_min_x(origin.right());
    text_in(ui, quality, false, RichText::new(quality_text(&tag.mark)).color(ink));
    cell(ui, rect, 3, RichText::new(tag.age.map_or_else(String::new, age_text)));
    let whole = whole_value(&tag.value);
    response.on_hover_text(format!("{}{whole}{}", tag.name, origin_mark::tooltip(tag.origin)))
}

fn column(rect: egui::Rect, index: usize) -> egui::Rect {
    let left: f32 = COLUMNS[..index].iter().sum();
    let x = rect.left() + left * rect.width();
    let size = Vec2::new(COLUMNS[index] * rect.width(), rect.height());
    egui::Rect::from_min_size(egui::pos2(x, rect.top()), size)
}

fn cell(ui: &mut Ui, rect: egui::Rect, index: usize, text: RichText) {
    text_in(ui, column(rect, index), index == 1 || index == 3, text);
}

fn text_in(ui: &mut Ui, place: egui::Rect, right: bool, text: RichText) {
    let layout = if right {
        Layout::right_to_left(Align::Center)
    } else {
        Layout::left_to_right(Align::Center)
    };
    let cell = place.shrink2(Vec2::new(4.0, 0.0));
    let mut cell_ui = ui.new_child(UiBuilder::new().max_rect(cell).layout(layout));
    cell_ui.add(egui::Label::new(text).selectable(false).truncate());
}

/// Returns the quality text of a mark.
pub(crate) fn quality_text(mark: &ValueMark) -> String {
    let symbol = theme::symbol(mark);
    match mark {
        ValueMark::Normal => "good".into(),
        ValueMark::Warning => format!("{symbol} good, limit"),
        ValueMark::Alarm => format!("{symbol} good, alarm"),
        ValueMark::Uncertain { reason } | ValueMark::Bad { reason } => format!("{symbol} {reason}"),
        ValueMark::LateDisplay => format!("{symbol} {}", theme::LATE_DISPLAY),
    }
}
