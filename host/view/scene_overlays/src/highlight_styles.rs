//! Highlight styles of equipment by state. Each pair is distinguishable in grey, as a test verifies
//! (`tests/end_to_end/view_tests/tests/greyscale.rs`): abnormal states have patterns, normal ones
//! are plain.

use busbar_renderer::highlight_with_pattern;
use busbar_scene::linear_from_srgb;
use busbar_types::Pattern;

/// Linear rgb, strength and pattern, as the renderer takes them.
pub type Highlight = [f32; 4];

/// No highlight at all.
pub const NONE: Highlight = [0.0; 4];
/// Selected; it has an outline besides.
pub const SELECTION: Highlight = [0.02, 0.16, 0.55, 0.45];
/// Outside its normal band.
pub const WARNING: Highlight = highlight_with_pattern([0.7, 0.25, 0.01], 0.9, DOTTED);
/// Value that needs immediate action.
pub const ALARM: Highlight = highlight_with_pattern([0.5, 0.005, 0.008], 0.85, CROSSED);
/// Something was shown here, and is not known any more.
pub const UNKNOWN: Highlight = highlight_with_pattern([0.05, 0.05, 0.06], 0.75, STRIPED);
/// Strength of plain and of highlight_with_pattern legend states; plain ones are weaker.
const PLAIN_STRENGTH: f32 = 0.5;
const PATTERN_STRENGTH: f32 = 0.85;
/// Pattern numbers of the renderer.
const STRIPED: u32 = 1;
const CROSSED: u32 = 2;
const DOTTED: u32 = 3;

/// Highlights that do not come from an overlay, by name.
pub const ALL: [(&str, Highlight); 5] = [
    ("nothing", NONE),
    ("selected", SELECTION),
    ("warning", WARNING),
    ("alarm", ALARM),
    ("not known", UNKNOWN),
];

/// Returns the highlight of a legend entry; the color is sRGB.
pub fn state_style(color: [u8; 3], pattern: Pattern) -> Highlight {
    let pattern = match pattern {
        Pattern::Solid => 0,
        Pattern::Striped => STRIPED,
        Pattern::Crossed => CROSSED,
        Pattern::Dotted => DOTTED,
    };
    let strength = if pattern == 0 { PLAIN_STRENGTH } else { PATTERN_STRENGTH };
    highlight_with_pattern(color.map(linear_from_srgb), strength, pattern)
}
