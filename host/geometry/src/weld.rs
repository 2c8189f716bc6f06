//! Welding: raw vertex arrays to one mesh of positions and wedges.
//!
//! glTF splits a vertex at every normal, UV and material seam, so edges taken
//! from its indices are nearly all false borders. Positions are welded when
//! they are bit-equal (with -0 read as 0), within one mesh.

use glam::{Vec2, Vec3};
use hashbrown::HashMap;
use thiserror::Error;

use crate::{Mesh, Section};

/// One primitive as a file gives it: parallel vertex arrays and indices.
#[derive(Clone, Debug, Default)]
pub struct RawPrimitive {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex normals; empty to have flat ones computed.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; empty for none.
    pub uvs: Vec<Vec2>,
    /// Triangle corners as vertex indices.
    pub triangles: Vec<[u32; 3]>,
    /// Index into the model's materials.
    pub material: Option<u32>,
}

/// What welding did, for the import report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WeldReport {
    /// Vertices that the triangles referenced.
    pub vertices_in: usize,
    /// Welded positions.
    pub positions: usize,
    /// Wedges after merging equal vertices.
    pub wedges: usize,
    /// Triangles dropped because corners coincide after welding.
    pub coincident_triangles: usize,
}

/// Why raw primitives cannot be welded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum WeldError {
    /// A triangle names a vertex that does not exist.
    #[error("primitive {primitive}: triangle {triangle} names vertex {vertex} of {count}")]
    IndexOutOfRange {
        /// Primitive at fault.
        primitive: usize,
        /// Triangle at fault.
        triangle: usize,
        /// The index it names.
        vertex: u32,
        /// Vertices there are.
        count: usize,
    },
    /// An attribute array has another length than the positions.
    #[error("primitive {primitive}: {found} {attribute} for {expected} positions")]
    AttributeLength {
        /// Primitive at fault.
        primitive: usize,
        /// Attribute at fault.
        attribute: &'static str,
        /// Its length.
        found: usize,
        /// The number of positions.
        expected: usize,
    },
    /// A referenced coordinate is NaN or infinite.
    #[error("primitive {primitive}: position of vertex {vertex} is not finite")]
    NotFinite {
        /// Primitive at fault.
        primitive: usize,
        /// Vertex at fault.
        vertex: u32,
    },
    /// The mesh exceeds 32-bit indices.
    #[error("the mesh has more than 2^32 - 2 vertices")]
    TooLarge,
}

type WedgeKey = (u32, [u32; 3], [u32; 2], u32);

/// Welds the primitives of one mesh.
///
/// Only vertices that a kept triangle references are kept, so that every
/// position has a wedge; positions are numbered in order of first use, so the
/// result depends on the input alone.
///
/// # Errors
/// [`WeldError`] names the primitive at fault; nothing is repaired silently.
pub fn weld(primitives: &[RawPrimitive]) -> Result<(Mesh, WeldReport), WeldError> {
    let corner_total: usize = primitives.iter().map(|p| p.triangles.len() * 3).sum();
    if corner_total > (u32::MAX - 1) as usize {
        return Err(WeldError::TooLarge);
    }
    let mut welder = Welder::default();
    for (index, primitive) in primitives.iter().enumerate() {
        check(index, primitive)?;
        welder.add(primitive);
    }
    Ok(welder.finish())
}

fn check(index: usize, primitive: &RawPrimitive) -> Result<(), WeldError> {
    let count = primitive.positions.len();
    for (attribute, found) in [("normals", primitive.normals.len()), ("UVs", primitive.uvs.len())] {
        if found != 0 && found != count {
            return Err(WeldError::AttributeLength {
                primitive: index,
                attribute,
                found,
                expected: count,
            });
        }
    }
    for (triangle, corners) in primitive.triangles.iter().enumerate() {
        for &vertex in corners {
            let Some(position) = primitive.positions.get(vertex as usize) else {
                return Err(WeldError::IndexOutOfRange {
                    primitive: index,
                    triangle,
                    vertex,
                    count,
                });
            };
            if !position.is_finite() {
                return Err(WeldError::NotFinite { primitive: index, vertex });
            }
        }
    }
    Ok(())
}

#[derive(Default)]
struct Welder {
    mesh: Mesh,
    report: WeldReport,
    position_of: HashMap<[u32; 3], u32>,
    wedge_of: HashMap<WedgeKey, u32>,
}

impl Welder {
    fn add(&mut self, primitive: &RawPrimitive) {
        let section = self.mesh.sections.len() as u32;
        let first_triangle = self.mesh.triangles.len() as u32;
        let mut referenced = vec![false; primitive.positions.len()];
        for &corners in &primitive.triangles {
            for vertex in corners {
                let seen = &mut referenced[vertex as usize];
                self.report.vertices_in += usize::from(!*seen);
                *seen = true;
            }
            let points = corners.map(|v| clean(primitive.positions[v as usize]));
            if points[0] == points[1] || points[1] == points[2] || points[2] == points[0] {
                self.report.coincident_triangles += 1;
                continue;
            }
            let positions = points.map(|p| self.position(p));
            let flat = face_normal(points);
            let wedges = std::array::from_fn(|i| {
                let vertex = corners[i] as usize;
                let normal = primitive.normals.get(vertex).copied().unwrap_or(flat);
                let uv = primitive.uvs.get(vertex).copied().unwrap_or(Vec2::ZERO);
                self.wedge(positions[i], usable_normal(normal, flat), uv, section)
            });
            self.mesh.triangles.push(wedges);
        }
        let triangle_count = self.mesh.triangles.len() as u32 - first_triangle;
        self.mesh.sections.push(Section {
            material: primitive.material,
            first_triangle,
            triangle_count,
        });
    }

    fn position(&mut self, point: Vec3) -> u32 {
        let key = point.to_array().map(f32::to_bits);
        *self.position_of.entry(key).or_insert_with(|| {
            self.mesh.positions.push(point);
            self.mesh.positions.len() as u32 - 1
        })
    }

    fn wedge(&mut self, position: u32, normal: Vec3, uv: Vec2, section: u32) -> u32 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let key = (
            position,
            normal.to_array().map(f32::to_bits),
            uv.to_array().map(f32::to_bits),
            section,
        );
        *self.wedge_of.entry(key).or_insert_with(|| {
            let wedges = &mut self.mesh.wedges;
            wedges.position.push(position);
            wedges.normal.push(normal);
            wedges.uv.push(uv);
            wedges.section.push(section);
            wedges.position.len() as u32 - 1
        })
    }

    fn finish(mut self) -> (Mesh, WeldReport) {
        self.report.positions = self.mesh.positions.len();
        self.report.wedges = self.mesh.wedges.len();
        (self.mesh, self.report)
    }
}

/// Adding zero turns -0 into 0 and leaves every other value as it is.
fn clean(point: Vec3) -> Vec3 {
    point + Vec3::ZERO
}

fn face_normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    let cross = (b - a).as_dvec3().cross((c - a).as_dvec3());
    cross.try_normalize().map_or(Vec3::Y, |n| n.as_vec3())
}

/// Files hold zero and NaN normals; the face's own is the best stand-in.
fn usable_normal(normal: Vec3, flat: Vec3) -> Vec3 {
    if normal.is_finite() && normal.length_squared() > 1e-12 { normal } else { flat }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad_with_seam() -> RawPrimitive {
        // Two triangles that share an edge in space but not in the vertex array.
        let p = [(0., 0.), (1., 0.), (1., 1.), (0., 0.), (1., 1.), (0., 1.)];
        RawPrimitive {
            positions: p.iter().map(|&(x, y)| Vec3::new(x, y, -0.0)).collect(),
            normals: vec![Vec3::Z; 3].into_iter().chain(vec![Vec3::X; 3]).collect(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..Default::default()
        }
    }

    #[test]
    fn welds_positions_and_keeps_wedges_on_a_seam() {
        let (mesh, report) = weld(&[quad_with_seam()]).unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.wedges.len(), 6);
        assert_eq!(report.vertices_in, 6);
        assert_eq!(mesh.topology().triangles, vec![[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn negative_zero_and_zero_are_one_position() {
        let mut primitive = quad_with_seam();
        primitive.positions[3].x = -0.0;
        let (mesh, _) = weld(&[primitive]).unwrap();
        assert_eq!(mesh.positions.len(), 4);
    }

    #[test]
    fn primitives_weld_to_each_other_but_keep_their_sections() {
        let mut second = quad_with_seam();
        second.material = Some(1);
        let (mesh, report) = weld(&[quad_with_seam(), second]).unwrap();
        assert_eq!(mesh.positions.len(), 4);
        assert_eq!(mesh.wedges.len(), 12);
        assert_eq!(mesh.sections.len(), 2);
        assert_eq!(mesh.sections[1].first_triangle, 2);
        assert_eq!(report.coincident_triangles, 0);
    }

    #[test]
    fn coincident_corners_drop_the_triangle_and_are_counted() {
        let mut primitive = quad_with_seam();
        primitive.triangles.push([0, 3, 1]);
        let (mesh, report) = weld(&[primitive]).unwrap();
        assert_eq!(mesh.triangles.len(), 2);
        assert_eq!(report.coincident_triangles, 1);
    }

    #[test]
    fn unreferenced_vertices_are_not_positions() {
        let mut primitive = quad_with_seam();
        primitive.positions.push(Vec3::splat(9.0));
        primitive.normals.push(Vec3::Z);
        let (mesh, _) = weld(&[primitive]).unwrap();
        assert_eq!(mesh.positions.len(), 4);
    }

    #[test]
    fn missing_normals_become_flat_ones() {
        let mut primitive = quad_with_seam();
        primitive.normals.clear();
        let (mesh, _) = weld(&[primitive]).unwrap();
        assert!(mesh.wedges.normal.iter().all(|&n| n == Vec3::Z));
        assert_eq!(mesh.wedges.len(), 4);
    }

    #[test]
    fn bad_input_is_named() {
        let mut primitive = quad_with_seam();
        primitive.triangles[1] = [0, 1, 99];
        assert!(matches!(
            weld(&[primitive]),
            Err(WeldError::IndexOutOfRange { triangle: 1, vertex: 99, count: 6, .. })
        ));
        let mut primitive = quad_with_seam();
        primitive.positions[2].y = f32::NAN;
        assert_eq!(weld(&[primitive]), Err(WeldError::NotFinite { primitive: 0, vertex: 2 }));
    }
}
