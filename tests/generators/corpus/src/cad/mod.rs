//! A dead-tank circuit breaker of one pole, as a CAD system tessellates it.
//!
//! Chord errors bound the triangles, nothing else: the tank is strips two
//! metres long and three centimetres wide, threads are hundreds of triangles
//! of millimetres. Bodies overlap where they touch, as in assemblies.

mod fasteners;
mod parts;
mod profile;
mod shape;
mod solids;

use busbar_geometry::RawPrimitive;
use busbar_scene::Material;
use glam::{Mat4, Vec3};

use crate::cad::shape::Shape;

/// Materials of the bodies: name, linear colour, metallic factor, roughness factor.
const FINISHES: [(&str, [f32; 3], f32, f32); 6] = [
    ("grey paint", [0.58, 0.60, 0.60], 0.0, 0.45),
    ("galvanised steel", [0.50, 0.52, 0.53], 0.8, 0.55),
    ("stainless steel", [0.62, 0.61, 0.58], 1.0, 0.35),
    ("brown porcelain", [0.16, 0.052, 0.025], 0.0, 0.18),
    ("aluminium", [0.78, 0.79, 0.80], 1.0, 0.35),
    ("dark paint", [0.12, 0.13, 0.14], 0.0, 0.5),
];

/// Index of a row of [`FINISHES`].
#[derive(Clone, Copy, Debug)]
enum Finish {
    Paint,
    Galvanised,
    Stainless,
    Porcelain,
    Aluminium,
    Dark,
}

/// Shapes of the assembly, one for each finish.
#[derive(Default)]
struct Assembly {
    shapes: [Shape; FINISHES.len()],
}

impl Assembly {
    fn add(&mut self, finish: Finish, shape: &Shape, place: Mat4) {
        self.shapes[finish as usize].add(shape, place);
    }

    fn add_all(&mut self, other: &Self, place: Mat4) {
        for (own, other) in self.shapes.iter_mut().zip(&other.shapes) {
            own.add(other, place);
        }
    }
}

/// Returns the transform that moves the origin to a point.
fn at(x: f32, y: f32, z: f32) -> Mat4 {
    Mat4::from_translation(Vec3::new(x, y, z))
}

/// Returns the rotation of the y axis onto the x axis.
fn along_x() -> Mat4 {
    Mat4::from_cols(
        Vec3::NEG_Y.extend(0.0),
        Vec3::X.extend(0.0),
        Vec3::Z.extend(0.0),
        Vec3::ZERO.extend(1.0),
    )
}

/// Returns the rotation of the y axis onto the z axis.
fn along_z() -> Mat4 {
    Mat4::from_cols(
        Vec3::X.extend(0.0),
        Vec3::Z.extend(0.0),
        Vec3::NEG_Y.extend(0.0),
        Vec3::ZERO.extend(1.0),
    )
}

/// Builds the breaker, with one primitive for each finish.
pub(crate) fn breaker() -> (Vec<RawPrimitive>, Vec<Material>) {
    let mut assembly = Assembly::default();
    parts::tank(&mut assembly);
    let bushing = parts::bushing();
    for (x, degrees) in [(-0.72, 14.0_f32), (0.72, -14.0)] {
        let (sine, cosine) = (libm::sinf(degrees.to_radians()), libm::cosf(degrees.to_radians()));
        let tilted = Mat4::from_cols(
            Vec3::new(cosine, sine, 0.0).extend(0.0),
            Vec3::new(-sine, cosine, 0.0).extend(0.0),
            Vec3::Z.extend(0.0),
            Vec3::new(x, parts::AXIS_HEIGHT, 0.0).extend(1.0),
        );
        assembly.add_all(&bushing, tilted);
    }
    parts::cabinet(&mut assembly);
    parts::mechanism(&mut assembly);
    parts::pipes(&mut assembly);
    parts::frame(&mut assembly);
    parts::cooler(&mut assembly);
    let primitives = (0..).zip(&assembly.shapes).map(|(finish, shape)| shape.primitive(finish));
    let materials = FINISHES.map(|(name, [r, g, b], metallic, roughness)| Material {
        name: name.to_owned(),
        base_color: [r, g, b, 1.0],
        metallic,
        roughness,
        ..Material::default()
    });
    (primitives.collect(), materials.to_vec())
}
