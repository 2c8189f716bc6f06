//! Distance between two surfaces by samples, with a tree of boxes.

use glam::DVec3;

/// Triangles in a leaf.
const LEAF: usize = 4;

/// Mean and largest distance both ways over seeded samples, metres: the mean
/// is that of the two one-way means.
pub(crate) fn two_sided(a: &[[DVec3; 3]], b: &[[DVec3; 3]], samples: usize) -> (f64, f64) {
    let (forth, back) = (one_way(a, b, samples), one_way(b, a, samples));
    ((forth.0 + back.0) / 2.0, forth.1.max(back.1))
}

fn one_way(from: &[[DVec3; 3]], to: &[[DVec3; 3]], samples: usize) -> (f64, f64) {
    let tree = Tree::build(to);
    let mut sums = Vec::with_capacity(from.len());
    let mut total = 0.0;
    for [a, b, c] in from {
        total += (b - a).cross(c - a).length();
        sums.push(total);
    }
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (mut sum, mut largest) = (0.0, 0.0_f64);
    for index in 0..samples {
        let at = (index as f64 + random.next()) / samples as f64 * total;
        let [a, b, c] = from[sums.partition_point(|&sum| sum < at).min(from.len() - 1)];
        let (root, v) = (random.next().sqrt(), random.next());
        let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
        let distance = tree.distance(point);
        sum += distance;
        largest = largest.max(distance);
    }
    (sum / samples as f64, largest)
}

/// SplitMix64 (Steele et al., OOPSLA 2014), 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

struct Node {
    min: DVec3,
    max: DVec3,
    /// First triangle and count of a leaf, or right child and 0.
    start: usize,
    count: usize,
}

struct Tree {
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

impl Tree {
    fn build(triangles: &[[DVec3; 3]]) -> Self {
        let mut tree = Self { nodes: Vec::new(), triangles: triangles.to_vec() };
        tree.split(0, triangles.len());
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
        let size = max - min;
        let axis = if size.x >= size.y.max(size.z) {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let key = |t: &[DVec3; 3]| t[0][axis] + t[1][axis] + t[2][axis];
        let middle = part.len() / 2;
        part.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        self.split(start, start + middle);
        self.nodes[index].start = self.nodes.len();
        self.nodes[index].count = 0;
        self.split(start + middle, end);
    }

    fn distance(&self, point: DVec3) -> f64 {
        let mut best = f64::INFINITY;
        let mut stack = vec![(self.gap(0, point), 0)];
        while let Some((gap, index)) = stack.pop() {
            if gap >= best {
                continue;
            }
            let node = &self.nodes[index];
            if node.count > 0 {
                for triangle in &self.triangles[node.start..node.start + node.count] {
                    best = best.min(nearest(point, triangle).distance_squared(point));
                }
                continue;
            }
            let (left, right) = (index + 1, node.start);
            let (near, far) = (self.gap(left, point), self.gap(right, point));
            if near <= far {
                stack.extend([(far, right), (near, left)]);
            } else {
                stack.extend([(near, left), (far, right)]);
            }
        }
        best.sqrt()
    }

    fn gap(&self, index: usize, point: DVec3) -> f64 {
        let node = &self.nodes[index];
        (node.min - point).max(point - node.max).max(DVec3::ZERO).length_squared()
    }
}

/// The nearest point of a triangle (Ericson, Real-Time Collision Detection,
/// 5.1.5).
fn nearest(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let ap = p - a;
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
    let sum = va + vb + vc;
    if sum == 0.0 { a } else { a + (ab * vb + ac * vc) / sum }
}
