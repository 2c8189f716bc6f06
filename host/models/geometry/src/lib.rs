//! Meshes, collapse sequences and collapse stacks: pure values, no I/O.
//!
//! The path of a mesh through this crate: raw primitives are welded
//! ([`weld()`]) into a [`Mesh`]; an optimiser turns its [`Topology`] into a
//! [`CollapseSequence`]; [`CollapseStacks`] then gives the mesh at any cursor.
#![doc = include_str!("../DESIGN.md")]

mod error_order;
mod face_splitting;
mod islands;
mod merge;
mod mesh;
mod sequence;
mod slender;
mod stacks;
mod statistics;
mod stochastic_simplification;
mod surface_deviation;
mod theta_sharing;
mod weld;

pub use islands::PieceLimits;
pub use merge::{MergePart, merge};
pub use mesh::{Bounds, Mesh, NO_FEATURE, Section, Topology, Wedges};
pub use sequence::{Collapse, CollapseSequence, SequenceError, theta_to_cursor};
pub use slender::SlenderPoint;
pub use stacks::{
    CollapseStacks, NEVER_REMOVED, ResolvedMesh, StackTables, TablesError, removal_ranks,
};
pub use statistics::{Components, MeshStatistics, count_components};
pub use theta_sharing::share_theta;
pub use weld::{RawPrimitive, WeldError, WeldReport, weld};
