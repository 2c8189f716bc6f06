//! Slender islands: long, thin and round shapes such as conductors, wires and rods.
//!
//! They are narrower than a pixel long before they are too short to matter, and what draws
//! them has to know how thick they are.

use glam::Vec3;

use crate::{Bounds, Mesh};

/// Length over radius from which an island is slender.
const LEAST_SLENDERNESS: f32 = 60.0;
/// Share of its area that has to be round.
const ROUND_SHARE: f32 = 0.9;
/// Least cosine between a face and its corners' outward directions: a tube of five sides is round
/// (36 degrees), a box is not (45).
const ROUND_COSINE: f32 = 0.76;

/// A point of the surface of something slender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlenderPoint {
    /// Position index into [`Mesh::positions`].
    pub position: u32,
    /// Away from the axis, of unit length.
    pub outward: Vec3,
    /// Radius of the whole tube, in the mesh's own space, metres.
    pub radius: f32,
}

/// Measurements of an island that may be a tube.
#[derive(Clone, Copy)]
struct Tube {
    bounds: Bounds,
    area: f32,
    round_area: f32,
    /// Sum of all normals: zero for a closed surface.
    facing: Vec3,
}

impl Tube {
    const NONE: Self = Self {
        bounds: Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY },
        area: 0.0,
        round_area: 0.0,
        facing: Vec3::ZERO,
    };

    /// Returns the radius of a tube as long as its box's diagonal. A bent tube is longer, and
    /// thinner than this.
    fn radius(&self) -> f32 {
        self.area / (std::f32::consts::TAU * self.length())
    }

    fn length(&self) -> f32 {
        self.bounds.max.distance(self.bounds.min)
    }

    fn is_slender(&self) -> bool {
        self.area > 0.0 && self.length() >= LEAST_SLENDERNESS * self.radius()
    }

    fn is_round(&self) -> bool {
        let is_closed = self.facing.length() <= (1.0 - ROUND_SHARE) * self.area;
        is_closed && self.round_area >= ROUND_SHARE * self.area
    }
}

impl Mesh {
    /// Returns the points of all islands (connected components) that are slender and round.
    pub fn slender_points(&self) -> Vec<SlenderPoint> {
        let (island_of, islands) = self.island_numbers();
        let island = |corners: [u32; 3]| island_of[corners[0] as usize] as usize;
        let mut tubes = vec![Tube::NONE; islands];
        for &triangle in &self.triangles {
            let (corners, normal) = self.corners_and_normal(triangle);
            let tube = &mut tubes[island(corners)];
            tube.area += normal.length();
            tube.facing += normal;
            let [a, b, c] = corners.map(|corner| self.positions[corner as usize]);
            let around = Bounds { min: a.min(b).min(c), max: a.max(b).max(c) };
            tube.bounds = tube.bounds.union(around);
        }
        let slender: Vec<bool> = tubes.iter().map(Tube::is_slender).collect();
        if !slender.contains(&true) {
            return Vec::new();
        }
        let is_slender = |triangle: &&[u32; 3]| slender[island(self.corner_positions(**triangle))];
        let faces: Vec<_> =
            self.triangles.iter().filter(is_slender).map(|&t| self.corners_and_normal(t)).collect();
        let mut outward = vec![Vec3::ZERO; self.positions.len()];
        for &(corners, normal) in &faces {
            // By angles, so that it does not matter which way a flat side is cut in two; and
            // by areas, so that ends do not.
            let angles = self.angles(corners);
            for (corner, angle) in corners.into_iter().zip(angles) {
                outward[corner as usize] += angle * normal;
            }
        }
        outward.iter_mut().for_each(|direction| *direction = direction.normalize_or_zero());
        for (corners, normal) in faces {
            let tube = &mut tubes[island(corners)];
            let least = ROUND_COSINE * normal.length();
            if corners.iter().all(|&corner| outward[corner as usize].dot(normal) >= least) {
                tube.round_area += normal.length();
            }
        }
        let point = |(position, &island): (u32, &u32)| {
            let tube = &tubes[island as usize];
            // None of what is not slender.
            let outward = outward[position as usize];
            let is_one = outward != Vec3::ZERO && tube.is_round();
            is_one.then(|| SlenderPoint { position, outward, radius: tube.radius() })
        };
        (0..).zip(&island_of).filter_map(point).collect()
    }

    /// Returns the positions of a triangle's corners, and its normal with the area as length.
    fn corners_and_normal(&self, triangle: [u32; 3]) -> ([u32; 3], Vec3) {
        let corners = self.corner_positions(triangle);
        let [a, b, c] = corners.map(|position| self.positions[position as usize]);
        (corners, 0.5 * (b - a).cross(c - a))
    }

    /// Returns the angles of a triangle at its corners, radians.
    fn angles(&self, corners: [u32; 3]) -> [f32; 3] {
        let [a, b, c] = corners.map(|position| self.positions[position as usize]);
        [(a, b, c), (b, c, a), (c, a, b)].map(|(at, to, other)| {
            let sides = [to - at, other - at].map(Vec3::normalize_or_zero);
            sides[0].dot(sides[1]).clamp(-1.0, 1.0).acos()
        })
    }
}

#[cfg(test)]
#[path = "slender_tests.rs"]
mod tests;
