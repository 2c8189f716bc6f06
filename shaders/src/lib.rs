//! WGSL shaders, compiled to SPIR-V at build time, and the structs they read.
//!
//! Invariant: a struct whose memory layout differs from the shader's does not
//! compile.

use bytemuck::{Pod, Zeroable};

include!(concat!(env!("OUT_DIR"), "/words.rs"));
include!(concat!(env!("OUT_DIR"), "/layouts.rs"));

/// One vertex, as the passes take it at locations 0, 1 and 2.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Mesh space, metres.
    pub position: [f32; 3],
    /// Unit normal, mesh space.
    pub normal: [f32; 3],
    /// Texture coordinate, v down.
    pub uv: [f32; 2],
}

/// What is the same for a whole frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameUniform {
    /// Column-major; Vulkan clip space with reverse-Z.
    pub clip_from_world: [[f32; 4]; 4],
    /// World space, metres; the fourth is unused.
    pub eye: [f32; 4],
}

/// One drawn instance.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// Column-major.
    pub world_from_mesh: [[f32; 4]; 4],
    /// Linear rgb and strength; of what belongs to no feature.
    pub highlight: [f32; 4],
    /// Non-zero id for picking; of what belongs to no feature.
    pub object: u32,
    /// -1 where the transform mirrors, else 1.
    pub handedness: f32,
    /// Id of the mesh's feature 0; 0 where the mesh is drawn as one piece.
    pub first_feature_object: u32,
    /// Index of the highlight of the mesh's feature 0.
    pub first_feature_highlight: u32,
}

/// One material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MaterialUniform {
    /// Linear rgb and alpha.
    pub base_color: [f32; 4],
    /// Linear rgb; the fourth is unused.
    pub emissive: [f32; 4],
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// 0 mirror to 1 matt.
    pub roughness: f32,
    /// Fragments with less alpha are left out.
    pub alpha_cutoff: f32,
    /// 1 where alpha counts, 0 where it is ignored.
    pub alpha_used: f32,
}

#[cfg(test)]
mod tests {
    /// First word of every SPIR-V module (SPIR-V specification, section 2.3).
    const MAGIC: u32 = 0x0723_0203;

    #[test]
    fn every_pass_is_spirv_with_its_entry_points() {
        let check = |words: &[u32], entries: &[&str]| {
            assert_eq!(words[0], MAGIC);
            let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
            for entry in entries {
                let name = [entry.as_bytes(), &[0]].concat();
                assert!(bytes.windows(name.len()).any(|w| w == name), "{entry}");
            }
        };
        check(super::SCENE, &["vertex_main", "fragment_main"]);
        check(super::WIREFRAME, &["fill_vertex", "line_vertex", "fill_fragment", "line_fragment"]);
        check(super::PICK, &["vertex_main", "fragment_main"]);
    }
}
