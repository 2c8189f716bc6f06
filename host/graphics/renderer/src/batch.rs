//! Batches of alike instances, and the keys that sort them.

use std::ops::Range;

/// A mesh at a cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct IndexKey {
    pub(crate) model: u32,
    pub(crate) mesh: u32,
    pub(crate) cursor: u32,
}

/// The way that instances are on, and how far.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct MorphKey {
    /// Coarser cursor that vertices move to.
    pub(crate) coarser: u32,
    /// The weight's bits: those that are equally far are drawn together.
    pub(crate) weight: u32,
}

/// Highlights among the instances that are drawn together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Highlights {
    None,
    /// Highlights of whole instances only.
    OfInstances,
    /// Some feature of some instance.
    OfFeatures,
}

/// Instances that one draw call a section draws.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Batch {
    pub(crate) key: IndexKey,
    /// Morph target and weight, if the mesh morphs.
    pub(crate) morph: Option<MorphKey>,
    /// Handedness: the transforms mirror.
    pub(crate) mirrored: bool,
    pub(crate) highlights: Highlights,
    /// Range in [`VisibleInstances::instances`](crate::instance_culling::VisibleInstances::instances): those that may be in the picture. Where there are
    /// none, it is ready for the camera to turn, but not drawn.
    pub(crate) instances: Range<u32>,
    /// Number of instances, from the first on, that are drawn in the first phase.
    pub(crate) first_count: u32,
    /// Number of instances, visible or not.
    pub(crate) count: u32,
}

impl Batch {
    /// Returns a batch of one of its instances.
    pub(crate) fn single(&self, index: u32) -> Self {
        Self { instances: index..index + 1, count: 1, ..self.clone() }
    }

    /// Returns the range of its instances as list indices.
    pub(crate) fn range(&self) -> Range<usize> {
        self.instances.start as usize..self.instances.end as usize
    }

    /// Returns the batch with only the instances of a drawing phase.
    pub(crate) fn in_phase(&self, phase: DrawPhase) -> Self {
        let Range { start, end } = self.instances;
        let middle = start + self.first_count;
        let instances = match phase {
            DrawPhase::First => start..middle,
            DrawPhase::Second => middle..end,
        };
        Self { instances, ..self.clone() }
    }
}

/// Drawing phase of two-pass occlusion culling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DrawPhase {
    /// Nearest instances, drawn first as occluders.
    First,
    /// Remaining instances, tested against the first.
    Second,
}
