//! A model as imported: meshes, materials, textures and named nodes.

use busbar_geometry::Mesh;
use glam::Mat4;

use crate::max_scale_factor;

/// Index of a model in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ModelIndex(pub u32);

/// Everything one model file holds.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Meshes; each gets collapse stacks of its own.
    pub meshes: Vec<Mesh>,
    /// Names of each mesh's features ([`Mesh::features`]), equipment ids as a
    /// rule; one list a mesh. A list that is empty or missing names none.
    pub features: Vec<Vec<String>>,
    /// Materials that mesh sections name.
    pub materials: Vec<Material>,
    /// Decoded textures that materials name.
    pub textures: Vec<Texture>,
    /// Nodes, parents before children.
    pub nodes: Vec<ModelNode>,
}

impl Model {
    /// Returns the greatest scale of each mesh among the nodes that show it: metres of the model to
    /// a unit of the mesh; 1 where none shows it.
    pub fn mesh_scales(&self) -> Vec<f32> {
        let mut scales: Vec<Option<f32>> = vec![None; self.meshes.len()];
        let mut model_from_node: Vec<Mat4> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let parent = node.parent.and_then(|parent| model_from_node.get(parent as usize));
            let transform = parent.map_or(node.parent_from_node, |of| *of * node.parent_from_node);
            model_from_node.push(transform);
            if let Some(known) = node.mesh.and_then(|mesh| scales.get_mut(mesh as usize)) {
                let scale = max_scale_factor(&transform);
                *known = Some(known.map_or(scale, |known| known.max(scale)));
            }
        }
        scales.into_iter().map(|scale| scale.unwrap_or(1.0)).collect()
    }
}

/// One node of a model file.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelNode {
    /// Name as equipment part, unique within the model.
    pub name: String,
    /// Parent, an earlier node; `None` for a root.
    pub parent: Option<u32>,
    /// Transform from this node's space to its parent's.
    pub parent_from_node: Mat4,
    /// Mesh shown at this node.
    pub mesh: Option<u32>,
}

/// Metallic-roughness material (glTF 2.0, section 3.9).
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the file.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// Base-colour texture, sRGB encoded.
    pub base_color_texture: Option<TextureRef>,
    /// 0 dielectric (porcelain, paint) to 1 metal.
    pub metallic: f32,
    /// 0 mirror to 1 matt.
    pub roughness: f32,
    /// Roughness in green, metallic in blue; linear.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// Emitted colour in linear rgb.
    pub emissive: [f32; 3],
    /// Back faces: whether they are drawn.
    pub double_sided: bool,
    /// Use of the alpha channel.
    pub alpha: AlphaMode,
}

/// Alpha mode of a material (glTF 2.0, section 3.9.4).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Ignores the alpha channel.
    #[default]
    Opaque,
    /// Drawn where alpha is at least the cutoff.
    Mask(f32),
    /// Blends the surface over the background.
    Blend,
}

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TextureRef {
    /// Texture index into [`Model::textures`].
    pub texture: u32,
    /// Repeat rule along u and v.
    pub wrap: [Wrap; 2],
}

/// Wrap mode of texture coordinates outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Repeats the texture in tiles.
    #[default]
    Repeat,
    /// Clamps to the edge's colour.
    Clamp,
    /// Tiles, every other one mirrored.
    Mirror,
}

/// Decoded image of a texture.
#[derive(Clone, PartialEq, Eq)]
pub struct Texture {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// Rows from the top, four bytes a pixel (RGBA), not premultiplied.
    pub rgba8: Vec<u8>,
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Texture({}x{})", self.width, self.height)
    }
}

impl Default for Material {
    /// Returns the glTF default material, but matt and not metallic: a bare mesh is then readable
    /// without an environment to mirror.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [0.8, 0.8, 0.8, 1.0],
            base_color_texture: None,
            metallic: 0.0,
            roughness: 0.8,
            metallic_roughness_texture: None,
            emissive: [0.0; 3],
            double_sided: false,
            alpha: AlphaMode::Opaque,
        }
    }
}

impl Model {
    /// Returns the names of a mesh's features; none for a mesh without named features.
    pub fn feature_names(&self, mesh: usize) -> &[String] {
        self.features.get(mesh).map_or(&[], Vec::as_slice)
    }

    /// Returns the transforms from each node's space to the model's.
    pub fn model_from_nodes(&self) -> Vec<Mat4> {
        let mut transforms: Vec<Mat4> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let parent = node.parent.map_or(Mat4::IDENTITY, |p| transforms[p as usize]);
            transforms.push(parent * node.parent_from_node);
        }
        transforms
    }
}
