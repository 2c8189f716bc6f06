//! Shapes, and a mesh as a plugin gets it.

use busbar_geometry::{
    Collapse, CollapseSequence, CollapseStacks, Mesh, MeshStatistics, RawPrimitive, weld,
};
use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{CollapseList, Error, Mesh as View, Plugin, Progress, Wedges};
use glam::{Vec2, Vec3};
use quadric_collapse::{Limits, QuadricCollapse, Settings};

/// Runs the optimiser with its defaults.
pub(crate) fn optimize(mesh: &Mesh) -> Vec<Collapse> {
    let list = optimize_with(mesh, Settings::default(), &mut Progress::detached());
    let list = list.expect("the optimiser takes every mesh");
    let entry = |c: &busbar_plugin_sdk::Collapse| Collapse {
        removed: c.removed,
        kept: c.kept,
        error: c.error,
    };
    list.collapses.iter().map(entry).collect()
}

pub(crate) fn optimize_with(
    mesh: &Mesh,
    settings: Settings,
    progress: &mut Progress<'_>,
) -> Result<CollapseList, Error> {
    optimize_within(&Limits::default(), mesh, settings, progress)
}

pub(crate) fn optimize_within(
    limits: &Limits,
    mesh: &Mesh,
    settings: Settings,
    progress: &mut Progress<'_>,
) -> Result<CollapseList, Error> {
    let positions: Vec<_> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let triangles = mesh.topology().triangles;
    let normals: Vec<_> = mesh.wedges.normal.iter().map(|n| n.to_array()).collect();
    let uvs: Vec<_> = mesh.wedges.uv.iter().map(|uv| uv.to_array()).collect();
    let wedges = Wedges {
        corners: &mesh.triangles,
        positions: &mesh.wedges.position,
        normals: &normals,
        uvs: &uvs,
        sections: &mesh.wedges.section,
    };
    let view = View { positions: &positions, triangles: &triangles, wedges: Some(wedges) };
    QuadricCollapse::create(settings, host())?.optimize_within(limits, view, progress)
}

pub(crate) fn stacks(mesh: &Mesh) -> CollapseStacks {
    let sequence = CollapseSequence::new(optimize(mesh), mesh.positions.len() as u32);
    let sequence = sequence.expect("it is a sequence");
    CollapseStacks::build(mesh.clone(), &sequence)
}

pub(crate) fn statistics(stacks: &CollapseStacks, cursor: u32) -> MeshStatistics {
    MeshStatistics::from_resolved(&stacks.resolve(cursor), stacks.surviving(cursor))
}

/// A surface over a grid of `n` by `n` cells in [0, 1]; smooth normals and
/// coordinates where `attributes` gives them.
pub(crate) fn patch(
    n: u32,
    point: impl Fn(f32, f32) -> Vec3,
    attributes: impl Fn(f32, f32) -> (Vec3, Vec2),
) -> RawPrimitive {
    let mut primitive = RawPrimitive::default();
    for i in 0..=n {
        for j in 0..=n {
            let (u, v) = (i as f32 / n as f32, j as f32 / n as f32);
            let (normal, uv) = attributes(u, v);
            primitive.positions.push(point(u, v));
            primitive.normals.push(normal);
            primitive.uvs.push(uv);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            primitive.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    primitive
}

pub(crate) fn welded(primitives: &[RawPrimitive]) -> Mesh {
    weld(primitives).expect("the shape is sound").0
}

/// The unit square, upwards.
pub(crate) fn grid(n: u32) -> Mesh {
    welded(&[patch(n, |u, v| Vec3::new(u, v, 0.0), |u, v| (Vec3::Z, Vec2::new(u, v)))])
}

/// Six patches of the unit cube, each with its own flat normals.
pub(crate) fn cube(n: u32) -> Mesh {
    welded(&cube_faces(n, |p| p))
}

/// The unit sphere: a cube blown up, with smooth normals.
pub(crate) fn sphere(n: u32) -> Mesh {
    let mut faces = cube_faces(n, |p| (p - Vec3::splat(0.5)).normalize());
    for face in &mut faces {
        face.normals = face.positions.clone();
        face.uvs.clear();
    }
    welded(&faces)
}

fn cube_faces(n: u32, map: impl Fn(Vec3) -> Vec3) -> Vec<RawPrimitive> {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z];
    let mut faces = Vec::new();
    for k in 0..3 {
        let (normal, u_axis, v_axis) = (axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]);
        for (side, normal) in [(1.0, normal), (0.0, -normal)] {
            let point = |u: f32, v: f32| {
                // Turned round on the far side, so that it looks outwards.
                let (u, v) = if side == 1.0 { (u, v) } else { (v, u) };
                map(axes[k] * side + u_axis * u + v_axis * v)
            };
            let mut face = patch(n, point, |_, _| (normal, Vec2::ZERO));
            face.material = Some(0);
            faces.push(face);
        }
    }
    // One section: hard edges alone make seams.
    let mut all = RawPrimitive::default();
    for face in faces {
        let base = all.positions.len() as u32;
        all.triangles.extend(face.triangles.iter().map(|t| t.map(|v| v + base)));
        all.positions.extend(face.positions);
        all.normals.extend(face.normals);
        all.uvs.extend(face.uvs);
    }
    vec![all]
}

pub(crate) fn normal_of(mesh: &Mesh, triangle: [u32; 3]) -> Vec3 {
    let [a, b, c] = mesh.corner_positions(triangle).map(|p| mesh.positions[p as usize]);
    (b - a).cross(c - a)
}
