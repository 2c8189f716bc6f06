//! Alarm panel: alarm list, suppressed alarms, audit log.

use busbar_types::{AlarmAction, Origin, Priority};
use egui::{Align, Align2, Layout, Rect, Response};
use egui::{Button, RichText, ScrollArea, Sense, Ui, UiBuilder, Vec2, vec2};

use crate::age::age_text;
use crate::alarm_symbol::{self, AlarmSymbol};
use crate::{
    AlarmList, AlarmModel, AlarmRow, AlarmRows, Command, ValueMark, alarm_detail,
    alarm_source_status, origin_mark, quality_hatching, theme,
};

/// Height of a row, points.
const ROW_HEIGHT: f32 = 21.0;
const MARK_RADIUS: f32 = 7.5;
/// Width of the detail view of the selected alarm, points.
const DETAIL_WIDTH: f32 = 270.0;
/// The first column, for the mark, points.
const MARK_WIDTH: f32 = 30.0;
/// Titles of the others, and their shares of the width.
const COLUMNS: [(&str, f32); 7] = [
    ("State", 0.25),
    ("UTC", 0.11),
    ("Since", 0.08),
    ("Alarm", 0.19),
    ("Equipment", 0.16),
    ("Value", 0.10),
    ("Count", 0.11),
];

/// Shows the panel: counts and lists above, rows below, the chosen alarm beside them.
pub(crate) fn show(
    ui: &mut Ui,
    model: &AlarmModel,
    rows: &dyn AlarmRows,
    commands: &mut Vec<Command>,
) {
    let mut seen = Vec::new();
    // The list has the width where there is nothing to say beside it.
    if model.selected.is_some() || model.trouble.is_some() {
        egui::Panel::right("alarm detail")
            .exact_size(DETAIL_WIDTH)
            .resizable(false)
            .frame(egui::Frame::NONE.inner_margin(vec2(8.0, 2.0)))
            .show(ui, |ui| alarm_detail::show(ui, model, commands));
    }
    egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| {
        let top = ui.max_rect();
        let header = Rect::from_min_size(top.min, vec2(top.width(), 24.0));
        ui.allocate_rect(header, Sense::hover());
        match model.list {
            AlarmList::Log => log(ui, model),
            AlarmList::Alarms | AlarmList::Held => list(ui, model, rows, &mut seen, commands),
        }
        let layout = Layout::left_to_right(Align::Center);
        let mut ui = ui.new_child(UiBuilder::new().max_rect(header).layout(layout));
        head(&mut ui, model, &seen, commands);
    });
}

/// Shows counts by priority, the lists to choose from, and the action on all visible alarms.
fn head(ui: &mut Ui, model: &AlarmModel, seen: &[u32], commands: &mut Vec<Command>) {
    let annunciated: usize = model.counts.iter().map(|[_, all]| all).sum();
    for (list, title) in [
        (AlarmList::Alarms, format!("Alarms {annunciated}")),
        (AlarmList::Held, format!("Held back {}", model.held)),
        (AlarmList::Log, "Log".to_owned()),
    ] {
        if ui.selectable_label(model.list == list, RichText::new(title).strong()).clicked() {
            commands.push(Command::ShowAlarmList(list));
        }
    }
    ui.separator();
    for (priority, [unacknowledged, all]) in Priority::ALL.into_iter().zip(model.counts) {
        let (place, response) = ui.allocate_exact_size(Vec2::splat(20.0), Sense::hover());
        let symbol = AlarmSymbol { priority, is_active: all > 0, has_ring: false };
        alarm_symbol::paint(ui.painter(), place.center(), MARK_RADIUS, symbol);
        let hint = format!("{}: {unacknowledged} unacknowledged of {all}", priority.name());
        response.on_hover_text(hint);
        ui.label(format!("{unacknowledged}/{all}"));
    }
    ui.separator();
    alarm_source_status::show(ui, &model.sources);
    if model.list == AlarmList::Alarms {
        let button = Button::new("Acknowledge in view");
        if ui.add_enabled(!seen.is_empty(), button).clicked() {
            let act = |&alarm| Command::ActOnAlarm { alarm, action: AlarmAction::Acknowledge };
            commands.extend(seen.iter().map(act));
        }
    }
}

fn log(ui: &mut Ui, model: &AlarmModel) {
    let area = ScrollArea::vertical().id_salt("alarm log").auto_shrink(false);
    area.show_rows(ui, ROW_HEIGHT - 4.0, model.log.len(), |ui, shown| {
        for line in &model.log[shown] {
            ui.add(egui::Label::new(line).selectable(false).truncate());
        }
    });
}

/// The rows in view; gives the numbers of those that can be acknowledged.
fn list(
    ui: &mut Ui,
    model: &AlarmModel,
    rows: &dyn AlarmRows,
    seen: &mut Vec<u32>,
    commands: &mut Vec<Command>,
) {
    let (head, _) =
        ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT - 4.0), Sense::hover());
    for (index, (title, _)) in COLUMNS.into_iter().enumerate() {
        cell(ui, head, index, RichText::new(title).color(theme::palette(ui.ctx()).weak_text));
    }
    if rows.is_empty() {
        let nothing = match model.list {
            AlarmList::Held => "Nothing is held back.",
            _ => "No alarms.",
        };
        ui.label(RichText::new(nothing).color(theme::palette(ui.ctx()).weak_text));
        return;
    }
    let lit = alarm_symbol::is_flash_on(ui, model.flashes);
    let selected = model.selected.as_ref().map(|detail| detail.row.number);
    let area = ScrollArea::vertical().id_salt("alarms").auto_shrink(false);
    area.show_rows(ui, ROW_HEIGHT, rows.len(), |ui, shown| {
        for index in shown {
            let alarm = rows.row(index);
            if alarm.is_unacknowledged && !alarm.is_saving && alarm.source.is_none() {
                seen.push(alarm.number);
            }
            let response = row(ui, &alarm, selected == Some(alarm.number), lit);
            if response.double_clicked() {
                commands.extend(alarm.equipment.map(Command::Reveal));
            } else if response.clicked() {
                commands.push(Command::SelectAlarm(alarm.number));
            }
        }
    });
}

fn row(ui: &mut Ui, alarm: &AlarmRow, selected: bool, lit: bool) -> Response {
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT), Sense::click());
    if selected {
        ui.painter().rect_filled(rect, 2.0, ui.visuals().selection.bg_fill);
    }
    if let Some(uncertainty) = &alarm.uncertainty {
        let ground = column(rect, 5).union(column(rect, 6)).shrink2(vec2(0.0, 1.0));
        quality_hatching::fill(
            ui.painter(),
            ground,
            &ValueMark::Bad { reason: uncertainty.clone() },
        );
    }
    let center = rect.left_center() + vec2(MARK_WIDTH * 0.5, 0.0);
    let has_ring = alarm.is_unacknowledged && lit;
    let symbol = AlarmSymbol { priority: alarm.priority, is_active: alarm.is_active, has_ring };
    alarm_symbol::paint(ui.painter(), center, MARK_RADIUS, symbol);
    let ink = state_ground(ui, column(rect, 0).shrink2(vec2(0.0, 2.0)), alarm);
    let text = |words: &str| RichText::new(words);
    let state = if alarm.is_saving { "saving…" } else { alarm.state };
    cell(ui, rect, 0, text(state).color(ink));
    cell(ui, rect, 1, text(&alarm.time));
    cell(ui, rect, 2, text(&alarm.age.map_or_else(String::new, age_text)));
    cell(ui, rect, 3, text(&alarm.message));
    cell(ui, rect, 4, text(alarm.equipment.as_deref().unwrap_or("–")));
    let (value, more) = (value_of(alarm), notes(alarm));
    let [value_place, more_place] =
        mark_origin(ui, [5, 6].map(|at| column(rect, at)), alarm.origin);
    match alarm.source.is_some() {
        // It has no count, and may have more to say.
        true => cell_in(ui, value_place.union(more_place), text(&value)),
        false => {
            cell_in(ui, value_place, text(&value));
            cell_in(ui, more_place, text(&more));
        }
    }
    let place = alarm.equipment.as_deref().unwrap_or("no equipment");
    let uncertainty = alarm.uncertainty.as_deref().unwrap_or_default();
    let origin = origin_mark::tooltip(alarm.origin);
    let hint =
        format!("{}\n{}\n{place}\n{state}  {more}{uncertainty}{origin}", alarm.id, alarm.message);
    response.on_hover_text(hint)
}

/// Marks an origin before a value, which moves aside, and what stands behind it with it;
/// gives the places of both.
fn mark_origin(ui: &Ui, [value, more]: [Rect; 2], origin: Origin) -> [Rect; 2] {
    if origin.is_live() {
        return [value, more];
    }
    let at = value.left_center() + vec2(4.0, 0.0);
    let marked = origin_mark::paint(ui.painter(), at, Align2::LEFT_CENTER, origin);
    let aside = marked.width();
    [
        value.with_min_x(marked.right()).with_max_x(value.right() + aside),
        more.with_min_x((more.left() + aside).min(more.right())),
    ]
}

/// Returns the value of the tag or the name of the source; a cross marks doubt.
fn value_of(alarm: &AlarmRow) -> String {
    match (&alarm.source, &alarm.uncertainty) {
        (None, None) => alarm.value.clone(),
        (None, Some(_)) => format!("× {}", alarm.value),
        (Some(source), None) => format!("by {source}"),
        (Some(source), Some(uncertainty)) => format!("× {source} {uncertainty}"),
    }
}

/// Paints the state's background and returns its text color: inverse video while unacknowledged, a
/// frame once the condition has cleared.
fn state_ground(ui: &Ui, place: Rect, alarm: &AlarmRow) -> egui::Color32 {
    match (alarm.is_unacknowledged, alarm.is_active) {
        (true, true) => {
            ui.painter().rect_filled(place, 2.0, theme::palette(ui.ctx()).text);
            theme::palette(ui.ctx()).background
        }
        (true, false) => {
            let line = egui::Stroke::new(1.5, theme::palette(ui.ctx()).text);
            ui.painter().rect_stroke(place, 2.0, line, egui::StrokeKind::Inside);
            theme::palette(ui.ctx()).text
        }
        (false, _) => theme::palette(ui.ctx()).text,
    }
}

/// Returns further remarks on an alarm: `28 min left, 4×, chattering`.
fn notes(alarm: &AlarmRow) -> String {
    let count = (alarm.occurrences > 0).then(|| format!("{}×", alarm.occurrences));
    let left = alarm.shelf_left.map(|left| format!("{} left", age_text(left)));
    let words = [
        left,
        count,
        alarm.chatters.then(|| "chattering".to_owned()),
        alarm.is_first_out.then(|| "first out".to_owned()),
    ];
    words.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn column(rect: Rect, index: usize) -> Rect {
    let width = rect.width() - MARK_WIDTH;
    let left: f32 = COLUMNS[..index].iter().map(|(_, share)| share).sum();
    let x = rect.left() + MARK_WIDTH + left * width;
    Rect::from_min_size(egui::pos2(x, rect.top()), vec2(COLUMNS[index].1 * width, rect.height()))
}

fn cell(ui: &mut Ui, rect: Rect, index: usize, text: RichText) {
    cell_in(ui, column(rect, index), text);
}

fn cell_in(ui: &mut Ui, place: Rect, text: RichText) {
    let cell = place.shrink2(vec2(4.0, 0.0));
    let layout = Layout::left_to_right(Align::Center);
    let mut cell_ui = ui.new_child(UiBuilder::new().max_rect(cell).layout(layout));
    cell_ui.add(egui::Label::new(text).selectable(false).truncate());
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn columns_fill_the_width() {
        let sum: f32 = COLUMNS.iter().map(|(_, share)| share).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    }

    #[test]
    fn the_deciding_source_replaces_the_value() {
        let of = |source: Option<&str>, uncertainty: Option<&str>| {
            let value = "96 °C".to_owned();
            let [source, uncertainty] = [source, uncertainty].map(|text| text.map(str::to_owned));
            value_of(&AlarmRow { value, source, uncertainty, ..AlarmRow::default() })
        };
        assert_eq!(of(None, None), "96 °C");
        assert_eq!(of(None, Some("stale")), "× 96 °C");
        assert_eq!(of(Some("plc"), None), "by plc");
        assert_eq!(of(Some("plc"), Some("stale 12 s")), "× plc stale 12 s");
    }

    #[test]
    fn notes_list_the_present_conditions() {
        let mut alarm = AlarmRow { occurrences: 4, chatters: true, ..AlarmRow::default() };
        assert_eq!(notes(&alarm), "4×, chattering");
        alarm =
            AlarmRow { shelf_left: Some(Duration::from_secs(1700).into()), ..AlarmRow::default() };
        alarm.is_first_out = true;
        assert_eq!(notes(&alarm), "28 min left, first out");
    }
}
