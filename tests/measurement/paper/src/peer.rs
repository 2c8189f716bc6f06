//! Levels of a mesh by meshoptimizer, as the outside peer.

use anyhow::{Result, ensure};
use busbar_geometry::{Mesh, RawPrimitive, Topology, weld};
use measure::meshoptimizer::{Input, Simplifier};

/// Simplifies the mesh to each theta: the number of vertices in use is as near to V - `round(theta
/// V)` as the peer comes. Normals are those of faces.
///
/// # Errors
/// When the peer refuses the mesh.
pub fn levels<const N: usize>(mesh: &Topology, thetas: [f64; N]) -> Result<[Mesh; N]> {
    let input = Input::new(mesh)?;
    let mut levels = Vec::with_capacity(N);
    for theta in thetas {
        let kept = ((1.0 - theta) * mesh.positions.len() as f64).round() as usize;
        levels.push(flat(mesh, input.at_vertices(Simplifier::Plain, kept)?)?);
    }
    match levels.try_into() {
        Ok(levels) => Ok(levels),
        Err(_) => anyhow::bail!("a level is missing"),
    }
}

/// Returns a mesh of the surviving vertices, with normals of faces.
fn flat(mesh: &Topology, triangles: Vec<[u32; 3]>) -> Result<Mesh> {
    ensure!(!triangles.is_empty(), "meshoptimizer left no triangle");
    let primitive =
        RawPrimitive { positions: mesh.positions.clone(), triangles, ..RawPrimitive::default() };
    Ok(weld(&[primitive])?.0)
}
