//! Models on the device: vertex upload and per-mesh data.

use std::sync::Arc;

use busbar_culling::BoundingSphere;
use busbar_geometry::{Bounds, CollapseStacks, Mesh, Section};
use busbar_gpu::{BufferArena, BufferSlice, Recorder};
use busbar_scene::{Material, Texture};
use busbar_shaders::{SLENDER, Vertex};
use glam::Vec3;

use crate::RenderError;
use crate::features::{FeatureResources, MeshFeatures};
use crate::material::{GpuMaterial, MaterialResources};
use crate::mesh_preparation::MeshPreparation;
use crate::resolver::ResolveSource;
use crate::slender::SlenderWedges;

/// A model to upload.
#[derive(Clone, Copy)]
pub struct ModelUpload<'a> {
    /// One for each mesh.
    pub stacks: &'a [Arc<CollapseStacks>],
    /// Materials that mesh sections name.
    pub materials: &'a [Material],
    /// Textures that materials name.
    pub textures: &'a [Texture],
}

/// A model on the device.
pub(crate) struct GpuModel {
    pub(crate) meshes: Vec<GpuMesh>,
    materials: Vec<GpuMaterial>,
    /// Blending: whether any section blends.
    pub(crate) blends: bool,
}

/// A mesh on the device: all vertices, once.
pub(crate) struct GpuMesh {
    pub(crate) stacks: Arc<CollapseStacks>,
    /// `None` for a mesh without vertices.
    pub(crate) vertices: Option<BufferSlice>,
    /// `None` for a mesh that is one piece.
    pub(crate) features: Option<MeshFeatures>,
    /// Around the mesh, mesh space.
    pub(crate) sphere: BoundingSphere,
    pub(crate) bounds: Bounds,
    /// Blending: whether any section blends.
    pub(crate) blends: bool,
    /// Conductors, wires and rods; `None` where it holds none.
    pub(crate) slender: Option<Arc<SlenderWedges>>,
    /// Part of a model: other meshes stand in the same place.
    is_part: bool,
}

impl GpuMesh {
    /// Returns the data that its triangles are resolved from.
    pub(crate) fn source(&self, preparation: MeshPreparation) -> ResolveSource<'_> {
        let (slender, is_part) = (self.slender.as_ref(), self.is_part);
        ResolveSource { stacks: &self.stacks, slender, is_part, preparation }
    }
}

impl GpuModel {
    pub(crate) fn upload(
        recorder: &mut Recorder<'_>,
        (material_resources, feature_resources): (&mut MaterialResources, &FeatureResources),
        vertices: &mut BufferArena,
        upload: ModelUpload<'_>,
    ) -> Result<Self, RenderError> {
        let materials = material_resources.upload(recorder, upload.materials, upload.textures)?;
        let meshes = Vec::with_capacity(upload.stacks.len());
        let mut model = Self { meshes, materials, blends: false };
        let is_part = upload.stacks.len() > 1;
        for (index, stacks) in upload.stacks.iter().enumerate() {
            check_sections(index, stacks.mesh(), upload.materials.len())?;
            let mesh =
                model.upload_mesh(recorder, feature_resources, vertices, (stacks, is_part))?;
            model.blends |= mesh.blends;
            model.meshes.push(mesh);
        }
        Ok(model)
    }

    fn upload_mesh(
        &self,
        recorder: &mut Recorder<'_>,
        feature_resources: &FeatureResources,
        arena: &mut BufferArena,
        (stacks, is_part): (&Arc<CollapseStacks>, bool),
    ) -> Result<GpuMesh, RenderError> {
        let mesh = stacks.mesh();
        let bounds = mesh.bounds().unwrap_or_default();
        let outward = slender_normals(stacks);
        let bytes = mesh.wedges.len() * size_of::<Vertex>();
        let color_of = |section: &Section| self.material(section.material).vertex_color;
        let colors: Vec<Option<[f32; 2]>> = mesh.sections.iter().map(color_of).collect();
        let write = |bytes: &mut [u8]| write_vertices(mesh, &outward, &colors, bytes);
        let vertices = match bytes {
            0 => None,
            bytes => Some(recorder.upload_slice_with(arena, bytes as u64, write)?),
        };
        let slender = (!outward.is_empty()).then(|| {
            let of_wedge = |wedge: usize| outward[mesh.wedges.position[wedge] as usize];
            SlenderWedges::new(mesh.wedges.len(), |wedge| of_wedge(wedge) != Vec3::ZERO)
        });
        Ok(GpuMesh {
            stacks: Arc::clone(stacks),
            vertices,
            features: feature_resources.upload(recorder, mesh)?,
            sphere: bounding_sphere(mesh, bounds),
            bounds,
            blends: mesh.sections.iter().any(|section| self.material(section.material).blends),
            slender: slender.map(Arc::new),
            is_part,
        })
    }

    /// Returns a section's material, or the default one.
    pub(crate) fn material(&self, index: Option<u32>) -> &GpuMaterial {
        let default = self.materials.len() - 1;
        &self.materials[index.map_or(default, |index| index as usize)]
    }
}

fn bounding_sphere(mesh: &Mesh, bounds: Bounds) -> BoundingSphere {
    let center = bounds.center();
    let squared = |position: &Vec3| position.distance_squared(center);
    let radius = mesh.positions.iter().map(squared).fold(0.0, f32::max).sqrt();
    BoundingSphere { center, radius }
}

/// Computes the normals of slender pieces by position. Each points away from the axis and is longer
/// than one by the radius. Zero elsewhere; empty without slender pieces.
fn slender_normals(stacks: &CollapseStacks) -> Vec<Vec3> {
    let points = stacks.slender_points();
    if points.is_empty() {
        return Vec::new();
    }
    let mut normals = vec![Vec3::ZERO; stacks.mesh().positions.len()];
    for point in points {
        normals[point.position as usize] = point.outward * (SLENDER + point.radius);
    }
    normals
}

/// Wedges are the vertices: a position with one set of attributes each. They are written in
/// order and never read: device memory that the processor sees may be slow to read.
fn write_vertices(mesh: &Mesh, slender: &[Vec3], colors: &[Option<[f32; 2]>], into: &mut [u8]) {
    let wedges = &mesh.wedges;
    let normal_at = |position: usize, own: Vec3| match slender.get(position) {
        Some(&normal) if normal != Vec3::ZERO => normal,
        _ => unit_at_most(own),
    };
    let of_wedges = wedges.position.iter().zip(&wedges.normal);
    let of_wedges = of_wedges.zip(&wedges.uv).zip(&wedges.section);
    let (places, _) = into.as_chunks_mut::<{ size_of::<Vertex>() }>();
    for (place, (((&position, &normal), uv), &section)) in places.iter_mut().zip(of_wedges) {
        let position = position as usize;
        let [u, v] = colors.get(section as usize).copied().flatten().unwrap_or(uv.to_array());
        *place = bytemuck::cast(Vertex {
            position_u: mesh.positions[position].extend(u).to_array(),
            normal_v: normal_at(position, normal).extend(v).to_array(),
        });
    }
}

/// Normalizes long normals: files hold normals of any length, and a long one marks slender parts.
fn unit_at_most(normal: Vec3) -> Vec3 {
    const LONG: f32 = 1.1;
    if normal.length_squared() > LONG { normal.normalize() } else { normal }
}

fn check_sections(mesh_index: usize, mesh: &Mesh, count: usize) -> Result<(), RenderError> {
    let named = mesh.sections.iter().filter_map(|section| section.material);
    match named.into_iter().find(|&index| index as usize >= count) {
        None => Ok(()),
        Some(index) => Err(RenderError::BadReference {
            place: format!("mesh {mesh_index}"),
            what: "material",
            index,
            count,
        }),
    }
}
