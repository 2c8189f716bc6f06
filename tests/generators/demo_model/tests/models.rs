//! The models as they are written: closed, outward, named, the same each time.

use std::collections::{HashMap, HashSet};

use busbar_geometry::{Mesh, count_components};
use busbar_scene::Model;
use demo_model::{breaker_pole, disconnector_pole, power_transformer, yard};
use glam::{DVec3, Vec3};

fn models() -> [(&'static str, Model); 4] {
    [
        ("transformer", power_transformer().expect("finite dimensions")),
        ("breaker", breaker_pole().expect("finite dimensions")),
        ("yard", yard().expect("finite dimensions")),
        ("disconnector", disconnector_pole().expect("finite dimensions")),
    ]
}

fn triangles_shown(model: &Model) -> usize {
    let shown = model.nodes.iter().filter_map(|node| node.mesh);
    shown.map(|mesh| model.meshes[mesh as usize].triangles.len()).sum()
}

/// Computes the signed volume of every connected shell of a mesh.
fn shell_volumes(mesh: &Mesh) -> Vec<f64> {
    let topology = mesh.topology();
    let mut shell: Vec<u32> = (0..topology.positions.len() as u32).collect();
    fn root(shell: &[u32], mut x: u32) -> u32 {
        while shell[x as usize] != x {
            x = shell[x as usize];
        }
        x
    }
    for &[a, b, c] in &topology.triangles {
        for other in [b, c] {
            let (x, y) = (root(&shell, a), root(&shell, other));
            shell[x.max(y) as usize] = x.min(y);
        }
    }
    let mut volumes: HashMap<u32, f64> = HashMap::new();
    for &triangle in &topology.triangles {
        // About a point of the shell itself, so that far shells lose no digits.
        let id = root(&shell, triangle[0]);
        let origin = topology.positions[id as usize].as_dvec3();
        let [a, b, c]: [DVec3; 3] =
            triangle.map(|v| topology.positions[v as usize].as_dvec3() - origin);
        *volumes.entry(id).or_default() += a.dot(b.cross(c)) / 6.0;
    }
    volumes.into_values().collect()
}

#[test]
fn every_welded_edge_has_two_triangles_in_opposite_directions() {
    for (name, model) in models() {
        for (index, mesh) in model.meshes.iter().enumerate() {
            let mut uses: HashMap<(u32, u32), u32> = HashMap::new();
            for [a, b, c] in mesh.topology().triangles {
                for edge in [(a, b), (b, c), (c, a)] {
                    *uses.entry(edge).or_default() += 1;
                }
            }
            for (&(a, b), &count) in &uses {
                let place = mesh.positions[a as usize];
                assert_eq!(count, 1, "{name}: mesh {index}: doubled edge at {place}");
                assert!(uses.contains_key(&(b, a)), "{name}: mesh {index}: open edge at {place}");
            }
        }
    }
}

#[test]
fn every_shell_encloses_a_positive_volume() {
    for (name, model) in models() {
        for (index, mesh) in model.meshes.iter().enumerate() {
            let volumes = shell_volumes(mesh);
            let count =
                count_components(mesh.positions.len() as u32, &mesh.topology().triangles).all;
            assert_eq!(volumes.len(), count as usize);
            assert!(
                volumes.iter().all(|&v| v > 1e-8),
                "{name}: mesh {index}: a shell is inside out"
            );
        }
    }
}

#[test]
fn normals_are_unit_vectors_on_the_outer_side_of_their_triangle() {
    for (name, model) in models() {
        for mesh in &model.meshes {
            for &triangle in &mesh.triangles {
                let [a, b, c] = mesh.corner_positions(triangle).map(|p| mesh.positions[p as usize]);
                let face = (b - a).cross(c - a).normalize_or_zero();
                for wedge in triangle {
                    let normal: Vec3 = mesh.wedges.normal[wedge as usize];
                    assert!((normal.length() - 1.0).abs() < 1e-4, "{name}: {normal}");
                    assert!(normal.dot(face) > 0.5, "{name}: {normal} on a face towards {face}");
                }
            }
        }
    }
}

#[test]
fn triangle_counts_stay_within_their_budgets() {
    for ((name, model), budget) in
        models().into_iter().zip([60_000..=120_000, 4_000..=10_000, 500..=3_000, 4_000..=14_000])
    {
        let count = triangles_shown(&model);
        assert!(budget.contains(&count), "{name}: {count} triangles, expected {budget:?}");
    }
}

#[test]
fn parts_have_names_of_their_own_and_parents_before_them() {
    for (name, model) in models() {
        let names: HashSet<&str> = model.nodes.iter().map(|node| node.name.as_str()).collect();
        assert_eq!(names.len(), model.nodes.len(), "{name}: a name is used twice");
        for (index, node) in model.nodes.iter().enumerate() {
            assert_eq!(node.parent.is_none(), index == 0);
            assert!(node.parent.is_none_or(|parent| (parent as usize) < index));
        }
    }
    let transformer = power_transformer().unwrap();
    for part in [
        "tank",
        "radiator 22",
        "fan 16",
        "bushing 1U",
        "bushing 2N",
        "bushing 3W",
        "conservator",
        "cabinet",
        "buchholz relay",
        "tap changer",
    ] {
        assert!(transformer.nodes.iter().any(|node| node.name == part), "no part '{part}'");
    }
}

#[test]
fn repeated_parts_share_one_mesh() {
    let model = power_transformer().unwrap();
    for (prefix, count) in [("radiator ", 22), ("fan ", 18), ("bushing 1", 4), ("bushing 3", 3)] {
        let nodes = model.nodes.iter().filter(|node| node.name.starts_with(prefix));
        assert_eq!(nodes.count(), count, "{prefix}");
    }
    let meshes_of = |prefix: &str| -> HashSet<u32> {
        let nodes = model.nodes.iter().filter(|node| node.name.starts_with(prefix));
        nodes.filter_map(|node| node.mesh).collect()
    };
    assert_eq!(meshes_of("radiator ").len(), 1);
    assert_eq!(meshes_of("bushing 3").len(), 1);
    assert_eq!(meshes_of("bushing 1").len(), 2);
}

#[test]
fn transformer_has_the_size_of_its_rating() {
    let model = power_transformer().unwrap();
    let transforms = model.model_from_nodes();
    let mut points = Vec::new();
    for (node, model_from_node) in model.nodes.iter().zip(transforms) {
        let Some(mesh) = node.mesh else { continue };
        let positions = &model.meshes[mesh as usize].positions;
        let model_from_node = model_from_node.as_mat4();
        points.extend(positions.iter().map(|&p| model_from_node.transform_point3(p)));
    }
    let bounds = busbar_geometry::Bounds::from_points(points).unwrap();
    let size = bounds.max - bounds.min;
    assert!((11.0..=14.0).contains(&size.x), "length {}", size.x);
    assert!((6.0..=9.0).contains(&size.z), "width {}", size.z);
    assert!((7.5..=9.0).contains(&bounds.max.y), "height {}", bounds.max.y);
}

#[test]
fn textured_faces_span_their_image() {
    let model = power_transformer().unwrap();
    assert_eq!(model.textures.len(), 2);
    for (material, _) in
        model.materials.iter().enumerate().filter(|(_, m)| m.base_color_texture.is_some())
    {
        let mut corners = HashSet::new();
        for mesh in &model.meshes {
            for section in mesh.sections.iter().filter(|s| s.material == Some(material as u32)) {
                let first = section.first_triangle as usize;
                let triangles = &mesh.triangles[first..first + section.triangle_count as usize];
                for &wedge in triangles.iter().flatten() {
                    let uv = mesh.wedges.uv[wedge as usize];
                    assert!(uv.min_element() > -1e-3 && uv.max_element() < 1.001, "{uv}");
                    corners.insert((uv.x.round() as i32, uv.y.round() as i32));
                }
            }
        }
        assert_eq!(corners.len(), 4, "material {material}");
    }
}

#[test]
fn the_same_bytes_twice() {
    for ((name, first), (_, second)) in models().into_iter().zip(models()) {
        let bytes = busbar_gltf_export::write_glb(&first).unwrap();
        assert_eq!(bytes, busbar_gltf_export::write_glb(&second).unwrap(), "{name}");
        assert_eq!(&bytes[..4], b"glTF");
    }
}
