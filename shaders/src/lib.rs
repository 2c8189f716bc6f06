//! WGSL shaders, compiled to SPIR-V at build time, and the structs they read.
//!
//! Invariant: a struct whose memory layout differs from the shader's does not
//! compile, nor do attributes that differ from the shader's.

use bytemuck::{Pod, Zeroable};

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
include!(concat!(env!("OUT_DIR"), "/layouts.rs"));

/// One vertex, as the passes take it at locations 0 and 1: whole vectors are
/// fetched faster than parts of them.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Mesh space, metres; then u of the texture coordinate. At low quality a vertex of a plain
    /// material has a [`vertex_color`] in place of that.
    pub position_u: [f32; 4],
    /// Unit normal, mesh space, or that of a slender part, of length [`SLENDER`] plus its radius;
    /// then v of the texture coordinate, down.
    pub normal_v: [f32; 4],
}

/// Length that marks normals of slender islands, metres in mesh space. Such a normal is longer by
/// the radius, and its vertex is drawn at least a pixel wide (`shaders/common/frame.wgsl`).
pub const SLENDER: f32 = 2.0;

/// Encodes a colour, each of red, green and blue from 0 to 1, in place of u and v: red and green to
/// 14 bits, then blue. Neither number is NaN or subnormal.
pub fn vertex_color([red, green, blue]: [f32; 3]) -> [f32; 2] {
    const BITS: u32 = 14;
    const FULL: f32 = ((1 << BITS) - 1) as f32;
    /// Exponent bit that makes the number normal: neither NaN nor subnormal.
    const NORMAL: u32 = 1 << 29;
    let [red, green] = [red, green].map(|part| (part.clamp(0.0, 1.0) * FULL).round() as u32);
    [f32::from_bits(NORMAL | red << BITS | green), blue]
}

/// Uniform data shared by all draws of a frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FrameUniform {
    /// Column-major; Vulkan clip space with reverse-Z.
    pub clip_from_world: [[f32; 4]; 4],
    /// From the eye through the upper left corner of the picture, world space,
    /// of any length; the fourth is unused.
    pub ray_corner: [f32; 4],
    /// Change of the ray from a pixel to the next one on the right.
    pub ray_right: [f32; 4],
    /// Change of the ray from a pixel to the next one below.
    pub ray_down: [f32; 4],
    /// Linear rgb of the background; one over the squared distance in metres at which fog hides
    /// half of a surface, 0 without fog.
    pub fog: [f32; 4],
    /// The point of the ground below the eye; how far it reaches from there, metres.
    pub ground: [f32; 4],
    /// Ground point within its cell of ten metres along x and z; the others are unused.
    pub ground_phase: [f32; 4],
    /// Plane of the ground: its product with a pixel's (x, y, depth, 1) is zero on the ground; all
    /// zero without ground.
    pub ground_plane: [f32; 4],
    /// Section plane by pixels, (x, y, depth, 1): positive before it, all zero without section.
    pub section_plane: [f32; 4],
    /// Transform from a pixel's (x, y, depth, 1) to camera space; divide by the fourth.
    pub camera_from_pixel: [[f32; 4]; 4],
    /// Transform from a pixel to the shadow map: 0 to 1 right and down, and its depth, reverse-Z.
    pub shadow_from_pixel: [[f32; 4]; 4],
    /// Transform from a world direction, in texels of the map, to a distance on the map.
    pub shadow_from_texels: [[f32; 4]; 4],
    /// Texels along a side of the shadow map; physical pixels a point; the picture's
    /// width and height, pixels.
    pub sizes: [f32; 4],
}

/// One drawn instance, as the passes take it at locations 2 to 6.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Instance {
    /// The first three rows of the transform from mesh to world space; the last
    /// is (0, 0, 0, 1).
    pub world_from_mesh: [[f32; 4]; 3],
    /// Linear rgb and strength, for vertices without a feature.
    pub highlight: [f32; 4],
    /// Non-zero id for picking, for vertices without a feature.
    pub object: u32,
    /// Id of the mesh's feature 0; 0 where the mesh is drawn as one piece.
    pub first_feature_object: u32,
    /// Index of the highlight of the mesh's feature 0; [`NONE`] where no
    /// feature has one.
    pub first_feature_highlight: u32,
    /// 1 where the transform mirrors, else 0.
    pub mirrored: u32,
}

/// Names no feature and no highlight.
pub const NONE: u32 = u32::MAX;

/// Four numbers that a shader reads at one location.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attribute {
    /// Location in the shader.
    pub location: u32,
    /// Integer type: whether they are whole numbers rather than floats.
    pub whole: bool,
    /// Bytes from the start of the struct.
    pub offset: u32,
}

const fn floats(location: u32, offset: usize) -> Attribute {
    Attribute { location, whole: false, offset: offset as u32 }
}

impl Vertex {
    /// Vertex attributes that shaders read.
    pub const ATTRIBUTES: [Attribute; 2] = [
        floats(0, std::mem::offset_of!(Self, position_u)),
        floats(1, std::mem::offset_of!(Self, normal_v)),
    ];
}

impl Instance {
    /// Instance attributes that shaders read.
    pub const ATTRIBUTES: [Attribute; 5] = [
        floats(2, 0),
        floats(3, 16),
        floats(4, 32),
        floats(5, std::mem::offset_of!(Self, highlight)),
        Attribute { location: 6, whole: true, offset: std::mem::offset_of!(Self, object) as u32 },
    ];
}

/// Uniform data of a material.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MaterialUniform {
    /// Linear rgb and alpha.
    pub base_color: [f32; 4],
    /// Linear rgb; then 1 where both sides are shown.
    pub emissive: [f32; 4],
    /// Base colour in sRGB encoding, less what a metal loses at low quality; the fourth is unused.
    pub encoded_color: [f32; 4],
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// 0 mirror to 1 matt.
    pub roughness: f32,
    /// Fragments with less alpha are left out.
    pub alpha_cutoff: f32,
    /// 1 where alpha counts, 0 where it is ignored.
    pub alpha_used: f32,
}

/// A line of [`POLYLINES`], at locations 1 to 3.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct StrokeInstance {
    /// World space, metres; its width in points.
    pub from_width: [f32; 4],
    /// World space, metres; the number of its pattern.
    pub to_pattern: [f32; 4],
    /// Colour as the target takes it; coverage in alpha.
    pub color: [f32; 4],
}

/// A face of [`POLYLINES`], at locations 1 to 4: corners around it, world space, with each
/// a part of its colour as the target takes it, and with the last how much it covers.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct FaceInstance {
    /// First corner; red component.
    pub a_red: [f32; 4],
    /// Second corner; green component.
    pub b_green: [f32; 4],
    /// Third corner; blue component.
    pub c_blue: [f32; 4],
    /// Fourth corner; coverage of the face.
    pub d_cover: [f32; 4],
}

/// Push constants of [`MORPH`]. A workgroup takes [`MORPH_GROUP`] vertices.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct MorphStep {
    /// Number of vertices to move.
    pub vertices: u32,
    /// Output position of the first one, vertices.
    pub start: u32,
    /// 0 leaves them where they are, 1 puts them where they are going.
    pub weight: f32,
}

/// Workgroup size of the morph shader.
pub const MORPH_GROUP: u32 = 64;

/// Push constants of [`DENSITY`]. A workgroup takes [`DENSITY_GROUP`] records.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct DensityStep {
    /// Number of records to count.
    pub records: u32,
    /// Number of values a record.
    pub axes: u32,
    /// Number of binned axes.
    pub binned_axes: u32,
    /// Number of pairs of binned axes.
    pub pairs: u32,
    /// Number of brushed axes.
    pub brushes: u32,
    /// 1 where matching any of them is enough.
    pub any: u32,
    /// Words of the mask before the first of these records.
    pub first_word: u32,
    /// Length of the gate of counted records, words; 0 where all are counted.
    pub record_filter_words: u32,
    /// Length of the gate of records that match brushes evaluated on the CPU, behind that one,
    /// words; 0 without such brushes.
    pub brush_filter_words: u32,
}

/// Push constants of [`DENSITY_RASTERIZE`]. An invocation takes a pair, column and bin (that of
/// missing values included), and a workgroup [`DENSITY_GROUP`] invocations.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct RasterizeStep {
    /// Number of pairs of axes.
    pub pairs: u32,
}

/// Columns of a density's picture from axis to axis, as the shader's `COLUMNS`.
pub const DENSITY_COLUMNS: u32 = 64;
/// Rows of a density's picture, as the shader's `ROWS`: a row a bin, and below those the lane of
/// records without a value.
pub const DENSITY_ROWS: u32 = 137;

/// The picture between two axes, an instance of [`DENSITY_PLANE`], at locations 1 to 5.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PlaneInstance {
    /// Foot of the first axis, world space in metres; height of axes.
    pub from_height: [f32; 4],
    /// Foot of the second; the number of the pair.
    pub to_pair: [f32; 4],
    /// Colour as the target takes it; greatest number of lines in a cell.
    pub color_peak: [f32; 4],
    /// Colour of brushed lines as the target takes it; greatest number of them in a cell.
    pub brushed_peak: [f32; 4],
    /// Number of pairs; 1 where lines may be brushed; unused.
    pub pairs: [f32; 4],
}

/// Workgroup size of the density shaders.
pub const DENSITY_GROUP: u32 = 64;
/// Bins of an axis, as the shader's `BINS`, without that of records without a value.
pub const DENSITY_BINS: u32 = 128;

/// Reports whether one of the attributes matches what the shader reads at a location.
const fn has(all: [&[Attribute]; 2], location: u32, whole: bool) -> bool {
    let (mut buffer, mut at) = (0, 0);
    while buffer < all.len() {
        if at == all[buffer].len() {
            (buffer, at) = (buffer + 1, 0);
            continue;
        }
        let a = all[buffer][at];
        if a.location == location && a.whole == whole {
            return true;
        }
        at += 1;
    }
    false
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
        check(super::GROUND, &["vertex_main", "fragment_main"]);
        check(super::LOW, &["plain_vertex_main", "plain_fragment_main", "fragment_main"]);
        check(super::WIREFRAME, &["fill_vertex", "line_vertex", "fill_fragment", "line_fragment"]);
        check(super::PICK, &["vertex_main", "fragment_main"]);
        for words in [super::SCENE_SHADOWED, super::SCENE_SECTION, super::SCENE_SHADOWED_SECTION] {
            check(words, &["plain_vertex_main", "plain_fragment_main", "feature_vertex_main"]);
        }
        check(super::SHADOW, &["vertex_main", "fragment_main", "plain_vertex_main"]);
        check(super::AMBIENT_OCCLUSION, &["screen_main", "ambient_occlusion_main", "apply_main"]);
        check(super::MASK, &["vertex_main", "fragment_main"]);
        check(super::OUTLINE, &["screen_main", "tile_main", "edge_main", "outline_main"]);
        check(super::PANELS, &["vertex_main", "fragment_main"]);
        check(super::MORPH, &["morph_main"]);
        check(super::DENSITY, &["count_main"]);
        check(super::DENSITY_RASTERIZE, &["rasterize_main"]);
        check(super::DENSITY_PLANE, &["plane_vertex", "plane_fragment"]);
        let polylines = ["stroke_vertex", "stroke_fragment", "face_vertex", "face_fragment"];
        check(super::POLYLINES, &polylines);
    }
}
