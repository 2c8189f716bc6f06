//! Meshes, collapse sequences and collapse stacks: pure values, no I/O.
//!
//! The path of a mesh through this crate: raw primitives are welded
//! ([`weld()`]) into a [`Mesh`]; an optimiser turns its [`Topology`] into a
//! [`CollapseSequence`]; [`CollapseStacks`] then gives the mesh at any cursor.

mod by_error;
mod deviation;
mod islands;
mod loose_faces;
mod merge;
mod mesh;
mod sequence;
mod slender;
mod stacks;
mod statistics;
mod thin_out;
mod weld;

pub use islands::PieceLimits;
pub use merge::{MergePart, merge};
pub use mesh::{Bounds, Mesh, NO_FEATURE, Section, Topology, Wedges};
pub use sequence::{Collapse, CollapseSequence, SequenceError, theta_to_cursor};
pub use slender::SlenderPoint;
pub use stacks::{CollapseStacks, NEVER, ResolvedMesh, StackTables, TablesError, removal_ranks};
pub use statistics::{Components, MeshStatistics, components};
pub use weld::{RawPrimitive, WeldError, WeldReport, weld};
