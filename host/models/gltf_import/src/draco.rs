//! Meshes compressed by KHR_draco_mesh_compression.

use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointIndex};

use crate::error::ImportFault;
use crate::schema::ComponentType;

/// A decompressed mesh: attributes by point, and corners as point indices.
pub(crate) struct DracoMesh {
    attributes: Vec<DracoAttribute>,
    /// Corners of the triangles, each a little-endian word.
    pub(crate) corners: Vec<u8>,
}

/// An attribute of a decompressed mesh, tightly packed.
pub(crate) struct DracoAttribute {
    id: u32,
    pub(crate) component_type: ComponentType,
    pub(crate) components: usize,
    pub(crate) values: Vec<u8>,
}

impl DracoMesh {
    /// Decompresses a mesh of at most `max_triangles` and `max_bytes`.
    pub(crate) fn decode(
        packed: &[u8],
        max_triangles: u64,
        max_bytes: u64,
    ) -> Result<Self, ImportFault> {
        let limits = DecodeLimits::default()
            .with_max_faces(max_triangles)
            .with_max_points(3 * max_triangles)
            .with_max_decoded_bytes(max_bytes);
        let mut buffer = DecoderBuffer::new(packed).with_limits(limits);
        let mut mesh = Mesh::new();
        let damaged = |reason: String| ImportFault::Draco(crate::document::shortened(&reason));
        MeshDecoder::new()
            .decode(&mut buffer, &mut mesh)
            .map_err(|reason| damaged(reason.to_string()))?;
        let points = mesh.num_points();
        let mut attributes = Vec::new();
        let mut left = max_bytes;
        for index in 0..mesh.num_attributes() {
            let attribute = mesh.attribute(index);
            let Some(component_type) = component_type(attribute.data_type()) else { continue };
            let components = usize::from(attribute.num_components());
            let element = components * component_type.size();
            let bytes = points as u64 * element as u64;
            left = left.checked_sub(bytes).ok_or(ImportFault::TooMany {
                what: "decompressed bytes",
                count: max_bytes - left + bytes,
                limit: max_bytes,
            })?;
            let stride = usize::try_from(attribute.byte_stride()).unwrap_or(0);
            let data = attribute.buffer().data();
            let mut values = Vec::with_capacity(bytes as usize);
            for point in 0..points {
                let value = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
                let start = value.checked_mul(stride);
                let found = start.and_then(|start| data.get(start..start.checked_add(element)?));
                let found = found.ok_or_else(|| damaged(format!("point {point} has no value")))?;
                values.extend(found);
            }
            let id = attribute.unique_id();
            attributes.push(DracoAttribute { id, component_type, components, values });
        }
        let corners = mesh.faces().iter().flatten().flat_map(|corner| corner.0.to_le_bytes());
        Ok(Self { attributes, corners: corners.collect() })
    }

    /// Returns the number of bytes.
    pub(crate) fn bytes(&self) -> u64 {
        let values: usize = self.attributes.iter().map(|attribute| attribute.values.len()).sum();
        (values + self.corners.len()) as u64
    }

    /// Finds an attribute by its unique id; returns its place too.
    pub(crate) fn attribute(&self, id: u32) -> Option<(usize, &DracoAttribute)> {
        self.attributes.iter().enumerate().find(|(_, attribute)| attribute.id == id)
    }
}

/// Returns the component type in glTF; `None` for those that it does not have.
fn component_type(data_type: DataType) -> Option<ComponentType> {
    Some(match data_type {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 | DataType::Bool => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        _ => return None,
    })
}
