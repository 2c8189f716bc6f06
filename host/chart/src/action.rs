//! Operator actions on a chart.

use crate::{Brush, BrushOperator, Layout};

/// Operator action on a chart.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Lets axes stand otherwise.
    SetLayout(Layout),
    /// Adds a brush; `alone` puts it in place of those on the same axis.
    AddBrush {
        /// Brush to be added.
        brush: Brush,
        /// True where it replaces the brushes on its axis.
        alone: bool,
    },
    /// Takes the brush with this index away.
    RemoveBrush(usize),
    /// Takes all brushes away.
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
    /// Leaves the axis at a place out, or shows it again; two always stay.
    HideAxis(usize),
    /// Makes the axis at a place logarithmic or linear, where its values allow it.
    SwitchScale(usize),
    /// Lets the axis at a place reach from the lowest brushed value to the highest, or, as
    /// far as nothing is brushed, as it is described.
    Rescale(usize),
    /// Shows what was known at an instant, nanoseconds since 1970-01-01 UTC; `None` shows
    /// the present.
    SetPlayhead(Option<i64>),
    /// Lets time go by in the chart, or stops it.
    Play(bool),
    /// Shows how the records of each state spread.
    ShowClusters(bool),
}
