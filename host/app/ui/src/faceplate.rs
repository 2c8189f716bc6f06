//! Faceplate of one piece of equipment: alarms, verdict, states, live values, trends.

use busbar_types::Origin;
use egui::{
    Align, Align2, Button, Key, Label, Layout, Rect, RichText, ScrollArea, Sense, Ui, UiBuilder,
    Vec2, vec2,
};

use crate::age::age_text;
use crate::alarm_symbol::{self, AlarmSymbol};
use crate::faceplate_records::{self, FaceplateSection};
use crate::tag_panel::quality_text;
use crate::value_mark::whole_value;
use crate::{
    AlarmRow, Command, Faceplate, FaceplateState, FaceplateValue, ValueMark, faceplate_verdict,
    layers, origin_mark, quality_hatching, theme, trend,
};

/// Height of a row, points.
const ROW_HEIGHT: f32 = 19.0;
/// Shares of the width of a value's row: name, value, age.
const COLUMNS: [f32; 3] = [0.50, 0.34, 0.16];
/// Points that a key scrolls.
const PAGE: f32 = 320.0;

/// The panel of a faceplate between frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceplatePanel {
    /// Scroll offset of the panel, points.
    offset: f32,
}

impl FaceplatePanel {
    /// Shows a faceplate; it scrolls where it is long.
    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        faceplate: &Faceplate,
        flashes: bool,
        into: &mut Vec<Command>,
    ) {
        ui.add_space(3.0);
        head(ui, faceplate, into);
        let goes_to = faceplate_records::bar(ui, &faceplate.records);
        ui.separator();
        // Each piece of equipment is read from its top.
        let area = ScrollArea::vertical().id_salt(("faceplate", &faceplate.id));
        let area = match pages(ui) {
            0.0 => area,
            pages => area.vertical_scroll_offset((self.offset + pages * PAGE).max(0.0)),
        };
        let shown = area.auto_shrink(false).show(ui, |ui| {
            // The bar stands at the edge, not over the rows.
            ui.set_max_width(ui.available_width() - 6.0);
            if goes_to == Some(FaceplateSection::Operating) {
                ui.scroll_to_cursor(Some(Align::TOP));
            }
            alarms(ui, faceplate, flashes, into);
            if let Some(verdict) = &faceplate.verdict {
                faceplate_verdict::show(ui, &faceplate.id, verdict);
            }
            states(ui, &faceplate.states);
            values(ui, faceplate, into);
            trends(ui, faceplate, into);
            faceplate_records::show(ui, &faceplate.records, goes_to);
        });
        self.offset = shown.state.offset.y;
    }
}

/// Returns the pages to scroll by the PgUp and PgDn keys; 0 while a text field has the focus.
fn pages(ui: &Ui) -> f32 {
    if ui.ctx().egui_wants_keyboard_input() {
        return 0.0;
    }
    ui.input(|input| {
        let count = |key| f32::from(u8::from(input.key_pressed(key)));
        count(Key::PageDown) - count(Key::PageUp)
    })
}

fn head(ui: &mut Ui, faceplate: &Faceplate, into: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let close = |ui: &mut Ui| {
            if ui.add(Button::new("×").frame(false)).on_hover_text("Close (Esc)").clicked() {
                into.push(Command::Escape);
            }
            let id = RichText::new(&faceplate.id).strong().size(15.0);
            let layout = Layout::left_to_right(Align::Center).with_main_justify(true);
            ui.with_layout(layout.with_main_align(Align::Min), |ui| {
                ui.add(Label::new(id).truncate());
            });
        };
        ui.with_layout(Layout::right_to_left(Align::Center), close);
    });
    if !faceplate.name.is_empty() {
        ui.add(Label::new(&faceplate.name).truncate());
    }
    let mut more = faceplate.aliases.clone();
    if !faceplate.within.is_empty() {
        more.push(format!("in {}", faceplate.within.join(" › ")));
    }
    if !more.is_empty() {
        let text = RichText::new(more.join(" · ")).color(theme::palette(ui.ctx()).weak_text);
        ui.add(Label::new(text).wrap());
    }
}

/// Shows the title of a faceplate section.
pub(crate) fn section(ui: &mut Ui, title: &str) {
    ui.add_space(8.0);
    ui.label(RichText::new(title).strong());
}

fn alarms(ui: &mut Ui, faceplate: &Faceplate, flashes: bool, into: &mut Vec<Command>) {
    let calm = faceplate.calm_alarms;
    if faceplate.alarms.is_empty() && calm == 0 {
        return;
    }
    ui.label(RichText::new("Alarms").strong());
    let lit = alarm_symbol::is_flash_on(ui, flashes && !faceplate.alarms.is_empty());
    for alarm in &faceplate.alarms {
        alarm_row(ui, alarm, lit, into);
    }
    let words = match (calm, faceplate.alarms.len()) {
        (0, _) => return,
        (calm, 0) => format!("none; {calm} watch it"),
        (calm, _) => format!("{calm} more are normal"),
    };
    ui.weak(words);
}

/// Mark and message, the state below: a state is too long to stand beside it.
fn alarm_row(ui: &mut Ui, alarm: &AlarmRow, lit: bool, into: &mut Vec<Command>) {
    let size = vec2(ui.available_width(), 2.0 * ROW_HEIGHT - 2.0);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    if let Some(uncertainty) = &alarm.uncertainty {
        let reason = uncertainty.clone();
        let right = rect.with_min_x(rect.left() + 24.0).with_min_y(rect.center().y);
        quality_hatching::fill(ui.painter(), right, &ValueMark::Bad { reason });
    }
    let has_ring = alarm.is_unacknowledged && lit;
    let symbol = AlarmSymbol { priority: alarm.priority, is_active: alarm.is_active, has_ring };
    alarm_symbol::paint(ui.painter(), rect.left_center() + vec2(11.0, 0.0), 7.5, symbol);
    let text = rect.with_min_x(rect.left() + 26.0);
    let (above, below) = text.split_top_bottom_at_fraction(0.5);
    line(ui, above, RichText::new(&alarm.message).strong(), Align::Min);
    let state = if alarm.is_saving { "saving…" } else { alarm.state };
    let uncertainty = alarm
        .uncertainty
        .as_ref()
        .map_or_else(String::new, |uncertainty| format!("  × {uncertainty}"));
    let words = format!("{}  {}{uncertainty}", alarm.time, state);
    let below = mark_origin(ui, below, alarm.origin);
    line(ui, below, RichText::new(words.trim()), Align::Min);
    let hover = format!("{}{}", alarm.id, origin_mark::tooltip(alarm.origin));
    if response.on_hover_text(hover).clicked() {
        into.push(Command::SelectAlarm(alarm.number));
    }
}

fn states(ui: &mut Ui, states: &[FaceplateState]) {
    if states.is_empty() {
        return;
    }
    section(ui, "State");
    for state in states {
        let (rect, _) = row(ui);
        let [name, what, age] = columns(rect);
        let caption = state.place.as_ref().unwrap_or(&state.layer);
        let name = mark_origin(ui, name, state.origin);
        line(
            ui,
            name,
            RichText::new(caption).color(theme::palette(ui.ctx()).weak_text),
            Align::Min,
        );
        let is_known = state.mark.urgency() == 0;
        if is_known {
            let sample = Rect::from_min_size(what.left_top() + vec2(2.0, 3.0), vec2(26.0, 13.0));
            layers::paint_swatch(&ui.painter().with_clip_rect(sample), sample, &state.state);
            let words = what.union(age).with_min_x(what.left() + 34.0);
            line(ui, words, RichText::new(&state.state.name), Align::Min);
        } else {
            // Last known, and not known now.
            quality_hatching::fill(
                ui.painter(),
                what.union(age).shrink2(vec2(0.0, 1.0)),
                &state.mark,
            );
            let words = format!("not known: was {}", state.state.name);
            line(ui, what, RichText::new(words), Align::Min);
            line(ui, age, RichText::new(state.age.map_or_else(String::new, age_text)), Align::Max);
        }
    }
}

fn values(ui: &mut Ui, faceplate: &Faceplate, into: &mut Vec<Command>) {
    if faceplate.values.is_empty() {
        return;
    }
    section(ui, "Values");
    for value in &faceplate.values {
        value_row(ui, value, into);
    }
    if faceplate.more_values > 0 {
        ui.weak(format!("and {} more: see its parts, or the tags", faceplate.more_values));
    }
}

fn value_row(ui: &mut Ui, value: &FaceplateValue, into: &mut Vec<Command>) {
    let tag = &value.row;
    let (rect, response) = row(ui);
    let [name, number, age] = columns(rect);
    quality_hatching::fill(ui.painter(), number.union(age).shrink2(vec2(0.0, 1.0)), &tag.mark);
    let (_, ink) = theme::background_and_text(ui.ctx(), &tag.mark);
    let caption = match &value.place {
        Some(place) => format!("{place}  {}", tag.name),
        None => tag.name.clone(),
    };
    let marker = if value.is_trended == Some(true) { "• " } else { "" };
    let name = mark_origin(ui, name, tag.origin);
    line(ui, name, RichText::new(format!("{marker}{caption}")), Align::Min);
    let symbol = theme::symbol(&tag.mark);
    let text = format!("{symbol} {} {}", tag.value, tag.unit);
    line(ui, number, RichText::new(text.trim()).color(ink), Align::Max);
    let text = tag.age.map_or_else(String::new, age_text);
    line(ui, age, RichText::new(text).color(ink), Align::Max);
    let hint = match value.is_trended {
        Some(false) => "\nClick: show its trend",
        Some(true) => "\nClick: hide its trend",
        None => "",
    };
    let origin = origin_mark::tooltip(tag.origin);
    let whole = whole_value(&tag.value);
    let hover = format!("{}{whole}\n{}{origin}{hint}", tag.id, quality_text(&tag.mark));
    if response.on_hover_text(hover).clicked() && value.is_trended.is_some() {
        into.push(Command::ToggleTrend(value.tag));
    }
}

fn trends(ui: &mut Ui, faceplate: &Faceplate, into: &mut Vec<Command>) {
    if faceplate.trends.is_empty() {
        return;
    }
    ui.add_space(8.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Trends").strong());
        trend::spans(ui, faceplate.trend_span, into);
    });
    for shown in &faceplate.trends {
        trend::show(ui, shown, faceplate.trend_span);
    }
}

/// Marks an origin at the right end of a place and returns the remaining width.
fn mark_origin(ui: &Ui, place: Rect, origin: Origin) -> Rect {
    let at = place.right_center() - vec2(3.0, 0.0);
    let marked = origin_mark::paint(ui.painter(), at, Align2::RIGHT_CENTER, origin);
    place.with_max_x(marked.left().max(place.left()))
}

fn row(ui: &mut Ui) -> (Rect, egui::Response) {
    ui.allocate_exact_size(vec2(ui.available_width(), ROW_HEIGHT), Sense::click())
}

fn columns(rect: Rect) -> [Rect; 3] {
    let mut left = rect.left();
    COLUMNS.map(|share| {
        let size = Vec2::new(share * rect.width(), rect.height());
        let column = Rect::from_min_size(egui::pos2(left, rect.top()), size);
        left += size.x;
        column
    })
}

/// Shows one line of text, truncated to its place.
fn line(ui: &mut Ui, place: Rect, text: RichText, align: Align) {
    let layout = match align {
        Align::Max => Layout::right_to_left(Align::Center),
        _ => Layout::left_to_right(Align::Center),
    };
    let place = place.shrink2(vec2(3.0, 0.0));
    let mut ui = ui.new_child(UiBuilder::new().max_rect(place).layout(layout));
    ui.add(Label::new(text).selectable(false).truncate());
}
