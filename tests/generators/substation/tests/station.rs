//! The station as it is written: exact counts, owners, ids, configuration.

use std::collections::{BTreeMap, HashSet};
use std::sync::LazyLock;

use busbar_geometry::{Topology, count_components};
use busbar_gltf_import::{ImportLimits, import_bytes};
use busbar_scene::Model;
use glam::Vec3;
use substation::{FlatStation, PAPER_TRIANGLES, PAPER_VERTICES, PointKind, Station, points};

static STATION: LazyLock<Station> = LazyLock::new(|| Station::generate(1).expect("it closes"));
static FLAT: LazyLock<FlatStation> = LazyLock::new(|| STATION.flatten().expect("shells apart"));
static FLAT_BYTES: LazyLock<Vec<u8>> =
    LazyLock::new(|| busbar_gltf_export::write_glb(&FLAT.model).expect("valid"));
static IMPORTED: LazyLock<Model> = LazyLock::new(|| {
    import_bytes(&FLAT_BYTES, None, &ImportLimits::default()).expect("readable").model
});

#[test]
fn the_flattened_station_has_the_papers_counts_after_import() {
    assert_eq!((PAPER_VERTICES, PAPER_TRIANGLES), (536_141, 1_057_086));
    let [mesh] = IMPORTED.meshes.as_slice() else { panic!("not one mesh") };
    assert_eq!(mesh.positions.len(), PAPER_VERTICES);
    assert_eq!(mesh.triangles.len(), PAPER_TRIANGLES);
    let materials: HashSet<_> = mesh.sections.iter().map(|s| s.material).collect();
    assert_eq!(materials.len(), mesh.sections.len(), "a section a material");
}

#[test]
fn the_instanced_station_shows_the_same_counts() {
    let counts = STATION.counts().unwrap();
    assert_eq!((counts.vertices, counts.triangles), (PAPER_VERTICES, PAPER_TRIANGLES));
    let models = STATION.catalogue.iter().count();
    assert!((24..=60).contains(&models), "{models} models");
    let uses = STATION.uses();
    for (name, _) in STATION.catalogue.iter() {
        assert!(uses.contains_key(name), "model '{name}' is placed nowhere");
    }
}

#[test]
fn every_seed_closes() {
    for seed in [0, 2, 99, u64::MAX] {
        let flat = Station::generate(seed).unwrap().flatten().unwrap();
        assert_eq!(flat.model.meshes[0].positions.len(), PAPER_VERTICES, "seed {seed}");
        assert_eq!(flat.model.meshes[0].triangles.len(), PAPER_TRIANGLES, "seed {seed}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_seed_others() {
    let bytes = |seed| {
        let flat = Station::generate(seed).unwrap().flatten().unwrap();
        (busbar_gltf_export::write_glb(&flat.model).unwrap(), flat.equipment_csv())
    };
    let again = bytes(1);
    assert!(again.0 == *FLAT_BYTES, "the mesh differs");
    assert_eq!(again.1, FLAT.equipment_csv());
    assert!(bytes(2).0 != *FLAT_BYTES, "the seed does nothing");
    let again = Station::generate(1).unwrap();
    assert_eq!(again.configuration(), STATION.configuration());
    for ((name, entry), (_, first)) in again.catalogue.iter().zip(STATION.catalogue.iter()) {
        let glb = |model| busbar_gltf_export::write_glb(model).unwrap();
        assert!(glb(&entry.model) == glb(&first.model), "model '{name}' differs");
    }
}

#[test]
fn runs_cover_every_triangle_once_in_order() {
    let ids: HashSet<String> = STATION.placements.iter().map(|p| p.id()).collect();
    let mut next = 0;
    let mut owners = HashSet::new();
    for run in &FLAT.runs {
        assert_eq!(run.first_triangle, next);
        assert!(run.triangle_count > 0 && ids.contains(&run.equipment), "{run:?}");
        owners.insert(run.equipment.clone());
        next += run.triangle_count;
    }
    assert_eq!(next, PAPER_TRIANGLES);
    assert_eq!(owners, ids, "equipment without triangles");
}

#[test]
fn every_imported_triangle_has_the_feature_of_its_run() {
    let mesh = &IMPORTED.meshes[0];
    let [names] = IMPORTED.features.as_slice() else { panic!("not one list of names") };
    assert_eq!(names.len(), STATION.placements.len());
    for run in &FLAT.runs {
        let triangles = &mesh.triangles[run.first_triangle..][..run.triangle_count];
        for &triangle in triangles {
            let feature = mesh.feature(triangle).expect("each triangle has a feature");
            assert_eq!(names[feature as usize], run.equipment);
        }
    }
}

#[test]
fn no_shell_belongs_to_two_owners() {
    let topology = IMPORTED.meshes[0].topology();
    let mut owner_of = vec![None; topology.positions.len()];
    for run in &FLAT.runs {
        let end = run.first_triangle + run.triangle_count;
        for &position in topology.triangles[run.first_triangle..end].as_flattened() {
            let owner = owner_of[position as usize].get_or_insert(&run.equipment);
            assert_eq!(*owner, &run.equipment);
        }
    }
    assert!(owner_of.iter().all(Option::is_some));
    let shells = count_components(topology.positions.len() as u32, &topology.triangles).all;
    assert!(shells as usize > STATION.placements.len(), "{shells} shells");
}

/// Computes the signed volume of every connected shell, with a point of it.
fn shell_volumes(topology: &Topology) -> Vec<(Vec3, f64)> {
    let mut parent: Vec<u32> = (0..topology.positions.len() as u32).collect();
    fn root(parent: &mut [u32], mut x: u32) -> u32 {
        while parent[x as usize] != x {
            parent[x as usize] = parent[parent[x as usize] as usize];
            x = parent[x as usize];
        }
        x
    }
    for &[a, b, c] in &topology.triangles {
        for other in [b, c] {
            let (x, y) = (root(&mut parent, a), root(&mut parent, other));
            parent[x.max(y) as usize] = x.min(y);
        }
    }
    let mut volumes = BTreeMap::new();
    for &corners in &topology.triangles {
        // About a point of the shell itself, so that far shells lose no digits.
        let id = root(&mut parent, corners[0]);
        let origin = topology.positions[id as usize];
        let [a, b, c] =
            corners.map(|v| topology.positions[v as usize].as_dvec3() - origin.as_dvec3());
        volumes.entry(id).or_insert((origin, 0.0)).1 += a.dot(b.cross(c)) / 6.0;
    }
    volumes.into_values().collect()
}

#[test]
fn every_shell_faces_outward() {
    for (name, entry) in STATION.catalogue.iter().filter(|(name, _)| *name != "ground") {
        for mesh in &entry.model.meshes {
            for (place, volume) in shell_volumes(&mesh.topology()) {
                assert!(volume > 1e-7, "{name}: the shell at {place} has {volume} m3");
            }
        }
    }
}

#[test]
fn the_ground_faces_up() {
    let ground = STATION.catalogue.get("ground").unwrap();
    assert!(ground.model.meshes[0].wedges.normal.iter().all(|n| n.y > 0.99));
}

#[test]
fn equipment_ids_are_unique() {
    let mut seen = HashSet::new();
    for placement in &STATION.placements {
        assert!(seen.insert(placement.id()), "{} is used twice", placement.id());
    }
    assert!(seen.contains("=S12D1Q3-QB9-L1") && seen.contains("=S12T1-TA1"));
}

#[test]
fn the_configuration_has_no_faults() {
    let text = serde_json::to_string_pretty(&STATION.configuration()).unwrap();
    let config = busbar_config::parse(&text).unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert!(config.warnings.is_empty(), "{:?}", config.warnings);
    for camera in ["overview", "bay", "transformer"] {
        assert!(text.contains(&format!("\"{camera}\": {{")), "no camera '{camera}'");
    }
    for placement in &STATION.placements {
        assert!(text.contains(&format!("\"id\": \"{}\"", placement.id())));
    }
}

#[test]
fn points_are_as_many_as_such_a_station_has() {
    let points = points();
    let count = |kind| points.iter().filter(|p| p.kind == kind).count();
    assert!((5_300..=5_500).contains(&points.len()), "{} points", points.len());
    assert!((680..=720).contains(&count(PointKind::Analog)));
    assert!((200..=230).contains(&count(PointKind::Double)));
    assert!((3_000..=3_200).contains(&count(PointKind::Single)));
    assert!((350..=370).contains(&count(PointKind::Control)));
    assert!((1_000..=1_080).contains(&count(PointKind::Monitoring)));
    let ids: HashSet<&str> = points.iter().map(|p| p.id.as_str()).collect();
    assert_eq!(ids.len(), points.len(), "an id is used twice");
}

#[test]
fn points_have_units_ranges_scan_rates_and_equipment() {
    let equipment: HashSet<String> =
        STATION.placements.iter().flat_map(|p| [p.id(), p.device_id()]).collect();
    for point in points() {
        let place = format!("{} of {}", point.id, point.equipment);
        assert!(equipment.contains(&point.equipment), "{place}: no such equipment");
        assert!(point.low < point.high, "{place}");
        let is_value = matches!(point.kind, PointKind::Analog | PointKind::Monitoring);
        assert_eq!(!point.unit.is_empty(), is_value, "{place}");
        // From a second to a day.
        assert!((1_000..=86_400_000).contains(&point.scan_millis), "{place}");
        if point.kind == PointKind::Double {
            assert_eq!((point.low, point.high), (0.0, 3.0), "{place}");
        }
    }
}
