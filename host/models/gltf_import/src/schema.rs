//! Elements of a glTF file (glTF 2.0, section 5), each parsed when it is used.

use serde::Deserialize;
use serde_json::value::RawValue;

use crate::bounded::{List, Members};
use crate::extensions::FeatureIdSets;
use crate::limits::{MAX_CHILDREN, MAX_JOINTS, MAX_PRIMITIVES};
use crate::scalars::{Doubles, Flag, Real, Reals, Text, Tolerant, Whole};

/// Type of an accessor's components.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ComponentType {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl ComponentType {
    pub(crate) fn from_code(code: Whole) -> Option<Self> {
        Some(match code.0 {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    /// Returns the number of bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Returns the name in the specification.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::I8 => "BYTE",
            Self::U8 => "UNSIGNED_BYTE",
            Self::I16 => "SHORT",
            Self::U16 => "UNSIGNED_SHORT",
            Self::U32 => "UNSIGNED_INT",
            Self::F32 => "FLOAT",
        }
    }
}

/// Shape of an accessor's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shape {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

impl Shape {
    const ALL: [(Self, &'static str, usize); 7] = [
        (Self::Scalar, "SCALAR", 1),
        (Self::Vec2, "VEC2", 2),
        (Self::Vec3, "VEC3", 3),
        (Self::Vec4, "VEC4", 4),
        (Self::Mat2, "MAT2", 4),
        (Self::Mat3, "MAT3", 9),
        (Self::Mat4, "MAT4", 16),
    ];

    pub(crate) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known, _)| *known == name).map(|(shape, ..)| *shape)
    }

    pub(crate) fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Returns the number of components.
    pub(crate) fn components(self) -> usize {
        Self::ALL[self as usize].2
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Accessor<'a> {
    pub(crate) buffer_view: Option<Whole>,
    pub(crate) byte_offset: Option<Whole>,
    pub(crate) component_type: Whole,
    #[serde(default)]
    pub(crate) normalized: Flag,
    pub(crate) count: Whole,
    #[serde(borrow, rename = "type", default)]
    pub(crate) shape: Text<'a>,
    pub(crate) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Sparse {
    pub(crate) count: Whole,
    pub(crate) indices: SparseIndices,
    pub(crate) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct SparseIndices {
    pub(crate) buffer_view: Whole,
    pub(crate) byte_offset: Option<Whole>,
    pub(crate) component_type: Whole,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct SparseValues {
    pub(crate) buffer_view: Whole,
    pub(crate) byte_offset: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Buffer<'a> {
    #[serde(borrow, default)]
    pub(crate) uri: Text<'a>,
    pub(crate) byte_length: Option<Whole>,
}

/// View of a part of a buffer.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct BufferView<'a> {
    pub(crate) buffer: Whole,
    pub(crate) byte_offset: Option<Whole>,
    pub(crate) byte_length: Whole,
    pub(crate) byte_stride: Option<Whole>,
    #[serde(borrow, default)]
    pub(crate) extensions: Option<BufferViewExtensions<'a>>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct BufferViewExtensions<'a> {
    #[serde(borrow, rename = "EXT_meshopt_compression")]
    pub(crate) meshopt: Option<MeshoptView<'a>>,
    #[serde(borrow, rename = "KHR_meshopt_compression")]
    pub(crate) khronos_meshopt: Option<MeshoptView<'a>>,
}

/// The compressed content of a view (EXT_meshopt_compression).
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct MeshoptView<'a> {
    pub(crate) buffer: Whole,
    pub(crate) byte_offset: Option<Whole>,
    pub(crate) byte_length: Whole,
    pub(crate) byte_stride: Whole,
    pub(crate) count: Whole,
    #[serde(borrow, default)]
    pub(crate) mode: Text<'a>,
    #[serde(borrow, default)]
    pub(crate) filter: Text<'a>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Image<'a> {
    #[serde(borrow, default)]
    pub(crate) uri: Text<'a>,
    pub(crate) buffer_view: Option<Whole>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Material<'a> {
    #[serde(borrow, default)]
    pub(crate) name: Text<'a>,
    pub(crate) pbr_metallic_roughness: Option<MetallicRoughness>,
    pub(crate) normal_texture: Option<TextureInfo>,
    pub(crate) occlusion_texture: Option<TextureInfo>,
    pub(crate) emissive_texture: Option<TextureInfo>,
    pub(crate) emissive_factor: Option<Reals<3>>,
    #[serde(borrow, default)]
    pub(crate) alpha_mode: Text<'a>,
    pub(crate) alpha_cutoff: Option<Real>,
    #[serde(default)]
    pub(crate) double_sided: Flag,
    pub(crate) extensions: Option<MaterialExtensions>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct MetallicRoughness {
    pub(crate) base_color_factor: Option<Reals<4>>,
    pub(crate) base_color_texture: Option<TextureInfo>,
    pub(crate) metallic_factor: Option<Real>,
    pub(crate) roughness_factor: Option<Real>,
    pub(crate) metallic_roughness_texture: Option<TextureInfo>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct MaterialExtensions {
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    pub(crate) specular_glossiness: Option<SpecularGlossiness>,
    #[serde(rename = "KHR_materials_emissive_strength")]
    pub(crate) emissive_strength: Option<Tolerant<EmissiveStrength>>,
}

/// Factor of the emitted light beyond one (KHR_materials_emissive_strength).
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct EmissiveStrength {
    pub(crate) emissive_strength: Option<Real>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct SpecularGlossiness {
    pub(crate) diffuse_factor: Option<Reals<4>>,
    pub(crate) diffuse_texture: Option<TextureInfo>,
    pub(crate) specular_factor: Option<Reals<3>>,
    pub(crate) glossiness_factor: Option<Real>,
    pub(crate) specular_glossiness_texture: Option<TextureInfo>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct TextureInfo {
    pub(crate) index: Whole,
    pub(crate) tex_coord: Option<Whole>,
    pub(crate) extensions: Option<TextureInfoExtensions>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct TextureInfoExtensions {
    #[serde(rename = "KHR_texture_transform")]
    pub(crate) transform: Option<TextureTransform>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct TextureTransform {
    pub(crate) offset: Option<Reals<2>>,
    pub(crate) rotation: Option<Real>,
    pub(crate) scale: Option<Reals<2>>,
    pub(crate) tex_coord: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Mesh<'a> {
    #[serde(borrow, default)]
    pub(crate) name: Text<'a>,
    /// Texts of the primitives.
    #[serde(borrow, default)]
    pub(crate) primitives: Option<List<&'a RawValue, MAX_PRIMITIVES>>,
    /// Default weights of the morph targets.
    pub(crate) weights: Option<Tolerant<List<Real>>>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Primitive {
    /// Accessors of the attributes, by name.
    #[serde(default)]
    pub(crate) attributes: Option<Members<Whole>>,
    pub(crate) indices: Option<Whole>,
    pub(crate) material: Option<Whole>,
    pub(crate) mode: Option<Whole>,
    /// Morph targets: accessors of displacements, by the name of the attribute.
    pub(crate) targets: Option<List<Members<Whole>>>,
    pub(crate) extensions: Option<PrimitiveExtensions>,
}

impl Primitive {
    /// Returns the accessor of an attribute.
    pub(crate) fn attribute(&self, name: &str) -> Option<Whole> {
        let mut attributes = self.attributes.iter().flat_map(|attributes| &attributes.0);
        attributes.find(|(known, _)| known == name).map(|(_, accessor)| *accessor)
    }
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct PrimitiveExtensions {
    #[serde(rename = "EXT_mesh_features")]
    pub(crate) mesh_features: Option<MeshFeatures>,
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(crate) draco: Option<DracoPrimitive>,
}

/// The compressed content of a primitive (KHR_draco_mesh_compression).
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct DracoPrimitive {
    pub(crate) buffer_view: Whole,
    /// Unique ids in the compressed data, by the name of the attribute.
    pub(crate) attributes: Members<Whole>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct MeshFeatures {
    #[serde(default)]
    pub(crate) feature_ids: FeatureIdSets,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Node<'a> {
    #[serde(borrow, default)]
    pub(crate) name: Text<'a>,
    #[serde(default)]
    pub(crate) children: Option<List<Whole, MAX_CHILDREN>>,
    pub(crate) mesh: Option<Whole>,
    pub(crate) matrix: Option<Doubles<16>>,
    pub(crate) translation: Option<Doubles<3>>,
    pub(crate) rotation: Option<Doubles<4>>,
    pub(crate) scale: Option<Doubles<3>>,
    pub(crate) skin: Option<Tolerant<Whole>>,
    /// Weights of the mesh's morph targets, which go before the mesh's own.
    pub(crate) weights: Option<Tolerant<List<Real>>>,
    pub(crate) extensions: Option<NodeExtensions>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(crate) instancing: Option<Instancing>,
}

/// Accessors of the places at which a node shows its mesh (EXT_mesh_gpu_instancing).
#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Instancing {
    #[serde(default)]
    pub(crate) attributes: Members<Whole>,
}

/// Joints of a skin. The root of its skeleton is not read: it decides no place.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Skin {
    pub(crate) inverse_bind_matrices: Option<Whole>,
    /// Nodes of the joints, in the order that vertices name them by.
    #[serde(default)]
    pub(crate) joints: List<Whole, MAX_JOINTS>,
}

/// Children of a node alone, for passes that need nothing else.
#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct NodeChildren {
    #[serde(default)]
    pub(crate) children: Option<List<Whole, MAX_CHILDREN>>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Scene<'a> {
    #[serde(borrow, default)]
    pub(crate) name: Text<'a>,
    #[serde(default)]
    pub(crate) nodes: Option<List<Whole, MAX_CHILDREN>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", expecting = "an object")]
pub(crate) struct Sampler {
    pub(crate) wrap_s: Option<Whole>,
    pub(crate) wrap_t: Option<Whole>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object")]
pub(crate) struct Texture {
    pub(crate) source: Option<Whole>,
    pub(crate) sampler: Option<Whole>,
    pub(crate) extensions: Option<TextureExtensions>,
}

/// Images that a texture's extensions name, by extension.
#[derive(Deserialize)]
pub(crate) struct TextureExtensions(Members<ExtensionSource>);

impl TextureExtensions {
    /// Returns the image of the extension that is read best, or of any.
    pub(crate) fn source(&self) -> Option<Whole> {
        let named = |name: &str| self.0.0.iter().find(|(known, _)| known == name);
        let known = named("EXT_texture_webp").or_else(|| named("KHR_texture_basisu"));
        known.and_then(|(_, of)| of.0).or_else(|| self.0.0.iter().find_map(|(_, of)| of.0))
    }
}

/// The image that an extension of a texture names, if it does.
pub(crate) struct ExtensionSource(Option<Whole>);

impl<'de> Deserialize<'de> for ExtensionSource {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        struct Source {
            source: Option<Whole>,
        }
        let raw = <&RawValue>::deserialize(deserializer)?;
        let source = serde_json::from_str::<Source>(raw.get()).ok();
        Ok(Self(source.and_then(|source| source.source)))
    }
}
