//! Plane quadrics (Garland and Heckbert, SIGGRAPH 1997) in double precision.

use std::ops::{Add, AddAssign};

use glam::DVec3;

/// A weighted sum of squared distances to planes as a function of a point:
/// p'Ap + 2b'p + c.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Quadric {
    /// Diagonal of A: xx, yy, zz.
    diagonal: DVec3,
    /// Rest of A: yz, zx, xy.
    mixed: DVec3,
    linear: DVec3,
    constant: f64,
    /// Area that the quadric stands for, square metres.
    pub(crate) area: f64,
}

impl Quadric {
    /// Makes the quadric of the squared distance to the plane through `point`, times `weight`.
    /// `normal` has length 1.
    pub(crate) fn plane(normal: DVec3, point: DVec3, weight: f64) -> Self {
        let offset = -normal.dot(point);
        let scaled = normal * weight;
        Self {
            diagonal: normal * scaled,
            mixed: DVec3::new(normal.y * scaled.z, normal.z * scaled.x, normal.x * scaled.y),
            linear: scaled * offset,
            constant: weight * offset * offset,
            area: 0.0,
        }
    }

    /// Returns the quadric, weighted by an area as well.
    pub(crate) fn with_area(self, area: f64) -> Self {
        Self { area, ..self }
    }

    /// Evaluates the quadric at a point; rounding never makes it negative.
    #[inline]
    pub(crate) fn evaluate(&self, p: DVec3) -> f64 {
        let cross = DVec3::new(p.y * p.z, p.z * p.x, p.x * p.y);
        let linear = (self.diagonal * p + 2.0 * self.linear).dot(p);
        (linear + 2.0 * self.mixed.dot(cross) + self.constant).max(0.0)
    }
}

impl AddAssign for Quadric {
    fn add_assign(&mut self, other: Self) {
        self.diagonal += other.diagonal;
        self.mixed += other.mixed;
        self.linear += other.linear;
        self.constant += other.constant;
        self.area += other.area;
    }
}

impl Add for Quadric {
    type Output = Self;
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_of_planes_is_the_sum_of_squared_distances() {
        let roof = Quadric::plane(DVec3::Y, DVec3::new(5.0, 2.0, 7.0), 3.0).with_area(3.0);
        let wall = Quadric::plane(DVec3::new(0.6, 0.0, 0.8), DVec3::ZERO, 2.0);
        let point = DVec3::new(1.0, -1.0, 2.0);
        let expected = 3.0 * 9.0 + 2.0 * (0.6 + 1.6) * (0.6 + 1.6);
        assert!(((roof + wall).evaluate(point) - expected).abs() < 1e-12);
        assert_eq!((roof + wall).area, 3.0);
    }
}
