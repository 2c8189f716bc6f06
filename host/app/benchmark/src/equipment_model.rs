//! Model of one piece of equipment: a tank on feet with three insulators.

use std::f32::consts::TAU;

use busbar_geometry::{RawPrimitive, WeldError, weld};
use busbar_scene::{Material, Model, ModelNode};
use glam::{DMat4, Vec3};

/// Number of facets around an insulator and around the tank.
const FACETS: u32 = 24;
/// Sheds of an insulator, their distance, and the radii of core and shed, metres.
const SHEDS: u32 = 30;
const SHED_PITCH: f32 = 0.06;
const CORE_RADIUS: f32 = 0.08;
const SHED_RADIUS: f32 = 0.16;
/// Radius of the tank, and the heights of its bottom and top, metres.
const TANK_RADIUS: f32 = 0.9;
const TANK_BOTTOM: f32 = 0.8;
const TANK_TOP: f32 = 2.2;
/// Positions of the insulators on the tank, metres from its axis.
const INSULATORS: [f32; 3] = [-0.55, 0.0, 0.55];
/// Radius and positions of the feet, metres.
const FOOT_RADIUS: f32 = 0.1;
const FEET: [[f32; 2]; 4] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];

/// Materials by number: paint, porcelain.
const PAINT: u32 = 0;
const PORCELAIN: u32 = 1;

/// Builds the model: one node for the tank, one for each insulator.
///
/// # Errors
/// [`WeldError`] never occurs with these shapes.
pub(crate) fn equipment_model() -> Result<Model, WeldError> {
    let mut body = RawPrimitive { material: Some(PAINT), ..RawPrimitive::default() };
    lathe(&mut body, [0.0, 0.0], &cylinder(TANK_RADIUS, TANK_BOTTOM, TANK_TOP));
    for foot in FEET {
        // Into the tank, so that nothing coincides.
        lathe(&mut body, foot, &cylinder(FOOT_RADIUS, 0.0, TANK_BOTTOM + 0.05));
    }
    let mut insulator = RawPrimitive { material: Some(PORCELAIN), ..RawPrimitive::default() };
    lathe(&mut insulator, [0.0, 0.0], &insulator_profile());
    let node = |name: &str, mesh: u32, translation: Vec3| ModelNode {
        name: name.to_owned(),
        parent: None,
        parent_from_node: DMat4::from_translation(translation.as_dvec3()),
        mesh: Some(mesh),
    };
    let names = ["L1", "L2", "L3"];
    let insulators = INSULATORS.iter().zip(names);
    let insulators = insulators.map(|(x, name)| node(name, 1, Vec3::new(*x, TANK_TOP - 0.02, 0.0)));
    Ok(Model {
        meshes: vec![weld(&[body])?.0, weld(&[insulator])?.0],
        materials: vec![
            material("paint", [0.42, 0.45, 0.47, 1.0], 0.5),
            material("porcelain", [0.35, 0.12, 0.06, 1.0], 0.3),
        ],
        nodes: std::iter::once(node("tank", 0, Vec3::ZERO)).chain(insulators).collect(),
        ..Model::default()
    })
}

fn material(name: &str, base_color: [f32; 4], roughness: f32) -> Material {
    Material { name: name.to_owned(), base_color, roughness, ..Material::default() }
}

/// Profile of a cylinder from its lower to its upper end: radii and heights.
fn cylinder(radius: f32, bottom: f32, top: f32) -> Vec<[f32; 2]> {
    vec![[radius, bottom], [radius, top]]
}

fn insulator_profile() -> Vec<[f32; 2]> {
    let shed = |number: u32| {
        let base = SHED_PITCH * number as f32;
        [
            [CORE_RADIUS, base],
            [CORE_RADIUS, base + SHED_PITCH * 0.4],
            [SHED_RADIUS, base + SHED_PITCH * 0.5],
            [SHED_RADIUS, base + SHED_PITCH * 0.6],
        ]
    };
    let top = [CORE_RADIUS, SHED_PITCH * SHEDS as f32];
    (0..SHEDS).flat_map(shed).chain([top]).collect()
}

/// Appends the surface that a profile makes around a vertical axis, closed by a disc at each end.
fn lathe(primitive: &mut RawPrimitive, [x, z]: [f32; 2], profile: &[[f32; 2]]) {
    let first = primitive.positions.len() as u32;
    for [radius, height] in profile {
        for facet in 0..FACETS {
            let (sin, cos) = (facet as f32 / FACETS as f32 * TAU).sin_cos();
            primitive.positions.push(Vec3::new(x + radius * cos, *height, z + radius * sin));
        }
    }
    let at = |ring: u32, facet: u32| first + ring * FACETS + facet % FACETS;
    let rings = profile.len() as u32;
    for (ring, facet) in (0..rings - 1).flat_map(|ring| (0..FACETS).map(move |f| (ring, f))) {
        let [a, b] = [at(ring, facet), at(ring, facet + 1)];
        let [c, d] = [at(ring + 1, facet), at(ring + 1, facet + 1)];
        primitive.triangles.extend([[a, c, b], [b, c, d]]);
    }
    for (ring, is_top) in [(0, false), (rings - 1, true)] {
        for facet in 1..FACETS - 1 {
            let [a, b, c] = [at(ring, 0), at(ring, facet), at(ring, facet + 1)];
            primitive.triangles.push(if is_top { [a, c, b] } else { [a, b, c] });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_are_closed_and_face_outward() {
        let model = equipment_model().unwrap();
        for mesh in &model.meshes {
            let mut edges = std::collections::HashMap::new();
            let mut volume = 0.0;
            for corners in mesh.triangles.iter() {
                let points = corners.map(|wedge| mesh.wedges.position[wedge as usize]);
                for side in 0..3 {
                    let edge = [points[side], points[(side + 1) % 3]];
                    *edges.entry(edge).or_insert(0) += 1;
                }
                let [a, b, c] = points.map(|point| mesh.positions[point as usize].as_dvec3());
                volume += a.dot(b.cross(c)) / 6.0;
            }
            assert!(
                edges.iter().all(|([a, b], count)| *count == 1 && edges.contains_key(&[*b, *a]))
            );
            assert!(volume > 0.0, "{volume}");
        }
    }
}
