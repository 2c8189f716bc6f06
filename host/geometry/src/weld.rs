//! Welding: raw vertex arrays to one mesh of positions and wedges.
//!
//! glTF splits a vertex at every normal, UV and material seam, so edges taken
//! from its indices are nearly all false borders. Positions are welded when
//! they are bit-equal (with -0 read as 0), within one feature of one mesh.

use std::hash::BuildHasher;

use glam::{Vec2, Vec3};
use hashbrown::{DefaultHashBuilder, HashTable};
use thiserror::Error;

use crate::{Mesh, NO_FEATURE, Section};

/// One primitive as a file gives it: parallel vertex arrays and indices.
#[derive(Clone, Debug, Default)]
pub struct RawPrimitive {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex normals; empty to have flat ones computed.
    pub normals: Vec<Vec3>,
    /// Texture coordinates; empty for none.
    pub uvs: Vec<Vec2>,
    /// Feature of each vertex; empty for none. A triangle belongs to the
    /// feature of its first corner.
    pub features: Vec<u32>,
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
    let with_features = primitives.iter().any(|primitive| !primitive.features.is_empty());
    let mut welder = Welder { with_features, ..Welder::default() };
    welder.reserve(primitives);
    for (index, primitive) in primitives.iter().enumerate() {
        check(index, primitive)?;
        welder.add(primitive);
    }
    Ok(welder.finish())
}

fn check(index: usize, primitive: &RawPrimitive) -> Result<(), WeldError> {
    let count = primitive.positions.len();
    let lengths = [
        ("normals", primitive.normals.len()),
        ("UVs", primitive.uvs.len()),
        ("features", primitive.features.len()),
    ];
    for (attribute, found) in lengths {
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

/// Not yet in the mesh.
const NEW: u32 = u32::MAX;

/// Wedges of a position that are looked through one by one, which few positions have
/// more of; those beyond are found by hash.
const MAX_CHAIN: usize = 16;

#[derive(Default)]
struct Welder {
    mesh: Mesh,
    report: WeldReport,
    with_features: bool,
    hasher: DefaultHashBuilder,
    /// Indices into the mesh's positions, found by what they name.
    positions: HashTable<u32>,
    /// Of each position the last of its first wedges, of each wedge the one before it.
    last_wedges: Vec<u32>,
    wedges_before: Vec<u32>,
    /// Wedges beyond a position's first ones.
    more_wedges: HashTable<u32>,
}

impl Welder {
    fn add(&mut self, primitive: &RawPrimitive) {
        let section = self.mesh.sections.len() as u32;
        let first_triangle = self.mesh.triangles.len() as u32;
        let mut referenced = vec![false; primitive.positions.len()];
        // Most vertices are met six times; their wedge is looked up once.
        let mut wedge_of_vertex = vec![NEW; primitive.positions.len()];
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
            let feature_of = |v: u32| primitive.features.get(v as usize).copied();
            let feature = feature_of(corners[0]).unwrap_or(NO_FEATURE);
            let wedges = std::array::from_fn(|i| {
                let vertex = corners[i] as usize;
                let normal = primitive.normals.get(vertex).copied().filter(|n| is_usable(*n));
                let own = normal.is_some() && feature_of(corners[i]).is_none_or(|f| f == feature);
                if own && wedge_of_vertex[vertex] != NEW {
                    return wedge_of_vertex[vertex];
                }
                let position = self.position(points[i], feature);
                let normal = normal.unwrap_or_else(|| face_normal(points));
                let uv = primitive.uvs.get(vertex).copied().unwrap_or(Vec2::ZERO);
                let wedge = self.wedge(position, normal, uv, section);
                if own {
                    wedge_of_vertex[vertex] = wedge;
                }
                wedge
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

    /// Room for as many positions and wedges as there are vertices: growing costs more
    /// than filling. What stays empty is given back in the end.
    fn reserve(&mut self, primitives: &[RawPrimitive]) {
        let vertices = primitives.iter().map(|primitive| primitive.positions.len()).sum();
        let triangles = primitives.iter().map(|primitive| primitive.triangles.len()).sum();
        let Self { mesh, positions, hasher, .. } = self;
        positions.reserve(vertices, |&i| hasher.hash_one(position_key_at(mesh, i)));
        mesh.triangles.reserve_exact(triangles);
        mesh.positions.reserve_exact(vertices);
        mesh.wedges.position.reserve_exact(vertices);
        mesh.wedges.normal.reserve_exact(vertices);
        mesh.wedges.uv.reserve_exact(vertices);
        mesh.wedges.section.reserve_exact(vertices);
        self.last_wedges.reserve_exact(vertices);
        self.wedges_before.reserve_exact(vertices);
    }

    fn position(&mut self, point: Vec3, feature: u32) -> u32 {
        let Self { mesh, positions, last_wedges, hasher, .. } = self;
        let wanted = position_key(point, feature);
        let entry = positions.entry(
            hasher.hash_one(wanted),
            |&i| position_key_at(mesh, i) == wanted,
            |&i| hasher.hash_one(position_key_at(mesh, i)),
        );
        *entry
            .or_insert_with(|| {
                mesh.positions.push(point);
                last_wedges.push(NEW);
                if self.with_features {
                    mesh.features.push(feature);
                }
                mesh.positions.len() as u32 - 1
            })
            .get()
    }

    fn wedge(&mut self, position: u32, normal: Vec3, uv: Vec2, section: u32) -> u32 {
        let uv = if uv.is_finite() { uv } else { Vec2::ZERO };
        let wanted = wedge_key(position, normal, uv, section);
        let last = self.last_wedges[position as usize];
        let (mut wedge, mut passed) = (last, 0);
        while wedge != NEW {
            if wedge_key_at(&self.mesh, wedge) == wanted {
                return wedge;
            }
            wedge = self.wedges_before[wedge as usize];
            passed += 1;
        }
        if passed == MAX_CHAIN {
            return self.further_wedge(position, normal, uv, section);
        }
        let wedge = add_wedge(&mut self.mesh, position, normal, uv, section);
        self.wedges_before.push(last);
        self.last_wedges[position as usize] = wedge;
        wedge
    }

    /// A wedge of a position that has many.
    fn further_wedge(&mut self, position: u32, normal: Vec3, uv: Vec2, section: u32) -> u32 {
        let Self { mesh, more_wedges, wedges_before, hasher, .. } = self;
        let wanted = wedge_key(position, normal, uv, section);
        let entry = more_wedges.entry(
            hasher.hash_one(wanted),
            |&i| wedge_key_at(mesh, i) == wanted,
            |&i| hasher.hash_one(wedge_key_at(mesh, i)),
        );
        *entry
            .or_insert_with(|| {
                wedges_before.push(NEW);
                add_wedge(mesh, position, normal, uv, section)
            })
            .get()
    }

    fn finish(mut self) -> (Mesh, WeldReport) {
        self.report.positions = self.mesh.positions.len();
        self.report.wedges = self.mesh.wedges.len();
        self.mesh.shrink_to_fit();
        self.mesh.group_wedges();
        (self.mesh, self.report)
    }
}

fn add_wedge(mesh: &mut Mesh, position: u32, normal: Vec3, uv: Vec2, section: u32) -> u32 {
    let wedges = &mut mesh.wedges;
    wedges.position.push(position);
    wedges.normal.push(normal);
    wedges.uv.push(uv);
    wedges.section.push(section);
    wedges.position.len() as u32 - 1
}

/// What makes two points one position.
fn position_key(point: Vec3, feature: u32) -> [u32; 4] {
    let [x, y, z] = point.to_array().map(f32::to_bits);
    [x, y, z, feature]
}

fn position_key_at(mesh: &Mesh, position: u32) -> [u32; 4] {
    let feature = mesh.features.get(position as usize).copied().unwrap_or(NO_FEATURE);
    position_key(mesh.positions[position as usize], feature)
}

/// What makes two vertices one wedge.
fn wedge_key(position: u32, normal: Vec3, uv: Vec2, section: u32) -> [u32; 7] {
    let [x, y, z] = normal.to_array().map(f32::to_bits);
    let [u, v] = uv.to_array().map(f32::to_bits);
    [position, x, y, z, u, v, section]
}

fn wedge_key_at(mesh: &Mesh, wedge: u32) -> [u32; 7] {
    let (wedge, wedges) = (wedge as usize, &mesh.wedges);
    let (normal, uv) = (wedges.normal[wedge], wedges.uv[wedge]);
    wedge_key(wedges.position[wedge], normal, uv, wedges.section[wedge])
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
fn is_usable(normal: Vec3) -> bool {
    normal.is_finite() && normal.length_squared() > 1e-12
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

    /// A fan around one point, whose corner there has another normal in each triangle.
    #[test]
    fn a_position_may_have_many_wedges_and_each_is_found_again() {
        let count = 4 * MAX_CHAIN;
        let ring = |i: usize| Vec3::new(1.0, i as f32, 0.0);
        let normal = |i: usize| Vec3::new(0.0, i as f32, 1.0);
        let twice = || (0..count).chain(0..count);
        let primitive = RawPrimitive {
            positions: twice().flat_map(|i| [Vec3::ZERO, ring(i), ring(i + 1)]).collect(),
            normals: twice().flat_map(|i| [normal(i), Vec3::Z, Vec3::Z]).collect(),
            triangles: (0..2 * count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Default::default()
        };
        let (mesh, _) = weld(&[primitive]).unwrap();
        assert_eq!(mesh.positions.len(), 1 + count + 1);
        assert_eq!(mesh.wedges.len(), count + count + 1);
        let of_middle =
            mesh.triangles.iter().map(|&[middle, ..]| mesh.wedges.normal[middle as usize]);
        assert!(of_middle.eq(twice().map(normal)));
        assert_eq!(mesh.triangles[..count], mesh.triangles[count..]);
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
    fn features_do_not_weld_to_each_other() {
        let mut primitive = quad_with_seam();
        primitive.features = vec![3, 3, 3, 8, 8, 8];
        let (mesh, _) = weld(&[primitive]).unwrap();
        assert_eq!(mesh.positions.len(), 6);
        let features: Vec<_> = mesh.triangles.iter().map(|&t| mesh.feature(t)).collect();
        assert_eq!(features, vec![Some(3), Some(8)]);
    }

    #[test]
    fn a_triangle_belongs_to_the_feature_of_its_first_corner() {
        let mut primitive = quad_with_seam();
        primitive.features = vec![3, 8, 8, 8, 3, 3];
        let (mesh, _) = weld(&[primitive, quad_with_seam()]).unwrap();
        let corners = mesh.triangles.iter().map(|&t| mesh.corner_positions(t));
        let features: Vec<_> = corners.map(|t| t.map(|p| mesh.features[p as usize])).collect();
        assert_eq!(features, vec![[3; 3], [8; 3], [NO_FEATURE; 3], [NO_FEATURE; 3]]);
        assert_eq!(mesh.feature(mesh.triangles[2]), None);
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
