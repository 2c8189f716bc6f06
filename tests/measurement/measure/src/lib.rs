//! Measures of a simplified mesh's difference from its original, the same for every simplifier:
//! sampled distances and normals ([`Reference`]), pictures from all around ([`Gallery`]), topology
//! ([`EdgeCounts`], [`duplicates`]), order of vertices ([`acmr`]). And levels to measure: those of
//! a sequence ([`level`]), and those of a peer at a given number of vertices ([`search`],
//! [`meshoptimizer`]).
//!
//! What is measured is a [`busbar_geometry::Topology`]: points and triangles,
//! nothing that one simplifier keeps and another does not.

mod cache;
mod disjoint_sets;
mod distance;
mod edges;
mod gallery;
mod levels;
pub mod meshoptimizer;
mod raster;
mod shading;
mod similarity;
mod triangle_tree;

pub use cache::acmr;
pub use disjoint_sets::DisjointSets;
pub use distance::{Reference, SurfaceError};
pub use edges::{EdgeCounts, duplicates};
pub use gallery::{Gallery, PictureError};
pub use levels::{level, search, used_alone, vertices_in_use};
pub use raster::{ShadedView, View, draw};
pub use shading::{CREASE_DEGREES, creased_normals};
pub use similarity::ssim;
