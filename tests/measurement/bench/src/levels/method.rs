//! Methods of simplification that are compared.

use measure::meshoptimizer::Simplifier;
use weighted_collapse::Order;

/// Method of simplification to compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Method {
    /// Short name, in file names and in JSON too.
    pub(crate) id: &'static str,
    pub(crate) work: Implementation,
}

/// Implementation of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Implementation {
    /// Whole sequence by the paper's weights.
    Weighted(Order),
    /// Whole sequence by quadric error.
    Quadric,
    /// Function of meshoptimizer, one call for each level.
    Meshoptimizer(Simplifier),
    /// Python script, one call for each level.
    Script(&'static str),
}

/// Method that deployments use by default.
pub(crate) const OURS: &str = "quadric_collapse";
/// Method that the bars compare with.
pub(crate) const BASELINE: &str = "meshoptimizer";

/// List of all methods. Busbar's first method comes first: its triangle counts are where the
/// searches of the others begin.
pub(crate) const METHODS: [Method; 10] = [
    method(OURS, Implementation::Quadric),
    method(BASELINE, Implementation::Meshoptimizer(Simplifier::Plain)),
    method("weighted, reweighted", Implementation::Weighted(Order::Reweighted)),
    method("weighted, guarded", Implementation::Weighted(Order::Guarded)),
    method("weighted, paper", Implementation::Weighted(Order::Paper)),
    method("meshoptimizer, normals", Implementation::Meshoptimizer(Simplifier::WithNormals)),
    method("meshoptimizer, sloppy", Implementation::Meshoptimizer(Simplifier::Sloppy)),
    method("fast-simplification", Implementation::Script("decimate_fast_simplification.py")),
    method("VTK", Implementation::Script("decimate_vtk.py")),
    method("Open3D", Implementation::Script("decimate_open3d.py")),
];

const fn method(id: &'static str, work: Implementation) -> Method {
    Method { id, work }
}

impl Method {
    /// Returns the method with this id.
    pub(crate) fn named(id: &str) -> Option<Self> {
        METHODS.into_iter().find(|method| method.id == id)
    }

    /// Reports whether the method is not this project's.
    pub(crate) fn is_peer(self) -> bool {
        matches!(self.work, Implementation::Meshoptimizer(_) | Implementation::Script(_))
    }
}
