//! Mesh export: sections become primitives with their accessors.

use busbar_geometry::{Mesh, Section};
use busbar_scene::Model;
use glam::Vec3;

use crate::binary::{Binary, Location, Stream};
use crate::document::{self, Accessor, Attributes, Document, Primitive};
use crate::features::{MeshFeatureWriter, PropertyTables, VertexFeatures};

const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// More vertices need 32-bit indices: 65535 itself means "restart".
const MAX_VERTICES_16: usize = 65_535;

const UNUSED: u32 = u32::MAX;

/// Writes all meshes that have triangles; returns the index of each in the file.
pub(crate) fn write(
    model: &Model,
    document: &mut Document,
    binary: &mut Binary,
) -> Vec<Option<u32>> {
    let mut file_meshes = Vec::with_capacity(model.meshes.len());
    let mut tables = PropertyTables::default();
    for (index, mesh) in model.meshes.iter().enumerate() {
        if mesh.triangles.is_empty() {
            file_meshes.push(None);
            continue;
        }
        let mut writer = MeshWriter {
            mesh,
            features: MeshFeatureWriter::new(mesh, model.feature_names(index), &mut tables),
            vertex_of_wedge: vec![UNUSED; mesh.wedges.len()],
            accessors: &mut document.accessors,
            binary,
        };
        let filled = mesh.sections.iter().filter(|s| s.triangle_count > 0);
        let primitives: Vec<_> = filled.map(|section| writer.section(section)).collect();
        file_meshes.push((!primitives.is_empty()).then(|| {
            document.meshes.push(document::Mesh { primitives });
            document.meshes.len() as u32 - 1
        }));
    }
    tables.finish(document, binary);
    file_meshes
}

struct MeshWriter<'a> {
    mesh: &'a Mesh,
    features: MeshFeatureWriter<'a>,
    /// Scratch, all [`UNUSED`] between sections.
    vertex_of_wedge: Vec<u32>,
    accessors: &'a mut Vec<Accessor>,
    binary: &'a mut Binary,
}

impl MeshWriter<'_> {
    fn section(&mut self, section: &Section) -> Primitive {
        let (wedges, indices) = self.gather(section);
        let features = self.features.vertex_features(&wedges);
        Primitive {
            attributes: Attributes {
                position: self.positions(&wedges),
                normal: self.normals(&wedges),
                uv: self.uvs(&wedges),
                feature: features.as_ref().map(|features| self.feature_ids(features)),
            },
            indices: self.indices(&indices, wedges.len()),
            material: section.material,
            extensions: features.map(VertexFeatures::into_extension),
        }
    }

    /// Gathers the wedges that a section's triangles name, in order of first use, and its corners
    /// as indices into them.
    fn gather(&mut self, section: &Section) -> (Vec<u32>, Vec<u32>) {
        let first = section.first_triangle as usize;
        let triangles = &self.mesh.triangles[first..first + section.triangle_count as usize];
        let mut wedges = Vec::new();
        let mut indices = Vec::with_capacity(triangles.len() * 3);
        for &wedge in triangles.as_flattened() {
            let vertex = &mut self.vertex_of_wedge[wedge as usize];
            if *vertex == UNUSED {
                *vertex = wedges.len() as u32;
                wedges.push(wedge);
            }
            indices.push(*vertex);
        }
        for &wedge in &wedges {
            self.vertex_of_wedge[wedge as usize] = UNUSED;
        }
        (wedges, indices)
    }

    fn positions(&mut self, wedges: &[u32]) -> u32 {
        let mesh = self.mesh;
        let point = |&w: &u32| mesh.positions[mesh.wedges.position[w as usize] as usize];
        let min = wedges.iter().map(point).fold(Vec3::MAX, Vec3::min);
        let max = wedges.iter().map(point).fold(Vec3::MIN, Vec3::max);
        let bytes = wedges.iter().flat_map(|w| vec3_bytes(point(w)));
        let at = self.binary.append(Stream::Positions, bytes);
        self.accessor(at, FLOAT, wedges.len(), "VEC3", Some([min, max]))
    }

    fn normals(&mut self, wedges: &[u32]) -> u32 {
        let normals = &self.mesh.wedges.normal;
        let bytes = wedges.iter().flat_map(|&w| vec3_bytes(normals[w as usize]));
        let at = self.binary.append(Stream::Normals, bytes);
        self.accessor(at, FLOAT, wedges.len(), "VEC3", None)
    }

    /// Writes texture coordinates; `None` where all are zero, the reader's default.
    fn uvs(&mut self, wedges: &[u32]) -> Option<u32> {
        let uvs = &self.mesh.wedges.uv;
        if wedges.iter().all(|&w| uvs[w as usize] == glam::Vec2::ZERO) {
            return None;
        }
        let bytes =
            wedges.iter().flat_map(|&w| uvs[w as usize].to_array()).flat_map(f32::to_le_bytes);
        let at = self.binary.append(Stream::Uvs, bytes);
        Some(self.accessor(at, FLOAT, wedges.len(), "VEC2", None))
    }

    fn feature_ids(&mut self, features: &VertexFeatures) -> u32 {
        let ids = features.ids.iter();
        let (at, component) = if features.is_narrow {
            // Attributes lie on four bytes (glTF 2.0, section 3.6.2.4).
            let bytes = ids.flat_map(|&id| id.to_le_bytes());
            (self.binary.append(Stream::Features16, bytes), UNSIGNED_SHORT)
        } else {
            let bytes = ids.flat_map(|&id| (id as f32).to_le_bytes());
            (self.binary.append(Stream::Features32, bytes), FLOAT)
        };
        self.accessor(at, component, features.ids.len(), "SCALAR", None)
    }

    fn indices(&mut self, indices: &[u32], vertices: usize) -> u32 {
        let (at, component) = if vertices <= MAX_VERTICES_16 {
            let bytes = indices.iter().flat_map(|&i| (i as u16).to_le_bytes());
            (self.binary.append(Stream::Indices16, bytes), UNSIGNED_SHORT)
        } else {
            let bytes = indices.iter().flat_map(|&i| i.to_le_bytes());
            (self.binary.append(Stream::Indices32, bytes), UNSIGNED_INT)
        };
        self.accessor(at, component, indices.len(), "SCALAR", None)
    }

    fn accessor(
        &mut self,
        at: Location,
        component_type: u32,
        count: usize,
        shape: &'static str,
        bounds: Option<[Vec3; 2]>,
    ) -> u32 {
        self.accessors.push(Accessor {
            buffer_view: at.view,
            byte_offset: at.byte_offset,
            component_type,
            count: count as u32,
            shape,
            min: bounds.map(|[min, _]| min.to_array()),
            max: bounds.map(|[_, max]| max.to_array()),
        });
        self.accessors.len() as u32 - 1
    }
}

fn vec3_bytes(v: Vec3) -> [u8; 12] {
    bytemuck::cast(v.to_array().map(f32::to_le_bytes))
}
