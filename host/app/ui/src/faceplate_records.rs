//! The parts of a faceplate that come from business and management systems, and the bar that
//! leads to them.

use busbar_records::Kind;
use busbar_types::DefectSeverity;
use egui::{
    Align, Color32, Frame, Label, Layout, Margin, Rect, RichText, Sense, Stroke, StrokeKind, Ui,
    vec2,
};

use crate::faceplate::section;
use crate::{RecordRow, RecordSection, ValueMark, quality_hatching, theme};

/// A part of a faceplate that the bar leads to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaceplateSection {
    Operating,
    Records(Kind),
}

/// Width of the names of columns, points.
const NAME_WIDTH: f32 = 96.0;
/// Room beside uncertain rows, points.
const DOUBT_MARGIN: i8 = 10;

/// The bar of parts, where there is more than one; the part that is clicked.
pub(crate) fn bar(ui: &mut Ui, records: &[RecordSection]) -> Option<FaceplateSection> {
    if records.is_empty() {
        return None;
    }
    let has = |kind: Kind| records.iter().any(|section| section.kind == kind);
    let mut clicked = None;
    ui.horizontal(|ui| {
        let mut part = |ui: &mut Ui, part: FaceplateSection, words: &str| {
            if ui.button(words).on_hover_text("Go to this part").clicked() {
                clicked = Some(part);
            }
        };
        part(ui, FaceplateSection::Operating, "Operating");
        if has(Kind::Business) {
            part(ui, FaceplateSection::Records(Kind::Business), &work_words(records));
        }
        if let Some(severity) = greatest_severity(records) {
            badge(ui, severity, true);
        }
        if has(Kind::Asset) {
            let words = format!("{}Asset", uncertainty_mark(records, Kind::Asset));
            part(ui, FaceplateSection::Records(Kind::Asset), &words);
        }
    });
    clicked
}

fn work_words(records: &[RecordSection]) -> String {
    let work = records.iter().filter(|section| section.kind == Kind::Business);
    let uncertainty = uncertainty_mark(records, Kind::Business);
    match work.map(|section| section.open).sum::<usize>() {
        0 => format!("{uncertainty}Work"),
        open => format!("{uncertainty}Work: {open} open"),
    }
}

/// Returns the mark before a section in which any list is doubtful.
fn uncertainty_mark(records: &[RecordSection], kind: Kind) -> &'static str {
    let is_uncertain =
        |section: &RecordSection| section.kind == kind && section.uncertainty.is_some();
    if records.iter().any(is_uncertain) { "× " } else { "" }
}

/// Returns the greatest severity among the open records.
fn greatest_severity(records: &[RecordSection]) -> Option<DefectSeverity> {
    let rows = records.iter().flat_map(|section| &section.rows);
    rows.filter(|row| row.is_open).filter_map(|row| row.severity).max()
}

/// Shows all lists; the view goes to the part that was clicked.
pub(crate) fn show(ui: &mut Ui, records: &[RecordSection], mut goes_to: Option<FaceplateSection>) {
    for kind in [Kind::Business, Kind::Asset] {
        for list in records.iter().filter(|section| section.kind == kind) {
            if goes_to.take_if(|part| *part == FaceplateSection::Records(kind)).is_some() {
                ui.scroll_to_cursor(Some(Align::TOP));
            }
            section(ui, &list.title);
            origin(ui, list);
            match &list.uncertainty {
                None => rows(ui, list),
                Some(uncertainty) => show_uncertain_rows(ui, uncertainty, list),
            }
        }
    }
}

/// Source and time; hatched where the list may not be as the source has it now.
fn origin(ui: &mut Ui, list: &RecordSection) {
    let as_of = match list.as_of.is_empty() {
        true => String::new(),
        false => format!(", as of {}", list.as_of),
    };
    let words = match &list.uncertainty {
        None => format!("{}{as_of}", list.source),
        Some(uncertainty) => format!("× {}{as_of}: {uncertainty}", list.source),
    };
    let palette = theme::palette(ui.ctx());
    let ink = if list.uncertainty.is_some() { palette.text } else { palette.weak_text };
    let width = ui.available_width();
    let galley = ui.painter().layout(words, theme::small_font(), ink, width);
    let (place, _) = ui.allocate_exact_size(vec2(width, galley.size().y), Sense::hover());
    if let Some(reason) = list.uncertainty.clone() {
        quality_hatching::fill(ui.painter(), place, &ValueMark::Bad { reason });
    }
    ui.painter().galley(place.min, galley, ink);
    let (count, first) = &list.left_out;
    if *count > 0 {
        let rows = if *count == 1 { "row is" } else { "rows are" };
        ui.label(format!("! {count} {rows} wrong there and left out")).on_hover_text(first);
    }
}

/// Rows that may be otherwise by now: hatched along their side, for the text is to be read.
fn show_uncertain_rows(ui: &mut Ui, uncertainty: &str, list: &RecordSection) {
    let margin = Margin { left: DOUBT_MARGIN, ..Margin::ZERO };
    let shown = Frame::new().inner_margin(margin).show(ui, |ui| rows(ui, list));
    let side = shown.response.rect;
    let side = side.with_max_x(side.left() + f32::from(DOUBT_MARGIN) - 3.0);
    quality_hatching::fill(ui.painter(), side, &ValueMark::Bad { reason: uncertainty.to_owned() });
}

fn rows(ui: &mut Ui, list: &RecordSection) {
    if list.rows.is_empty() {
        // Of a list that is not there, nothing is known.
        if list.uncertainty.is_none() {
            ui.weak(match list.kind {
                Kind::Business => "none",
                Kind::Asset => "not in the register",
            });
        }
        return;
    }
    for (index, row) in list.rows.iter().enumerate() {
        if index > 0 {
            ui.separator();
        }
        if list.kind == Kind::Business {
            head(ui, row);
        }
        cells(ui, row);
    }
    if list.more > 0 {
        ui.weak(format!("and {} more", list.more));
    }
}

/// Shows severity, open or closed state, and date of a record.
fn head(ui: &mut Ui, row: &RecordRow) {
    ui.horizontal(|ui| {
        if let Some(severity) = row.severity {
            badge(ui, severity, row.is_open);
        }
        let state = RichText::new(if row.is_open { "open" } else { "closed" });
        ui.label(if row.is_open { state.strong() } else { state.weak() });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(&row.when);
        });
    });
}

/// Shows a severity badge: filled if open and critical, framed if open and serious, plain
/// otherwise.
fn badge(ui: &mut Ui, severity: DefectSeverity, is_open: bool) {
    let palette = theme::palette(ui.ctx());
    let (ground, ink, line) = match severity {
        _ if !is_open => (Color32::TRANSPARENT, palette.weak_text, Color32::TRANSPARENT),
        DefectSeverity::Critical => (theme::WARNING, theme::DARK_TEXT, palette.text),
        DefectSeverity::Serious => (Color32::TRANSPARENT, palette.text, palette.text),
        DefectSeverity::General => (Color32::TRANSPARENT, palette.text, Color32::TRANSPARENT),
    };
    let galley = ui.painter().layout_no_wrap(severity.name().to_owned(), theme::value_font(), ink);
    let around = if line == Color32::TRANSPARENT { vec2(0.0, 2.0) } else { vec2(10.0, 2.0) };
    let (place, _) = ui.allocate_exact_size(galley.size() + around, Sense::hover());
    ui.painter().rect(place, 3.0, ground, Stroke::new(1.0, line), StrokeKind::Inside);
    let at = Rect::from_center_size(place.center(), galley.size()).min;
    ui.painter().galley(at, galley, ink);
}

/// Names of columns and what stands there, the first lines side by side.
fn cells(ui: &mut Ui, row: &RecordRow) {
    let faint = theme::palette(ui.ctx()).weak_text;
    let place = row.place.iter().map(|place| ("Part", place.as_str()));
    let cells = row.cells.iter().map(|(name, text)| (name.as_str(), text.as_str()));
    for (name, text) in place.chain(cells) {
        ui.horizontal_top(|ui| {
            let size = vec2(NAME_WIDTH, 0.0);
            ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::TOP), |ui| {
                ui.set_min_width(NAME_WIDTH);
                ui.add(Label::new(RichText::new(name).color(faint)).truncate());
            });
            ui.add(Label::new(text).wrap());
        });
    }
}
