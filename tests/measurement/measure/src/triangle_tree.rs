//! Bounding volume hierarchy for the nearest point on a surface.

use busbar_geometry::Topology;
use glam::DVec3;

/// Greatest number of triangles in a leaf.
const LEAF: usize = 4;

/// Closest point on a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClosestPoint {
    pub(crate) distance: f64,
    /// Normal of the closest triangle; zero for one without area.
    pub(crate) normal: DVec3,
}

struct Node {
    min: DVec3,
    max: DVec3,
    /// First triangle of a leaf, or right child.
    start: usize,
    /// Number of triangles of a leaf, or 0.
    count: usize,
}

/// Bounding volume hierarchy of a surface's triangles.
pub(crate) struct TriangleTree {
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

impl TriangleTree {
    pub(crate) fn build(mesh: &Topology) -> Self {
        let corner = |&v: &u32| mesh.positions[v as usize].as_dvec3();
        let triangles = mesh.triangles.iter().map(|t| t.each_ref().map(corner)).collect();
        let mut tree = Self { nodes: Vec::new(), triangles };
        tree.split(0, tree.triangles.len());
        tree
    }

    fn split(&mut self, start: usize, end: usize) {
        let part = &mut self.triangles[start..end];
        let points = || part.iter().flatten();
        let min = points().copied().fold(DVec3::INFINITY, DVec3::min);
        let max = points().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let index = self.nodes.len();
        self.nodes.push(Node { min, max, start, count: end - start });
        if end - start <= LEAF {
            return;
        }
        let axis = (max - min).max_position();
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        self.split(start, start + middle);
        self.nodes[index].start = self.nodes.len();
        self.nodes[index].count = 0;
        self.split(start + middle, end);
    }

    /// Returns the point of the surface nearest to a point. Among places within `tolerance` of one
    /// another, as on both sides of a flattened part, the one whose normal is nearest to `normal`
    /// wins.
    pub(crate) fn nearest(&self, point: DVec3, normal: DVec3, tolerance: f64) -> ClosestPoint {
        let tie = tolerance * tolerance;
        let (mut least, mut best) =
            (f64::INFINITY, ClosestPoint { distance: f64::INFINITY, normal });
        let mut alike = f64::NEG_INFINITY;
        let mut waiting = vec![(self.gap(0, point), 0)];
        while let Some((gap, index)) = waiting.pop() {
            if gap > least + tie {
                continue;
            }
            let node = &self.nodes[index];
            if node.count == 0 {
                let (left, right) = (index + 1, node.start);
                let (near, far) = (self.gap(left, point), self.gap(right, point));
                if near <= far {
                    waiting.extend([(far, right), (near, left)]);
                } else {
                    waiting.extend([(near, left), (far, right)]);
                }
                continue;
            }
            for triangle in &self.triangles[node.start..node.start + node.count] {
                let squared = closest(point, triangle).distance_squared(point);
                if squared > least + tie {
                    continue;
                }
                let [a, b, c] = *triangle;
                let own = (b - a).cross(c - a).normalize_or_zero();
                // Much nearer, or as near and turned alike.
                if squared + tie < least || own.dot(normal) > alike {
                    (best.normal, alike) = (own, own.dot(normal));
                }
                least = least.min(squared);
            }
        }
        best.distance = least.sqrt();
        best
    }

    /// Returns the squared distance of a point from a node's box.
    fn gap(&self, index: usize, point: DVec3) -> f64 {
        let node = &self.nodes[index];
        (node.min - point).max(point - node.max).max(DVec3::ZERO).length_squared()
    }
}

/// Returns the closest point of a triangle (Ericson, Real-Time Collision Detection, 2005, section
/// 5.1.5).
fn closest(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let scale = 1.0 / (va + vb + vc);
    a + ab * (vb * scale) + ac * (vc * scale)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn the_tree_finds_what_a_search_of_all_finds() {
        let mut random = fastrand::Rng::with_seed(5);
        let mut point = || Vec3::new(random.f32(), random.f32(), random.f32());
        let positions: Vec<Vec3> = (0..900).map(|_| point()).collect();
        let triangles: Vec<[u32; 3]> = (0..300).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let queries: Vec<DVec3> = (0..200).map(|_| point().as_dvec3() * 2.0 - 0.5).collect();
        let tree = TriangleTree::build(&Topology { positions, triangles });
        for query in queries {
            let all = tree.triangles.iter().map(|t| closest(query, t).distance(query));
            let expected = all.fold(f64::INFINITY, f64::min);
            let found = tree.nearest(query, DVec3::Z, 0.0).distance;
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn of_two_sides_the_one_turned_alike_counts() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        for triangles in [[[0, 1, 2], [0, 2, 1]], [[0, 2, 1], [0, 1, 2]]] {
            let tree = TriangleTree::build(&Topology {
                positions: positions.clone(),
                triangles: triangles.to_vec(),
            });
            for normal in [DVec3::Z, DVec3::NEG_Z] {
                let place = tree.nearest(DVec3::new(0.2, 0.2, 0.5), normal, 1e-6);
                assert_eq!((place.distance, place.normal), (0.5, normal));
            }
        }
    }
}
