//! Switch position symbols in the scene, after IEC 60617-7: filled means conducting, so that no
//! color is needed.

use busbar_types::Origin;
use egui::{Align2, Color32, Painter, Pos2, Rect, Shape, Stroke, StrokeKind, Ui, Vec2, pos2, vec2};

use crate::age::{Age, age_text};
use crate::{ValueMark, origin_mark, quality_hatching, theme};

/// Half a side of a flag, points.
const HALF: f32 = 7.0;
/// Padding between a symbol's edge and its background, points.
const PAPER: f32 = 3.0;
/// Greatest distance at which normal positions have a word, metres; abnormal ones always have it.
const MAX_WORD_METRES: f32 = 70.0;
/// Flags of normal positions as far as this, metres.
const MAX_METRES: f32 = 220.0;
/// Symbols in a frame: abnormal positions first, then the nearest.
const MAX_SYMBOLS: usize = 300;

/// Switch position as far as it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchState {
    /// Open: the switch does not conduct.
    Open,
    /// Closed: the switch conducts.
    Closed,
    /// Travelling between the end positions.
    Travelling,
    /// Contradictory report of the position.
    Invalid,
    /// Position of bad or uncertain quality.
    Unknown,
}

impl SwitchState {
    /// All states, for the legend.
    pub(crate) const ALL: [Self; 5] =
        [Self::Open, Self::Closed, Self::Travelling, Self::Invalid, Self::Unknown];

    /// Returns the state as one word.
    pub(crate) fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Closed => "closed",
            Self::Travelling => "travelling",
            Self::Invalid => "invalid",
            Self::Unknown => "unknown",
        }
    }

    fn is_normal(self) -> bool {
        matches!(self, Self::Open | Self::Closed)
    }
}

/// A flag at a switch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwitchSymbol {
    /// Screen position of the switch, points.
    pub anchor: Pos2,
    /// Distance from the eye, metres.
    pub distance: f32,
    /// Position of the switch.
    pub state: SwitchState,
    /// Age of a value that is not good.
    pub age: Option<Age>,
    /// Origin of the reported position.
    pub origin: Origin,
}

/// Flags that are shown, with the places that they take: labels go elsewhere. One that
/// would cover another is left out, the less urgent and farther one first.
pub(crate) fn placed(ui: &Ui, switch_symbols: &[SwitchSymbol]) -> Vec<(SwitchSymbol, Rect)> {
    let viewport = ui.max_rect();
    let is_seen = |symbol: &&SwitchSymbol| {
        viewport.contains(symbol.anchor)
            && (!symbol.state.is_normal() || symbol.distance < MAX_METRES)
    };
    let mut ordered: Vec<&SwitchSymbol> = switch_symbols.iter().filter(is_seen).collect();
    ordered.sort_by(|a, b| {
        let rank = |symbol: &SwitchSymbol| symbol.state.is_normal();
        rank(a).cmp(&rank(b)).then(a.distance.total_cmp(&b.distance))
    });
    ordered.truncate(MAX_SYMBOLS);
    let mut shown: Vec<(SwitchSymbol, Rect)> = Vec::new();
    for symbol in ordered {
        let rect = place_of(ui.painter(), symbol);
        if shown.iter().all(|(_, other)| !other.intersects(rect)) {
            shown.push((*symbol, rect));
        }
    }
    shown
}

/// Paints flags over the scene.
pub(crate) fn paint(ui: &Ui, switch_symbols: &[(SwitchSymbol, Rect)]) {
    let painter = ui.painter().with_clip_rect(ui.max_rect());
    for (symbol, rect) in switch_symbols {
        painter.rect_filled(*rect, 2.0, theme::palette(ui.ctx()).background.gamma_multiply(0.9));
        shape(&painter, symbol.anchor, symbol.state);
        let at = symbol.anchor + vec2(HALF + PAPER, 0.0);
        let ink = theme::palette(ui.ctx()).text;
        let text = painter.text(at, Align2::LEFT_CENTER, words(symbol), theme::small_font(), ink);
        let beside = pos2(text.right().max(at.x) + PAPER, at.y);
        origin_mark::paint(&painter, beside, Align2::LEFT_CENTER, symbol.origin);
    }
}

fn words(symbol: &SwitchSymbol) -> String {
    match (symbol.state, symbol.age) {
        // The shape has the question mark.
        (SwitchState::Unknown, Some(age)) => age_text(age),
        (state, _) if state.is_normal() && symbol.distance > MAX_WORD_METRES => String::new(),
        (state, _) => state.word().to_owned(),
    }
}

fn place_of(painter: &Painter, symbol: &SwitchSymbol) -> Rect {
    let own = Rect::from_center_size(symbol.anchor, Vec2::splat(2.0 * (HALF + PAPER)));
    let text = match words(symbol) {
        words if words.is_empty() => 0.0,
        words => painter.layout_no_wrap(words, theme::small_font(), Color32::BLACK).size().x,
    };
    let origin = origin_mark::size(painter, symbol.origin).x;
    let widths = [text, origin].into_iter().filter(|width| *width > 0.0);
    own.with_max_x(own.right() + widths.map(|width| width + PAPER).sum::<f32>())
}

/// Paints the shape of a state about a point.
pub(crate) fn shape(painter: &Painter, center: Pos2, state: SwitchState) {
    let square = Rect::from_center_size(center, Vec2::splat(2.0 * HALF));
    let palette = theme::palette(painter.ctx());
    let outline = Stroke::new(2.0, palette.text);
    let fill = match state {
        SwitchState::Closed => palette.text,
        SwitchState::Invalid => theme::WARNING,
        _ => palette.background,
    };
    painter.rect_filled(square, 0.0, fill);
    match state {
        SwitchState::Open | SwitchState::Closed => {}
        SwitchState::Travelling => {
            // Half of it conducts, as if it were.
            let half = vec![square.left_bottom(), square.right_top(), square.right_bottom()];
            painter.add(Shape::convex_polygon(half, palette.text, Stroke::NONE));
        }
        SwitchState::Invalid => {
            let cross = square.shrink(2.0);
            let stroke = Stroke::new(2.0, theme::DARK_TEXT);
            painter.line_segment([cross.left_top(), cross.right_bottom()], stroke);
            painter.line_segment([cross.right_top(), cross.left_bottom()], stroke);
        }
        SwitchState::Unknown => {
            quality_hatching::draw_stripes(
                painter,
                square,
                &ValueMark::Bad { reason: String::new() },
            );
            let font = theme::small_font();
            painter.circle_filled(pos2(center.x, center.y), 5.0, palette.background);
            painter.text(center, Align2::CENTER_CENTER, "?", font, palette.text);
        }
    }
    painter.rect_stroke(square, 0.0, outline, StrokeKind::Inside);
}
