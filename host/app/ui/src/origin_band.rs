//! Origin band across the scene while values are not live: replay, simulation, test, history.
//! Nothing hides or covers the band.

use busbar_types::Origin;
use egui::{
    Align2, Context, FontFamily, FontId, Id, LayerId, Order, Painter, Pos2, Rect, Stroke, pos2,
    vec2,
};

use crate::{origin_mark, theme};

/// Height of a row of text, points; a low window has lower rows.
const ROW_HEIGHT: f32 = 20.0;
const LOW_ROW_HEIGHT: f32 = 15.0;
/// Height of a window that is low, points.
const LOW_WINDOW: f32 = 260.0;
/// Size of letters, as a share of a row's height.
const LETTERS: f32 = 0.68;
/// Gap between texts, and width of the stripes between repetitions, points.
const WORD_GAP: f32 = 16.0;
const STRIPES: f32 = 44.0;
/// Distance between stripes, points.
const STRIPE_STEP: f32 = 8.0;
/// A scene narrower than this has the band across the whole window, points.
const MIN_SCENE_WIDTH: f32 = 160.0;

/// Place of the band: the top of the scene, or of the window where panels leave no scene;
/// none where all is live.
pub(crate) fn place(context: &Context, scene: Rect, origin: Origin) -> Option<Rect> {
    let window = context.content_rect();
    let across = if scene.width() < MIN_SCENE_WIDTH { window } else { scene };
    let rows = rows(context, across.width(), origin);
    let height = rows.len() as f32 * row_height(context);
    (!rows.is_empty()).then(|| across.with_max_y(across.top() + height))
}

/// Paints the band into its place, over all else.
pub(crate) fn paint(context: &Context, place: Rect, origin: Origin) {
    // A layer of its own above windows, menus and tooltips.
    let layer = LayerId::new(Order::Debug, Id::new("origin band"));
    let painter = Painter::new(context.clone(), layer, place);
    let palette = theme::palette(context);
    painter.rect_filled(place, 0.0, palette.text);
    let height = row_height(context);
    for (index, row) in rows(context, place.width(), origin).into_iter().enumerate() {
        let top = place.top() + index as f32 * height;
        let line = Rect::from_min_size(pos2(place.left(), top), vec2(place.width(), height));
        paint_row(&painter, line, &row);
    }
}

/// Paints the texts in the middle of a row and repeats them to both sides where there is room.
fn paint_row(painter: &Painter, line: Rect, words: &[&str]) {
    let width = width(painter.ctx(), words);
    let step = width + 2.0 * WORD_GAP + STRIPES;
    let beside = ((line.width() - width) * 0.5 / step).floor().max(0.0) as i32;
    for number in -beside..=beside {
        let center = line.center().x + number as f32 * step;
        let mut left = center - width * 0.5;
        for word in words {
            let at = pos2(left, line.center().y);
            let ink = theme::palette(painter.ctx()).background;
            let shown = painter.text(at, Align2::LEFT_CENTER, word, font(painter.ctx()), ink);
            left = shown.right() + WORD_GAP;
        }
        let edge = center + width * 0.5 + WORD_GAP;
        stripe(painter, line.with_min_x(edge).with_max_x(edge + STRIPES));
        if number == -beside {
            let edge = center - width * 0.5 - WORD_GAP;
            stripe(painter, line.with_max_x(edge));
        }
        if number == beside {
            stripe(painter, line.with_min_x(edge + STRIPES));
        }
    }
}

/// Slanting stripes, as on a barrier.
fn stripe(painter: &Painter, place: Rect) {
    let painter = painter.with_clip_rect(place.intersect(painter.clip_rect()));
    let stroke = Stroke::new(STRIPE_STEP * 0.4, theme::palette(painter.ctx()).background);
    // On one grid all along the band.
    let first = ((place.left() - place.height()) / STRIPE_STEP).floor() as i32;
    let last = (place.right() / STRIPE_STEP).ceil() as i32;
    for number in first..=last {
        let x = number as f32 * STRIPE_STEP;
        let ends: [Pos2; 2] = [pos2(x, place.bottom()), pos2(x + place.height(), place.top())];
        painter.line_segment(ends, stroke);
    }
}

/// Returns the texts of the band, broken into rows.
fn rows(context: &Context, room: f32, origin: Origin) -> Vec<Vec<&'static str>> {
    let mut rows: Vec<Vec<&'static str>> = Vec::new();
    for word in origin_mark::words(origin).filter_map(|words| words.band) {
        if let Some(row) = rows.last_mut() {
            row.push(word);
            if width(context, row) + WORD_GAP <= room {
                continue;
            }
            row.pop();
        }
        rows.push(vec![word]);
    }
    rows
}

fn width(context: &Context, words: &[&str]) -> f32 {
    let font = font(context);
    let of_word = |word: &&str| {
        let text = (*word).to_owned();
        context
            .fonts_mut(|fonts| fonts.layout_no_wrap(text, font.clone(), theme::DARK_TEXT))
            .size()
            .x
    };
    words.iter().map(of_word).sum::<f32>() + WORD_GAP * words.len().saturating_sub(1) as f32
}

fn font(context: &Context) -> FontId {
    FontId::new(row_height(context) * LETTERS, FontFamily::Proportional)
}

fn row_height(context: &Context) -> f32 {
    if context.content_rect().height() < LOW_WINDOW { LOW_ROW_HEIGHT } else { ROW_HEIGHT }
}
