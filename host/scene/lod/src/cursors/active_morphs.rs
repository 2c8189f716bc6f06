//! Active morphs: their progress, and the memory that they take.

/// Instances that are on their way at once.
pub(super) const MAX_MORPHS: usize = 1024;

/// The way of an instance that is on none.
pub(super) const NO_TRANSITION: u32 = u32::MAX;

/// Morph of a drawn mesh towards a coarser cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Morph {
    /// Cursor of the coarser mesh.
    pub coarser: u32,
    /// Weight of the coarser mesh, 0 to 1.
    pub weight: f32,
}

/// Vertex memory for morphing, as the renderer has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MorphBudget {
    /// Largest number of vertex bytes of all active morphs.
    pub max_bytes: u64,
    /// Bytes of one morphed vertex.
    pub vertex_bytes: u64,
}

/// Active morphs and their duration.
pub(super) struct ActiveMorphs {
    pub(super) budget: MorphBudget,
    /// 0 where all changes at once.
    pub(super) seconds: f64,
    /// Time of the current frame, seconds.
    pub(super) now: f64,
    pub(super) transitions: Vec<MorphTransition>,
    /// Vertex bytes of all active morphs.
    pub(super) bytes: u64,
}

/// Morph from one cursor to another.
#[derive(Clone, Copy)]
pub(super) struct MorphTransition {
    /// Index of the instance.
    pub(super) index: usize,
    pub(super) from: u32,
    pub(super) to: u32,
    /// Start time on the clock of frames, seconds.
    pub(super) begun: f64,
    /// Vertex bytes of the morph.
    pub(super) bytes: u64,
}

impl ActiveMorphs {
    /// Creates the state without any morph: all changes are immediate.
    pub(super) fn new(budget: MorphBudget) -> Self {
        Self { budget, seconds: 0.0, now: 0.0, transitions: Vec::new(), bytes: 0 }
    }
}

impl MorphTransition {
    pub(super) fn coarser(&self) -> u32 {
        self.from.max(self.to)
    }

    /// Returns the completed share, 0 to 1.
    pub(super) fn share(&self, now: f64, seconds: f64) -> f64 {
        let share = (now - self.begun) / seconds;
        // A clock that was set back, too, ends it.
        if (0.0..1.0).contains(&share) { share } else { 1.0 }
    }
}
