//! A bushing as a laser scanner leaves it: the surface of a noisy field
//! ([`field`]), meshed on an uneven grid ([`tetrahedra`]), and then damaged
//! ([`damage`]).

mod damage;
mod field;
mod tetrahedra;

use busbar_geometry::RawPrimitive;
use glam::Vec3;

use crate::random::signed;

/// Noise of the range along the surface's normal, metres.
const RANGE_NOISE: f32 = 0.00035;

/// Surface as points and triangles over them.
#[derive(Clone, Debug, Default)]
struct Surface {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

/// Returns the bushing as scanned: noise on the surface, holes and damage.
pub(crate) fn bushing() -> RawPrimitive {
    let whole = tetrahedra::surface();
    let mut surface = damage::damaged(&whole);
    let normals = surface.normals();
    for ((point, normal), seed) in surface.points.iter_mut().zip(normals).zip(0_u64..) {
        *point += normal * (signed(seed) + signed(!seed)) * RANGE_NOISE;
    }
    let normals = surface.normals();
    RawPrimitive {
        positions: surface.points,
        normals,
        triangles: surface.triangles,
        material: Some(0),
        ..RawPrimitive::default()
    }
}

impl Surface {
    /// Computes smooth normals, weighted by area.
    fn normals(&self) -> Vec<Vec3> {
        let mut normals = vec![Vec3::ZERO; self.points.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| self.points[v as usize]);
            for corner in triangle {
                normals[*corner as usize] += (b - a).cross(c - a);
            }
        }
        normals.iter().map(|normal| normal.try_normalize().unwrap_or(Vec3::Y)).collect()
    }

    /// Returns the surface without points that no triangle uses.
    fn compact(self) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut new_of_old = vec![UNUSED; self.points.len()];
        let mut points = Vec::new();
        let mut number = |old: u32| {
            let new = &mut new_of_old[old as usize];
            if *new == UNUSED {
                *new = points.len() as u32;
                points.push(self.points[old as usize]);
            }
            *new
        };
        let triangles = self.triangles.iter().map(|t| t.map(&mut number)).collect();
        Self { points, triangles }
    }
}
