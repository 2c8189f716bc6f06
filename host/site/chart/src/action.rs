//! Operator actions on a chart.

use crate::{Brush, BrushOperator, Layout};

/// Operator action on a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Sets the layout of axes.
    SetLayout(Layout),
    /// Adds a brush; `alone` puts it in place of those on the same axis.
    AddBrush {
        /// Brush to be added.
        brush: Brush,
        /// True where it replaces the brushes on its axis.
        alone: bool,
    },
    /// Removes the brush with this index.
    RemoveBrush(usize),
    /// Removes all the brushes.
    ClearBrushes,
    /// Sets the operator that combines brushes.
    SetBrushOperator(BrushOperator),
    /// Moves the axis at a place of the order to another place.
    MoveAxis {
        /// Place of the axis before.
        from: usize,
        /// Place of the axis after.
        to: usize,
    },
    /// Turns the axis at a place upside down.
    FlipAxis(usize),
    /// Hides the axis at a place, or shows it again; two always stay visible.
    HideAxis(usize),
    /// Makes the axis at a place logarithmic or linear, where its values permit.
    SwitchScale(usize),
    /// Rescales the axis at a place to the range of brushed values; to the described range where
    /// nothing is brushed.
    Rescale(usize),
    /// Shows what was known at an instant, nanoseconds since 1970-01-01 UTC; `None` shows
    /// the present.
    SetPlayhead(Option<i64>),
    /// Starts or stops the playhead.
    Play(bool),
    /// Shows how the records of each state spread.
    ShowClusters(bool),
}
