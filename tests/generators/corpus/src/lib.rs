//! Makes the meshes that optimisers are judged on, beside the demo's models.
//!
//! [`breaker`] is a dead-tank circuit breaker as a CAD system tessellates it:
//! drilled flanges, threads, fillets, slivers beside large flat faces.
//! [`scan`] is a bushing as a laser scanner leaves it: noise, uneven sampling,
//! holes, and islands that belong to nothing.
//!
//! Both were fixed before any optimiser was tuned on them, and a test holds
//! their bytes. Metres, y up; the same on every machine: angles go through
//! `libm`.

mod cad;
mod random;
mod scan;

use busbar_geometry::{RawPrimitive, WeldError, weld};
use busbar_scene::{Material, Model, ModelNode};
use glam::DMat4;

/// Builds a dead-tank circuit breaker as from CAD.
///
/// # Errors
/// [`WeldError`] if a coordinate is not finite.
pub fn breaker() -> Result<Model, WeldError> {
    let (primitives, materials) = cad::breaker();
    model("breaker", &primitives, materials)
}

/// Builds a bushing as from a laser scanner.
///
/// # Errors
/// [`WeldError`] if a coordinate is not finite.
pub fn scan() -> Result<Model, WeldError> {
    let material = Material { name: "scanned".to_owned(), ..Material::default() };
    model("bushing", &[scan::bushing()], vec![material])
}

/// Returns a model of one node with one mesh.
fn model(
    name: &str,
    primitives: &[RawPrimitive],
    materials: Vec<Material>,
) -> Result<Model, WeldError> {
    let (mesh, _) = weld(primitives)?;
    let node = ModelNode {
        name: name.to_owned(),
        parent: None,
        parent_from_node: DMat4::IDENTITY,
        mesh: Some(0),
    };
    Ok(Model { meshes: vec![mesh], materials, nodes: vec![node], ..Model::default() })
}
