//! Meshes for tests of optimizers, and the rules of a collapse sequence.

use crate::{Collapse, Mesh};

/// Flat grid in the plane z = 0, two triangles a cell.
#[derive(Clone, Debug)]
pub struct Grid {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Grid {
    /// Creates a grid of so many cells, a metre each.
    pub fn new(columns: u32, rows: u32) -> Self {
        let width = columns + 1;
        let position = |index: u32| [(index % width) as f32, (index / width) as f32, 0.0];
        let cell = |index: u32| {
            let low = index / columns * width + index % columns;
            let [a, b, c, d] = [low, low + 1, low + width, low + width + 1];
            [[a, b, d], [a, d, c]]
        };
        Self {
            positions: (0..width * (rows + 1)).map(position).collect(),
            triangles: (0..columns * rows).flat_map(cell).collect(),
        }
    }

    /// Returns the mesh to pass to an optimizer, without attributes.
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh { positions: &self.positions, triangles: &self.triangles, wedges: None }
    }
}

/// Checks the rules that the host checks: each collapse moves a live position onto another live
/// one, and errors are finite and never decrease.
///
/// # Errors
/// The first rule that is broken.
pub fn check_sequence(mesh: &Mesh<'_>, collapses: &[Collapse]) -> Result<(), String> {
    let mut removed = vec![false; mesh.positions.len()];
    let mut last_error = 0.0;
    for (index, &Collapse { removed: from, kept: onto, error }) in collapses.iter().enumerate() {
        for position in [from, onto] {
            match removed.get(position as usize) {
                None => return Err(format!("collapse {index}: there is no position {position}")),
                Some(true) => return Err(format!("collapse {index}: position {position} is gone")),
                Some(false) => {}
            }
        }
        if from == onto {
            return Err(format!("collapse {index} moves position {from} onto itself"));
        }
        if !error.is_finite() || error < last_error {
            return Err(format!("collapse {index}: error {error} after {last_error}"));
        }
        last_error = error;
        removed[from as usize] = true;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_a_mesh() {
        let grid = Grid::new(3, 2);
        let mesh = grid.mesh();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 12));
        assert!(mesh.triangles.as_flattened().iter().all(|&corner| corner < 12));
        assert!(mesh.triangles.iter().all(|[a, b, c]| a != b && b != c && c != a));
    }

    #[test]
    fn broken_rules_are_named() {
        let grid = Grid::new(1, 1);
        let check = |entries: &[(u32, u32, f32)]| {
            let entry = |&(removed, kept, error)| Collapse { removed, kept, error };
            check_sequence(&grid.mesh(), &entries.iter().map(entry).collect::<Vec<_>>())
        };
        assert_eq!(check(&[(0, 1, 0.5), (1, 2, 0.5)]), Ok(()));
        for broken in [
            &[(4, 0, 0.0)][..],
            &[(1, 1, 0.0)],
            &[(0, 1, 0.0), (2, 0, 0.0)],
            &[(0, 1, 1.0), (2, 1, 0.5)],
            &[(0, 1, f32::NAN)],
        ] {
            assert!(check(broken).is_err(), "{broken:?}");
        }
    }
}
