//! A small piece of switchyard for the examples: tank, insulators, conductors.

use std::f32::consts::TAU;
use std::sync::Arc;

use anyhow::Result;
use busbar_geometry::{CollapseSequence, CollapseStacks, RawPrimitive, weld};
use busbar_renderer::{DrawInstance, ModelUpload, Renderer};
use busbar_scene::{AlphaMode, Material};
use glam::{Mat4, Vec2, Vec3};

/// Segments around an axis.
const SEGMENTS: u32 = 48;

/// Sheds of one insulator.
const SHEDS: u32 = 9;

/// Uploads the yard and places it.
pub(crate) fn build(renderer: &mut Renderer) -> Result<Vec<DrawInstance>> {
    let meshes = [
        lathe(&insulator_profile(), PORCELAIN),
        boxed(Vec3::new(1.6, 1.1, 0.9), PAINT),
        lathe(&rod(0.035, 1.0), METAL),
        boxed(Vec3::new(3.2, 0.06, 2.4), CONCRETE),
        lathe(&rod(0.16, 0.7), GLASS),
        boxed(Vec3::new(0.05, 0.9, 0.75), PAINT),
    ];
    let stacks: Vec<_> = meshes.into_iter().map(fixed).collect::<Result<_>>()?;
    let model = renderer.upload_model(ModelUpload {
        stacks: &stacks,
        materials: &materials(),
        textures: &[],
    })?;
    let mut placed = Vec::new();
    let mut place = |mesh: u32, world_from_mesh: Mat4, highlight: [f32; 4]| {
        let object = placed.len() as u32 + 1;
        placed.push(DrawInstance {
            model,
            mesh,
            cursor: 0,
            morph: None,
            world_from_mesh,
            object,
            highlight,
            first_feature: None,
        });
    };
    let at = |x: f32, y: f32, z: f32| Mat4::from_translation(Vec3::new(x, y, z));
    let plain = [0.0; 4];
    place(3, at(0.0, -0.06, 0.0), plain);
    place(1, at(0.0, 1.1, 0.0), plain);
    for (phase, x) in [-0.9_f32, 0.0, 0.9].into_iter().enumerate() {
        let alarm = if phase == 2 { [0.85, 0.05, 0.03, 0.75] } else { plain };
        place(0, at(x, 2.2, 0.0), alarm);
        place(2, at(x, 3.5, 0.0), plain);
    }
    for i in 0..9 {
        place(5, at(-1.4 + i as f32 * 0.35, 1.1, 1.25), plain);
    }
    place(4, at(-2.4, 0.0, 1.2), plain);
    place(2, at(-2.4, 0.0, 1.2), plain);
    place(0, at(2.5, 0.0, 1.3), [0.1, 0.35, 0.9, 0.35]);
    Ok(placed)
}

const PORCELAIN: u32 = 0;
const PAINT: u32 = 1;
const METAL: u32 = 2;
const CONCRETE: u32 = 3;
const GLASS: u32 = 4;

fn materials() -> Vec<Material> {
    let of = |color: [f32; 3], metallic, roughness| {
        let [r, g, b] = color;
        Material { base_color: [r, g, b, 1.0], metallic, roughness, ..Material::default() }
    };
    vec![
        of([0.36, 0.13, 0.07], 0.0, 0.25),
        of([0.42, 0.46, 0.45], 0.0, 0.6),
        of([0.75, 0.76, 0.78], 1.0, 0.35),
        of([0.55, 0.54, 0.52], 0.0, 0.95),
        Material {
            alpha: AlphaMode::Blend,
            base_color: [0.6, 0.75, 0.8, 0.35],
            double_sided: true,
            ..of([0.6, 0.75, 0.8], 0.0, 0.1)
        },
    ]
}

fn fixed(primitive: RawPrimitive) -> Result<Arc<CollapseStacks>> {
    let (mesh, _) = weld(&[primitive])?;
    let sequence = CollapseSequence::new(Vec::new(), mesh.positions.len() as u32)?;
    Ok(Arc::new(CollapseStacks::build(mesh, &sequence)))
}

/// Radius and height along an insulator, bottom to top.
fn insulator_profile() -> Vec<Vec2> {
    let mut profile = vec![Vec2::new(0.0, 0.0), Vec2::new(0.16, 0.0), Vec2::new(0.16, 0.1)];
    for shed in 0..SHEDS {
        let foot = 0.14 + shed as f32 * 0.13;
        profile.push(Vec2::new(0.09, foot));
        profile.push(Vec2::new(0.21, foot + 0.02));
        profile.push(Vec2::new(0.215, foot + 0.035));
        profile.push(Vec2::new(0.10, foot + 0.09));
    }
    profile.extend([Vec2::new(0.09, 1.3), Vec2::new(0.0, 1.3)]);
    profile
}

fn rod(radius: f32, height: f32) -> Vec<Vec2> {
    vec![Vec2::ZERO, Vec2::new(radius, 0.0), Vec2::new(radius, height), Vec2::new(0.0, height)]
}

/// Turns a profile of radius and height about the y axis; each stretch of the
/// profile is smooth around and sharp towards the next.
fn lathe(profile: &[Vec2], material: u32) -> RawPrimitive {
    let mut lathe = RawPrimitive { material: Some(material), ..Default::default() };
    for stretch in profile.windows(2) {
        let along = stretch[1] - stretch[0];
        let first = lathe.positions.len() as u32;
        for segment in 0..=SEGMENTS {
            let angle = segment as f32 / SEGMENTS as f32 * TAU;
            let (sin, cos) = angle.sin_cos();
            for point in stretch {
                lathe.positions.push(Vec3::new(point.x * cos, point.y, -point.x * sin));
                let outward = Vec2::new(along.y, -along.x).normalize_or_zero();
                lathe.normals.push(Vec3::new(outward.x * cos, outward.y, -outward.x * sin));
                lathe.uvs.push(Vec2::new(segment as f32 / SEGMENTS as f32, point.y));
            }
        }
        for segment in 0..SEGMENTS {
            let i = first + segment * 2;
            lathe.triangles.extend([[i, i + 2, i + 1], [i + 1, i + 2, i + 3]]);
        }
    }
    lathe
}

/// A box of this size, its middle at the origin.
fn boxed(size: Vec3, material: u32) -> RawPrimitive {
    let mut boxed = RawPrimitive { material: Some(material), ..Default::default() };
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for normal in [axis, -axis] {
            let right = Vec3::new(normal.z, normal.x, normal.y);
            let up = normal.cross(right);
            let first = boxed.positions.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                boxed.positions.push((normal + right * x + up * y) * size);
                boxed.normals.push(normal);
                boxed.uvs.push(Vec2::new(x, y));
            }
            boxed.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
        }
    }
    boxed
}
