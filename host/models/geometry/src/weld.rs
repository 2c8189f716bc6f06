//! Welding: raw vertex arrays to one mesh of positions and wedges.
//!
//! glTF splits a vertex at every normal, UV and material seam, so edges taken
//! from its indices are nearly all false borders. Positions are welded when
//! they are bit-equal (with -0 read as 0), within one feature of one mesh.

mod normals;
mod point_groups;

use std::hash::BuildHasher;

use glam::{Vec2, Vec3};
use hashbrown::{DefaultHashBuilder, HashTable};
use thiserror::Error;

use self::normals::{face_normal, is_usable};
use self::point_groups::PointGroups;
use crate::{Mesh, NO_FEATURE, Section};

/// One primitive as a file gives it: parallel vertex arrays and indices.
#[derive(Clone, Debug, Default)]
pub struct RawPrimitive {
    /// Positions of the vertices.
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

impl RawPrimitive {
    /// Returns the feature that a triangle belongs to, or [`NO_FEATURE`].
    fn feature_of(&self, corners: [u32; 3]) -> u32 {
        self.features.get(corners[0] as usize).copied().unwrap_or(NO_FEATURE)
    }

    /// Reports whether a corner of a triangle belongs to another feature by itself.
    fn is_foreign(&self, corner: u32, feature: u32) -> bool {
        self.features.get(corner as usize).is_some_and(|&own| own != feature)
    }
}

/// Counts of one welding, for the import report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WeldReport {
    /// Vertices that the triangles referenced.
    pub vertices_in: usize,
    /// Number of welded positions.
    pub positions: usize,
    /// Wedges after merging equal vertices.
    pub wedges: usize,
    /// Triangles dropped because corners coincide after welding.
    pub coincident_triangles: usize,
}

/// Reasons why raw primitives cannot be welded.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum WeldError {
    /// A triangle names a vertex that does not exist.
    #[error("primitive {primitive}: triangle {triangle} names vertex {vertex} of {count}")]
    IndexOutOfRange {
        /// Index of the faulty primitive.
        primitive: usize,
        /// Index of the faulty triangle.
        triangle: usize,
        /// The index it names.
        vertex: u32,
        /// Number of vertices there are.
        count: usize,
    },
    /// An attribute array has another length than the positions.
    #[error("primitive {primitive}: {found} {attribute} for {expected} positions")]
    AttributeLength {
        /// Index of the faulty primitive.
        primitive: usize,
        /// Name of the faulty attribute.
        attribute: &'static str,
        /// Length of the attribute array.
        found: usize,
        /// The number of positions.
        expected: usize,
    },
    /// A referenced coordinate is NaN or infinite.
    #[error("primitive {primitive}: position of vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the faulty primitive.
        primitive: usize,
        /// Index of the faulty vertex.
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
    let vertex_total: usize = primitives.iter().map(|p| p.positions.len()).sum();
    // Corners may become points of their own beside the vertices.
    if corner_total + vertex_total > (u32::MAX - 1) as usize {
        return Err(WeldError::TooLarge);
    }
    for (index, primitive) in primitives.iter().enumerate() {
        check(index, primitive)?;
    }
    let mut welder = Welder::with_room_for(primitives);
    primitives.iter().for_each(|primitive| welder.add(primitive));
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
    // Looking each corner up takes several times as long.
    let largest = primitive.triangles.as_flattened().iter().copied().max();
    let are_inside = largest.is_none_or(|largest| (largest as usize) < count);
    if are_inside && primitive.positions.iter().all(|position| position.is_finite()) {
        return Ok(());
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

struct Welder {
    mesh: Mesh,
    report: WeldReport,
    with_features: bool,
    /// Vertices grouped by point, and the mesh's position at each point once it has one.
    points: PointGroups,
    positions: Vec<u32>,
    hasher: DefaultHashBuilder,
    /// Last chained wedge of each position. `wedges_before` links each wedge to the one before it.
    last_wedges: Vec<u32>,
    wedges_before: Vec<u32>,
    /// Wedges beyond a position's first ones.
    more_wedges: HashTable<u32>,
}

impl Welder {
    /// Makes a welder with room for as many positions and wedges as there are vertices: growing
    /// costs more than filling. Unused room is released in the end.
    fn with_room_for(primitives: &[RawPrimitive]) -> Self {
        let vertices = primitives.iter().map(|primitive| primitive.positions.len()).sum();
        let triangles = primitives.iter().map(|primitive| primitive.triangles.len()).sum();
        let points = PointGroups::new(primitives);
        let mut mesh = Mesh::default();
        mesh.triangles.reserve_exact(triangles);
        mesh.positions.reserve_exact(vertices);
        mesh.wedges.position.reserve_exact(vertices);
        mesh.wedges.normal.reserve_exact(vertices);
        mesh.wedges.uv.reserve_exact(vertices);
        mesh.wedges.section.reserve_exact(vertices);
        Self {
            mesh,
            report: WeldReport::default(),
            with_features: primitives.iter().any(|primitive| !primitive.features.is_empty()),
            positions: vec![NEW; points.len()],
            points,
            hasher: DefaultHashBuilder::default(),
            last_wedges: Vec::with_capacity(vertices),
            wedges_before: Vec::with_capacity(vertices),
            more_wedges: HashTable::new(),
        }
    }

    fn add(&mut self, primitive: &RawPrimitive) {
        let section = self.mesh.sections.len() as u32;
        let first_triangle = self.mesh.triangles.len() as u32;
        let first_vertex = self.points.begin(primitive);
        let mut referenced = vec![false; primitive.positions.len()];
        // Most vertices are met six times; their wedge is looked up once.
        let mut wedge_of_vertex = vec![NEW; primitive.positions.len()];
        for &corners in &primitive.triangles {
            let points = corners.map(|v| normalize_zero(primitive.positions[v as usize]));
            let feature = primitive.feature_of(corners);
            let mut vertices = corners.map(|vertex| first_vertex + vertex);
            for (corner, vertex) in corners.into_iter().zip(&mut vertices) {
                let seen = &mut referenced[corner as usize];
                self.report.vertices_in += usize::from(!*seen);
                *seen = true;
                if primitive.is_foreign(corner, feature) {
                    *vertex = self.points.next_foreign();
                }
            }
            if points[0] == points[1] || points[1] == points[2] || points[2] == points[0] {
                self.report.coincident_triangles += 1;
                continue;
            }
            let wedges = std::array::from_fn(|i| {
                let vertex = corners[i] as usize;
                let normal = primitive.normals.get(vertex).copied().filter(|n| is_usable(*n));
                let own = normal.is_some() && vertices[i] == first_vertex + corners[i];
                if own && wedge_of_vertex[vertex] != NEW {
                    return wedge_of_vertex[vertex];
                }
                let position = self.position(vertices[i], points[i], feature);
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

    /// Returns the position of a vertex, numbered by first use.
    fn position(&mut self, vertex: u32, point: Vec3, feature: u32) -> u32 {
        let position = &mut self.positions[self.points.first_at(vertex) as usize];
        if *position == NEW {
            *position = self.mesh.positions.len() as u32;
            self.mesh.positions.push(point);
            self.last_wedges.push(NEW);
            if self.with_features {
                self.mesh.features.push(feature);
            }
        }
        *position
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

    /// Finds or adds a wedge of a position that has many.
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

/// Returns the key by which two vertices are one wedge.
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

/// Turns -0 into 0 by adding zero; every other value stays.
fn normalize_zero(point: Vec3) -> Vec3 {
    point + Vec3::ZERO
}

#[cfg(test)]
mod tests;
