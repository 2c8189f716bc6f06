//! The four factors of an edge: Eq. 1-4 of the paper.

use busbar_plugin_sdk::Mesh;

use crate::edges::Side;
use crate::reading::{BorderFlag, Curvature, Reading};
use crate::vector::{Vector, cross, dot, norm, point, sub};

/// Pairs of triangles looked at on a non-manifold edge; bounds the work on an
/// edge that very many triangles share.
const MAX_PAIRS: usize = 4096;

/// The four factors of one edge before equalisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Factors {
    /// L, Eq. 1: length.
    pub(crate) length: f64,
    /// F, Eq. 2.
    pub(crate) flag: bool,
    /// S, Eq. 3: area of the triangles at the edge.
    pub(crate) area: f64,
    /// The cosine of C, Eq. 4. The angle itself is for [`angle`] to find: all
    /// of a chunk in one go, which is faster.
    pub(crate) curvature_cosine: f64,
}

/// Whether an edge with these sides is a border. One of three and more
/// triangles counts as such.
pub(crate) fn is_border(sides: &[Side]) -> bool {
    sides.len() != 2
}

/// Eq. 1-4 for the edge between two vertices.
///
/// S on a border is its one triangle; on an edge of three and more triangles it
/// is the sum of all, and C the largest of any two (of the first [`MAX_PAIRS`]
/// pairs). A triangle without area contributes C = 0. For F and C see
/// [`Reading`].
#[inline]
pub(crate) fn measure(
    mesh: &Mesh<'_>,
    [v1, v2]: [u32; 2],
    sides: &[Side],
    reading: &Reading,
) -> Factors {
    let p1 = point(mesh, v1);
    let along = sub(point(mesh, v2), p1);
    let normal = |side: &Side| {
        let normal = cross(along, sub(point(mesh, side.opposite()), p1));
        (normal, norm(normal))
    };
    let (doubled_area, curvature_cosine) = match sides {
        [side] => (normal(side).1, reading.border_curvature_cosine()),
        [first, second] => {
            let (first, second) = (normal(first), normal(second));
            (first.1 + second.1, bend_cosine(first, second, reading.curvature))
        }
        many => {
            let pairs = (1..many.len()).flat_map(|i| (0..i).map(move |j| (&many[i], &many[j])));
            let cosines = pairs
                .take(MAX_PAIRS)
                .map(|(a, b)| bend_cosine(normal(a), normal(b), reading.curvature));
            (many.iter().map(|side| normal(side).1).sum(), cosines.fold(1.0, f64::min))
        }
    };
    Factors {
        length: norm(along),
        flag: is_border(sides) == (reading.border_flag == BorderFlag::Text),
        area: 0.5 * doubled_area,
        curvature_cosine,
    }
}

/// The cosine of C by Eq. 4 from two normals with their lengths, clamped to
/// [-1, 1].
#[inline]
fn bend_cosine(a: (Vector, f64), b: (Vector, f64), reading: Curvature) -> f64 {
    let scale = a.1 * b.1;
    if scale == 0.0 {
        return 1.0;
    }
    let cosine = (dot(a.0, b.0) / scale).clamp(-1.0, 1.0);
    match reading {
        Curvature::Mended => -cosine,
        Curvature::AsPrinted => cosine,
    }
}

/// The angle of a cosine in [-1, 1], radians in [0, pi].
pub(crate) fn angle(cosine: f64) -> f64 {
    libm::acos(cosine)
}
