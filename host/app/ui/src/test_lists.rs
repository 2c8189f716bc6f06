//! Lists for tests of the panels, and the texts that these paint.

use egui::{Rect, Shape};

use crate::alarm_model::{AlarmRow, AlarmRows};
use crate::equipment_model::{EquipmentRow, EquipmentRows};
use crate::view_model::{TagRow, TagRows};

/// List model without rows.
pub(crate) struct EmptyList;

impl TagRows for EmptyList {
    fn len(&self) -> usize {
        0
    }

    fn total(&self) -> usize {
        0
    }

    fn is_truncated(&self) -> bool {
        false
    }

    fn row(&self, _: usize) -> TagRow {
        unreachable!("there is none")
    }
}

impl AlarmRows for EmptyList {
    fn len(&self) -> usize {
        0
    }

    fn row(&self, _: usize) -> AlarmRow {
        unreachable!("there is none")
    }

    fn next_unacknowledged(&self) -> Option<(u32, Option<String>)> {
        None
    }
}

impl EquipmentRows for EmptyList {
    fn len(&self) -> usize {
        0
    }

    fn total(&self) -> usize {
        0
    }

    fn is_truncated(&self) -> bool {
        false
    }

    fn selected(&self) -> Option<usize> {
        None
    }

    fn row(&self, _: usize) -> EquipmentRow {
        unreachable!("there is none")
    }
}

/// Adds the places of texts that begin so.
pub(crate) fn texts(shape: &Shape, start: &str, into: &mut Vec<Rect>) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(|shape| texts(shape, start, into)),
        Shape::Text(text) if text.galley.text().starts_with(start) => {
            into.push(text.visual_bounding_rect());
        }
        _ => {}
    }
}
