//! Meshes at any cursor against the paper's sequential process, one collapse after the other: for
//! every optimiser and order, on meshes with hard edges.

use busbar_geometry::{Collapse, CollapseSequence, CollapseStacks, Mesh, RawPrimitive, weld};
use busbar_gltf_import::{ImportLimits, import_file};
use busbar_plugin_host::{Catalog, MeshOptimizer};
use e2e::{Scene, workspace_path};
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

/// Number of compared cursors for each mesh and order.
const CURSORS: usize = 1000;
/// Greatest number of wedges of a position among which a parent is chosen.
const MAX_CANDIDATES: usize = 64;

/// Lists every order of collapses.
fn orders() -> [(&'static str, Value); 4] {
    [
        ("weighted_collapse", json!({ "order": "paper" })),
        ("weighted_collapse", json!({ "order": "guarded" })),
        ("weighted_collapse", json!({ "order": "reweighted" })),
        ("quadric_collapse", json!({})),
    ]
}

/// Sequential collapse of wedges by the paper's definition, without death indices or tables.
struct Process<'a> {
    mesh: &'a Mesh,
    /// Live triangles, as wedges; `None` for a dead one.
    triangles: Vec<Option<[u32; 3]>>,
    /// Triangles that have, or had, a corner at each position.
    around: Vec<Vec<u32>>,
    first_wedge: Vec<usize>,
}

impl<'a> Process<'a> {
    fn new(mesh: &'a Mesh) -> Self {
        let mut around = vec![Vec::new(); mesh.positions.len()];
        for (index, &triangle) in (0..).zip(&mesh.triangles) {
            mesh.corner_positions(triangle).iter().for_each(|&p| around[p as usize].push(index));
        }
        let mut first_wedge = vec![usize::MAX; mesh.positions.len()];
        for (wedge, &position) in mesh.wedges.position.iter().enumerate() {
            let first = &mut first_wedge[position as usize];
            *first = wedge.min(*first);
        }
        Self {
            mesh,
            triangles: mesh.triangles.iter().copied().map(Some).collect(),
            around,
            first_wedge,
        }
    }

    fn collapse(&mut self, entry: &Collapse) {
        let wedges = &self.mesh.wedges;
        for index in std::mem::take(&mut self.around[entry.removed as usize]) {
            let Some(mut corners) = self.triangles[index as usize] else { continue };
            for corner in &mut corners {
                if wedges.position[*corner as usize] == entry.removed {
                    *corner = self.heir(*corner, entry.kept);
                }
            }
            let [a, b, c] = self.mesh.corner_positions(corners);
            self.triangles[index as usize] = (a != b && b != c && c != a).then_some(corners);
            self.around[entry.kept as usize].push(index);
        }
    }

    /// Returns the wedge of `kept` that fits a wedge best.
    fn heir(&self, wedge: u32, kept: u32) -> u32 {
        let wedges = &self.mesh.wedges;
        let wedge = wedge as usize;
        let first = self.first_wedge[kept as usize];
        let candidates = (first..wedges.len()).take_while(|&w| wedges.position[w] == kept);
        let mut best: Option<(bool, f32, usize)> = None;
        for candidate in candidates.take(MAX_CANDIDATES) {
            let bend = 1.0 - wedges.normal[wedge].dot(wedges.normal[candidate]);
            let misfit = bend + wedges.uv[wedge].distance(wedges.uv[candidate]);
            let foreign = wedges.section[wedge] != wedges.section[candidate];
            if best.is_none_or(|(f, m, _)| (foreign, misfit) < (f, m)) {
                best = Some((foreign, misfit, candidate));
            }
        }
        best.expect("every position has a wedge").2 as u32
    }
}

/// Returns the next number of SplitMix64 (Steele et al., OOPSLA 2014).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

fn assert_cursors(name: &str, mesh: &Mesh, sequence: &CollapseSequence, count: usize) {
    let stacks = CollapseStacks::build(mesh.clone(), sequence);
    let whole = stacks.resolve(0).triangles;
    assert_eq!(whole, mesh.triangles, "{name}");
    let mut state = 7;
    let mut cursor = || (random(&mut state) % (u64::from(sequence.len()) + 1)) as u32;
    let mut cursors: Vec<u32> = (0..count).map(|_| cursor()).collect();
    cursors.push(stacks.cursor_for_theta(0.95));
    cursors.sort_unstable();
    let mut process = Process::new(mesh);
    let mut done = 0;
    for &cursor in &cursors {
        let entries = &sequence.entries()[done..cursor as usize];
        entries.iter().for_each(|entry| process.collapse(entry));
        done = cursor as usize;
        let resolved = stacks.resolve(cursor).triangles;
        let expected = process.triangles.iter().flatten();
        assert!(resolved.iter().eq(expected), "{name}: cursor {cursor} is another mesh");
        assert_eq!(stacks.live_triangles(cursor), resolved.len() as u64, "{name}: {cursor}");
    }
    assert!(stacks.resolve(0).triangles == whole, "{name}: nothing is lost");
}

fn assert_all_orders(meshes: &[Mesh], count: usize) {
    let scene = Scene::without_tags();
    let catalog = Catalog::discover(&[scene.path("plugins")]);
    for (plugin, settings) in orders() {
        let optimizer = catalog
            .create("optimizer", plugin, &settings)
            .and_then(MeshOptimizer::from_instance)
            .unwrap_or_else(|fault| panic!("{fault}"));
        let mut collapses = 0;
        for mesh in meshes {
            let optimised = optimizer.optimize(mesh, |_| true);
            let sequence = optimised.unwrap_or_else(|fault| panic!("{fault}")).sequence;
            collapses += sequence.len() as usize;
            assert_cursors(&format!("{plugin} {settings}"), mesh, &sequence, count);
        }
        let positions: usize = meshes.iter().map(|mesh| mesh.positions.len()).sum();
        assert!(collapses > positions / 4, "{plugin} {settings}: {collapses} of {positions}");
    }
}

/// Builds a hill of two materials with a texture seam and a sharp ridge.
fn patchwork() -> Mesh {
    const SIDE: u32 = 30;
    let half = |material: u32| {
        let columns = SIDE / 2;
        let mut primitive = RawPrimitive { material: Some(material), ..Default::default() };
        // Vertices are split along the middle: another texture there.
        for stripe in 0..2 {
            let first = primitive.positions.len() as u32;
            for (row, column) in (0..=columns).flat_map(|r| (0..=columns).map(move |c| (r, c))) {
                let (x, z) = (column + material * columns, row + stripe * columns);
                let height = (0.3 * x as f32).sin() * 3.0 - (z as f32 - SIDE as f32 / 2.0).abs();
                primitive.positions.push(Vec3::new(x as f32, height, z as f32));
                let lean = if stripe == 0 { -Vec3::Z } else { Vec3::Z };
                primitive.normals.push((Vec3::Y + lean).normalize());
                primitive.uvs.push(Vec2::new(x as f32, z as f32 + 100.0 * stripe as f32) / 30.0);
            }
            for (row, column) in (0..columns).flat_map(|r| (0..columns).map(move |c| (r, c))) {
                let a = first + row * (columns + 1) + column;
                let below = a + columns + 1;
                primitive.triangles.extend([[a, below, a + 1], [a + 1, below, below + 1]]);
            }
        }
        primitive
    };
    let (mesh, _) = weld(&[half(0), half(1)]).expect("it is valid");
    assert!(mesh.wedges.len() > mesh.positions.len(), "it has seams");
    mesh
}

#[test]
fn any_cursor_is_the_sequential_process() {
    let transformer = workspace_path("config/models/transformer.glb");
    let model = import_file(&transformer, &ImportLimits::default()).expect("it is valid").model;
    assert_all_orders(&[patchwork()], CURSORS);
    assert_all_orders(&model.meshes, CURSORS);
}

/// Runs by name in a release build; takes minutes.
#[test]
#[ignore = "takes minutes"]
fn any_cursor_of_large_meshes_is_the_sequential_process() {
    let scene = Scene::without_tags();
    let corpus = [corpus::breaker(), corpus::scan()].map(|m| m.expect("it can be made"));
    let station = substation::Station::generate(1).expect("it can be generated");
    let paper = station.flatten().expect("it can be made one mesh").model;
    for model in corpus.into_iter().chain([paper]) {
        let file = busbar_gltf_export::write_glb(&model).expect("it can be written");
        let path = scene.path("corpus.glb");
        std::fs::write(&path, file).expect("the folder can be written");
        let model = import_file(&path, &ImportLimits::default()).expect("it is valid").model;
        assert_all_orders(&model.meshes, CURSORS);
    }
}
