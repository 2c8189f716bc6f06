//! meshoptimizer's levels of a mesh, as the outside peer.

use anyhow::{Result, ensure};
use busbar_geometry::{Mesh, RawPrimitive, Topology, weld};
use meshopt::{SimplifyOptions, VertexDataAdapter};

/// Steps of halving until the number of vertices is met as well as it can be.
const MAX_BISECTIONS: usize = 16;

/// The mesh at each theta: as many vertices in use as `round(theta V)` fewer
/// leaves, as near as the peer comes. Normals are those of faces.
///
/// # Errors
/// When the peer refuses the mesh.
pub fn levels<const N: usize>(mesh: &Topology, thetas: [f64; N]) -> Result<[Mesh; N]> {
    let bytes: &[u8] = bytemuck::cast_slice(&mesh.positions);
    let vertices = VertexDataAdapter::new(bytes, size_of::<glam::Vec3>(), 0)?;
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let mut levels = Vec::with_capacity(N);
    for theta in thetas {
        let kept = ((1.0 - theta) * mesh.positions.len() as f64).round() as usize;
        levels.push(flat(mesh, &level(&indices, &vertices, kept))?);
    }
    match levels.try_into() {
        Ok(levels) => Ok(levels),
        Err(_) => anyhow::bail!("a level is missing"),
    }
}

/// The level with the most vertices in use that are not more than `kept`.
fn level(indices: &[u32], vertices: &VertexDataAdapter<'_>, kept: usize) -> Vec<u32> {
    let (mut few, mut many) = (0, indices.len() / 3);
    let mut best = Vec::new();
    for _ in 0..MAX_BISECTIONS {
        if few >= many {
            break;
        }
        let triangles = (few + many).div_ceil(2);
        let simplified = meshopt::simplify(
            indices,
            vertices,
            triangles * 3,
            f32::MAX,
            SimplifyOptions::None,
            None,
        );
        if vertices_in_use(&simplified) <= kept {
            few = triangles;
            best = simplified;
        } else {
            many = triangles - 1;
        }
    }
    best
}

fn vertices_in_use(indices: &[u32]) -> usize {
    let mut used = indices.to_vec();
    used.sort_unstable();
    used.dedup();
    used.len()
}

/// A mesh of the surviving vertices, with normals of faces.
fn flat(mesh: &Topology, indices: &[u32]) -> Result<Mesh> {
    ensure!(!indices.is_empty(), "meshoptimizer left no triangle");
    let primitive = RawPrimitive {
        positions: mesh.positions.clone(),
        triangles: indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        ..RawPrimitive::default()
    };
    Ok(weld(&[primitive])?.0)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A bumpy grid of n by n squares.
    fn grid(n: u32) -> Topology {
        let at = |i: u32| {
            let (x, y) = ((i % (n + 1)) as f32, (i / (n + 1)) as f32);
            Vec3::new(x, y, (x * 0.7).sin() * (y * 0.4).cos())
        };
        let quad = |i: u32| {
            let a = i / n * (n + 1) + i % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        };
        Topology {
            positions: (0..(n + 1) * (n + 1)).map(at).collect(),
            triangles: (0..n * n).flat_map(quad).collect(),
        }
    }

    #[test]
    fn levels_have_the_vertices_asked_for() {
        let mesh = grid(40);
        let [half, little] = levels(&mesh, [0.5, 0.9]).unwrap();
        let total = mesh.positions.len() as f64;
        for (level, share) in [(half, 0.5), (little, 0.1)] {
            let found = level.positions.len() as f64 / total;
            assert!(found <= share + 1e-3 && found > share * 0.9, "{found} for {share}");
        }
    }
}
