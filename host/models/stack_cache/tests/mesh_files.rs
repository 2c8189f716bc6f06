//! Welded meshes on disk: found to the bit, refused in whatever way they are damaged.

#![allow(clippy::unwrap_used)]

use std::fs;

use busbar_geometry::{RawPrimitive, weld};
use busbar_stack_cache::{CacheError, MeshKey, StackCache, WeldedMesh, content_digest, probe};
use glam::{Vec2, Vec3};
use proptest::prelude::*;

const ROOMY_BYTES: u64 = 1 << 30;

/// Two sections of two features, with or without texture coordinates.
fn welded(has_uvs: bool) -> WeldedMesh {
    let row = (0..=9).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(x as f32, y, 0.0)));
    let positions: Vec<Vec3> = row.collect();
    let quad = |x: u32| [[2 * x, 2 * x + 2, 2 * x + 1], [2 * x + 1, 2 * x + 2, 2 * x + 3]];
    let uv = |point: &Vec3| Vec2::new(point.x * 0.1, point.y);
    let first = RawPrimitive {
        uvs: if has_uvs { positions.iter().map(uv).collect() } else { Vec::new() },
        features: (0..positions.len() as u32).map(|vertex| vertex / 10).collect(),
        triangles: (0..9).flat_map(quad).collect(),
        material: Some(2),
        positions,
        ..RawPrimitive::default()
    };
    let second = RawPrimitive { material: None, ..first.clone() };
    let (mesh, report) = weld(&[first, second]).unwrap();
    WeldedMesh { mesh, feature_names: vec!["=S12D1Q1".into(), "Gerät ä".into()], report }
}

fn key() -> MeshKey {
    MeshKey::new(content_digest(&[b"document", b"buffer"]), 3)
}

#[test]
fn what_was_stored_is_found_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let cache = StackCache::open(folder.path(), ROOMY_BYTES).unwrap();
    assert_eq!(cache.load_mesh(key()).unwrap(), None);
    for has_uvs in [false, true] {
        let stored = welded(has_uvs);
        cache.store_mesh(key(), &stored.mesh, &stored.feature_names, stored.report).unwrap();
        assert_eq!(cache.load_mesh(key()).unwrap(), Some(stored));
    }
    fs::write(cache.mesh_path(key()), "short").unwrap();
    assert!(cache.load_mesh(key()).unwrap_err().contains("cut short"));
}

#[test]
fn another_content_or_mesh_has_another_key() {
    let of = |parts: &[&[u8]], mesh| MeshKey::new(content_digest(parts), mesh);
    let keys = [
        of(&[b"document", b"buffer"], 3),
        of(&[b"document", b"buffer"], 4),
        of(&[b"documentb", b"uffer"], 3),
        of(&[b"document"], 3),
    ];
    for (index, key) in keys.iter().enumerate() {
        assert!(!keys[..index].contains(key));
    }
}

#[test]
fn meshes_count_towards_the_limit_as_stacks_do() {
    let folder = tempfile::tempdir().unwrap();
    let stored = welded(true);
    let cache = StackCache::open(folder.path(), 1).unwrap();
    cache.store_mesh(key(), &stored.mesh, &stored.feature_names, stored.report).unwrap();
    assert_eq!(cache.load_mesh(key()).unwrap(), None, "there is no room for it");
    let none = StackCache::open(&folder.path().join("gone"), ROOMY_BYTES).unwrap();
    fs::remove_dir(folder.path().join("gone")).unwrap();
    let refused = none.store_mesh(key(), &stored.mesh, &stored.feature_names, stored.report);
    assert!(matches!(refused, Err(CacheError::Write { .. })), "{refused:?}");
}

/// Data that break a rule of welded meshes are refused, though their checksum is right.
#[test]
fn what_is_no_welded_mesh_is_refused() {
    let breaks: [fn(&mut WeldedMesh); 10] = [
        |w| w.mesh.triangles[0][1] = u32::MAX,
        |w| w.mesh.triangles[4] = [0; 3],
        |w| w.mesh.wedges.position[2] = 1000,
        |w| w.mesh.wedges.section[2] = 2,
        |w| w.mesh.positions[1].y = f32::NAN,
        |w| w.mesh.positions.push(Vec3::ONE),
        |w| w.mesh.features[0] = 2,
        |w| w.mesh.features[0] = 1,
        |w| w.mesh.sections[1].first_triangle += 1,
        |w| w.mesh.sections[1].triangle_count -= 1,
    ];
    for (number, change) in breaks.iter().enumerate() {
        let mut broken = welded(true);
        change(&mut broken);
        let found = probe::read_mesh(&probe::mesh_file(key(), &broken), key());
        let reason = found.expect_err(&format!("case {number}"));
        assert!(reason.contains("no welded mesh"), "{reason}");
    }
}

proptest! {
    #[test]
    fn no_change_of_a_byte_goes_unseen(at in any::<prop::sample::Index>(), by in 1..=255_u8) {
        let stored = welded(false);
        let mut bytes = probe::mesh_file(key(), &stored);
        let at = at.index(bytes.len());
        bytes[at] ^= by;
        prop_assert!(probe::read_mesh(&bytes, key()).is_err());
        bytes.truncate(at);
        prop_assert!(probe::read_mesh(&bytes, key()).is_err());
    }
}
