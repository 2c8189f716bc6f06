//! Exported files, read back by the `gltf` crate, which validates as it reads.

#![allow(clippy::unwrap_used)]

use busbar_geometry::{Mesh, RawPrimitive, Section, weld};
use busbar_gltf_export::{ExportError, write_glb};
use busbar_scene::{AlphaMode, Material, Model, ModelNode, Texture, TextureRef, Wrap};
use glam::{DMat4, DVec3, Vec2, Vec3};

/// An n x n grid of quads in the plane z = 0.
fn grid(n: u32, material: Option<u32>, uvs: bool) -> RawPrimitive {
    let points = (0..=n).flat_map(|y| (0..=n).map(move |x| Vec3::new(x as f32, y as f32, 0.0)));
    let positions: Vec<Vec3> = points.collect();
    let quads = (0..n).flat_map(|y| (0..n).map(move |x| y * (n + 1) + x));
    RawPrimitive {
        normals: vec![Vec3::Z; positions.len()],
        uvs: if uvs { positions.iter().map(|p| p.truncate() / 8.0).collect() } else { vec![] },
        triangles: quads.flat_map(|i| [[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]]).collect(),
        positions,
        material,
        ..Default::default()
    }
}

fn node(name: &str, parent: Option<u32>, mesh: Option<u32>) -> ModelNode {
    let parent_from_node = DMat4::from_translation(DVec3::new(0.1, 0.0, 0.0));
    ModelNode { name: name.into(), parent, parent_from_node, mesh }
}

fn model() -> Model {
    let texture = TextureRef { texture: 1, wrap: [Wrap::Clamp, Wrap::Mirror] };
    let painted = Material {
        name: "paint".into(),
        base_color_texture: Some(texture),
        metallic_roughness_texture: Some(TextureRef { wrap: [Wrap::Repeat; 2], ..texture }),
        alpha: AlphaMode::Mask(0.25),
        double_sided: true,
        ..Default::default()
    };
    let unused = Texture { width: 1, height: 1, rgba8: vec![9; 4] };
    let checker = Texture { width: 2, height: 1, rgba8: vec![0, 1, 2, 255, 10, 20, 30, 128] };
    Model {
        meshes: vec![weld(&[grid(3, Some(1), true), grid(1, None, false)]).unwrap().0],
        materials: vec![Material::default(), painted],
        textures: vec![unused, checker],
        nodes: vec![node("tank", None, None), node("bushing 1U", Some(0), Some(0))],
        ..Default::default()
    }
}

fn read(glb: &[u8]) -> gltf::Gltf {
    gltf::Gltf::from_slice(glb).unwrap()
}

type Vertices = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<u32>);

fn vertices(file: &gltf::Gltf, primitive: &gltf::Primitive<'_>) -> Vertices {
    let reader = primitive.reader(|_| file.blob.as_deref());
    let positions: Vec<_> = reader.read_positions().unwrap().collect();
    let bounds = primitive.bounding_box();
    for axis in 0..3 {
        let values = || positions.iter().map(|p| p[axis]);
        assert_eq!(bounds.min[axis], values().fold(f32::MAX, f32::min));
        assert_eq!(bounds.max[axis], values().fold(f32::MIN, f32::max));
    }
    let normals = reader.read_normals().unwrap().collect();
    (positions, normals, reader.read_indices().unwrap().into_u32().collect())
}

#[test]
fn geometry_reads_back_as_it_was() {
    let model = model();
    let file = read(&write_glb(&model).unwrap());
    let mesh = file.meshes().next().unwrap();
    for (primitive, section) in mesh.primitives().zip(&model.meshes[0].sections) {
        let (positions, normals, indices) = vertices(&file, &primitive);
        let first = section.first_triangle as usize;
        let source = &model.meshes[0];
        let corners = source.triangles[first..][..section.triangle_count as usize].as_flattened();
        assert_eq!(corners.len(), indices.len());
        for (&wedge, index) in corners.iter().zip(indices) {
            let position = source.positions[source.wedges.position[wedge as usize] as usize];
            assert_eq!(position.to_array(), positions[index as usize]);
            assert_eq!(source.wedges.normal[wedge as usize].to_array(), normals[index as usize]);
        }
        assert_eq!(primitive.material().index(), section.material.map(|m| m as usize));
    }
    let uvs = |i: usize| mesh.primitives().nth(i).unwrap().get(&gltf::Semantic::TexCoords(0));
    assert!(uvs(0).is_some(), "non-zero UVs are written");
    assert!(uvs(1).is_none(), "zero UVs are not");
}

#[test]
fn nodes_materials_and_textures_read_back() {
    let model = model();
    let file = read(&write_glb(&model).unwrap());
    let root = file.default_scene().unwrap().nodes().next().unwrap();
    assert_eq!(root.name(), Some("tank"));
    let child = root.children().next().unwrap();
    assert_eq!((child.name(), child.mesh().unwrap().index()), (Some("bushing 1U"), 0));
    assert_eq!(
        child.transform().matrix(),
        model.nodes[1].parent_from_node.as_mat4().to_cols_array_2d()
    );

    let paint = file.materials().nth(1).unwrap();
    assert_eq!(paint.alpha_cutoff(), Some(0.25));
    assert!(paint.double_sided());
    let texture = paint.pbr_metallic_roughness().base_color_texture().unwrap().texture();
    let sampler = texture.sampler();
    assert_eq!(sampler.wrap_s(), gltf::texture::WrappingMode::ClampToEdge);
    assert_eq!(sampler.wrap_t(), gltf::texture::WrappingMode::MirroredRepeat);
    assert_eq!(file.images().len(), 1, "one image, shared; the unused one is left out");
    let gltf::image::Source::View { view, mime_type } = texture.source().source() else {
        panic!("the image is embedded");
    };
    assert_eq!(mime_type, "image/png");
    let png = &file.blob.as_deref().unwrap()[view.offset()..][..view.length()];
    let pixels = image::load_from_memory(png).unwrap().into_rgba8();
    assert_eq!(pixels.into_raw(), model.textures[1].rgba8);
}

#[test]
fn the_same_model_gives_the_same_bytes() {
    assert_eq!(write_glb(&model()).unwrap(), write_glb(&model()).unwrap());
}

#[test]
fn unreferenced_wedges_are_dropped() {
    let mut model = model();
    let whole = write_glb(&model).unwrap().len();
    model.meshes[0].triangles.truncate(2);
    model.meshes[0].sections.truncate(1);
    model.meshes[0].sections[0].triangle_count = 2;
    let glb = write_glb(&model).unwrap();
    assert!(glb.len() < whole);
    let file = read(&glb);
    let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
    assert_eq!(vertices(&file, &primitive).0.len(), 4);
}

#[test]
fn many_vertices_take_wide_indices_and_few_take_narrow_ones() {
    for (n, expected) in [(3, gltf::accessor::DataType::U16), (256, gltf::accessor::DataType::U32)]
    {
        let mut model = model();
        model.meshes = vec![weld(&[grid(n, None, true)]).unwrap().0];
        let file = read(&write_glb(&model).unwrap());
        let primitive = file.meshes().next().unwrap().primitives().next().unwrap();
        assert_eq!(primitive.indices().unwrap().data_type(), expected);
        let (positions, _, indices) = vertices(&file, &primitive);
        assert_eq!(indices.iter().max().copied(), Some(positions.len() as u32 - 1));
    }
}

#[test]
fn empty_sections_meshes_and_models_are_still_files() {
    let mut model = model();
    let end = model.meshes[0].triangles.len() as u32;
    let empty = Section { material: None, first_triangle: end, triangle_count: 0 };
    model.meshes[0].sections.push(empty);
    model.meshes.insert(0, Mesh::default());
    model.nodes[0].mesh = Some(0);
    model.nodes[1].mesh = Some(1);
    let file = read(&write_glb(&model).unwrap());
    assert_eq!(file.meshes().map(|m| m.primitives().len()).collect::<Vec<_>>(), [2]);
    let meshes: Vec<_> = file.nodes().map(|n| n.mesh().map(|m| m.index())).collect();
    assert_eq!(meshes, [None, Some(0)]);

    assert_eq!(read(&write_glb(&Model::default()).unwrap()).nodes().len(), 0);
}

#[test]
fn contradictions_are_named() {
    let check = |spoil: fn(&mut Model), expected: &str| {
        let mut model = model();
        spoil(&mut model);
        let message = write_glb(&model).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    };
    check(|m| m.meshes[0].triangles[1][2] = 99, "mesh 0 names wedge 99, but there are 20");
    check(|m| m.meshes[0].sections[0].triangle_count = 99, "mesh 0 names triangle 98");
    check(|m| m.meshes[0].sections[0].material = Some(7), "mesh 0 names material 7");
    check(|m| m.meshes[0].wedges.position[0] = 70, "mesh 0 names position 70");
    check(|m| m.meshes[0].positions[3].y = f32::NAN, "a position of mesh 0 is not finite");
    check(|m| m.meshes[0].wedges.uv[1] = Vec2::INFINITY, "a UV of mesh 0 is not finite");
    check(|m| m.materials[0].metallic = f32::NAN, "a factor of material 0 is not finite");
    check(|m| m.nodes[1].mesh = Some(1), "node 1 names mesh 1, but there are 1");
    check(|m| m.nodes[0].parent = Some(0), "node 0 has parent 0");
    check(|m| m.textures[1].height = 3, "texture 1 is 2 x 3, but holds 8 bytes");
    let mut short = model();
    short.meshes[0].wedges.uv.pop();
    assert!(matches!(write_glb(&short), Err(ExportError::WedgeArrays { mesh: 0 })));
}
