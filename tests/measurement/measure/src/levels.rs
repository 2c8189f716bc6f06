//! Levels: those of a sequence, and those of simplifiers that take a number of
//! triangles, at a wanted number of vertices.

use busbar_geometry::{CollapseSequence, Topology};

/// Greatest miss of the wanted count, as a share of it.
const NEAR: f64 = 0.002;
/// Least distance of a guess from the ends of its bracket, as a share of it.
const INWARD: f64 = 0.03;

/// Returns the live triangles after `cursor` collapses, over the mesh's positions.
pub fn level(mesh: &Topology, sequence: &CollapseSequence, cursor: u32) -> Vec<[u32; 3]> {
    let mut stands_for: Vec<u32> = (0..mesh.positions.len() as u32).collect();
    for entry in sequence.entries()[..cursor as usize].iter().rev() {
        stands_for[entry.removed as usize] = stands_for[entry.kept as usize];
    }
    let moved = mesh.triangles.iter().map(|t| t.map(|v| stands_for[v as usize]));
    moved.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

/// Counts the vertices that triangles use.
pub fn vertices_in_use(triangles: &[[u32; 3]]) -> usize {
    let most = triangles.as_flattened().iter().max().map_or(0, |&most| most as usize + 1);
    let mut used = vec![false; most];
    triangles.as_flattened().iter().for_each(|&v| used[v as usize] = true);
    used.iter().filter(|&&used| used).count()
}

/// Returns the same triangles over the positions that they use, and no others.
pub fn used_alone(mesh: &Topology, triangles: &[[u32; 3]]) -> Topology {
    const UNUSED: u32 = u32::MAX;
    let mut new_of_old = vec![UNUSED; mesh.positions.len()];
    let mut positions = Vec::new();
    let mut number = |old: u32| {
        let new = &mut new_of_old[old as usize];
        if *new == UNUSED {
            *new = positions.len() as u32;
            positions.push(mesh.positions[old as usize]);
        }
        *new
    };
    let triangles = triangles.iter().map(|t| t.map(&mut number)).collect();
    Topology { positions, triangles }
}

/// Searches for the number of triangles at which a simplifier leaves about `wanted` vertices, by at
/// most `max_calls` calls. The first call is for `first` triangles if that lies between none and
/// all. `full` is the mesh's number of triangles and of vertices; `vertices` calls the simplifier.
///
/// # Errors
/// Errors that the simplifier reports.
pub fn search<E>(
    full: [usize; 2],
    first: Option<usize>,
    wanted: usize,
    max_calls: usize,
    mut vertices: impl FnMut(usize) -> Result<usize, E>,
) -> Result<usize, E> {
    let (mut low, mut high) = ([0, 0], full);
    let mut best = full;
    for call in 0..max_calls {
        let [triangles, counts] = [0, 1].map(|i| (low[i] as f64, high[i] as f64));
        let share = (wanted as f64 - counts.0) / (counts.1 - counts.0).max(1.0);
        let share = share.clamp(INWARD, 1.0 - INWARD);
        let between = (triangles.0 + (triangles.1 - triangles.0) * share).round() as usize;
        let guess = first.filter(|_| call == 0).unwrap_or(between);
        if guess <= low[0] || guess >= high[0] {
            break;
        }
        let found = [guess, vertices(guess)?];
        if found[1].abs_diff(wanted) <= best[1].abs_diff(wanted) {
            best = found;
        }
        let is_stuck = found[1] == low[1] || found[1] == high[1];
        if is_stuck || found[1].abs_diff(wanted) as f64 <= NEAR * wanted as f64 {
            break;
        }
        if found[1] > wanted {
            high = found;
        } else {
            low = found;
        }
    }
    Ok(best[0])
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use busbar_geometry::Collapse;
    use glam::Vec3;

    use super::*;

    #[test]
    fn a_level_is_what_is_left() {
        let mesh = Topology {
            positions: vec![Vec3::ZERO; 5],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]],
        };
        let collapse = |removed, kept| Collapse { removed, kept, error: 0.0 };
        let entries = vec![collapse(2, 3), collapse(3, 4)];
        let sequence = CollapseSequence::new(entries, 5).unwrap();
        assert_eq!(level(&mesh, &sequence, 0), mesh.triangles);
        assert_eq!(level(&mesh, &sequence, 1), [[0, 1, 3], [0, 3, 4]]);
        let last = level(&mesh, &sequence, 2);
        assert_eq!(last, [[0, 1, 4]]);
        assert_eq!(vertices_in_use(&last), 3);
        assert_eq!(used_alone(&mesh, &last).triangles, [[0, 1, 2]]);
    }

    #[test]
    fn a_search_ends_near_what_is_wanted() {
        // A simplifier with a bend: many vertices stay where triangles are few.
        let vertices = |triangles: usize| (triangles as f64).powf(0.9) as usize + 40;
        let full = [100_000, vertices(100_000)];
        for wanted in [200, 3_000, 20_000] {
            let mut calls = 0;
            let count = |triangles| {
                calls += 1;
                Ok::<_, Infallible>(vertices(triangles))
            };
            let Ok(found) = search(full, None, wanted, 12, count);
            let error = vertices(found).abs_diff(wanted) as f64 / wanted as f64;
            assert!(error < 0.01 && calls < 12, "{error} after {calls} calls");
            let mut calls = 0;
            let Ok(again) = search(full, Some(found), wanted, 12, |triangles| {
                calls += 1;
                Ok::<_, Infallible>(vertices(triangles))
            });
            assert_eq!((again, calls), (found, 1), "a good guess is the end");
        }
    }

    #[test]
    fn a_search_that_cannot_arrive_ends_at_the_nearest() {
        // Stops short of 500 vertices.
        let mut calls = 0;
        let Ok(found) = search([10_000, 5_000], None, 250, 8, |t| {
            calls += 1;
            Ok::<_, Infallible>((t / 2).max(500))
        });
        assert!(found <= 1_000, "{found}");
        assert!(calls <= 3, "it is seen that nothing helps: {calls}");
    }
}
