//! Edge factors: length, border flag, area and curvature (Eq. 1-4 of the paper).

use busbar_plugin_sdk::Mesh;

use crate::edges::Side;
use crate::interpretation::{Curvature, Interpretation};
use crate::vector::{cross, dot, norm, point, sub};

/// Pairs of triangles looked at on a non-manifold edge; bounds the work on an
/// edge that very many triangles share.
const MAX_PAIRS: usize = 4096;

/// The four factors of one edge before equalisation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Factors {
    /// L, Eq. 1: length.
    pub(crate) length: f64,
    /// Border flag F (Eq. 2).
    pub(crate) flag: bool,
    /// S, Eq. 3: area of the triangles at the edge.
    pub(crate) area: f64,
    /// The cosine of C, Eq. 4. The angle itself is for [`angle`] to find: all
    /// of a chunk in one go, which is faster.
    pub(crate) curvature_cosine: f64,
}

/// Geometry that the factors of an edge between two triangles are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hinge {
    pub(crate) length_squared: f64,
    /// Squared lengths of the normals n1 and n2 of Eq. 4: of double areas.
    pub(crate) first_squared: f64,
    pub(crate) second_squared: f64,
    /// Dot product n1 n2 of the triangles' normals.
    pub(crate) dot: f64,
}

impl Hinge {
    #[inline(always)]
    pub(crate) fn new(mesh: &Mesh<'_>, [v1, v2]: [u32; 2], first: Side, second: Side) -> Self {
        let p1 = point(mesh, v1);
        let along = sub(point(mesh, v2), p1);
        let normal = |side: Side| cross(along, sub(point(mesh, side.opposite()), p1));
        let (first, second) = (normal(first), normal(second));
        Self {
            length_squared: dot(along, along),
            first_squared: dot(first, first),
            second_squared: dot(second, second),
            dot: dot(first, second),
        }
    }
}

/// Measures Eq. 1-4 for the edge between two vertices.
///
/// S on a border is its one triangle; on an edge of three and more triangles it
/// is the sum of all, and C the largest of any two (of the first [`MAX_PAIRS`]
/// pairs). A triangle without area contributes C = 0. For F and C see
/// [`Interpretation`].
#[inline]
pub(crate) fn measure(
    mesh: &Mesh<'_>,
    ends: [u32; 2],
    sides: &[Side],
    interpretation: &Interpretation,
) -> Factors {
    let length = norm(sub(point(mesh, ends[1]), point(mesh, ends[0])));
    let hinge = |a: &Side, b: &Side| Hinge::new(mesh, ends, *a, *b);
    let double_area = |side: &Side| hinge(side, side).first_squared.sqrt();
    let curvature_cosine = match sides {
        [_] => interpretation.border_curvature_cosine(),
        many => {
            let pairs = (1..many.len()).flat_map(|i| (0..i).map(move |j| (&many[i], &many[j])));
            let cosines = pairs.take(MAX_PAIRS).map(|(a, b)| {
                let hinge = hinge(a, b);
                let scale = hinge.first_squared.sqrt() * hinge.second_squared.sqrt();
                bend_cosine(hinge.dot, scale, interpretation.curvature)
            });
            cosines.fold(1.0, f64::min)
        }
    };
    Factors {
        length,
        flag: interpretation.flag(sides.len() != 2),
        area: 0.5 * sides.iter().map(double_area).sum::<f64>(),
        curvature_cosine,
    }
}

/// Computes the cosine of C by Eq. 4 from n1 n2 and |n1| |n2|, clamped to [-1, 1].
#[inline(always)]
pub(crate) fn bend_cosine(dot: f64, scale: f64, interpretation: Curvature) -> f64 {
    let cosine = (dot / scale).clamp(-1.0, 1.0);
    let cosine = match interpretation {
        Curvature::Mended => -cosine,
        Curvature::AsPrinted => cosine,
    };
    if scale == 0.0 { 1.0 } else { cosine }
}

/// Computes the angle of a cosine in [-1, 1], radians in [0, pi].
pub(crate) fn angle(cosine: f64) -> f64 {
    libm::acos(cosine)
}
