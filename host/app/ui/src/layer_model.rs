//! Rows of layers and of their legends, as the panels show them.

use std::sync::Arc;

use busbar_types::Pattern;

/// An overlay as a layer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LayerRow {
    /// The configuration's id of the overlay.
    pub name: String,
    /// True if the layer is drawn.
    pub shown: bool,
    /// True if the overlay is late: the whole layer is hatched, whatever the qualities of its
    /// values.
    pub is_late: bool,
    /// The states that it shows equipment in.
    pub legend: Arc<[LegendRow]>,
    /// True if the layer shows switch symbols.
    pub has_switch_symbols: bool,
    /// True if the layer shows power-flow arrows.
    pub has_arrows: bool,
    /// The contour that it shows.
    pub contour: Option<ContourRow>,
}

/// A contour in a legend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContourRow {
    /// Quantity with its unit.
    pub name: String,
    /// Normal band as text.
    pub normal: String,
    /// Step between contour lines as text.
    pub step: String,
    /// Interpolation radius as text.
    pub reach: String,
    /// Colors of the first and the last step beyond the normal band, sRGB.
    pub colors: [[u8; 3]; 2],
}

/// A state of a legend.
#[derive(Clone, Debug, PartialEq)]
pub struct LegendRow {
    /// Name of the state.
    pub name: String,
    /// Color of the state, sRGB.
    pub color: [u8; 3],
    /// Fill pattern of the state.
    pub pattern: Pattern,
}
