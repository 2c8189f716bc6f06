//! Stack cache with whole, damaged, foreign and too many files.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::{Duration, SystemTime};

use busbar_geometry::{
    Collapse, CollapseSequence, CollapseStacks, Mesh, RawPrimitive, removal_ranks, weld,
};
use busbar_stack_cache::{CacheError, CacheKey, Lookup, OptimizerDigest, StackCache};
use glam::Vec3;
use proptest::prelude::*;
use tempfile::TempDir;

fn strip(quads: u32) -> Mesh {
    let row = (0..=quads).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(x as f32, y, 0.0)));
    let triangles =
        (0..quads).flat_map(|x| [[2 * x, 2 * x + 2, 2 * x + 1], [2 * x + 1, 2 * x + 2, 2 * x + 3]]);
    let primitive = RawPrimitive {
        positions: row.collect(),
        triangles: triangles.collect(),
        ..Default::default()
    };
    weld(&[primitive]).unwrap().0
}

/// More than any test stores.
const ROOMY_BYTES: u64 = 1 << 30;

/// A mesh, its stacks, and a cache that has them.
struct Stored {
    folder: TempDir,
    cache: StackCache,
    mesh: Mesh,
    key: CacheKey,
    stacks: CollapseStacks,
}

fn stored() -> Stored {
    let folder = tempfile::tempdir().unwrap();
    let cache = StackCache::open(&folder.path().join("a/b"), ROOMY_BYTES).unwrap();
    let mesh = strip(20);
    let count = mesh.positions.len() as u32;
    let entries = (0..30).map(|i| Collapse { removed: i, kept: i + 1, error: i as f32 }).collect();
    let sequence = CollapseSequence::new(entries, count).unwrap();
    let key = CacheKey::new(&mesh, OptimizerDigest::from_parts(&[b"optimiser", b"{}"]));
    let stacks = CollapseStacks::build(mesh.clone(), &sequence);
    cache.store(key, &removal_ranks(&sequence), stacks.tables()).unwrap();
    Stored { folder, cache, mesh, key, stacks }
}

fn assert_damaged(stored: &Stored, expected: &str) {
    let mut mesh = stored.mesh.clone();
    match stored.cache.load(stored.key, &mut mesh) {
        Lookup::Damaged(reason) => assert!(reason.contains(expected), "{reason}"),
        other => panic!("{other:?}"),
    }
    assert_eq!(mesh, stored.mesh, "the mesh is left to be optimised anew");
}

fn change(path: &Path, change: impl FnOnce(&mut Vec<u8>)) {
    let mut bytes = fs::read(path).unwrap();
    change(&mut bytes);
    fs::write(path, bytes).unwrap();
}

#[test]
fn what_was_stored_is_found_to_the_bit() {
    let stored = stored();
    let mut mesh = stored.mesh.clone();
    let Lookup::Found(again) = stored.cache.load(stored.key, &mut mesh) else { panic!() };
    assert_eq!(again.mesh(), stored.stacks.mesh());
    assert_eq!(again.tables(), stored.stacks.tables());
}

#[test]
fn another_mesh_maker_or_setting_has_another_key() {
    let stored = stored();
    let mut keys = vec![stored.key];
    let mut moved = stored.mesh.clone();
    moved.positions[7].z = 1e-30;
    let mut turned = stored.mesh.clone();
    turned.wedges.normal[3] = Vec3::X;
    let mut painted = stored.mesh.clone();
    painted.sections[0].material = Some(0);
    for mesh in [&moved, &turned, &painted] {
        keys.push(CacheKey::new(mesh, OptimizerDigest::from_parts(&[b"optimiser", b"{}"])));
    }
    keys.push(CacheKey::new(&stored.mesh, OptimizerDigest::from_parts(&[b"optimiser{}", b""])));
    keys.push(CacheKey::new(&stored.mesh, OptimizerDigest::from_parts(&[b"optimiser", b"{ }"])));
    for (i, key) in keys.iter().enumerate() {
        assert!(!keys[..i].contains(key), "{i}");
        let found = stored.cache.load(*key, &mut stored.mesh.clone());
        assert_eq!(matches!(found, Lookup::Absent), i > 0, "{i}: {found:?}");
    }
}

#[test]
fn damage_is_named_and_leaves_the_mesh() {
    let stored = stored();
    let path = stored.cache.path(stored.key);
    let whole = fs::read(&path).unwrap();
    let with = |expected: &str, damage: &dyn Fn(&mut Vec<u8>)| {
        fs::write(&path, &whole).unwrap();
        change(&path, damage);
        assert_damaged(&stored, expected);
    };
    with("cut short", &|bytes| bytes.clear());
    with("cut short", &|bytes| bytes.truncate(50));
    with("bytes instead of", &|bytes| bytes.truncate(bytes.len() - 1));
    with("bytes instead of", &|bytes| bytes.push(0));
    with("no cache file", &|bytes| bytes[0] ^= 1);
    with("version 3", &|bytes| bytes[8] = 3);
    with("another mesh", &|bytes| bytes[16] ^= 1);
    with("another mesh", &|bytes| bytes[32] ^= 1);
    with("its header is wrong", &|bytes| bytes[56..64].fill(0xff));
    with("checksum", &|bytes| bytes[72] ^= 1);
    with("checksum", &|bytes| *bytes.last_mut().unwrap() ^= 1);
}

#[test]
fn a_directory_that_others_may_write_is_refused() {
    let stored = stored();
    let directory = stored.folder.path().join("open");
    fs::create_dir(&directory).unwrap();
    fs::set_permissions(&directory, fs::Permissions::from_mode(0o777)).unwrap();
    let refused = StackCache::open(&directory, ROOMY_BYTES);
    assert!(matches!(refused, Err(CacheError::NotPrivate { .. })), "{refused:?}");
    let file = stored.cache.path(stored.key);
    let refused = StackCache::open(&file, ROOMY_BYTES);
    assert!(matches!(refused, Err(CacheError::Directory { .. })), "{refused:?}");
}

#[test]
fn what_was_used_longest_ago_goes_first() {
    let stored = stored();
    let size = fs::metadata(stored.cache.path(stored.key)).unwrap().len();
    let directory = stored.folder.path().join("a/b");
    let cache = StackCache::open(&directory, size * 2).unwrap();
    let sequence = CollapseSequence::empty(stored.mesh.positions.len() as u32);
    let stacks = CollapseStacks::build(stored.mesh.clone(), &sequence);
    let ranks = removal_ranks(&sequence);
    let old = |key| {
        let file = fs::File::options().write(true).open(cache.path(key)).unwrap();
        file.set_modified(SystemTime::now() - Duration::from_secs(60)).unwrap();
    };
    let [second, third] = [b"2", b"3"]
        .map(|maker| CacheKey::new(&stored.mesh, OptimizerDigest::from_parts(&[maker])));
    cache.store(second, &ranks, stacks.tables()).unwrap();
    old(second);
    old(stored.key);
    // Used: now the newest.
    assert!(matches!(cache.load(stored.key, &mut stored.mesh.clone()), Lookup::Found(_)));
    cache.store(third, &ranks, stacks.tables()).unwrap();
    let there = [stored.key, second, third].map(|key| cache.path(key).exists());
    assert_eq!(there, [true, false, true]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever byte changes, wherever: it is noticed.
    #[test]
    fn any_altered_byte_is_noticed(place in any::<prop::sample::Index>(), flip in 1_u8..) {
        let stored = stored();
        change(&stored.cache.path(stored.key), |bytes| {
            let place = place.index(bytes.len());
            bytes[place] ^= flip;
        });
        let found = stored.cache.load(stored.key, &mut stored.mesh.clone());
        prop_assert!(matches!(found, Lookup::Damaged(_)), "{:?}", found);
    }
}
