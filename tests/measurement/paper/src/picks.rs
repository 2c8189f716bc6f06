//! Picks under random pixels: comparison of the equipment ids at a theta with those at theta 0.

use std::collections::BTreeSet;

use anyhow::Result;
use busbar_viewer::Viewer;
use serde::Serialize;

use crate::frames;
use crate::scene::OVERVIEW;

/// Differences of picks at a theta from those at theta 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct PickChanges {
    /// Number of uniformly drawn pixels.
    pub pixels: usize,
    /// Number of pixels on equipment at theta 0.
    pub on_equipment: usize,
    /// Number of different pieces of equipment among them.
    pub pieces: usize,
    /// Number of pixels that changed from equipment to another piece.
    pub to_other: usize,
    /// Number of pixels that changed from equipment to the background.
    pub to_background: usize,
    /// Number of pixels that changed from the background to equipment.
    pub from_background: usize,
}

impl PickChanges {
    /// Compares picks at `theta` with those at theta 0, over `count` random pixels of the overview.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn measure(viewer: &mut Viewer, size: [u32; 2], theta: f64, count: usize) -> Result<Self> {
        let mut random = fastrand::Rng::with_seed(70);
        let pixels: Vec<[u32; 2]> =
            (0..count).map(|_| size.map(|side| random.u32(0..side))).collect();
        viewer.resize(size);
        viewer.use_camera(OVERVIEW)?;
        frames::settle(viewer, 0.0)?;
        let before = viewer.pick_many(&pixels)?;
        frames::settle(viewer, theta)?;
        Ok(Self::between(&before, &viewer.pick_many(&pixels)?))
    }

    /// Returns the number of pixels whose pick changed.
    pub fn changed(&self) -> usize {
        self.to_other + self.to_background + self.from_background
    }

    fn between(before: &[Option<String>], after: &[Option<String>]) -> Self {
        let mut changes = Self { pixels: before.len(), ..Self::default() };
        for pair in before.iter().zip(after) {
            match pair {
                (Some(a), Some(b)) => changes.to_other += usize::from(a != b),
                (Some(_), None) => changes.to_background += 1,
                (None, Some(_)) => changes.from_background += 1,
                (None, None) => {}
            }
        }
        changes.on_equipment = before.iter().flatten().count();
        changes.pieces = before.iter().flatten().collect::<BTreeSet<_>>().len();
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_change_is_counted() {
        let picks = |ids: [&str; 6]| ids.map(|id| (!id.is_empty()).then(|| id.to_owned())).to_vec();
        let before = picks(["Q0", "Q0", "T1", "", "", "T1"]);
        let after = picks(["Q0", "T1", "", "Q0", "", "T1"]);
        let changes = PickChanges::between(&before, &after);
        let expected = PickChanges {
            pixels: 6,
            on_equipment: 4,
            pieces: 2,
            to_other: 1,
            to_background: 1,
            from_background: 1,
        };
        assert_eq!(changes, expected);
        assert_eq!(changes.changed(), 3);
    }
}
