//! Solids of the breaker. Each stands on y = 0 about the y axis unless it says otherwise.

use glam::{Mat4, Vec2, Vec3};

use crate::cad::profile::{Profile, circle, turn};
use crate::cad::shape::{Shape, Vertex};

/// Round hole upright through a plate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hole {
    pub(crate) centre: Vec2,
    pub(crate) radius: f32,
    pub(crate) steps: usize,
}

impl Hole {
    fn outline(self) -> Vec<Vec2> {
        circle(self.centre, self.radius, self.steps)
    }

    fn wall(self, shape: &mut Shape, [from, to]: [f32; 2]) {
        let outline = self.outline();
        shape.net([self.steps, 1], |step, top| {
            let point = outline[step % self.steps];
            let round = turn(step, self.steps);
            let height = if top == 0 { from } else { to };
            let along = step as f32 / self.steps as f32 * std::f32::consts::TAU * self.radius;
            Vertex {
                position: Vec3::new(point.x, height, point.y),
                normal: Vec3::new(-round.x, 0.0, -round.y),
                uv: Vec2::new(along, height),
            }
        });
    }
}

/// Returns holes on a circle about the origin.
pub(crate) fn hole_circle(count: usize, on_radius: f32, radius: f32) -> Vec<Hole> {
    let hole = |i| Hole { centre: turn(i, count) * on_radius, radius, steps: 20 };
    (0..count).map(hole).collect()
}

/// Builds a plate with rounded corners and holes, its size in x and z.
pub(crate) fn drilled_plate(size: Vec2, corner: f32, thickness: f32, holes: &[Hole]) -> Shape {
    let (x, z, r) = (size.x * 0.5, size.y * 0.5, corner);
    let outline = Profile::from(x, r - z)
        .line(x, z - r)
        .arc([x - r, z], [x - r, z - r], true, 8)
        .line(r - x, z)
        .arc([-x, z - r], [r - x, z - r], true, 8)
        .line(-x, r - z)
        .arc([r - x, -z], [r - x, r - z], true, 8)
        .line(x - r, -z)
        .arc([x, r - z], [x - r, r - z], true, 8);
    extruded(&outline, thickness, holes)
}

/// Extrudes a closed profile in the plane of x and z upwards, with holes.
pub(crate) fn extruded(profile: &Profile, height: f32, holes: &[Hole]) -> Shape {
    let mut shape = profile.walls(0.0, height);
    let mut outlines = vec![profile.outline()];
    outlines.extend(holes.iter().map(|hole| hole.outline()));
    for (level, up) in [(0.0, false), (height, true)] {
        shape.plate(&outlines, level, up);
    }
    holes.iter().for_each(|hole| hole.wall(&mut shape, [0.0, height]));
    shape
}

/// Builds a ring with chamfered edges, drilled on a circle.
pub(crate) fn drilled_flange(
    [bore, rim]: [f32; 2],
    thickness: f32,
    segments: usize,
    holes: &[Hole],
) -> Shape {
    let chamfer = thickness * 0.08;
    let outside = Profile::from(rim - chamfer, 0.0)
        .line(rim, chamfer)
        .line(rim, thickness - chamfer)
        .line(rim - chamfer, thickness);
    let inside = Profile::from(bore, thickness).line(bore, 0.0);
    let mut shape = outside.revolved(segments);
    shape.add(&inside.revolved(segments), Mat4::IDENTITY);
    let mut outlines = vec![circle(Vec2::ZERO, rim - chamfer, segments)];
    outlines.push(circle(Vec2::ZERO, bore, segments));
    outlines.extend(holes.iter().map(|hole| hole.outline()));
    for (level, up) in [(0.0, false), (thickness, true)] {
        shape.plate(&outlines, level, up);
    }
    holes.iter().for_each(|hole| hole.wall(&mut shape, [0.0, thickness]));
    shape
}

/// Builds a box about the origin with rounded edges and corners.
pub(crate) fn rounded_box(size: Vec3, radius: f32, steps: usize) -> Shape {
    let mut shape = Shape::default();
    let inner = size * 0.5 - Vec3::splat(radius);
    let quarter = |step: usize| turn(step, 4 * steps);
    for octant in 0..8_usize {
        let sign = |bit: usize| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let signs = Vec3::new(sign(0), sign(1), sign(2));
        let vertex = |inner: Vec3, direction: Vec3, uv: Vec2| Vertex {
            position: (inner + direction * radius) * signs,
            normal: direction * signs,
            uv,
        };
        shape.net([steps, steps], |u, v| {
            let (round, up) = (quarter(u), quarter(v));
            let direction = Vec3::new(up.x * round.x, up.y, up.x * round.y);
            vertex(inner, direction, Vec2::new(u as f32, v as f32) * radius)
        });
        // Edges and sides run from one octant to the next along each axis.
        for axis in (0..3).filter(|&axis| octant >> axis & 1 == 0) {
            let (left, right) = ((axis + 1) % 3, (axis + 2) % 3);
            // The arcs of the octants, from where the cosine is to the sine.
            let [cosine, sine] = [[2, 1], [0, 2], [0, 1]][axis];
            shape.net([steps, 1], |u, end| {
                let round = quarter(u);
                let mut direction = Vec3::ZERO;
                direction[cosine] = round.x;
                direction[sine] = round.y;
                let mut from = inner;
                from[axis] *= if end == 0 { 1.0 } else { -1.0 };
                let uv = Vec2::new(u as f32 * radius, end as f32 * 2.0 * inner[axis]);
                vertex(from, direction, uv)
            });
            if octant >> left & 1 == 0 {
                side(&mut shape, inner, radius, [axis, left, right], signs[right]);
            }
        }
    }
    shape
}

/// Adds a flat side of a rounded box across the axis `normal`.
fn side(
    shape: &mut Shape,
    inner: Vec3,
    radius: f32,
    [u_axis, v_axis, normal]: [usize; 3],
    sign: f32,
) {
    shape.net([1, 1], |u, v| {
        let mut position = inner;
        position[u_axis] *= if u == 0 { 1.0 } else { -1.0 };
        position[v_axis] *= if v == 0 { 1.0 } else { -1.0 };
        position[normal] = (inner[normal] + radius) * sign;
        let mut direction = Vec3::ZERO;
        direction[normal] = sign;
        let uv = Vec2::new(position[u_axis], position[v_axis]);
        Vertex { position, normal: direction, uv }
    });
}

/// Builds a round tube or rod along a path: straight legs, arcs of `steps` at corners.
pub(crate) fn tube(path: &[Vec3], radius: f32, bend: f32, around: usize, steps: usize) -> Shape {
    let mut centres = vec![path[0]];
    for corner in path.windows(3) {
        let [back, on] = [corner[0] - corner[1], corner[2] - corner[1]].map(Vec3::normalize);
        let half = libm::acosf((-back.dot(on)).clamp(-1.0, 1.0)) * 0.5;
        let reach = bend * libm::tanf(half);
        let start = corner[1] + back * reach;
        let to_centre = (back + on).normalize() * (bend / libm::cosf(half));
        let centre = corner[1] + to_centre;
        let (x, y) = ((start - centre).normalize(), -back);
        for step in 0..=steps {
            let angle = 2.0 * half * step as f32 / steps as f32;
            centres.push(centre + (x * libm::cosf(angle) + y * libm::sinf(angle)) * bend);
        }
    }
    centres.extend(path.last());
    swept(&centres, radius, around)
}

/// Builds a coil of wire about the y axis.
pub(crate) fn coil(radius: f32, wire: f32, turns: usize, pitch: f32) -> Shape {
    const STEPS: usize = 32;
    let centre = |step: usize| {
        let round = turn(step, STEPS) * radius;
        Vec3::new(round.x, step as f32 / STEPS as f32 * pitch, round.y)
    };
    let centres: Vec<Vec3> = (0..=turns * STEPS).map(centre).collect();
    swept(&centres, wire, 12)
}

/// Sweeps a disc along a line of centres, with flat ends.
fn swept(centres: &[Vec3], radius: f32, around: usize) -> Shape {
    let legs: Vec<Vec3> = centres.windows(2).map(|c| (c[1] - c[0]).normalize()).collect();
    let mut x = legs[0].any_orthonormal_vector();
    let mut rings: Vec<(Vec3, [Vec3; 3])> = Vec::with_capacity(centres.len());
    for (index, &centre) in centres.iter().enumerate() {
        let before = legs[index.saturating_sub(1)];
        let after = legs[index.min(legs.len() - 1)];
        let along = (before + after).normalize();
        x = (x - along * x.dot(along)).normalize();
        rings.push((centre, [x, along.cross(x), along]));
    }
    let rim = |ring: usize, step: usize| {
        let (centre, [x, y, _]) = rings[ring];
        let round = turn(step, around);
        let out = x * round.x + y * round.y;
        (centre + out * radius, out)
    };
    let mut shape = Shape::default();
    let mut lengths = vec![0.0];
    for pair in centres.windows(2) {
        lengths.push(lengths[lengths.len() - 1] + pair[0].distance(pair[1]));
    }
    shape.net([around, centres.len() - 1], |step, ring| {
        let (position, normal) = rim(ring, step);
        let share = step as f32 / around as f32;
        let uv = Vec2::new(share * std::f32::consts::TAU * radius, lengths[ring]);
        Vertex { position, normal, uv }
    });
    for (ring, sign) in [(0, -1.0), (centres.len() - 1, 1.0)] {
        let (centre, [.., along]) = rings[ring];
        shape.net([around, 1], |step, out| {
            let position = if out == 0 { centre } else { rim(ring, step).0 };
            let uv = turn(step, around) * (out as f32 * radius);
            Vertex { position, normal: along * sign, uv }
        });
    }
    shape
}
