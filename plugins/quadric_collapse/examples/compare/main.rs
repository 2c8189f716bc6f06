//! `compare FILE.glb...` sets the whole sequence of `quadric_collapse` beside
//! meshoptimizer's `simplify`, on all meshes of a file as one.
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

mod distance;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use busbar_geometry::{Collapse, CollapseSequence, Mesh, Topology, theta_to_cursor};
use busbar_gltf_import::{ImportLimits, import_file};
use busbar_plugin_sdk as sdk;
use busbar_plugin_sdk::{MeshOptimizer, Plugin};
use glam::{DVec3, Mat3, Mat4};
use meshopt::{SimplifyOptions, VertexDataAdapter};
use peak_alloc::PeakAlloc;
use quadric_collapse::{QuadricCollapse, Settings};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Samples each way.
const SAMPLES: usize = 100_000;
/// Runs of which the fastest counts.
const RUNS: usize = 3;
const THETAS: [f64; 3] = [0.70, 0.85, 0.95];

fn main() -> Result<()> {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    if paths.is_empty() {
        bail!("name one or more .glb files");
    }
    for path in paths {
        let mesh = load(Path::new(&path))?;
        println!("{path}");
        compare(&mesh)?;
    }
    Ok(())
}

/// All meshes of a file where its nodes put them, as one.
fn load(path: &Path) -> Result<Mesh> {
    let model = import_file(path, &ImportLimits::default())?.model;
    let transforms = model.model_from_nodes();
    let mut all = Mesh::default();
    for (node, model_from_node) in model.nodes.iter().zip(transforms) {
        let Some(mesh) = node.mesh.and_then(|mesh| model.meshes.get(mesh as usize)) else {
            continue;
        };
        append(&mut all, mesh, model_from_node);
    }
    Ok(all)
}

fn append(all: &mut Mesh, mesh: &Mesh, model_from_mesh: Mat4) {
    let normals = Mat3::from_mat4(model_from_mesh.inverse()).transpose();
    let (positions, wedges) = (all.positions.len() as u32, all.wedges.len() as u32);
    let sections = all.sections.len() as u32;
    all.positions.extend(mesh.positions.iter().map(|&p| model_from_mesh.transform_point3(p)));
    all.wedges.position.extend(mesh.wedges.position.iter().map(|p| p + positions));
    all.wedges.normal.extend(mesh.wedges.normal.iter().map(|&n| (normals * n).normalize_or_zero()));
    all.wedges.uv.extend(&mesh.wedges.uv);
    all.wedges.section.extend(mesh.wedges.section.iter().map(|s| s + sections));
    all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|wedge| wedge + wedges)));
    all.sections.extend(mesh.sections.iter().cloned());
}

fn compare(mesh: &Mesh) -> Result<()> {
    let topology = mesh.topology();
    let (vertices, triangles) = (topology.positions.len(), topology.triangles.len());
    println!("  {vertices} vertices, {triangles} triangles, {} wedges", mesh.wedges.len());
    let baseline = Baseline::new(&topology)?;
    let input = Input::new(mesh, &topology);
    let mut seconds = [f64::INFINITY; 2];
    let mut sequence = None;
    let mut peak = 0;
    for _ in 0..RUNS {
        let start = Instant::now();
        baseline.simplify(triangles * 3 / 10 * 3);
        seconds[0] = seconds[0].min(start.elapsed().as_secs_f64());
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let start = Instant::now();
        let list = input.optimize()?;
        seconds[1] = seconds[1].min(start.elapsed().as_secs_f64());
        peak = MEMORY.peak_usage() - before;
        println!("    {:?}", list.stages());
        sequence = Some(list);
    }
    let list = sequence.context("no run was made")?.collapses;
    let entries =
        list.iter().map(|c| Collapse { removed: c.removed, kept: c.kept, error: c.error });
    let sequence = CollapseSequence::new(entries.collect(), vertices as u32)?;
    println!(
        "  meshoptimizer to 30 % {:.3} s; whole sequence {:.3} s, {:.2} times; {} bytes a triangle",
        seconds[0],
        seconds[1],
        seconds[1] / seconds[0],
        peak / triangles.max(1)
    );
    println!("  {} collapses, {} vertices stay", sequence.len(), vertices as u32 - sequence.len());
    table(&topology, &sequence, &baseline);
    Ok(())
}

/// A mesh as a plugin gets it.
struct Input<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
}

impl<'a> Input<'a> {
    fn new(mesh: &'a Mesh, topology: &'a Topology) -> Self {
        Self {
            mesh,
            topology,
            positions: topology.positions.iter().map(|p| p.to_array()).collect(),
            normals: mesh.wedges.normal.iter().map(|n| n.to_array()).collect(),
            uvs: mesh.wedges.uv.iter().map(|uv| uv.to_array()).collect(),
        }
    }

    fn optimize(&self) -> Result<sdk::CollapseList> {
        let plugin = QuadricCollapse::create(Settings::default(), sdk::testing::host())?;
        let view = sdk::Mesh {
            positions: &self.positions,
            triangles: &self.topology.triangles,
            wedges: Some(sdk::Wedges {
                corners: &self.mesh.triangles,
                positions: &self.mesh.wedges.position,
                normals: &self.normals,
                uvs: &self.uvs,
                sections: &self.mesh.wedges.section,
            }),
        };
        Ok(plugin.optimize(view, &mut sdk::Progress::unwatched())?)
    }
}

/// meshoptimizer on welded positions.
struct Baseline<'a> {
    topology: &'a Topology,
    adapter: VertexDataAdapter<'a>,
}

impl<'a> Baseline<'a> {
    fn new(topology: &'a Topology) -> Result<Self> {
        // Three floats, packed: Vec3 is repr(C).
        let bytes = meshopt::typed_to_bytes(&topology.positions);
        Ok(Self { topology, adapter: VertexDataAdapter::new(bytes, 12, 0)? })
    }

    fn simplify(&self, index_count: usize) -> Vec<u32> {
        let indices = self.topology.triangles.as_flattened();
        let options = SimplifyOptions::None;
        meshopt::simplify(indices, &self.adapter, index_count, f32::MAX, options, None)
    }

    /// The level whose vertex count is nearest to a wanted one.
    fn at_vertices(&self, wanted: usize) -> (Vec<[u32; 3]>, usize) {
        let (mut low, mut high) = (0, self.topology.triangles.len());
        let mut best: Option<(Vec<[u32; 3]>, usize)> = None;
        for _ in 0..12 {
            let middle = (low + high) / 2;
            let level = self.simplify(middle * 3).as_chunks().0.to_vec();
            let mut used = vec![false; self.topology.positions.len()];
            level.as_flattened().iter().for_each(|&v| used[v as usize] = true);
            let count = used.iter().filter(|&&used| used).count();
            if count > wanted {
                high = middle
            } else {
                low = middle
            }
            if best.as_ref().is_none_or(|b| count.abs_diff(wanted) < b.1.abs_diff(wanted)) {
                best = Some((level, count));
            }
        }
        best.unwrap_or_default()
    }
}

fn table(topology: &Topology, sequence: &CollapseSequence, baseline: &Baseline<'_>) {
    let whole = corners(topology, &topology.triangles);
    let (min, max) = whole
        .iter()
        .flatten()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)));
    let diagonal = min.distance(max);
    let to_whole = |level: &[[u32; 3]]| {
        let (mean, largest) = distance::two_sided(&whole, &corners(topology, level), SAMPLES);
        (mean / diagonal, largest / diagonal)
    };
    println!("  distances are shares of the diagonal, {diagonal:.2} m; meshoptimizer second");
    println!(
        "  theta {:^17} {:^17} {:>6} {:>9} {:^21} {:>6} {:^21}",
        "vertices", "triangles", "dup. %", "error, m", "mean distance", "ratio", "largest distance"
    );
    for theta in THETAS {
        let cursor = theta_to_cursor(theta, sequence.position_count(), sequence.len());
        let ours = level(topology, sequence, cursor);
        let vertices = (sequence.position_count() - cursor) as usize;
        let (theirs, their_vertices) = baseline.at_vertices(vertices);
        let error = sequence.entries()[..cursor as usize].last().map_or(0.0, |e| e.error);
        let duplicates = duplicates(&ours) as f64 / ours.len().max(1) as f64 * 100.0;
        let (our, their) = (to_whole(&ours), to_whole(&theirs));
        println!(
            "  {theta:.2} {vertices:>9} {their_vertices:>8} {:>8} {:>8} {duplicates:>6.3} \
             {error:>9.5} {:>10.3e} {:>10.3e} {:>6.3} {:>10.3e} {:>10.3e}",
            ours.len(),
            theirs.len(),
            our.0,
            their.0,
            our.0 / their.0,
            our.1,
            their.1,
        );
    }
}

fn corners(topology: &Topology, triangles: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
    let corner = |&v: &u32| topology.positions[v as usize].as_dvec3();
    triangles.iter().map(|t| t.each_ref().map(corner)).collect()
}

/// Live triangles at a cursor.
fn level(topology: &Topology, sequence: &CollapseSequence, cursor: u32) -> Vec<[u32; 3]> {
    let mut stands_for: Vec<u32> = (0..topology.positions.len() as u32).collect();
    for entry in sequence.entries()[..cursor as usize].iter().rev() {
        stands_for[entry.removed as usize] = stands_for[entry.kept as usize];
    }
    let moved = topology.triangles.iter().map(|t| t.map(|v| stands_for[v as usize]));
    moved.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

/// Triangles on the same three vertices as another, either way round.
fn duplicates(triangles: &[[u32; 3]]) -> usize {
    let mut sorted: Vec<_> = triangles
        .iter()
        .map(|t| {
            let mut t = *t;
            t.sort_unstable();
            t
        })
        .collect();
    sorted.sort_unstable();
    sorted.chunk_by(|a, b| a == b).map(|run| run.len() - 1).sum()
}
