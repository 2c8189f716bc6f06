//! Faceplate section with a chart's explanation: verdict, evidence, values against limits,
//! diagrams.

use busbar_chart::{Diagram, Evidence, Table};
use busbar_types::Severity;
use egui::{
    Align2, Color32, FontId, Grid, Label, Pos2, Rect, RichText, Sense, Stroke, Ui, pos2, vec2,
};

use crate::chart_model::EquipmentExplanation;
use crate::faceplate::section;
use crate::{ValueMark, layers, quality_hatching, theme};

/// Points: names of zones have room in it, and two of them in a faceplate.
const DIAGRAM_SIZE: f32 = 138.0;
/// Gap between diagrams, points.
const GAP: f32 = 8.0;
/// Points that a reason stands in from the method it is of.
const INDENT: f32 = 16.0;

/// Shows the explanation; that of a parent names the parent.
pub(crate) fn show(ui: &mut Ui, faceplate: &str, explained: &EquipmentExplanation) {
    let explanation = &explained.explanation;
    let of = if explained.id == faceplate { "" } else { explained.id.as_str() };
    section(ui, format!("{} {of}", explained.chart).trim());
    if let Some(state) = &explained.state {
        layers::entry(ui, state);
    }
    let taken = ui.label(&explained.taken);
    if explained.is_outdated {
        quality_hatching::fill(
            ui.painter(),
            taken.rect,
            &ValueMark::Uncertain { reason: String::new() },
        );
        ui.label(RichText::new("× too old to speak for the equipment").strong());
    }
    ui.add(Label::new(RichText::new(&explanation.verdict).size(14.0)).wrap());
    ui.add_space(4.0);
    diagrams(ui, &explanation.diagrams);
    ui.scope(|ui| evidence(ui, &explanation.evidence));
    for table in &explanation.tables {
        ui.add_space(4.0);
        numbers(ui, table);
    }
}

/// Shows the diagrams in rows, as many side by side as fit.
fn diagrams(ui: &mut Ui, diagrams: &[Diagram]) {
    let fitting = ((ui.available_width() + GAP) / (DIAGRAM_SIZE + GAP)) as usize;
    for row in diagrams.chunks(fitting.max(1)) {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = GAP;
            for shown in row {
                ui.vertical(|ui| diagram(ui, shown));
            }
        });
        ui.add_space(4.0);
    }
}

/// A method with its result, its reason below: that is too long to stand beside it.
fn evidence(ui: &mut Ui, list: &[Evidence]) {
    ui.spacing_mut().item_spacing.y = 0.0;
    for one in list {
        ui.add_space(4.0);
        let (sign, hint) = match one.agrees {
            Some(true) => ("=", "agrees with the verdict"),
            Some(false) => ("≠", "does not agree with the verdict"),
            None => ("–", "says nothing here"),
        };
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.label(RichText::new(sign).strong()).on_hover_text(hint);
            ui.label(format!("{}:", one.method));
            ui.add(Label::new(RichText::new(&one.result).strong()).truncate());
        });
        ui.horizontal(|ui| {
            ui.add_space(INDENT);
            let reason =
                RichText::new(&one.reason).color(theme::palette(ui.ctx()).weak_text).size(12.0);
            ui.add(Label::new(reason).wrap());
        });
    }
}

/// Rows with their signs; heads in two lines, so that a faceplate is wide enough.
fn numbers(ui: &mut Ui, table: &Table) {
    ui.label(RichText::new(&table.title).strong());
    let grid = Grid::new(&table.title).num_columns(table.columns.len() + 1);
    grid.spacing([10.0, 1.0]).show(ui, |ui| {
        ui.label("");
        for head in &table.columns {
            let head = head.replacen(" (", "\n(", 1);
            ui.label(RichText::new(head).color(theme::palette(ui.ctx()).weak_text).size(12.0));
        }
        ui.end_row();
        for row in &table.rows {
            let (sign, ground) = match row.severity {
                Severity::Normal => ("", Color32::TRANSPARENT),
                Severity::Warning => ("!", theme::WARNING),
                Severity::Alarm => ("!!", theme::ALARM),
            };
            let ink = match row.severity {
                Severity::Normal => theme::palette(ui.ctx()).text,
                Severity::Warning => theme::DARK_TEXT,
                Severity::Alarm => Color32::WHITE,
            };
            let sign = RichText::new(sign).strong().color(ink).background_color(ground);
            ui.label(sign);
            for cell in &row.cells {
                let text = RichText::new(cell);
                let strong = row.severity != Severity::Normal;
                ui.label(if strong { text.strong() } else { text });
            }
            ui.end_row();
        }
    });
}

/// Zones as outlines, the one that is hit filled; the trail with the last place marked.
fn diagram(ui: &mut Ui, diagram: &Diagram) {
    let hit = diagram.zones.iter().find(|zone| zone.is_hit);
    let title = hit.map_or(diagram.title.clone(), |hit| format!("{}: {}", diagram.title, hit.name));
    ui.label(RichText::new(title).size(12.0).strong());
    let (rect, _) = ui.allocate_exact_size(vec2(DIAGRAM_SIZE, DIAGRAM_SIZE), Sense::hover());
    let Some(place) = fit(diagram, rect) else { return };
    let painter = ui.painter().with_clip_rect(rect);
    let line = Stroke::new(1.0, theme::palette(ui.ctx()).border);
    for zone in &diagram.zones {
        let corners: Vec<Pos2> = zone.outline.iter().map(|corner| place(*corner)).collect();
        if zone.is_hit {
            // Stripes, so that it is told apart in grey as well.
            fill_striped(&painter, &corners);
        }
        painter.add(egui::Shape::closed_line(corners, line));
    }
    zone_names(&painter, diagram, &place);
    for (name, at) in &diagram.marks {
        let at = place(*at);
        let align = if at.y < rect.center().y { Align2::CENTER_BOTTOM } else { Align2::CENTER_TOP };
        let font = FontId::proportional(11.0);
        painter.text(at, align, name, font, theme::palette(ui.ctx()).text);
    }
    let trail: Vec<Pos2> = diagram.trail.iter().map(|at| place(*at)).collect();
    painter.add(egui::Shape::line(
        trail.clone(),
        Stroke::new(1.2, theme::palette(ui.ctx()).weak_text),
    ));
    if let Some((last, before)) = trail.split_last() {
        for at in before {
            painter.circle_filled(*at, 1.8, theme::palette(ui.ctx()).weak_text);
        }
        painter.circle(*last, 5.0, Color32::WHITE, Stroke::new(2.4, theme::palette(ui.ctx()).text));
    }
}

/// The name of the zone that is hit, and of the others, as far as there is room: the last
/// place is not to be hidden.
fn zone_names(painter: &egui::Painter, diagram: &Diagram, place: &impl Fn([f32; 2]) -> Pos2) {
    let last = diagram.trail.last().map(|at| Rect::from_center_size(place(*at), vec2(12.0, 12.0)));
    let mut there: Vec<Rect> = last.into_iter().collect();
    let (hit, others): (Vec<_>, Vec<_>) = diagram.zones.iter().partition(|zone| zone.is_hit);
    for zone in hit.into_iter().chain(others) {
        let count = zone.outline.len().max(1) as f32;
        let sum = zone.outline.iter().fold([0.0; 2], |sum, c| [sum[0] + c[0], sum[1] + c[1]]);
        let theme = theme::palette(painter.ctx());
        let (ink, size) = if zone.is_hit { (theme.text, 14.0) } else { (theme.weak_text, 11.0) };
        let font = FontId::proportional(size);
        let galley = painter.layout_no_wrap(zone.name.clone(), font, ink);
        let middle = place([sum[0] / count, sum[1] / count]);
        let rect = Align2::CENTER_CENTER.anchor_size(middle, galley.size());
        if there.iter().all(|other| !other.intersects(rect)) {
            painter.galley(rect.min, galley, ink);
            there.push(rect);
        }
    }
}

fn fill_striped(painter: &egui::Painter, corners: &[Pos2]) {
    let bounds = Rect::from_points(corners);
    let inside = |at: Pos2| {
        let mut crossings = false;
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            if (a.y > at.y) != (b.y > at.y) && at.x < (b.x - a.x) * (at.y - a.y) / (b.y - a.y) + a.x
            {
                crossings = !crossings;
            }
        }
        crossings
    };
    const STEP: f32 = 5.0;
    let stroke = Stroke::new(1.4, theme::palette(painter.ctx()).hatch);
    let mut x = bounds.left() - bounds.height();
    while x < bounds.right() {
        let along = |t: f32| pos2(x + t, bounds.bottom() - t);
        let mut begun: Option<f32> = None;
        let mut t = 0.0;
        while t <= bounds.height() {
            match (begun, inside(along(t))) {
                (None, true) => begun = Some(t),
                (Some(from), false) => {
                    painter.line_segment([along(from), along(t)], stroke);
                    begun = None;
                }
                _ => {}
            }
            t += 1.0;
        }
        if let Some(from) = begun {
            painter.line_segment([along(from), along(bounds.height())], stroke);
        }
        x += STEP;
    }
}

/// Returns the mapping from a diagram's plane to the screen that shows all zones.
fn fit(diagram: &Diagram, rect: Rect) -> Option<impl Fn([f32; 2]) -> Pos2 + use<>> {
    let corners = diagram.zones.iter().flat_map(|zone| &zone.outline);
    let places: Vec<Pos2> = corners.map(|[x, y]| pos2(*x, *y)).collect();
    if places.is_empty() {
        return None;
    }
    let bounds = Rect::from_points(&places);
    let room = rect.shrink(16.0);
    let scale =
        (room.width() / bounds.width().max(1e-6)).min(room.height() / bounds.height().max(1e-6));
    let (from, to) = (bounds.center(), rect.center());
    Some(move |[x, y]: [f32; 2]| pos2(to.x + (x - from.x) * scale, to.y - (y - from.y) * scale))
}
