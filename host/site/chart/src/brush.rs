//! Brushing: selection of records by conditions on axes.

use crate::{AxisView, Records};

/// Limit of simultaneous brushes.
pub const MAX_BRUSHES: usize = 32;
/// Intervals of one axis.
pub const MAX_RANGES: usize = 8;

/// A condition on records.
#[derive(Clone, Debug, PartialEq)]
pub enum Brush {
    /// Range brush: the value on an axis lies in one of these intervals, ends included, in its
    /// unit.
    Ranges {
        /// Index of the axis described.
        axis: usize,
        /// Lower and upper ends.
        ranges: Vec<[f32; 2]>,
        /// True where records without a value there are brushed too.
        with_missing: bool,
    },
    /// The line between two axes rises by so much of their height.
    Rise {
        /// Indices of the axes described.
        axes: [usize; 2],
        /// -1 to 1, ends included.
        range: [f32; 2],
    },
}

/// Boolean operator that combines brushes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BrushOperator {
    /// Records that meet all brushes.
    #[default]
    And,
    /// Records that meet any brush.
    Or,
}

/// Brushes of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Brushes {
    /// Operator that combines the brushes.
    pub operator: BrushOperator,
    /// Brushes in the order of creation; at most [`MAX_BRUSHES`].
    pub list: Vec<Brush>,
}

impl Brushes {
    /// Reports whether there is no brush: no record is brushed then.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Reports for each record whether it is brushed; all false without a brush.
    pub fn select(&self, records: &Records, views: &[AxisView]) -> Vec<bool> {
        if self.is_empty() || records.axes() == 0 {
            return vec![false; records.len()];
        }
        let rows = records.values().chunks_exact(records.axes());
        rows.map(|row| self.matches(row, views)).collect()
    }

    /// Reports whether a record with these values is brushed.
    pub fn matches(&self, row: &[f32], views: &[AxisView]) -> bool {
        let mut met = self.list.iter().map(|brush| brush.is_met(row, views));
        match self.operator {
            BrushOperator::And => !self.is_empty() && met.all(|met| met),
            BrushOperator::Or => met.any(|met| met),
        }
    }

    /// The intervals on an axis.
    pub fn on(&self, wanted: usize) -> Option<(&[[f32; 2]], bool)> {
        self.list.iter().find_map(|brush| match brush {
            Brush::Ranges { axis, ranges, with_missing } if *axis == wanted => {
                Some((ranges.as_slice(), *with_missing))
            }
            _ => None,
        })
    }

    /// Adds a brush. An interval comes to those of its axis, or, where `alone`, in place
    /// of them; a rise replaces that between the same axes. What is beyond the limits is
    /// left out.
    pub fn add(&mut self, brush: Brush, alone: bool) {
        let same = |other: &Brush| match (other, &brush) {
            (Brush::Ranges { axis, .. }, Brush::Ranges { axis: new, .. }) => axis == new,
            (Brush::Rise { axes, .. }, Brush::Rise { axes: new, .. }) => axes == new,
            _ => false,
        };
        let Some(there) = self.list.iter_mut().find(|other| same(other)) else {
            if self.list.len() < MAX_BRUSHES {
                self.list.push(brush);
            }
            return;
        };
        match (there, brush) {
            (
                Brush::Ranges { ranges, with_missing, .. },
                Brush::Ranges { ranges: new, with_missing: too, .. },
            ) if !alone => {
                ranges.extend(new);
                ranges.truncate(MAX_RANGES);
                *with_missing |= too;
            }
            (there, brush) => *there = brush,
        }
    }
}

impl Brush {
    pub(crate) fn is_met(&self, row: &[f32], views: &[AxisView]) -> bool {
        match self {
            Self::Ranges { axis, ranges, with_missing } => {
                let value = row.get(*axis).copied().unwrap_or(f32::NAN);
                ranges.iter().any(|[low, high]| *low <= value && value <= *high)
                    || (*with_missing && value.is_nan())
            }
            Self::Rise { axes, range: [low, high] } => {
                let place = |axis: usize| {
                    let view = views.iter().find(|view| view.axis == axis)?;
                    view.position(*row.get(axis)?)
                };
                let rise = place(axes[0]).zip(place(axes[1])).map(|(from, to)| to - from);
                rise.is_some_and(|rise| *low <= rise && rise <= *high)
            }
        }
    }
}
