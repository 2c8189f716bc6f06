//! Feature indices of vertices on the device: one word a vertex.
//!
//! A word a vertex, in meshes that have features: the passes read it to find a
//! feature's id and tint. All other meshes share one group that none reads.

use busbar_geometry::{Mesh, NO_FEATURE};
use busbar_gpu::{BindGroup, BindGroupLayout, Binding, Buffer, BufferUsage, Gpu, Recorder};

use crate::RenderError;

/// Binds the features of meshes.
pub(crate) struct FeatureResources {
    layout: BindGroupLayout,
    none: BindGroup,
}

/// The features of one mesh.
pub(crate) struct MeshFeatures {
    group: BindGroup,
    /// One more than the last feature.
    pub(crate) count: u32,
}

impl FeatureResources {
    pub(crate) fn new(gpu: &Gpu, layout: BindGroupLayout) -> Result<Self, RenderError> {
        let word = size_of::<u32>() as u64;
        let none = Buffer::new(gpu, "no features", BufferUsage::HostStorage, word)?;
        none.write(bytemuck::bytes_of(&NO_FEATURE))?;
        let none = BindGroup::new(&layout, &[Binding::Buffer(&none)])?;
        Ok(Self { layout, none })
    }

    /// Uploads a mesh's features; `None` for a mesh without features.
    pub(crate) fn upload(
        &self,
        recorder: &mut Recorder<'_>,
        mesh: &Mesh,
    ) -> Result<Option<MeshFeatures>, RenderError> {
        let used = mesh.features.iter().filter(|&&feature| feature != NO_FEATURE);
        let Some(&last) = used.max() else {
            return Ok(None);
        };
        let of_vertices: Vec<u32> =
            mesh.wedges.position.iter().map(|&position| mesh.features[position as usize]).collect();
        let bytes = bytemuck::cast_slice(&of_vertices);
        let buffer = recorder.upload_buffer("features", BufferUsage::Storage, bytes)?;
        let group = BindGroup::new(&self.layout, &[Binding::Buffer(&buffer)])?;
        Ok(Some(MeshFeatures { group, count: last + 1 }))
    }

    pub(crate) fn group<'a>(&'a self, features: Option<&'a MeshFeatures>) -> &'a BindGroup {
        features.map_or(&self.none, |features| &features.group)
    }
}
