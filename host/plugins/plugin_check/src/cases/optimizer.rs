//! Optimisers: sequences that are valid, lossless and the same each time.

use std::ffi::c_void;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use busbar_geometry::{Collapse, CollapseSequence, CollapseStacks, Mesh};
use busbar_plugin_abi as abi;

use super::plugin_instance::{Instance, required};
use crate::finding::{Finding, Outcome, Stop};
use crate::meshes;
use crate::probe::Probe;
use crate::text;

type Optimize = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarMesh,
    *const abi::BusbarProgress,
    *mut abi::BusbarCollapseOutput,
    *mut abi::BusbarError,
) -> abi::BusbarStatusNumber;

/// Room for stages, as in the host.
const STAGES: usize = 32;
/// Elements behind the end of a buffer that must stay as they are.
const CANARIES: usize = 16;
const CANARY: abi::BusbarCollapse =
    abi::BusbarCollapse { removed: 0xa5a5_a5a5, kept: 77, error: -7.5 };
const STAGE_CANARY: abi::BusbarStage = abi::BusbarStage { name: [0xa5; 24], millis: -7.5 };
/// Threads that optimise one mesh at once.
const THREADS: usize = 3;
/// Cursors at which a mesh is taken down and up again.
const ROUND_TRIPS: u32 = 24;
/// Longest time from a cancellation to the end of the call.
const MAX_CANCEL: Duration = Duration::from_secs(1);
/// A mesh that takes a while: cells along each side.
const LARGE_SIDE: u32 = 160;

pub(crate) fn function(instance: &Instance<'_>) -> Result<Optimize, Stop> {
    let table: &abi::BusbarMeshOptimizer = instance.capability(abi::MESH_OPTIMIZER_ID)?;
    required(table.optimize, "optimize")
}

/// A mesh as the ABI has it.
pub(crate) struct RawMesh {
    pub(crate) raw: abi::BusbarMesh,
    _triangles: Vec<[u32; 3]>,
}

// SAFETY: its pointers lead to memory that nobody changes while it is shared.
unsafe impl Sync for RawMesh {}

pub(crate) fn raw_mesh(mesh: &Mesh) -> RawMesh {
    let triangles: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corner_positions(t)).collect();
    let raw = abi::BusbarMesh {
        struct_size: size_of::<abi::BusbarMesh>() as u32,
        position_count: mesh.positions.len() as u32,
        triangle_count: triangles.len() as u32,
        reserved: 0,
        positions: mesh.positions.as_ptr().cast(),
        triangles: triangles.as_ptr().cast(),
        wedge_count: mesh.wedges.len() as u32,
        wedge_reserved: 0,
        corners: mesh.triangles.as_ptr().cast(),
        wedge_positions: mesh.wedges.position.as_ptr(),
        wedge_normals: mesh.wedges.normal.as_ptr().cast(),
        wedge_uvs: mesh.wedges.uv.as_ptr().cast(),
        wedge_sections: mesh.wedges.section.as_ptr(),
    };
    RawMesh { raw, _triangles: triangles }
}

/// The mesh as from a host without attributes.
fn bare(mut mesh: RawMesh) -> RawMesh {
    mesh.raw.wedge_count = 0;
    mesh.raw.corners = std::ptr::null();
    mesh.raw.wedge_positions = std::ptr::null();
    mesh.raw.wedge_normals = std::ptr::null();
    mesh.raw.wedge_uvs = std::ptr::null();
    mesh.raw.wedge_sections = std::ptr::null();
    mesh
}

/// Buffers for a result, with canaries behind their ends.
pub(crate) struct Output {
    pub(crate) raw: abi::BusbarCollapseOutput,
    collapses: Vec<abi::BusbarCollapse>,
    stages: Vec<abi::BusbarStage>,
}

impl Output {
    pub(crate) fn for_mesh(mesh: &RawMesh) -> Self {
        let count = mesh.raw.position_count;
        let mut collapses = vec![CANARY; count as usize + CANARIES];
        let mut stages = vec![STAGE_CANARY; STAGES + CANARIES];
        let raw = abi::BusbarCollapseOutput {
            struct_size: size_of::<abi::BusbarCollapseOutput>() as u32,
            collapse_capacity: count,
            collapse_count: 0,
            stage_capacity: STAGES as u32,
            stage_count: 0,
            flags: 0,
            collapses: collapses.as_mut_ptr(),
            stages: stages.as_mut_ptr(),
        };
        Self { raw, collapses, stages }
    }

    /// Expects intact guards behind the buffers.
    pub(crate) fn expect_canaries(&self, probe: &Probe, what: &str) {
        let room = (self.raw.collapse_capacity as usize).min(self.collapses.len() - CANARIES);
        let same = |c: &abi::BusbarCollapse| {
            (c.removed, c.kept, c.error.to_bits())
                == (CANARY.removed, CANARY.kept, CANARY.error.to_bits())
        };
        let whole = self.collapses[room..].iter().all(same)
            && self.stages[STAGES..].iter().all(|s| s.name == STAGE_CANARY.name);
        let fault = format!("`optimize` writes beyond the end of its buffers, given {what}");
        probe.expect(whole, fault, "write at most `collapse_capacity` and `stage_capacity`");
    }

    /// The sequence, checked as the host checks it.
    fn sequence(&self, probe: &Probe, what: &str) -> Result<CollapseSequence, Stop> {
        self.expect_canaries(probe, what);
        let count = self.raw.collapse_count;
        if count > self.raw.collapse_capacity || self.raw.stage_count > self.raw.stage_capacity {
            let fault =
                format!("`optimize` claims more results than it had room for, given {what}");
            return Err(Finding::new(fault, "set the counts to what was written").into());
        }
        for stage in &self.stages[..self.raw.stage_count as usize] {
            let len = stage.name.iter().position(|&b| b == 0).unwrap_or(stage.name.len());
            let good = std::str::from_utf8(&stage.name[..len]).is_ok()
                && stage.millis.is_finite()
                && stage.millis >= 0.0;
            let fault = "a stage has a name that is not UTF-8 or an impossible time";
            probe.expect(good, fault, "pad the name with zeros; give milliseconds");
        }
        let entries = self.collapses[..count as usize].iter();
        let entry =
            |c: &abi::BusbarCollapse| Collapse { removed: c.removed, kept: c.kept, error: c.error };
        let positions = self.collapses.len() - CANARIES;
        CollapseSequence::new(entries.map(entry).collect(), positions as u32).map_err(|error| {
            let fault = format!("the sequence is invalid, given {what}: {error}");
            Finding::new(fault, "see BusbarCollapse in the header").into()
        })
    }
}

/// Progress callback that cancels from a certain report on.
struct ProgressRecord {
    reports: AtomicU64,
    stop_at: u64,
    bad_fractions: AtomicU64,
    asked: std::sync::Mutex<Option<Instant>>,
}

unsafe extern "C" fn report(context: *mut c_void, fraction: f32) -> u32 {
    // SAFETY: a plugin passes the context of its progress, or breaks the ABI.
    let Some(watch) = (unsafe { context.cast::<ProgressRecord>().as_ref() }) else { return 1 };
    let reports = watch.reports.fetch_add(1, Ordering::Relaxed) + 1;
    if !(0.0..=1.0).contains(&fraction) {
        watch.bad_fractions.fetch_add(1, Ordering::Relaxed);
    }
    if reports < watch.stop_at {
        return 1;
    }
    let mut asked = watch.asked.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    asked.get_or_insert_with(Instant::now);
    0
}

impl ProgressRecord {
    fn new(stop_at: u64) -> Self {
        Self {
            reports: AtomicU64::new(0),
            stop_at,
            bad_fractions: AtomicU64::new(0),
            asked: std::sync::Mutex::new(None),
        }
    }

    fn progress(&self) -> abi::BusbarProgress {
        abi::BusbarProgress {
            struct_size: size_of::<abi::BusbarProgress>() as u32,
            reserved: 0,
            context: std::ptr::from_ref(self).cast_mut().cast(),
            report: Some(report),
        }
    }
}

/// Runs an optimiser to the end.
fn optimized(
    probe: &Probe,
    instance: &Instance<'_>,
    mesh: &RawMesh,
    what: &str,
) -> Result<CollapseSequence, Stop> {
    let optimize = function(instance)?;
    let (mut error, mut output) = (abi::BusbarError::empty(), Output::for_mesh(mesh));
    let watch = ProgressRecord::new(u64::MAX);
    let progress = watch.progress();
    let plugin = instance.as_ptr();
    let status =
        probe.optimize(optimize, plugin, &mesh.raw, &progress, &mut output.raw, &mut error);
    probe.expect_ok(&format!("optimize of {what}"), status, &error)?;
    let bad = watch.bad_fractions.load(Ordering::Relaxed);
    let fault = format!("{bad} reports of progress are outside 0 to 1");
    probe.expect(bad == 0, fault, "report the share that is done");
    output.sequence(probe, what)
}

pub(crate) fn use_briefly(probe: &Probe, instance: &Instance<'_>) -> Outcome {
    let mesh = meshes::hilly(4, 4);
    optimized(probe, instance, &raw_mesh(&mesh), "a small mesh").map(drop)
}

pub(crate) fn limits(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::MESH_OPTIMIZER_ID)?;
    let instance = subject.make(probe)?;
    for (what, mesh) in meshes::odd() {
        let sequence = optimized(probe, &instance, &raw_mesh(&mesh), what)?;
        round_trip(probe, &mesh, &sequence, what);
    }
    let large = meshes::hilly(LARGE_SIDE, LARGE_SIDE);
    optimized(probe, &instance, &raw_mesh(&large), "a surface of 51,200 triangles")?;
    let mesh = meshes::hilly(8, 8);
    optimized(probe, &instance, &bare(raw_mesh(&mesh)), "a mesh without attributes")?;
    instance.destroy()
}

pub(crate) fn sequence(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::MESH_OPTIMIZER_ID)?;
    let instance = subject.make(probe)?;
    let mesh = meshes::hilly(30, 20);
    let raw = raw_mesh(&mesh);
    let what = "a surface of 1200 triangles";
    let first = optimized(probe, &instance, &raw, what)?;
    let fault = format!("it finds nothing to collapse in {what}");
    probe.expect(!first.is_empty(), fault, "give the whole sequence, down to very little");
    round_trip(probe, &mesh, &first, what);
    let remedy = "the same mesh and settings must give the same sequence, bit for bit: no \
                  randomness, no order of a hash table, no shared state";
    let second = optimized(probe, &instance, &raw, what)?;
    probe.expect(first == second, "a second call gives another sequence", remedy);
    let table: &abi::BusbarMeshOptimizer = instance.capability(abi::MESH_OPTIMIZER_ID)?;
    if table.flags & abi::BUSBAR_OPTIMIZER_NO_WEDGES != 0 {
        let bare = optimized(probe, &instance, &bare(raw_mesh(&mesh)), what)?;
        let fault = "its flags say that it reads no wedges, and without them it gives another \
                     sequence";
        probe.expect(bare == first, fault, "leave BUSBAR_OPTIMIZER_NO_WEDGES out of `flags`");
    }
    let results = std::thread::scope(|scope| {
        let work = || optimized(probe, &instance, &raw, what);
        let threads: Vec<_> = (0..THREADS).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join()).collect::<Vec<_>>()
    });
    for result in results {
        let result = result.unwrap_or_else(|_| Err(Stop::Skip("the checker failed".into())));
        let same = result? == first;
        probe.expect(same, "calls at once, from several threads, give other sequences", remedy);
    }
    instance.destroy()
}

/// Down to a theta and back again gives every triangle back.
fn round_trip(probe: &Probe, mesh: &Mesh, sequence: &CollapseSequence, what: &str) {
    let stacks = CollapseStacks::build(mesh.clone(), sequence);
    let whole = stacks.resolve(0).triangles;
    let remedy = "report this: the sequence is valid, so the fault may be Busbar's";
    let fault = format!("nothing collapsed is not the mesh as it was, given {what}");
    probe.expect(whole.len() == mesh.triangles.len(), fault, remedy);
    let last = sequence.len();
    for step in 0..=ROUND_TRIPS {
        let cursor = (u64::from(last) * u64::from(step) / u64::from(ROUND_TRIPS)) as u32;
        let down = stacks.resolve(cursor);
        let in_range =
            down.triangles.as_flattened().iter().all(|&w| (w as usize) < mesh.wedges.len());
        let back = stacks.resolve(0).triangles;
        let again = stacks.resolve(cursor).triangles;
        let fault =
            format!("going to {cursor} of {last} collapses and back loses data, given {what}");
        probe.expect(in_range && back == whole && again == down.triangles, fault, remedy);
    }
}

pub(crate) fn cancel(probe: &Probe) -> Outcome {
    let subject = probe.subject_with(abi::MESH_OPTIMIZER_ID)?;
    let instance = subject.make(probe)?;
    let optimize = function(&instance)?;
    let mesh = meshes::hilly(LARGE_SIDE, LARGE_SIDE);
    let raw = raw_mesh(&mesh);
    for stop_at in [1, 2, 10] {
        let (mut error, mut output) = (abi::BusbarError::empty(), Output::for_mesh(&raw));
        let watch = ProgressRecord::new(stop_at);
        let progress = watch.progress();
        let begun = Instant::now();
        let plugin = instance.as_ptr();
        let status =
            probe.optimize(optimize, plugin, &raw.raw, &progress, &mut output.raw, &mut error);
        let asked = watch.asked.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let Some(asked) = *asked else {
            let took = begun.elapsed();
            probe.expect(
                took <= MAX_CANCEL,
                format!(
                    "it worked for {} ms and reported progress fewer than {stop_at} times",
                    took.as_millis()
                ),
                "report progress several times a second, so that a user can cancel",
            );
            continue;
        };
        let took = asked.elapsed();
        let fault = format!("it went on for {} ms after it was asked to stop", took.as_millis());
        let remedy = "return BUSBAR_CANCELLED as soon as `report` returns 0";
        probe.expect(took <= MAX_CANCEL, fault, remedy);
        let fault = format!("asked to stop, it returned {}", text::status_name(status));
        probe.expect(status == abi::BUSBAR_CANCELLED, fault, remedy);
    }
    // It still works afterwards.
    use_briefly(probe, &instance)?;
    instance.destroy()
}
