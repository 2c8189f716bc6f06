//! Marks of values that are not live: a bordered tag of letters at each, by origin.

use busbar_types::Origin;
use egui::{Align2, FontFamily, FontId, Painter, Pos2, Rect, Stroke, StrokeKind, Vec2, pos2, vec2};

use crate::theme;

/// Height of a tag, points.
pub(crate) const HEIGHT: f32 = 13.0;
/// Size of its letters, points.
const LETTERS: f32 = 9.5;
/// Points between letters and border, and between two tags.
const PADDING: f32 = 2.5;
const GAP: f32 = 2.0;

/// An origin as it is shown.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OriginText {
    pub(crate) origin: Origin,
    /// Letters at a value.
    pub(crate) letters: &'static str,
    /// Text of the origin band; none for an origin that is marked at values alone.
    pub(crate) band: Option<&'static str>,
    /// Explanation among the keys.
    pub(crate) meaning: &'static str,
}

/// All origins except live, in display order.
pub(crate) const ORIGINS: [OriginText; 5] = [
    OriginText {
        origin: Origin::RECORDED,
        letters: "REC",
        band: Some("REPLAY"),
        meaning: "replayed from a recording",
    },
    OriginText {
        origin: Origin::SIMULATED,
        letters: "SIM",
        band: Some("SIMULATED"),
        meaning: "made by a simulator",
    },
    OriginText {
        origin: Origin::TEST,
        letters: "TEST",
        band: Some("TEST"),
        meaning: "sent by a device under test",
    },
    OriginText {
        origin: Origin::HISTORICAL,
        letters: "HIST",
        band: Some("HISTORY"),
        meaning: "of the past, as its source says",
    },
    OriginText {
        origin: Origin::SUBSTITUTED,
        letters: "SUB",
        band: None,
        meaning: "put in place of the measured value",
    },
];

/// Returns the texts of the origins that are set.
pub(crate) fn words(origin: Origin) -> impl Iterator<Item = &'static OriginText> {
    ORIGINS.iter().filter(move |words| origin.contains(words.origin))
}

/// A line for tooltips: `SIM: made by a simulator` a row; empty for a live value.
pub(crate) fn tooltip(origin: Origin) -> String {
    words(origin).map(|words| format!("\n{}: {}", words.letters, words.meaning)).collect()
}

/// Size that the tags of an origin take; zero for a live value.
pub(crate) fn size(painter: &Painter, origin: Origin) -> Vec2 {
    let widths = words(origin).map(|words| tag_width(painter, words.letters) + GAP);
    match widths.sum::<f32>() - GAP {
        width if width > 0.0 => vec2(width, HEIGHT),
        _ => Vec2::ZERO,
    }
}

/// Paints the origin tags beside a position and returns their rectangle.
pub(crate) fn paint(painter: &Painter, at: Pos2, align: Align2, origin: Origin) -> Rect {
    let place = align.anchor_size(at, size(painter, origin));
    let palette = theme::palette(painter.ctx());
    let mut left = place.left();
    for words in words(origin) {
        let width = tag_width(painter, words.letters);
        let tag = Rect::from_min_size(pos2(left, place.top()), vec2(width, HEIGHT));
        // On any ground, stripes and alarm colours included.
        let border = Stroke::new(1.0, palette.text);
        painter.rect(tag, 2.0, palette.background, border, StrokeKind::Inside);
        painter.text(tag.center(), Align2::CENTER_CENTER, words.letters, font(), palette.text);
        left += width + GAP;
    }
    place
}

fn tag_width(painter: &Painter, letters: &str) -> f32 {
    let text = painter.layout_no_wrap(letters.to_owned(), font(), theme::DARK_TEXT);
    (text.size().x + 2.0 * PADDING).ceil()
}

fn font() -> FontId {
    FontId::new(LETTERS, FontFamily::Proportional)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_origin_has_letters_of_its_own() {
        let mut all: Vec<&str> = ORIGINS.iter().map(|words| words.letters).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), ORIGINS.len());
        let every = ORIGINS.iter().fold(Origin::LIVE, |all, words| all | words.origin);
        assert_eq!(every.names().count(), ORIGINS.len(), "{every}");
        let shown = |origin| words(origin).map(|words| words.letters).collect::<Vec<_>>();
        assert_eq!(shown(Origin::LIVE), [""; 0]);
        assert_eq!(shown(Origin::TEST | Origin::SIMULATED), ["SIM", "TEST"]);
        assert_eq!(tooltip(Origin::SUBSTITUTED), "\nSUB: put in place of the measured value");
    }
}
