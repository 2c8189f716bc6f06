//! Overlay pictures: what an overlay draws in one step, with the rules that a picture keeps.
//!
//! A picture names tags, equipment and legend entries by index, and never more than the bindings
//! and the description of its overlay have. Whoever hands a picture on checks it with
//! [`PictureRules`].
//!
//! Invariant: a picture is data; no plugin, scene or drawing is named here.

mod overlay_binding;
mod overlay_picture;
mod overlay_quantity;
mod overlay_verdict;

pub use overlay_binding::{MAX_PART_BYTES, OverlayBinding};
pub use overlay_picture::{
    LegendEntry, MAX_FINDINGS, MAX_LEGEND_ENTRIES, MAX_OVERLAY_EQUIPMENT, OverlayDescription,
    OverlayLine, OverlayPicture, OverlayState, OverlayTint, PictureRules, max_primitives,
    max_quantities,
};
pub use overlay_quantity::{Contour, MAX_MECHANISMS, OverlayQuantity, Quantity};
pub use overlay_verdict::{MAX_BASIS, OverlayVerdict, VerdictRating, Verdicts, max_verdicts};
