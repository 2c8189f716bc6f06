//! What states look like on equipment. Each pair of them is told apart without colour too,
//! which a test of pictures in grey goes through (`tests/e2e/tests/greyscale.rs`): what
//! needs somebody is marked, and what is as it should be is plain.

use busbar_plugin_host::Pattern;
use busbar_renderer::highlight_with_pattern;

use crate::color::linear_from_srgb;

/// Linear rgb, strength and pattern, as the renderer takes them.
pub type Highlight = [f32; 4];

/// Nothing to say.
pub const NONE: Highlight = [0.0; 4];
/// Selected; it has an outline besides.
pub const SELECTION: Highlight = [0.02, 0.16, 0.55, 0.45];
/// Outside its normal band.
pub const WARNING: Highlight = highlight_with_pattern([0.7, 0.25, 0.01], 0.9, DOTTED);
/// Needs action now.
pub const ALARM: Highlight = highlight_with_pattern([0.5, 0.005, 0.008], 0.85, CROSSED);
/// Something was shown here, and is not known any more.
pub const UNKNOWN: Highlight = highlight_with_pattern([0.05, 0.05, 0.06], 0.75, STRIPED);
/// How strongly states of a legend show: what is plain is as it should be, and calm.
const PLAIN_STRENGTH: f32 = 0.5;
const PATTERN_STRENGTH: f32 = 0.85;
/// The renderer's patterns.
const STRIPED: u32 = 1;
const CROSSED: u32 = 2;
const DOTTED: u32 = 3;

/// Those that are not an overlay's, by name.
pub const ALL: [(&str, Highlight); 5] = [
    ("nothing", NONE),
    ("selected", SELECTION),
    ("warning", WARNING),
    ("alarm", ALARM),
    ("not known", UNKNOWN),
];

/// That of a legend's entry; the colour is sRGB.
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
