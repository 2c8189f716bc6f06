//! Layouts of parallel axes: positions of axes and pairs of neighbours.

/// Arrangement of the axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// Axes side by side.
    #[default]
    Flat,
    /// The first one in the centre, the others around it (multi-relational).
    Focus,
    /// Side by side, and time goes into the depth.
    Time,
}

/// Extent of a chart, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Distance from the first axis to the last one.
    pub width: f32,
    /// Height of an axis.
    pub height: f32,
    /// Depth from the first time to the last one.
    pub depth: f32,
}

impl Layout {
    /// The feet of so many axes: x and z, metres.
    pub(crate) fn axis_positions(self, axes: usize, size: Size) -> Vec<[f32; 2]> {
        let Size { width, depth, .. } = size;
        match self {
            Self::Flat | Self::Time => {
                let step = width / axes.saturating_sub(1).max(1) as f32;
                (0..axes).map(|axis| [axis as f32 * step, 0.0]).collect()
            }
            Self::Focus => {
                let center = [width / 2.0, depth / 2.0];
                let radius = width.min(depth.max(width / 2.0)) / 2.0;
                let around = axes.saturating_sub(1).max(1) as f32;
                let place = |axis: usize| {
                    // The second one stands on the left, the rest follow over the back.
                    let turn = std::f32::consts::TAU * (axis as f32 - 1.0) / around;
                    [center[0] - radius * turn.cos(), center[1] - radius * turn.sin()]
                };
                (0..axes).map(|axis| if axis == 0 { center } else { place(axis) }).collect()
            }
        }
    }

    /// Returns the pairs of places of axes between which lines are drawn.
    pub fn pairs(self, axes: usize) -> Vec<[usize; 2]> {
        match self {
            Self::Flat | Self::Time => (1..axes).map(|axis| [axis - 1, axis]).collect(),
            Self::Focus => (1..axes).map(|axis| [0, axis]).collect(),
        }
    }
}

/// Returns the depth of a time, metres.
pub(crate) fn depth_of(time: i64, [first, last]: [i64; 2], depth: f32) -> f32 {
    let share = (time - first) as f64 / (last - first).max(1) as f64;
    depth * share.clamp(0.0, 1.0) as f32
}

/// Position of records without a value: a lane below the feet of axes.
pub(crate) const MISSING_LANE: f32 = -8.5 / crate::BINS as f32;

/// Below this a brush takes them in.
pub(crate) const MISSING_EDGE: f32 = MISSING_LANE / 2.0;
