//! Vector arithmetic in double precision, the same on every machine.

use busbar_plugin_sdk::Mesh;

pub(crate) type Vector = [f64; 3];

pub(crate) fn point(mesh: &Mesh<'_>, vertex: u32) -> Vector {
    mesh.positions[vertex as usize].map(f64::from)
}

pub(crate) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}
