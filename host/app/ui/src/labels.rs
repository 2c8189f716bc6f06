//! Labels at equipment: boxes with leader lines that do not overlap and give
//! way by urgency.

mod placement;

use std::cmp::Ordering;
use std::sync::Arc;

use busbar_types::Origin;
use egui::text::{LayoutJob, TextWrapping};
use egui::{
    Align2, Color32, Galley, Painter, Rect, Shape, Stroke, StrokeKind, Ui, Vec2, pos2, vec2,
};

pub(crate) use self::placement::LabelPlacement;

use self::placement::LabelRequest;
use crate::age::age_text;

use crate::{Label, LabelLine, ValueMark, origin_mark, quality_hatching, theme};

const PADDING: f32 = 6.0;
const CORNER: f32 = 3.0;
const ROW_HEIGHT: f32 = 17.0;
const TITLE_HEIGHT: f32 = 17.0;
const COLUMN_GAP: f32 = 12.0;
/// Points between a value and the mark of its origin.
const ORIGIN_GAP: f32 = 5.0;
/// Boxes in a frame, the most urgent and nearest first; the rest are dots.
const MAX_BOXES: usize = 200;
/// Opacity of a label whose equipment is occluded.
const HIDDEN_OPACITY: f32 = 0.7;
/// Lines of a box, the most urgent first.
const MAX_LINES: usize = 12;
/// Width of a caption, and of a value, points; a longer one ends with an ellipsis. Faceplate and list
/// of tags tell the whole on hovering.
const MAX_TEXT_WIDTH: f32 = 320.0;

/// Paints labels over the scene, clipped to the viewport, beside occupied places.
pub(crate) fn paint(
    ui: &Ui,
    labels: &[Label<'_>],
    placement: &mut LabelPlacement,
    occupied: &[Rect],
) {
    let viewport = ui.max_rect();
    let painter = ui.painter().with_clip_rect(viewport);
    let mut ordered: Vec<&Label<'_>> =
        labels.iter().filter(|label| viewport.contains(label.anchor)).collect();
    ordered.sort_by(|a, b| by_priority(a, b));
    let (boxed, dots) = ordered.split_at(ordered.len().min(MAX_BOXES));
    let laid_out: Vec<LabelBox> =
        boxed.iter().map(|label| LabelBox::lay_out(&painter, label)).collect();
    let wanted: Vec<LabelRequest<'_>> = boxed
        .iter()
        .zip(&laid_out)
        .map(|(label, laid_out)| LabelRequest {
            key: &label.title,
            size: laid_out.size,
            anchor: label.anchor,
        })
        .collect();
    let places = placement.place(&wanted, viewport.shrink(4.0), occupied);
    let mut boxes = Vec::new();
    let mut crowded = dots.to_vec();
    for ((&label, laid_out), place) in boxed.iter().zip(laid_out).zip(places) {
        match place {
            Some(place) => boxes.push((label, laid_out, place)),
            None => crowded.push(label),
        }
    }
    // What is nearer lies over what is farther.
    crowded.sort_by(|a, b| b.distance.total_cmp(&a.distance));
    boxes.sort_by(|(a, ..), (b, ..)| b.distance.total_cmp(&a.distance));
    for label in crowded {
        anchor_dot(&fading(&painter, label), label);
    }
    // Leaders first, so that none crosses a box.
    for (label, _, place) in &boxes {
        leader(&fading(&painter, label), label, *place);
    }
    for (label, laid_out, place) in boxes {
        // Paler, and yet to be read whatever is behind it.
        painter.rect_filled(place, CORNER, theme::palette(ui.ctx()).background);
        laid_out.paint(&fading(&painter, label), label, place);
    }
}

/// Orders labels by placement priority: selected, in alarm, by urgency of the mark, then by
/// distance.
fn by_priority(a: &Label<'_>, b: &Label<'_>) -> Ordering {
    let rank = |label: &Label<'_>| (label.selected, label.alarmed, urgency(label));
    rank(b)
        .cmp(&rank(a))
        .then(a.distance.total_cmp(&b.distance))
        .then_with(|| a.title.cmp(&b.title))
}

fn urgency(label: &Label<'_>) -> u8 {
    label.lines.iter().map(|line| line.mark.urgency()).max().unwrap_or_default()
}

/// Paler for what stands behind other equipment, unless something is wrong with it.
fn fading(painter: &Painter, label: &Label<'_>) -> Painter {
    let mut painter = painter.clone();
    if label.hidden && !label.selected && urgency(label) == 0 {
        painter.set_opacity(HIDDEN_OPACITY);
    }
    painter
}

/// The texts of a label, measured.
struct LabelBox {
    title: Arc<Galley>,
    rows: Vec<LabelRow>,
    /// Widths of caption, value and note; that of the origin stands between the last two.
    columns: [f32; 3],
    origin_width: f32,
    size: Vec2,
}

/// The texts of a line: caption, value, note.
struct LabelRow {
    mark: ValueMark,
    origin: Origin,
    texts: [Arc<Galley>; 3],
}

impl LabelBox {
    fn lay_out(painter: &Painter, label: &Label<'_>) -> Self {
        let text = |text: String, font, color: Color32| painter.layout_no_wrap(text, font, color);
        let cut_text = |text: String, font, color: Color32| {
            let mut job = LayoutJob::simple_singleline(text, font, color);
            job.wrap = TextWrapping::truncate_at_width(MAX_TEXT_WIDTH);
            painter.layout_job(job)
        };
        let lines = most_urgent_lines(label);
        let hidden = label.lines.len() - lines.len();
        let more = if hidden > 0 { format!("   +{hidden} more") } else { String::new() };
        let title = format!("{}{more}", label.title);
        let title = text(title, theme::small_font(), theme::palette(painter.ctx()).weak_text);
        let rows: Vec<LabelRow> = lines
            .into_iter()
            .map(|line| {
                let (_, ink) = theme::background_and_text(painter.ctx(), &line.mark);
                let galleys = [
                    cut_text(
                        line.caption.to_string(),
                        theme::value_font(),
                        theme::palette(painter.ctx()).weak_text,
                    ),
                    cut_text(line.text.to_string(), theme::value_font(), ink),
                    text(note(line), theme::small_font(), ink),
                ];
                LabelRow { mark: line.mark.clone(), origin: line.origin, texts: galleys }
            })
            .collect();
        let columns = std::array::from_fn(|i| {
            rows.iter().map(|row| row.texts[i].size().x).fold(0.0, f32::max)
        });
        let of_origin = |row: &LabelRow| origin_mark::size(painter, row.origin).x;
        let origin_width = match rows.iter().map(of_origin).fold(0.0, f32::max) {
            width if width > 0.0 => width + ORIGIN_GAP,
            _ => 0.0,
        };
        let [caption, value, note] = columns;
        let note = if note > 0.0 { note + COLUMN_GAP } else { 0.0 };
        let width = (caption + COLUMN_GAP + value + origin_width + note + 8.0).max(title.size().x);
        let height = TITLE_HEIGHT + rows.len() as f32 * ROW_HEIGHT;
        let size = vec2(width, height) + Vec2::splat(2.0 * PADDING);
        Self { title, rows, columns, origin_width, size }
    }

    fn paint(self, painter: &Painter, label: &Label<'_>, rect: Rect) {
        let color = if label.selected {
            theme::palette(painter.ctx()).selection
        } else {
            theme::palette(painter.ctx()).border
        };
        let border = Stroke::new(if label.selected { 2.0 } else { 1.0 }, color);
        painter.rect(
            rect,
            CORNER,
            theme::palette(painter.ctx()).background,
            border,
            StrokeKind::Inside,
        );
        let inner = rect.shrink(PADDING);
        painter.galley(inner.min, self.title, theme::palette(painter.ctx()).weak_text);
        let [caption_width, value_width, _] = self.columns;
        for (index, row) in self.rows.into_iter().enumerate() {
            let LabelRow { mark, origin, texts: [caption, value, note] } = row;
            let top = inner.top() + TITLE_HEIGHT + index as f32 * ROW_HEIGHT;
            let value_left = inner.left() + caption_width + COLUMN_GAP;
            let ground = Rect::from_min_max(
                pos2(value_left - 4.0, top),
                pos2(inner.right(), top + ROW_HEIGHT - 1.0),
            );
            quality_hatching::fill(painter, ground, &mark);
            let middle = ground.center().y;
            let at = |x: f32, galley: &Galley| pos2(x, middle - galley.size().y * 0.5);
            painter.galley(
                at(inner.left(), &caption),
                caption.clone(),
                theme::palette(painter.ctx()).weak_text,
            );
            let value_x = value_left + value_width - value.size().x;
            // On stripes, text needs a ground of its own to stay legible.
            let value_right = value_left + value_width;
            let note_x = value_right + self.origin_width + COLUMN_GAP;
            let origin_at = pos2(value_right + ORIGIN_GAP, middle);
            origin_mark::paint(painter, origin_at, Align2::LEFT_CENTER, origin);
            for (x, galley) in [(value_x, value), (note_x, note)] {
                let text_rect = Rect::from_min_size(at(x, &galley), galley.size());
                if matches!(
                    mark,
                    ValueMark::Bad { .. } | ValueMark::Uncertain { .. } | ValueMark::LateDisplay
                ) && galley.size().x > 0.0
                {
                    painter.rect_filled(
                        text_rect.expand2(vec2(2.0, -1.0)),
                        2.0,
                        theme::palette(painter.ctx()).background,
                    );
                }
                painter.galley(text_rect.min, galley, theme::palette(painter.ctx()).text);
            }
        }
    }
}

/// The lines that a box has room for, in their own order.
fn most_urgent_lines<'l>(label: &'l Label<'_>) -> Vec<&'l LabelLine<'l>> {
    let mut ranked: Vec<(usize, &LabelLine<'_>)> = label.lines.iter().enumerate().collect();
    ranked.sort_by_key(|(_, line)| std::cmp::Reverse(line.mark.urgency()));
    ranked.truncate(MAX_LINES);
    ranked.sort_by_key(|(index, _)| *index);
    ranked.into_iter().map(|(_, line)| line).collect()
}

/// Returns the note beside a value that is not simply good.
fn note(line: &LabelLine<'_>) -> String {
    let symbol = theme::symbol(&line.mark);
    let age = line.age.map_or_else(String::new, |age| format!(" {}", age_text(age)));
    match &line.mark {
        ValueMark::Normal => String::new(),
        ValueMark::Warning => format!("{symbol} limit"),
        ValueMark::Alarm => format!("{symbol} alarm"),
        ValueMark::Uncertain { reason } | ValueMark::Bad { reason } => {
            format!("{symbol} {reason}{age}")
        }
        ValueMark::LateDisplay => format!("{symbol} {}", theme::LATE_DISPLAY),
    }
}

fn leader(painter: &Painter, label: &Label<'_>, rect: Rect) {
    let from = rect.clamp(label.anchor);
    let stroke = Stroke::new(1.0, theme::palette(painter.ctx()).border);
    if label.hidden {
        // It ends behind what is seen.
        painter.extend(Shape::dashed_line(&[from, label.anchor], stroke, 4.0, 3.0));
    } else {
        painter.line_segment([from, label.anchor], stroke);
    }
    painter.circle_filled(label.anchor, 2.5, theme::palette(painter.ctx()).weak_text);
}

/// Paints the dot of a label without room, with its most urgent symbol.
fn anchor_dot(painter: &Painter, label: &Label<'_>) {
    let mark = label.lines.iter().fold(ValueMark::Normal, |m, l| m.most_urgent(l.mark.clone()));
    let (fill, ink) = theme::background_and_text(painter.ctx(), &mark);
    let fill =
        if fill == Color32::TRANSPARENT { theme::palette(painter.ctx()).background } else { fill };
    painter.circle(label.anchor, 6.0, fill, Stroke::new(1.0, theme::palette(painter.ctx()).border));
    let origin = label.lines.iter().fold(Origin::LIVE, |all, line| all | line.origin);
    let beside = label.anchor + vec2(8.0, 0.0);
    origin_mark::paint(painter, beside, Align2::LEFT_CENTER, origin);
    painter.text(
        label.anchor,
        Align2::CENTER_CENTER,
        theme::symbol(&mark),
        theme::small_font(),
        ink,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_give_way_to_selection_alarm_urgency_and_nearness() {
        let label = |title: &str, distance, mark, alarmed, selected| Label {
            title: title.into(),
            distance,
            lines: vec![LabelLine { mark, ..LabelLine::default() }],
            alarmed,
            selected,
            ..Label::default()
        };
        let mut labels = [
            label("near", 1.0, ValueMark::Normal, false, false),
            label("far", 9.0, ValueMark::Normal, false, false),
            label("warned", 20.0, ValueMark::Warning, false, false),
            label("alarmed", 30.0, ValueMark::Normal, true, false),
            label("selected", 40.0, ValueMark::Normal, false, true),
        ];
        labels.sort_by(by_priority);
        let titles = labels.map(|label| label.title);
        assert_eq!(titles, ["selected", "alarmed", "warned", "near", "far"]);
    }

    #[test]
    fn long_texts_are_cut_at_a_width_and_short_ones_are_whole() {
        let line = |text: &'static str| LabelLine { text: text.into(), ..LabelLine::default() };
        let long = "x".repeat(255).leak();
        let label = Label { lines: vec![line("231 kV"), line(long)], ..Label::default() };
        let context = egui::Context::default();
        let mut widths = Vec::new();
        let mut output = context.run_ui(egui::RawInput::default(), |ui| {
            let laid_out = LabelBox::lay_out(ui.painter(), &label);
            widths = laid_out.rows.iter().map(|row| row.texts[1].size().x).collect();
            let shown = |row: usize| laid_out.rows[row].texts[1].rows[0].text();
            assert_eq!(shown(0), "231 kV");
            assert!(shown(1).starts_with("xxx") && shown(1).ends_with('…'), "{}", shown(1));
        });
        output.textures_delta.clear();
        assert!(widths[0] < 100.0, "{widths:?}");
        assert!((300.0..=MAX_TEXT_WIDTH).contains(&widths[1]), "{widths:?}");
    }

    #[test]
    fn a_late_display_has_its_own_note() {
        let late = LabelLine { mark: ValueMark::LateDisplay, ..LabelLine::default() };
        assert_eq!(note(&late), "… display late");
    }
}
