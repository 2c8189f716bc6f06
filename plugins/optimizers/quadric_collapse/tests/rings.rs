//! Surfaces of revolution: what is regular stays regular.

#[allow(dead_code, reason = "not every test needs every shape")]
mod common;

use std::collections::BTreeSet;
use std::f32::consts::TAU;

use busbar_geometry::{CollapseStacks, Mesh, RawPrimitive};
use common::*;
use glam::{EulerRot, Quat, Vec3};

/// Radius and height of each ring, metres.
type Profile = Vec<(f32, f32)>;

/// Turned column of a test.
struct Column {
    profile: Profile,
    segments: usize,
    /// Places the column, which stands on the origin along y, anywhere.
    turn: Quat,
    /// Faces with a normal of their own each, as converters write them.
    is_flat: bool,
}

impl Column {
    fn point(&self, ring: usize, step: usize) -> Vec3 {
        let (radius, height) = self.profile[ring];
        let angle = TAU * (step % self.segments) as f32 / self.segments as f32;
        self.turn * Vec3::new(angle.cos() * radius, height, angle.sin() * radius)
    }

    fn mesh(&self) -> Mesh {
        let mut primitive = RawPrimitive::default();
        for (ring, pair) in self.profile.windows(2).enumerate() {
            let [(r0, y0), (r1, y1)] = [pair[0], pair[1]];
            for step in 0..self.segments {
                let base = primitive.positions.len() as u32;
                for (ring, side) in [(ring, 0), (ring, 1), (ring + 1, 0), (ring + 1, 1)] {
                    primitive.positions.push(self.point(ring, step + side));
                    let along = if self.is_flat { 0.5 } else { side as f32 };
                    let angle = TAU * (step as f32 + along) / self.segments as f32;
                    let out = Vec3::new(angle.cos(), 0.0, angle.sin());
                    let normal = out * (y1 - y0) - Vec3::Y * (r1 - r0);
                    primitive.normals.push(self.turn * normal.normalize());
                }
                let corners = [[0, 2, 1], [1, 2, 3]].map(|face| face.map(|corner| base + corner));
                primitive.triangles.extend(corners);
            }
        }
        welded(&[primitive])
    }

    /// Steps of each ring that are left, by what the triangles at a cursor use.
    fn rings_left(&self, mesh: &Mesh, stacks: &CollapseStacks, theta: f64) -> Vec<BTreeSet<usize>> {
        let triangles = stacks.resolve(stacks.cursor_for_theta(theta)).triangles;
        let used: BTreeSet<u32> =
            triangles.iter().flat_map(|&triangle| mesh.corner_positions(triangle)).collect();
        let is_used = |point: Vec3| {
            used.iter().any(|&vertex| mesh.positions[vertex as usize].distance(point) < 1e-4)
        };
        let rings = 0..self.profile.len();
        let steps = |ring| (0..self.segments).filter(move |&step| is_used(self.point(ring, step)));
        rings.map(|ring| steps(ring).collect()).collect()
    }
}

/// Sheds, large and small in turn, between two flanges.
fn sheds(count: usize) -> Profile {
    let pitch = 0.08;
    let mut profile = vec![(0.115, 0.0), (0.115, 0.06)];
    for shed in 0..count {
        let root = 0.06 + pitch * (shed as f32 + 0.24);
        let reach = if shed % 2 == 0 { 0.065 } else { 0.047 };
        profile.extend([(0.08, root), (0.08 + reach, root - 0.1 * pitch)]);
    }
    let top = 0.06 + pitch * count as f32;
    profile.extend([(0.115, top), (0.115, top + 0.06)]);
    profile
}

/// Disc insulators on a string.
fn discs(count: usize) -> Profile {
    let mut profile = vec![(0.02, 0.0)];
    for disc in 0..count {
        let height = 0.06 + 0.146 * disc as f32;
        profile.extend([(0.127, height), (0.05, height + 0.05), (0.05, height + 0.12)]);
    }
    profile.push((0.02, 0.12 + 0.146 * count as f32));
    profile
}

/// Share of pairs of rings of which one has all the steps that the other has: a ring that is thinner
/// than another stands in line with it.
fn share_in_line(rings: &[BTreeSet<usize>]) -> f64 {
    let (mut pairs, mut in_line) = (0, 0);
    for (index, a) in rings.iter().enumerate() {
        for b in &rings[index + 1..] {
            pairs += 1;
            in_line += usize::from(a.is_subset(b) || b.is_subset(a));
        }
    }
    f64::from(in_line as u32) / f64::from(pairs)
}

/// Share of rings whose gaps differ by a factor of two at most, as while every second vertex goes.
fn share_even(rings: &[BTreeSet<usize>], segments: usize) -> f64 {
    let is_even = |ring: &&BTreeSet<usize>| {
        let next = ring.iter().cycle().skip(1);
        let gaps = ring.iter().zip(next).map(|(a, b)| (b + segments - a - 1) % segments + 1);
        let (least, most) =
            gaps.fold((usize::MAX, 0), |(least, most), gap| (gap.min(least), gap.max(most)));
        ring.is_empty() || most <= 2 * least
    };
    rings.iter().filter(is_even).count() as f64 / rings.len() as f64
}

#[test]
fn turned_columns_stay_regular() {
    const THETAS: [f64; 4] = [0.3, 0.5, 0.6, 0.7];
    let (mut in_line_sum, mut even_sum, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..24_u32 {
        let segments = [8, 12, 16, 24][seed as usize % 4];
        let profile = if seed % 3 == 0 { discs(9) } else { sheds(14) };
        let angles = [0.3, 1.7, 2.9].map(|step| seed as f32 * step);
        let turn = Quat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2]);
        let column = Column { profile, segments, turn, is_flat: seed % 2 == 1 };
        let mesh = column.mesh();
        let stacks = stacks(&mesh);
        for theta in THETAS {
            let rings = column.rings_left(&mesh, &stacks, theta);
            let (in_line, even) = (share_in_line(&rings), share_even(&rings, segments));
            assert!(in_line > 0.7 && even > 0.9, "{seed}, {theta}: {in_line} {even} {rings:?}");
            (in_line_sum, even_sum) = (in_line_sum + in_line, even_sum + even);
            count += 1.0;
        }
    }
    let (in_line, even) = (in_line_sum / count, even_sum / count);
    assert!(in_line > 0.95 && even > 0.98, "{in_line} {even}");
}
