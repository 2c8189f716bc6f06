//! Interpretations of the points that the paper leaves open, or contradicts itself on.

use std::f64::consts::PI;

/// Interpretation of the paper's open points. The optimiser uses [`Self::BUSBAR`] and
/// [`Self::UNPROTECTED`]; reports compare others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interpretation {
    /// Eq. 4 on an edge of two and more triangles.
    pub curvature: Curvature,
    /// Eq. 2: which edges have F = 1.
    pub border_flag: BorderFlag,
    /// C of an edge with one triangle, where Eq. 4 has no second normal;
    /// radians in [0, pi].
    pub border_curvature: f64,
    /// w2 of Eq. 9.
    pub border_weight: BorderWeight,
}

/// Reading of Eq. 4, whose normals n1 = (V2 - V1) x (V3 - V1) and n2 = (V2 - V1) x (V4 - V1) point
/// apart on a flat pair of triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curvature {
    /// C = pi - acos(n1 . n2 / |n1||n2|): 0 for a flat pair, pi for one folded
    /// onto itself, whatever the winding.
    Mended,
    /// C = acos(n1 . n2 / |n1||n2|) as printed: pi for a flat pair.
    AsPrinted,
}

/// Eq. 2 and the text under Eq. 9, which contradict each other. A border is an
/// edge whose triangles are not two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BorderFlag {
    /// F = 1 on a border, as the text says.
    Text,
    /// F = 0 on a border and 1 inside, as Eq. 2 prints.
    Equation2,
}

/// w2, the coefficient of F in Eq. 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BorderWeight {
    /// alpha, the proportion of borders among the edges (Eq. 9).
    Alpha,
    /// 0: the paper's Fig. 8, "no boundary protecting mechanism".
    Zero,
}

impl Interpretation {
    /// Borders are protected by F, and by the largest C.
    pub const BUSBAR: Self = Self {
        curvature: Curvature::Mended,
        border_flag: BorderFlag::Text,
        border_curvature: PI,
        border_weight: BorderWeight::Alpha,
    };

    /// Borders weigh nothing of their own: C = 0 and w2 = 0 there.
    pub const UNPROTECTED: Self =
        Self { border_curvature: 0.0, border_weight: BorderWeight::Zero, ..Self::BUSBAR };

    /// Returns F of a border, or of an inner edge.
    pub(crate) fn flag(&self, is_border: bool) -> bool {
        is_border == (self.border_flag == BorderFlag::Text)
    }

    /// Returns the cosine of C on a border.
    pub(crate) fn border_curvature_cosine(&self) -> f64 {
        libm::cos(self.border_curvature)
    }
}
