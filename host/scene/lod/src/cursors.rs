//! Cursors: chooses the collapse cursor of each instance and tracks the cursor shown.
//!
//! Each frame chooses a level of detail for instances whose policy depends on the camera, and thus
//! their *wanted* cursors. The *shown* cursor follows once the mesh there is ready, by geomorphing.
//! Moving a cursor pops or pushes collapses (S1 and S2 of the paper); no mesh is edited. A distant
//! group is drawn as its proxy mesh, which has a cursor of its own, instead of its instances.

mod active_morphs;
mod advance;
mod cursor_state;
mod draw_changes;
mod geomorphing;
mod group_merging;
mod group_state;
mod instance_kinds;
mod level_choice;
mod lod_cursors;
mod reported_drawing;

pub use active_morphs::{Morph, MorphBudget};
pub use cursor_state::{DrawItem, LodRequest, MeshCursor, ModelDetail};
pub use lod_cursors::LodCursors;

#[cfg(test)]
mod group_merging_tests;
#[cfg(test)]
mod tests;
