//! Connected pieces of a mesh, and the order in which turned ones lose vertices of equal cost.

mod rings;
mod shells;

pub use rings::{MAX_HALVINGS, RegularOrder, coarse_cost, regular_order};
pub use shells::Shells;
