//! Helpers of the renderer's tests. Every test runs with the validation layer on, and a message is
//! a failure, also at destruction.

#![allow(dead_code, reason = "each test file uses a part")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::sync::Arc;

use busbar_geometry::{Collapse, CollapseSequence, CollapseStacks, Mesh, RawPrimitive, weld};
use busbar_renderer::{
    CameraView, DrawInstance, Frame, ModelHandle, ModelUpload, Picture, Quality, Renderer,
    RendererOptions,
};
use busbar_scene::{AlphaMode, Material, Texture};
use glam::{Mat4, Vec2, Vec3};

/// Small, since the tests draw in software.
pub(crate) const SIZE: [u32; 2] = [96, 64];

/// Linear background that no test object has.
pub(crate) const BACKGROUND: [f32; 3] = [0.0, 0.0, 1.0];

/// Runs a test on a renderer and asserts that the layer stayed silent.
pub(crate) fn with_renderer(samples: u32, test: impl FnOnce(&mut Renderer)) {
    with_quality(Quality::Medium, samples, test);
}

/// The same at every quality.
pub(crate) fn with_each_quality(samples: u32, test: impl Fn(&mut Renderer)) {
    for quality in [Quality::Low, Quality::Medium, Quality::High] {
        with_quality(quality, samples, &test);
    }
}

pub(crate) fn with_quality(quality: Quality, samples: u32, test: impl FnOnce(&mut Renderer)) {
    let options = RendererOptions { quality, samples, validation: true, ..Default::default() };
    let mut renderer = Renderer::headless(options, SIZE).unwrap();
    let log = renderer.validation_log();
    test(&mut renderer);
    drop(renderer);
    assert_eq!(log.messages(), Vec::<String>::new());
}

/// Reports whether a graphics card draws. A card draws hidden geometry as well, and batches
/// nothing.
pub(crate) fn draws_on_card() -> bool {
    let options = RendererOptions { validation: true, ..RendererOptions::default() };
    !Renderer::headless(options, SIZE).unwrap().uses_software_rasterizer()
}

/// Emits its colour and reflects next to nothing, so that pixels are known.
pub(crate) fn glowing(rgb: [f32; 3]) -> Material {
    Material {
        base_color: [0.0, 0.0, 0.0, 1.0],
        emissive: rgb,
        metallic: 1.0,
        roughness: 1.0,
        ..Material::default()
    }
}

/// An `n` by `n` grid of quads over -1..1 in x and y, facing +z.
pub(crate) fn grid(n: u32, material: Option<u32>) -> Mesh {
    let step = |i: u32| i as f32 / n as f32;
    let at = |x: u32, y: u32| Vec3::new(step(x) * 2.0 - 1.0, step(y) * 2.0 - 1.0, 0.0);
    let points = || (0..=n).flat_map(move |y| (0..=n).map(move |x| (x, y)));
    let triangles = (0..n)
        .flat_map(|y| (0..n).map(move |x| y * (n + 1) + x))
        .flat_map(|i| [[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]])
        .collect();
    let primitive = RawPrimitive {
        positions: points().map(|(x, y)| at(x, y)).collect(),
        normals: vec![Vec3::Z; ((n + 1) * (n + 1)) as usize],
        uvs: points().map(|(x, y)| Vec2::new(step(x), 1.0 - step(y))).collect(),
        triangles,
        material,
        ..Default::default()
    };
    weld(&[primitive]).unwrap().0
}

/// Collapses position after position onto the one before it.
pub(crate) fn stacks(mesh: Mesh) -> Arc<CollapseStacks> {
    let count = mesh.positions.len() as u32;
    let entries = (1..count)
        .rev()
        .map(|removed| Collapse { removed, kept: removed - 1, error: 0.0 })
        .collect();
    let sequence = CollapseSequence::new(entries, count).unwrap();
    Arc::new(CollapseStacks::build(mesh, &sequence))
}

/// A model of one quad with this material.
pub(crate) fn quad(renderer: &mut Renderer, material: Material) -> ModelHandle {
    upload(renderer, grid(1, Some(0)), &[material], &[])
}

pub(crate) fn upload(
    renderer: &mut Renderer,
    mesh: Mesh,
    materials: &[Material],
    textures: &[Texture],
) -> ModelHandle {
    let stacks = [stacks(mesh)];
    renderer.upload_model(ModelUpload { stacks: &stacks, materials, textures }).unwrap()
}

pub(crate) fn instance(model: ModelHandle, world_from_mesh: Mat4, object: u32) -> DrawInstance {
    DrawInstance {
        model,
        mesh: 0,
        cursor: 0,
        morph: None,
        world_from_mesh,
        object,
        highlight: [0.0; 4],
        first_feature: None,
    }
}

/// Four units before the origin, looking at it.
pub(crate) fn camera() -> CameraView {
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    CameraView::look_at(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 0.9, aspect, 0.1)
}

pub(crate) fn frame(instances: &[DrawInstance]) -> Frame<'_> {
    Frame { background: BACKGROUND, ..Frame::new(camera(), instances) }
}

pub(crate) fn picture(renderer: &mut Renderer, frame: &Frame<'_>) -> Picture {
    renderer.draw(frame).unwrap();
    renderer.read_picture().unwrap()
}

pub(crate) fn pixel(picture: &Picture, x: u32, y: u32) -> [u8; 4] {
    let start = ((y * picture.width + x) * 4) as usize;
    picture.rgba8[start..start + 4].try_into().unwrap()
}

pub(crate) fn center(picture: &Picture) -> [u8; 4] {
    pixel(picture, picture.width / 2, picture.height / 2)
}

/// Equal but for rounding and what a matt metal reflects: nothing, if black.
pub(crate) fn assert_near(actual: [u8; 4], expected: [u8; 4], tolerance: u8) {
    let near = actual.iter().zip(expected).all(|(&a, e)| a.abs_diff(e) <= tolerance);
    assert!(near, "{actual:?} is not {expected:?}");
}

/// The sRGB byte of a linear value (IEC 61966-2-1).
pub(crate) fn srgb_byte(linear: f32) -> u8 {
    let encoded =
        if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

pub(crate) fn blended(rgb: [f32; 3], alpha: f32) -> Material {
    let mut material = glowing(rgb);
    material.base_color[3] = alpha;
    material.alpha = AlphaMode::Blend;
    material
}

/// A small deterministic generator (Knuth's MMIX constants).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, limit: u32) -> u32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % u64::from(limit)) as u32
    }
}
