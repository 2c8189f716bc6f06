//! Labels at equipment: boxes with leader lines that do not overlap and give
//! way by urgency.

use std::sync::Arc;

use egui::{
    Align2, Color32, Galley, Painter, Pos2, Rect, Stroke, StrokeKind, Ui, Vec2, pos2, vec2,
};

use crate::view_model::age_text;
use crate::{Label, LabelLine, Mark, hatch, theme};

const PADDING: f32 = 6.0;
const ROW_HEIGHT: f32 = 17.0;
const TITLE_HEIGHT: f32 = 17.0;
const COLUMN_GAP: f32 = 12.0;
/// How far a box stands from its anchor, points.
const STAND_OFF: f32 = 34.0;
/// Places tried for one box; one that finds none shrinks to a dot.
const MAX_TRIES: usize = 4 * DIRECTIONS.len();
/// Radians from straight up, in the order of preference.
const DIRECTIONS: [f32; 10] = [0.0, 0.6, -0.6, 1.1, -1.1, 1.57, -1.57, 2.3, -2.3, 3.0];
/// Boxes in a frame, the most urgent and nearest first; the rest are dots.
const MAX_BOXES: usize = 200;
/// Lines of a box, the most urgent first.
const MAX_LINES: usize = 12;

/// Paints labels over the scene, clipped to the viewport.
pub(crate) fn paint(ui: &Ui, labels: &[Label]) {
    let viewport = ui.max_rect();
    let painter = ui.painter().with_clip_rect(viewport);
    let mut ordered: Vec<&Label> =
        labels.iter().filter(|label| viewport.contains(label.anchor)).collect();
    ordered.sort_by(|a, b| {
        let urgency = |label: &Label| label.lines.iter().map(|l| l.mark.urgency()).max();
        b.selected
            .cmp(&a.selected)
            .then(urgency(b).cmp(&urgency(a)))
            .then(a.distance.total_cmp(&b.distance))
            .then(a.title.cmp(&b.title))
    });
    let mut taken: Vec<Rect> = Vec::new();
    let mut boxes = Vec::new();
    for label in ordered {
        if boxes.len() == MAX_BOXES {
            anchor_dot(&painter, label);
            continue;
        }
        let laid_out = LabelBox::lay_out(&painter, label);
        match place(laid_out.size, label.anchor, viewport.shrink(4.0), &taken) {
            Some(rect) => {
                taken.push(rect);
                boxes.push((label, laid_out, rect));
            }
            None => anchor_dot(&painter, label),
        }
    }
    // Leaders first, so that none crosses a box.
    for (label, _, rect) in &boxes {
        leader(&painter, label, *rect);
    }
    for (label, laid_out, rect) in boxes {
        laid_out.paint(&painter, label, rect);
    }
}

/// A free place near the anchor: above first, then to the sides and below, on
/// widening rings.
fn place(size: Vec2, anchor: Pos2, within: Rect, taken: &[Rect]) -> Option<Rect> {
    (0..MAX_TRIES).find_map(|attempt| {
        let ring = (attempt / DIRECTIONS.len() + 1) as f32;
        let side = DIRECTIONS[attempt % DIRECTIONS.len()];
        let direction = vec2(f32::sin(side), -f32::cos(side));
        let reach = STAND_OFF * ring + size.y * 0.5 + direction.x.abs() * size.x * 0.5;
        let rect = Rect::from_center_size(anchor + direction * reach, size);
        let free = within.contains_rect(rect)
            && !rect.expand(3.0).contains(anchor)
            && taken.iter().all(|other| !other.expand(3.0).intersects(rect));
        free.then_some(rect)
    })
}

/// The texts of a label, measured.
struct LabelBox {
    title: Arc<Galley>,
    rows: Vec<(Mark, [Arc<Galley>; 3])>,
    columns: [f32; 3],
    size: Vec2,
}

impl LabelBox {
    fn lay_out(painter: &Painter, label: &Label) -> Self {
        let text = |text: String, font, color: Color32| painter.layout_no_wrap(text, font, color);
        let lines = most_urgent_lines(label);
        let hidden = label.lines.len() - lines.len();
        let more = if hidden > 0 { format!("   +{hidden} more") } else { String::new() };
        let title = format!("{}{more}", label.title);
        let title = text(title, theme::small_font(), theme::FAINT_INK);
        let rows: Vec<(Mark, [Arc<Galley>; 3])> = lines
            .into_iter()
            .map(|line| {
                let (_, ink) = theme::ground_and_ink(&line.mark);
                let galleys = [
                    text(line.caption.clone(), theme::value_font(), theme::FAINT_INK),
                    text(line.text.clone(), theme::value_font(), ink),
                    text(note(line), theme::small_font(), ink),
                ];
                (line.mark.clone(), galleys)
            })
            .collect();
        let columns = std::array::from_fn(|i| {
            rows.iter().map(|(_, row)| row[i].size().x).fold(0.0, f32::max)
        });
        let [caption, value, note] = columns;
        let note = if note > 0.0 { note + COLUMN_GAP } else { 0.0 };
        let width = (caption + COLUMN_GAP + value + note + 8.0).max(title.size().x);
        let height = TITLE_HEIGHT + rows.len() as f32 * ROW_HEIGHT;
        let size = vec2(width, height) + Vec2::splat(2.0 * PADDING);
        Self { title, rows, columns, size }
    }

    fn paint(self, painter: &Painter, label: &Label, rect: Rect) {
        let color = if label.selected { theme::SELECTION } else { theme::LINE };
        let border = Stroke::new(if label.selected { 2.0 } else { 1.0 }, color);
        painter.rect(rect, 3.0, theme::PAPER, border, StrokeKind::Inside);
        let inner = rect.shrink(PADDING);
        painter.galley(inner.min, self.title, theme::FAINT_INK);
        let [caption_width, value_width, _] = self.columns;
        for (index, (mark, [caption, value, note])) in self.rows.into_iter().enumerate() {
            let top = inner.top() + TITLE_HEIGHT + index as f32 * ROW_HEIGHT;
            let value_left = inner.left() + caption_width + COLUMN_GAP;
            let ground = Rect::from_min_max(
                pos2(value_left - 4.0, top),
                pos2(inner.right(), top + ROW_HEIGHT - 1.0),
            );
            hatch::ground(painter, ground, &mark);
            let middle = ground.center().y;
            let at = |x: f32, galley: &Galley| pos2(x, middle - galley.size().y * 0.5);
            painter.galley(at(inner.left(), &caption), caption.clone(), theme::FAINT_INK);
            let value_x = value_left + value_width - value.size().x;
            // On stripes, text needs a ground of its own to stay legible.
            for (x, galley) in [(value_x, value), (value_left + value_width + COLUMN_GAP, note)] {
                let text_rect = Rect::from_min_size(at(x, &galley), galley.size());
                if matches!(mark, Mark::Bad { .. } | Mark::Uncertain { .. })
                    && galley.size().x > 0.0
                {
                    painter.rect_filled(text_rect.expand2(vec2(2.0, -1.0)), 2.0, theme::PAPER);
                }
                painter.galley(text_rect.min, galley, theme::INK);
            }
        }
    }
}

/// The lines that a box has room for, in their own order.
fn most_urgent_lines(label: &Label) -> Vec<&LabelLine> {
    let mut ranked: Vec<(usize, &LabelLine)> = label.lines.iter().enumerate().collect();
    ranked.sort_by_key(|(_, line)| std::cmp::Reverse(line.mark.urgency()));
    ranked.truncate(MAX_LINES);
    ranked.sort_by_key(|(index, _)| *index);
    ranked.into_iter().map(|(_, line)| line).collect()
}

/// What stands behind a value that is not simply good.
fn note(line: &LabelLine) -> String {
    let symbol = theme::symbol(&line.mark);
    let age = line.age.map_or_else(String::new, |age| format!(" {}", age_text(age)));
    match &line.mark {
        Mark::Normal => String::new(),
        Mark::Warning => format!("{symbol} limit"),
        Mark::Alarm => format!("{symbol} alarm"),
        Mark::Uncertain { reason } | Mark::Bad { reason } => format!("{symbol} {reason}{age}"),
    }
}

fn leader(painter: &Painter, label: &Label, rect: Rect) {
    let from = rect.clamp(label.anchor);
    painter.line_segment([from, label.anchor], Stroke::new(1.0, theme::LINE));
    painter.circle_filled(label.anchor, 2.5, theme::FAINT_INK);
}

/// What is left of a label without room: a dot with its most urgent symbol.
fn anchor_dot(painter: &Painter, label: &Label) {
    let mark = label.lines.iter().fold(Mark::Normal, |m, l| m.most_urgent(l.mark.clone()));
    let (fill, ink) = theme::ground_and_ink(&mark);
    let fill = if fill == Color32::TRANSPARENT { theme::PAPER } else { fill };
    painter.circle(label.anchor, 6.0, fill, Stroke::new(1.0, theme::LINE));
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
    fn places_do_not_overlap_and_stay_inside() {
        let within = Rect::from_min_size(Pos2::ZERO, vec2(800.0, 600.0));
        let mut taken = Vec::new();
        for _ in 0..6 {
            let rect = place(vec2(120.0, 60.0), pos2(400.0, 300.0), within, &taken).unwrap();
            assert!(within.contains_rect(rect));
            assert!(taken.iter().all(|other: &Rect| !other.intersects(rect)));
            taken.push(rect);
        }
    }

    #[test]
    fn a_box_larger_than_the_screen_finds_no_place() {
        let within = Rect::from_min_size(Pos2::ZERO, vec2(100.0, 100.0));
        assert_eq!(place(vec2(200.0, 20.0), pos2(50.0, 50.0), within, &[]), None);
    }
}
