//! Collapse sequences of shapes whose answer is known.

#[allow(dead_code, reason = "not every test needs every shape")]
mod common;

use busbar_geometry::{CollapseStacks, Mesh, RawPrimitive, count_components};
use common::*;
use glam::{Vec2, Vec3};

/// The paper's thetas, and a few between.
const THETAS: [f64; 6] = [0.1, 0.3, 0.5, 0.7, 0.85, 0.95];

fn live(stacks: &CollapseStacks, cursor: u32) -> Vec<[u32; 3]> {
    stacks.resolve(cursor).triangles
}

fn area(mesh: &Mesh, triangles: &[[u32; 3]]) -> f32 {
    triangles.iter().map(|&t| normal_of(mesh, t).length() / 2.0).sum()
}

#[test]
fn a_flat_square_keeps_its_corners_without_error() {
    let mesh = grid(20);
    let stacks = stacks(&mesh);
    let cursor = stacks.position_count() - 4;
    assert!(stacks.error_at(cursor) < 1e-6, "{}", stacks.error_at(cursor));
    let left = live(&stacks, cursor);
    assert_eq!(left.len(), 2);
    assert!((area(stacks.mesh(), &left) - 1.0).abs() < 1e-6);
    assert!(stacks.error_at(cursor + 1) > 0.1, "a corner costs");
}

#[test]
fn a_cube_with_hard_normals_comes_down_to_its_corners() {
    let mesh = cube(8);
    let stacks = stacks(&mesh);
    let cursor = stacks.position_count() - 8;
    assert!(stacks.error_at(cursor) < 1e-6, "{}", stacks.error_at(cursor));
    for k in (0..=cursor).step_by(7).chain([cursor]) {
        let mesh = stacks.mesh();
        let triangles = live(&stacks, k);
        assert!((area(mesh, &triangles) - 6.0).abs() < 1e-4, "at {k}");
        for triangle in triangles {
            let face = normal_of(mesh, triangle).normalize();
            for wedge in triangle {
                assert!(face.dot(mesh.wedges.normal[wedge as usize]) > 0.999, "torn at {k}");
            }
        }
    }
    assert_eq!(live(&stacks, cursor).len(), 12);
}

#[test]
fn a_closed_surface_stays_closed_and_unflipped_while_guards_hold() {
    let mesh = sphere(9);
    let stacks = stacks(&mesh);
    let last = stacks.position_count() - 4;
    let mut error = 0.0;
    for k in 0..=last {
        let statistics = statistics(&stacks, k);
        assert_eq!((statistics.border_edges, statistics.non_manifold_edges), (0, 0), "at {k}");
        assert_eq!(statistics.euler_characteristic(), 2, "at {k}");
        assert!(stacks.error_at(k) >= error);
        error = stacks.error_at(k);
    }
    for theta in THETAS {
        let triangles = live(&stacks, stacks.cursor_for_theta(theta));
        for triangle in triangles {
            let mesh = stacks.mesh();
            let corners = mesh.corner_positions(triangle).map(|p| mesh.positions[p as usize]);
            let outwards = corners.iter().sum::<Vec3>();
            let normal = normal_of(mesh, triangle);
            assert!(normal.dot(outwards) > 0.0, "flipped at {theta}: {corners:?} {normal}");
        }
    }
    assert!(stacks.error_at(last) > 0.05 && stacks.error_at(last) < 2.0);
}

/// No collapse turns a triangle by more than 75 degrees and a bit.
#[test]
fn no_triangle_turns_over_while_guards_hold() {
    let hills = |u: f32, v: f32| Vec3::new(u, v, 0.2 * (9.0 * u).sin() * (7.0 * v).cos());
    let mesh = welded(&[patch(14, hills, |_, _| (Vec3::Z, Vec2::ZERO))]);
    let collapses = optimize(&mesh);
    let mut triangles = mesh.topology().triangles;
    let normal = |t: [u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
        (b - a).cross(c - a).normalize_or_zero()
    };
    let guarded = collapses.len() * 95 / 100;
    for collapse in &collapses[..guarded] {
        for triangle in &mut triangles {
            let before = *triangle;
            *triangle = before.map(|v| if v == collapse.removed { collapse.kept } else { v });
            let [a, b, c] = *triangle;
            if before != *triangle && a != b && b != c && c != a {
                assert!(normal(before).dot(normal(*triangle)) > 0.24, "{collapse:?}");
            }
        }
        triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
    }
}

#[test]
fn an_open_border_stays_where_it_is() {
    let bump = |u: f32, v: f32| {
        let r = Vec2::new(u - 0.5, v - 0.5).length_squared();
        Vec3::new(u, v, 0.3 * (-20.0 * r).exp())
    };
    let mesh = welded(&[patch(24, bump, |_, _| (Vec3::Z, Vec2::ZERO))]);
    let stacks = stacks(&mesh);
    let mesh = stacks.mesh();
    for theta in [0.3, 0.7, 0.9] {
        let triangles = live(&stacks, stacks.cursor_for_theta(theta));
        let flat: f32 = triangles.iter().map(|&t| normal_of(mesh, t).z / 2.0).sum();
        assert!((flat - 1.0).abs() < 1e-3, "covers {flat} of the square at {theta}");
    }
}

/// Two charts side by side, with other coordinates and other materials.
fn split_patch(second_material: Option<u32>, shift: f32) -> Mesh {
    let wave = |u: f32, v: f32| Vec3::new(u, v, 0.05 * (6.0 * (u + v)).sin());
    let left = patch(12, |u, v| wave(u * 0.5, v), |u, v| (Vec3::Z, Vec2::new(u * 0.5, v)));
    let mut right = patch(
        12,
        |u, v| wave(0.5 + u * 0.5, v),
        |u, v| (Vec3::Z, Vec2::new(0.5 + u * 0.5 + shift, v)),
    );
    right.material = second_material;
    if second_material.is_some() {
        return welded(&[left, right]);
    }
    let base = left.positions.len() as u32;
    let triangles = right.triangles.iter().map(|t| t.map(|v| v + base));
    welded(&[RawPrimitive {
        positions: [left.positions, right.positions].concat(),
        normals: [left.normals, right.normals].concat(),
        uvs: [left.uvs, right.uvs].concat(),
        triangles: left.triangles.iter().copied().chain(triangles).collect(),
        ..Default::default()
    }])
}

#[test]
fn a_texture_seam_never_tears() {
    let stacks = stacks(&split_patch(None, 10.0));
    for theta in [0.3, 0.7, 0.85, 0.95] {
        for triangle in live(&stacks, stacks.cursor_for_theta(theta)) {
            let charts = triangle.map(|w| stacks.mesh().wedges.uv[w as usize].x > 5.0);
            assert!(charts[0] == charts[1] && charts[1] == charts[2], "torn at {theta}");
        }
    }
}

#[test]
fn a_material_border_stays_where_it_is() {
    let stacks = stacks(&split_patch(Some(1), 0.0));
    let mesh = stacks.mesh();
    for theta in [0.3, 0.7, 0.95] {
        let mut areas = [0.0_f32; 2];
        for triangle in live(&stacks, stacks.cursor_for_theta(theta)) {
            let sections = triangle.map(|w| mesh.wedges.section[w as usize]);
            assert!(sections[0] == sections[1] && sections[1] == sections[2], "torn at {theta}");
            areas[sections[0] as usize] += normal_of(mesh, triangle).z / 2.0;
        }
        for area in areas {
            assert!((area - 0.5).abs() < 5e-3, "{areas:?} at {theta}");
        }
    }
}

/// Small balls beside a large one are removed first, each as a whole: none lingers as a flat pair
/// of triangles or as a vertex.
#[test]
fn small_pieces_die_as_wholes() {
    let mut primitives = Vec::new();
    for i in 0..40 {
        let size = if i == 0 { 10.0 } else { 0.1 };
        let ball = sphere(4);
        let at = Vec3::new(30.0 * i as f32, 0.0, 0.0);
        primitives.push(RawPrimitive {
            positions: ball.positions.iter().map(|&p| at + p * size).collect(),
            triangles: ball.topology().triangles,
            ..Default::default()
        });
    }
    let mesh = welded(&primitives);
    let count = mesh.positions.len() as u32;
    let stacks = stacks(&mesh);
    let pieces = count_components(count, &mesh.topology().triangles).all;
    assert_eq!((pieces, stacks.collapse_count()), (40, count - 1));
    let mut flat = 0;
    for k in 0..=stacks.collapse_count() {
        let mut triangles = stacks.resolve(k).position_triangles().collect::<Vec<_>>();
        triangles.iter_mut().for_each(|t| t.sort_unstable());
        triangles.sort_unstable();
        flat = flat.max(triangles.chunk_by(|a, b| a == b).filter(|run| run.len() > 1).count());
    }
    assert!(flat <= 1, "{flat} flat pieces at once");
    let cursor = count - 98;
    let big = live(&stacks, cursor);
    let is_big = |t: &[u32; 3]| normal_of(stacks.mesh(), *t).length() > 1.0;
    assert!(!big.is_empty() && big.iter().all(is_big), "the large ball alone is left");
    let resolved = stacks.resolve(cursor);
    let mut used: Vec<u32> = resolved.position_triangles().flatten().collect();
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len() as u32, stacks.surviving(cursor), "no vertex is without triangles");
    assert!(stacks.error_at(cursor) > 0.09, "what died was 0.1 m in radius");
}

/// A wire of so many segments of a metre that sags, 2.2 cm in radius, with six sides.
fn wire(segments: u32, sag: f32) -> Mesh {
    const SIDES: u32 = 6;
    let ring = |number: u32| {
        let along = 2.0 * number as f32 / segments as f32 - 1.0;
        let center = Vec3::new(number as f32, sag * (along * along - 1.0), 0.0);
        (0..SIDES).map(move |side| {
            let (sin, cos) = (side as f32 * std::f32::consts::TAU / SIDES as f32).sin_cos();
            (center, Vec3::new(0.0, cos, sin))
        })
    };
    let points: Vec<(Vec3, Vec3)> = (0..=segments).flat_map(ring).collect();
    let side = |number: u32, side: u32| {
        let next = (side + 1) % SIDES;
        let [a, b] = [side, next].map(|side| number * SIDES + side);
        [[a, b, b + SIDES], [a, b + SIDES, a + SIDES]]
    };
    let primitive = RawPrimitive {
        positions: points.iter().map(|&(center, out)| center + out * 0.022).collect(),
        normals: points.iter().map(|&(_, out)| out).collect(),
        triangles: (0..segments).flat_map(|i| (0..SIDES).flat_map(move |k| side(i, k))).collect(),
        ..RawPrimitive::default()
    };
    welded(&[primitive])
}

/// Narrow shapes may turn and shrink for little: the way along a wire is long, but what is lost on
/// it is no farther off than the wire is thick.
#[test]
fn a_wire_loses_segments_rather_than_its_thickness() {
    let stacks = stacks(&wire(30, 1.0));
    let at = |position: u32| stacks.mesh().positions[position as usize];
    let [all, left] = [0, stacks.collapse_count() * 3 / 4].map(|cursor| live(&stacks, cursor));
    let share = area(stacks.mesh(), &left) / area(stacks.mesh(), &all);
    assert!(share > 0.8, "{share} of its surface is left");
    let distance = |point: &Vec3, from: u32, to: u32| {
        let along = at(to) - at(from);
        let share = (*point - at(from)).dot(along) / along.length_squared();
        point.distance(at(from) + along * share.clamp(0.0, 1.0))
    };
    let off = |point: &Vec3| {
        let edges = left.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|[from, to]| distance(point, from, to)).fold(f32::INFINITY, f32::min)
    };
    let farthest = stacks.mesh().positions.iter().map(off).fold(0.0, f32::max);
    assert!(farthest < 0.06, "{farthest} m");
}
