//! Collapse guards: link condition and face flips, so that a surface keeps its topology and folds
//! no face over.

use busbar_plugin_sdk::Mesh;

use crate::surface::{Ring, Spoke, Surface};
use crate::vector::{Vector, cross, dot, point, sub};

/// A vertex with more triangles around it is neither moved nor moved onto;
/// bounds the work of a collapse.
pub(crate) const MAX_VALENCE: usize = 512;

/// A half-edge collapse to be judged.
pub(crate) struct Candidate<'a> {
    pub(crate) removed: u32,
    pub(crate) removed_ring: &'a Ring,
    pub(crate) kept: u32,
    pub(crate) kept_ring: &'a Ring,
}

impl Candidate<'_> {
    /// Reports whether the collapse keeps the surface whole.
    pub(crate) fn is_legal(&self, surface: &Surface<'_>) -> bool {
        let bounded = [self.removed, self.kept].iter().all(|&v| surface.valence(v) <= MAX_VALENCE);
        bounded && self.keeps_topology() && !self.flips_a_face(&surface.mesh)
    }

    /// Checks the link condition (Dey, Edelsbrunner, Guha and Nekhayev, 1999). The two vertices
    /// have no common neighbour but those of their common triangles. No face comes to lie on
    /// another, and two border vertices are not joined across the inside. A triangle on a corner of
    /// the border and a tetrahedron stay: they would end as a mere edge or a double face.
    fn keeps_topology(&self) -> bool {
        let shared = self.removed_ring.edge_to(self.kept);
        if shared.len() == 2 && is_on_border(self.removed_ring) && is_on_border(self.kept_ring) {
            return false;
        }
        self.removed_ring.edges().all(|of_removed| {
            let neighbour = of_removed[0].neighbour;
            let of_kept = self.kept_ring.edge_to(neighbour);
            of_kept.is_empty() || {
                let dying = shared.iter().filter(|spoke| spoke.opposite == neighbour).count();
                merges_well(of_removed, of_kept, dying)
            }
        })
    }

    /// Reports whether a moved triangle turns by more than a right angle, or loses its area.
    fn flips_a_face(&self, mesh: &Mesh<'_>) -> bool {
        let (from, to) = (point(mesh, self.removed), point(mesh, self.kept));
        let moved = self.removed_ring.triangles().filter(|corners| !corners.contains(&self.kept));
        moved.into_iter().any(|corners| {
            let corners = corners.map(|v| point(mesh, v));
            is_flip(normal(from, corners), normal(to, corners))
        })
    }
}

/// Reports whether the edges from the two vertices to a common neighbour become an edge that is no
/// less regular. `dying` of its triangles are common.
fn merges_well(of_removed: &[Spoke], of_kept: &[Spoke], dying: usize) -> bool {
    if dying == 0 {
        return false;
    }
    let most = of_removed.len().max(of_kept.len()).max(2);
    let merged = of_removed.len() + of_kept.len() - 2 * dying;
    let faces_meet = of_removed.iter().any(|a| of_kept.iter().any(|b| a.opposite == b.opposite));
    (1..=most).contains(&merged) && !faces_meet
}

fn is_on_border(ring: &Ring) -> bool {
    ring.edges().any(|edge| edge.len() != 2)
}

fn normal(apex: Vector, [a, b]: [Vector; 2]) -> Vector {
    cross(sub(a, apex), sub(b, apex))
}

/// Reports whether a normal flips; a triangle without area may move freely.
fn is_flip(before: Vector, after: Vector) -> bool {
    let had_area = dot(before, before) > 0.0;
    had_area && (dot(after, after) == 0.0 || dot(before, after) < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        [removed, kept]: [u32; 2],
        expected: bool,
    ) {
        let surface = Surface::new(Mesh { positions, triangles, wedges: None });
        let (mut removed_ring, mut kept_ring) = (Ring::default(), Ring::default());
        surface.ring(removed, &mut removed_ring);
        surface.ring(kept, &mut kept_ring);
        let candidate =
            Candidate { removed, removed_ring: &removed_ring, kept, kept_ring: &kept_ring };
        assert_eq!(candidate.is_legal(&surface), expected, "{removed} onto {kept}");
    }

    #[test]
    fn a_face_that_flips_or_flattens_may_not() {
        // A kite whose corner 2 points inwards, with a centre (4).
        let mut kite = [[0., 0., 0.], [4., 0., 0.], [1., 1., 0.], [0., 4., 0.], [0.5, 0.5, 0.]];
        let fan = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        check(&kite, &fan, [4, 0], true);
        check(&kite, &fan, [4, 2], true);
        // 2-3-4 becomes 2-3-1, which turns the other way.
        check(&kite, &fan, [4, 1], false);
        // And now a line.
        kite[2] = [2., 2., 0.];
        check(&kite, &fan, [4, 1], false);
        // What has no area already may stay without.
        kite[4] = [1.5, 2.5, 0.];
        check(&kite, &fan, [4, 3], true);
    }

    #[test]
    fn a_tetrahedron_and_a_lone_triangle_stay() {
        let positions = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]];
        check(&positions, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], [0, 1], false);
        check(&positions, &[[0, 2, 1]], [0, 1], false);
    }

    #[test]
    fn borders_are_not_joined_across_the_inside() {
        // Two triangles: the diagonal's ends are both on the border.
        let square = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
        check(&square, &[[0, 1, 2], [0, 2, 3]], [0, 2], false);
        // Along the border, one triangle remains.
        check(&square, &[[0, 1, 2], [0, 2, 3]], [3, 0], true);
        let strip = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0.5, 1., 0.], [1.5, 1., 0.]];
        check(&strip, &[[0, 1, 3], [1, 4, 3], [1, 2, 4]], [4, 3], true);
    }

    #[test]
    fn a_ring_that_is_too_large_is_left_alone() {
        let fan = |count: u32| {
            let place = |i: u32| {
                let angle = f64::from(i) / f64::from(count) * std::f64::consts::TAU;
                [angle.cos() as f32, angle.sin() as f32, 0.0]
            };
            let positions: Vec<_> = (0..count).map(place).chain([[0.1, 0., 0.]]).collect();
            let triangles: Vec<_> = (0..count).map(|i| [i, (i + 1) % count, count]).collect();
            (positions, triangles)
        };
        for (count, expected) in [(MAX_VALENCE as u32, true), (MAX_VALENCE as u32 + 1, false)] {
            let (positions, triangles) = fan(count);
            check(&positions, &triangles, [count, 0], expected);
        }
    }
}
