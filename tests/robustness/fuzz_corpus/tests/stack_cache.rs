//! Fuzzing of the stack cache: any bytes of a cache file are stacks of the mesh, or refused with
//! the mesh unchanged. Whatever tables or collapses are accepted, the mesh can be shown at every
//! cursor.

use std::sync::OnceLock;

use busbar_geometry::{
    Collapse, CollapseSequence, CollapseStacks, Mesh, RawPrimitive, StackTables, WeldReport,
    removal_ranks, weld,
};
use busbar_stack_cache::{CacheKey, MeshKey, OptimizerDigest, WeldedMesh, content_digest, probe};
use glam::Vec3;

/// Number of quads of the mesh, a strip.
const QUADS: u32 = 8;

/// Mesh under test with the key of its stacks.
struct Subject {
    mesh: Mesh,
    key: CacheKey,
}

/// Selector of inputs that are files of welded meshes.
const MESH: u8 = 255;

/// Runs one input. Its first byte selects the form of the rest: changes of a good file, tables
/// whose checksum is right, collapses, or changes of a welded mesh.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let subject = subject();
    if kind == MESH {
        return is_mesh_read(subject, rest);
    }
    match kind % 3 {
        0 => is_read(subject, &changed(&good_file(subject), rest)),
        1 => {
            let (ranks, tables) = tables(subject, rest);
            is_read(subject, &probe::file(subject.key, &ranks, &tables))
        }
        _ => match CollapseSequence::new(collapses(rest), subject.mesh.positions.len() as u32) {
            Err(_) => false,
            Ok(sequence) => {
                let stacks = CollapseStacks::build(subject.mesh.clone(), &sequence);
                assert_eq!(stacks.collapse_count(), sequence.len());
                check(&stacks);
                check_lossless(subject, &stacks);
                is_read(
                    subject,
                    &probe::file(subject.key, &removal_ranks(&sequence), stacks.tables()),
                )
            }
        },
    }
}

fn is_read(subject: &Subject, bytes: &[u8]) -> bool {
    let mut mesh = subject.mesh.clone();
    match probe::read(bytes, subject.key, &mut mesh) {
        Ok(stacks) => {
            assert!(mesh.positions.is_empty(), "the mesh is taken");
            check(&stacks);
            true
        }
        Err(reason) => {
            assert!(!reason.is_empty());
            assert_eq!(mesh.positions, subject.mesh.positions, "the mesh is left");
            false
        }
    }
}

/// Reads a changed file of the mesh, or one whose checksum is right over other indices. An accepted
/// mesh can be made stacks of and shown.
fn is_mesh_read(subject: &Subject, bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    let key = MeshKey::new(content_digest(&[b"a file"]), 0);
    let mut welded = WeldedMesh {
        mesh: subject.mesh.clone(),
        feature_names: vec!["T1".into()],
        report: WeldReport::default(),
    };
    let file = if kind % 2 == 0 {
        changed(&probe::mesh_file(key, &welded), rest)
    } else {
        let mesh = &mut welded.mesh;
        for change in rest.chunks_exact(3) {
            let (at, value) = (usize::from(change[1]), u32::from(change[2]));
            let place = match change[0] % 6 {
                0 => mesh.triangles.as_flattened_mut().get_mut(at),
                1 => mesh.wedges.position.get_mut(at),
                2 => mesh.wedges.section.get_mut(at),
                3 => mesh.sections.get_mut(at).map(|section| &mut section.first_triangle),
                4 => mesh.sections.get_mut(at).map(|section| &mut section.triangle_count),
                _ => {
                    mesh.features = vec![value; at];
                    None
                }
            };
            if let Some(place) = place {
                *place = value;
            }
        }
        probe::mesh_file(key, &welded)
    };
    match probe::read_mesh(&file, key) {
        Ok(WeldedMesh { mesh, .. }) => {
            let positions = mesh.positions.len() as u32;
            check(&CollapseStacks::build(mesh, &CollapseSequence::empty(positions)));
            true
        }
        Err(reason) => {
            assert!(!reason.is_empty());
            false
        }
    }
}

/// Checks that indices are within the mesh at every cursor.
fn check(stacks: &CollapseStacks) {
    let mesh = stacks.mesh();
    let wedges = mesh.wedges.len() as u32;
    for cursor in 0..=stacks.collapse_count() + 1 {
        let resolved = stacks.resolve(cursor);
        assert!(resolved.triangles.len() <= mesh.triangles.len());
        assert_eq!(resolved.triangles.len() as u64, stacks.live_triangles(cursor));
        assert!(resolved.triangles.iter().flatten().all(|wedge| *wedge < wedges));
        assert!(stacks.representative_wedges(cursor).iter().all(|wedge| *wedge < wedges));
        for position in resolved.position_triangles().flatten() {
            assert!(position < stacks.surviving(cursor), "a position that is removed");
        }
    }
}

/// Checks that cursor 0 is the mesh itself.
fn check_lossless(subject: &Subject, stacks: &CollapseStacks) {
    assert_eq!(stacks.resolve(0).triangles, subject.mesh.triangles);
}

fn subject() -> &'static Subject {
    static SUBJECT: OnceLock<Subject> = OnceLock::new();
    SUBJECT.get_or_init(|| {
        let row = (0..=QUADS).flat_map(|x| [0.0, 1.0].map(|y| Vec3::new(x as f32, y, 0.0)));
        let quad = |x| [[2 * x, 2 * x + 2, 2 * x + 1], [2 * x + 1, 2 * x + 2, 2 * x + 3]];
        let primitive = RawPrimitive {
            positions: row.collect(),
            triangles: (0..QUADS).flat_map(quad).collect(),
            ..Default::default()
        };
        let (mut mesh, _) = weld(&[primitive]).expect("it is a mesh");
        mesh.group_wedges();
        let key = CacheKey::new(&mesh, OptimizerDigest::from_parts(&[b"optimiser"]));
        Subject { mesh, key }
    })
}

fn good_file(subject: &Subject) -> Vec<u8> {
    let count = subject.mesh.positions.len() as u32;
    let entries = (0..count - 3).map(|i| Collapse { removed: i, kept: i + 1, error: i as f32 });
    let sequence = CollapseSequence::new(entries.collect(), count).expect("it is a sequence");
    let stacks = CollapseStacks::build(subject.mesh.clone(), &sequence);
    probe::file(subject.key, &removal_ranks(&sequence), stacks.tables())
}

/// Changes bytes of a file: each change is a place and its new byte. Without a change the file
/// stays good.
fn changed(file: &[u8], changes: &[u8]) -> Vec<u8> {
    let mut bytes = file.to_vec();
    for change in changes.chunks_exact(3) {
        let at = usize::from(u16::from_le_bytes([change[0], change[1]]));
        match bytes.get_mut(at) {
            Some(byte) => *byte = change[2],
            None => bytes.truncate(at % (file.len() + 1)),
        }
    }
    bytes
}

/// Decodes tables, mostly of the right lengths.
fn tables(subject: &Subject, bytes: &[u8]) -> (Vec<u32>, StackTables) {
    let Mesh { positions, wedges, triangles, .. } = &subject.mesh;
    let mut bytes = bytes.iter().copied();
    let mut next = || bytes.next().unwrap_or_default();
    let collapses = usize::from(next()) % (positions.len() + 2);
    // Most are a permutation with some exchanged.
    let mut ranks: Vec<u32> = (0..positions.len() as u32).collect();
    for _ in 0..next() % 16 {
        let [a, b] = [next(), next()].map(|place| usize::from(place) % ranks.len());
        ranks.swap(a, b);
    }
    if next() == 1 {
        ranks[0] = next().into();
    }
    let mut words = |count: usize| (0..count).map(|_| u32::from(next())).collect::<Vec<_>>();
    let parent_start = words(collapses);
    let removal_cursor = words(triangles.len());
    let errors: Vec<_> = words(collapses).into_iter().map(f32::from_bits).collect();
    let tables = StackTables {
        parent_start,
        removal_cursor,
        errors,
        parent_offset: words(wedges.len()).iter().map(|word| *word as u8 & 3).collect(),
        max_depth: words(1)[0],
        theta_by_mesh: words(1)[0] & 1 == 1,
    };
    (ranks, tables)
}

/// Decodes collapses: two positions and the exponent of an error each.
fn collapses(bytes: &[u8]) -> Vec<Collapse> {
    let collapse = |bytes: &[u8]| Collapse {
        removed: bytes[0].into(),
        kept: bytes[1].into(),
        error: f32::from_bits(u32::from(bytes[2]) << 23),
    };
    bytes.chunks_exact(3).map(collapse).collect()
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("stack_cache", fuzz_one);
}
