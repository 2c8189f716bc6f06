//! Parts under construction with counted positions, by which touching shells are detected.

use demo_model::shapes::{cuboid, ring_of_profile};
use demo_model::{Finish, Part, Solid};
use glam::{Mat4, Quat, Vec3};

/// Number of finishes that one shell may have.
const MAX_TONES: usize = 2;

/// Part under construction, with the number of its shells' positions.
#[derive(Clone, Debug, Default)]
pub(crate) struct Body {
    pub(crate) part: Part,
    pub(crate) positions: usize,
}

impl Body {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    pub(crate) fn add(&mut self, finish: Finish, solid: Solid) -> &mut Self {
        self.positions += solid.points.len();
        self.part.add(finish, solid);
        self
    }

    /// Adds one shell with two finishes: `second` where `is_second` holds for
    /// a triangle's middle.
    pub(crate) fn add_two_tone(
        &mut self,
        [first, second]: [Finish; MAX_TONES],
        solid: &Solid,
        is_second: impl Fn(Vec3) -> bool,
    ) -> &mut Self {
        self.positions += solid.points.len();
        for (finish, wanted) in [(first, false), (second, true)] {
            self.part.add(finish, cut_out(solid, |middle| is_second(middle) == wanted));
        }
        self
    }

    pub(crate) fn add_body(&mut self, body: Body, transform: Mat4) -> &mut Self {
        self.positions += body.positions;
        self.part.add_part(body.part, transform);
        self
    }

    /// Adds a box of `size` about `middle`.
    pub(crate) fn cuboid(&mut self, finish: Finish, size: [f32; 3], middle: [f32; 3]) -> &mut Self {
        let [x, y, z] = middle;
        self.add(finish, cuboid(Vec3::from(size)).moved(x, y, z))
    }
}

fn cut_out(solid: &Solid, wanted: impl Fn(Vec3) -> bool) -> Solid {
    let mut renumbered = vec![None; solid.points.len()];
    let mut cut = Solid::default();
    for &corners in &solid.triangles {
        let middle = corners.iter().map(|&c| solid.points[c as usize]).sum::<Vec3>() / 3.0;
        if !wanted(middle) {
            continue;
        }
        let triangle = corners.map(|corner| {
            *renumbered[corner as usize].get_or_insert_with(|| {
                cut.points.push(solid.points[corner as usize]);
                cut.points.len() as u32 - 1
            })
        });
        cut.triangles.push(triangle);
    }
    cut
}

/// Builds an open grid of `[across, along]` cells, facing up, at height `y`.
pub(crate) fn sheet(min: [f32; 2], max: [f32; 2], y: f32, cells: [u32; 2]) -> Solid {
    let mut solid = Solid::default();
    for j in 0..=cells[1] {
        for i in 0..=cells[0] {
            let share = |k: u32, n: u32| k as f32 / n as f32;
            let x = min[0] + (max[0] - min[0]) * share(i, cells[0]);
            let z = min[1] + (max[1] - min[1]) * share(j, cells[1]);
            solid.points.push(Vec3::new(x, y, z));
        }
    }
    let point = |i: u32, j: u32| j * (cells[0] + 1) + i;
    for j in 0..cells[1] {
        for i in 0..cells[0] {
            let (a, b) = (point(i, j), point(i + 1, j));
            let (c, d) = (point(i + 1, j + 1), point(i, j + 1));
            solid.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    solid
}

/// Builds a hollow tube that stands from `bottom` to `top`.
pub(crate) fn tube(inner: f32, outer: f32, bottom: f32, top: f32, sides: usize) -> Solid {
    ring_of_profile(&[(inner, bottom), (outer, bottom), (outer, top), (inner, top)], sides)
}

/// Returns a rotation about an axis of unit length, the same on every machine.
pub(crate) fn turned(axis: Vec3, degrees: f32) -> Mat4 {
    let half = f64::from(degrees).to_radians() * 0.5;
    let (sin, cos) = (libm::sin(half) as f32, libm::cos(half) as f32);
    Mat4::from_quat(Quat::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos))
}

/// Returns the rotation of the y axis onto the x axis.
pub(crate) fn along_x() -> Mat4 {
    turned(Vec3::Z, -90.0)
}

/// Returns the rotation of the y axis onto the z axis.
pub(crate) fn along_z() -> Mat4 {
    turned(Vec3::X, 90.0)
}
