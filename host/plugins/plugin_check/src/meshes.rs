//! Meshes that optimisers are tried on.

use busbar_geometry::{Mesh, RawPrimitive, weld};
use glam::{Vec2, Vec3};

/// A surface over a grid of cells with hills, welded, with normals and texture
/// coordinates that have a seam in the middle.
pub(crate) fn hilly(columns: u32, rows: u32) -> Mesh {
    let height = |x: f32, y: f32| (x * 0.9).sin() * (y * 0.7).cos() + 0.05 * (x * 5.1 + y).sin();
    surface(columns, rows, |x, y| Vec3::new(x, y, height(x, y)))
}

/// The same grid with every position where `place` puts it.
pub(crate) fn surface(columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let half = columns / 2;
    let parts = [(0, half, 0.0), (half, columns, 0.5)];
    let primitives: Vec<_> = parts
        .into_iter()
        .filter(|(from, to, _)| from < to)
        .map(|(from, to, shift)| strip(from, to, rows, shift, &place))
        .collect();
    // Only a place that is not finite could not be welded.
    weld(&primitives).map_or_else(|_| Mesh::default(), |(mesh, _)| mesh)
}

fn strip(
    from: u32,
    to: u32,
    rows: u32,
    shift: f32,
    place: &impl Fn(f32, f32) -> Vec3,
) -> RawPrimitive {
    let mut part = RawPrimitive { material: Some(u32::from(shift > 0.0)), ..Default::default() };
    let width = to - from + 1;
    for row in 0..=rows {
        for column in from..=to {
            let (x, y) = (column as f32, row as f32);
            part.positions.push(place(x, y));
            part.normals.push(Vec3::new((x * 0.3).sin() * 0.2, (y * 0.3).cos() * 0.2, 1.0));
            part.uvs.push(Vec2::new(x * 0.1 + shift, y * 0.1));
        }
    }
    for row in 0..rows {
        for column in 0..to - from {
            let low = row * width + column;
            let [a, b, c, d] = [low, low + 1, low + width, low + width + 1];
            part.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
    part
}

/// Odd meshes with their names, all of which an optimiser may get: positions are
/// finite, triangles name three different ones.
pub(crate) fn odd() -> Vec<(&'static str, Mesh)> {
    let from = |positions: Vec<Vec3>, triangles: Vec<[u32; 3]>| {
        let raw = RawPrimitive { positions, triangles, ..RawPrimitive::default() };
        weld(&[raw]).map_or_else(|_| Mesh::default(), |(mesh, _)| mesh)
    };
    let [o, x, y, z] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let shells = (0..50_u32).flat_map(|i| [o, x, y].map(|p| p + Vec3::splat(i as f32 * 3.0)));
    let of_shell = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
    vec![
        ("an empty mesh", Mesh::default()),
        ("one triangle", from(vec![o, x, y], vec![[0, 1, 2]])),
        ("a tetrahedron", from(vec![o, x, y, z], vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])),
        ("both sides of a triangle", from(vec![o, x, y], vec![[0, 1, 2], [0, 2, 1]])),
        ("the same triangle three times", from(vec![o, x, y], vec![[0, 1, 2]; 3])),
        (
            "three triangles at one edge",
            from(vec![o, x, y, z, -y], vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]]),
        ),
        ("fifty triangles apart", from(shells.collect(), (0..50).map(of_shell).collect())),
        ("a line without area", surface(8, 8, |x, y| Vec3::new(x + 9.0 * y, 0.0, 0.0))),
        ("coordinates of 1e18 m", surface(8, 8, |x, y| Vec3::new(x, y, x * y) * 1e18)),
        ("coordinates of 1e-30 m", surface(8, 8, |x, y| Vec3::new(x, y, x * y) * 1e-30)),
        ("a flat plane", surface(12, 12, |x, y| Vec3::new(x, y, 0.0))),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_what_they_are_called() {
        let mesh = hilly(10, 6);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (77, 120));
        assert!(mesh.wedges.len() > mesh.positions.len(), "there is a seam");
        for (name, mesh) in odd() {
            assert_eq!(mesh.triangles.is_empty(), name == "an empty mesh", "{name}");
        }
    }
}
