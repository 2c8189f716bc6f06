//! Fixed meshes: those that optimisers have been judged on do not change.

use std::collections::HashMap;

use busbar_geometry::{Mesh, count_components};
use busbar_gltf_import::{ImportLimits, import_bytes};
use busbar_scene::Model;
use twox_hash::XxHash3_64;

/// Counts and checksum that a mesh had when it was fixed.
#[derive(Debug, PartialEq, Eq)]
struct ExpectedMesh {
    positions: usize,
    wedges: usize,
    triangles: usize,
    sections: usize,
    components: u32,
    border_edges: usize,
    hash: u64,
}

fn check(model: &Model, fixed: &ExpectedMesh) {
    let bytes = busbar_gltf_export::write_glb(model).expect("it can be written");
    let imported = import_bytes(&bytes, None, &ImportLimits::default()).expect("it can be read");
    let [mesh] = imported.model.meshes.as_slice() else { panic!("one mesh") };
    assert!(mesh.wedges.normal.iter().all(|n| (n.length() - 1.0).abs() < 1e-3));
    let triangles = mesh.topology().triangles;
    let found = ExpectedMesh {
        positions: mesh.positions.len(),
        wedges: mesh.wedges.len(),
        triangles: mesh.triangles.len(),
        sections: mesh.sections.len(),
        components: count_components(mesh.positions.len() as u32, &triangles).referenced,
        border_edges: border_edges(mesh),
        hash: XxHash3_64::oneshot(&bytes),
    };
    assert_eq!(&found, fixed, "the meshes that results rest on have changed");
}

/// Counts the edges with exactly one triangle.
fn border_edges(mesh: &Mesh) -> usize {
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    for [a, b, c] in mesh.topology().triangles {
        for [a, b] in [[a, b], [b, c], [c, a]] {
            *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    edges.values().filter(|&&count| count == 1).count()
}

#[test]
fn the_breaker_is_as_from_cad() {
    let model = corpus::breaker().unwrap();
    assert_eq!(model.meshes, corpus::breaker().unwrap().meshes, "the same every time");
    assert!((100_000..200_000).contains(&model.meshes[0].triangles.len()));
    check(
        &model,
        &ExpectedMesh {
            positions: 92_124,
            wedges: 164_165,
            triangles: 187_996,
            sections: 6,
            components: 589,
            border_edges: 288,
            hash: 4_738_466_426_458_607_761,
        },
    );
}

#[test]
fn the_scan_is_noisy_and_torn() {
    let model = corpus::scan().unwrap();
    assert!((200_000..300_000).contains(&model.meshes[0].triangles.len()));
    check(
        &model,
        &ExpectedMesh {
            positions: 138_448,
            wedges: 138_448,
            triangles: 273_165,
            sections: 1,
            components: 215,
            border_edges: 3451,
            hash: 8_826_140_878_902_672_813,
        },
    );
}
