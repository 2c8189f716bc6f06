//! Parallel simplification of all shells, merged into one collapse sequence.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use busbar_plugin_sdk::{Collapse, Error, Progress};
use glam::DVec3;
use mesh_shells::Shells;

use crate::Limits;
use crate::collapse_cost::Source;
use crate::pieces::{CutParts, Remainder, center};
use crate::reduce::{ProgressCallback, Reducer, Step};

/// Vertices that a thread takes at once, as whole shells.
const BATCH: usize = 8192;
/// Greatest number of threads.
const MAX_THREADS: usize = 64;
/// Greatest number of times that a large shell is cut; each time a quarter is left.
const MAX_LEVELS: usize = 12;
/// A shell of which a level leaves more than this share is cut no more.
const MAX_LEFT: f64 = 0.8;
/// Interval of progress reports while other threads work.
const WATCH_INTERVAL: Duration = Duration::from_millis(5);

/// Computes the steps of all shells, the same for any number of threads: a step comes behind those
/// that it builds on.
///
/// # Errors
/// [`Error::cancelled`].
pub(crate) fn reduce_all(
    source: Source<'_, '_>,
    limits: &Limits,
    progress: &mut Progress<'_>,
) -> Result<Vec<Step>, Error> {
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get());
    let pool = WorkerPool {
        source,
        threads: cores.min(limits.threads).clamp(1, MAX_THREADS),
        vertices_done: AtomicUsize::new(0),
        cancelled: AtomicBool::new(false),
    };
    let mut steps = Vec::with_capacity(source.mesh.positions.len());
    let is_large =
        |shell: &usize| source.shells.triangle_range(*shell).len() > limits.part_triangles;
    let mut large: Vec<LargeShell> = (0..source.shells.len())
        .filter(is_large)
        .map(|shell| LargeShell::new(source, shell))
        .collect();
    for level in 0..MAX_LEVELS {
        if !pool.cut_down(&mut large, level, limits.part_triangles, &mut steps, progress)? {
            break;
        }
    }
    let jobs: Vec<Job<'_>> =
        large.iter().map(Job::Remainder).chain(batches(source.shells, is_large)).collect();
    for finished in pool.work(jobs.len(), progress, |index, worker, watch| {
        let mut steps = Vec::new();
        let goes_on = match &jobs[index] {
            Job::Remainder(LargeShell { remainder, center, .. }) => {
                let Worker { reducer, places } = worker;
                places.resize(source.mesh.positions.len(), 0);
                reducer.reduce_remainder(source, remainder, *center, places, &mut steps, watch)
            }
            Job::Shells(shells) => shells
                .clone()
                .filter(|shell| !is_large(shell))
                .all(|shell| worker.reducer.reduce(source, shell, &mut steps, watch)),
        };
        goes_on.then_some(steps)
    })? {
        steps.extend(finished);
    }
    Ok(steps)
}

/// Job of one thread.
enum Job<'a> {
    Remainder(&'a LargeShell),
    /// Range of small shells.
    Shells(Range<usize>),
}

/// A shell that is worked on in parts.
struct LargeShell {
    remainder: Remainder,
    /// The origin of its quadrics.
    center: DVec3,
    /// Progress of cutting: whether another level still gains something.
    shrinks: bool,
}

impl LargeShell {
    fn new(source: Source<'_, '_>, shell: usize) -> Self {
        let remainder = Remainder::from_shell(source.mesh, source.shells, shell);
        let center = center(source.mesh, &remainder.vertices);
        Self { remainder, center, shrinks: true }
    }
}

/// Buffers that a thread keeps from job to job.
#[derive(Default)]
struct Worker {
    reducer: Reducer,
    /// A place for each vertex of the mesh, where parts are worked on.
    places: Vec<u32>,
}

/// Threads that work on the jobs.
struct WorkerPool<'a, 'm> {
    source: Source<'a, 'm>,
    threads: usize,
    vertices_done: AtomicUsize,
    cancelled: AtomicBool,
}

impl WorkerPool<'_, '_> {
    /// Takes the parts of all shells with more than `limit` triangles down.
    /// Returns whether there were any.
    fn cut_down(
        &self,
        large: &mut [LargeShell],
        level: usize,
        limit: usize,
        steps: &mut Vec<Step>,
        progress: &mut Progress<'_>,
    ) -> Result<bool, Error> {
        let mesh = self.source.mesh;
        let cuts: Vec<Option<CutParts>> = large
            .iter()
            .map(|LargeShell { remainder, shrinks, .. }| {
                let is_large = *shrinks && remainder.corners.len() > limit;
                is_large.then(|| remainder.cut(mesh, limit, level))
            })
            .collect();
        let parts = |(shell, parts): (usize, &Option<CutParts>)| {
            let count = parts.as_ref().map_or(0, CutParts::len);
            (0..count).map(move |part| (shell, part))
        };
        let jobs: Vec<(usize, usize)> = cuts.iter().enumerate().flat_map(parts).collect();
        if jobs.is_empty() {
            return Ok(false);
        }
        let finished = self.work(jobs.len(), progress, |index, worker, watch| {
            let (shell, part) = jobs[index];
            let (LargeShell { remainder, center, .. }, parts) =
                (&large[shell], cuts[shell].as_ref()?);
            let Worker { reducer, places } = worker;
            places.resize(mesh.positions.len(), 0);
            let part = parts.take(remainder, part, places);
            let mut steps = Vec::new();
            let left = reducer.reduce_part(
                self.source,
                (&part, parts),
                *center,
                places,
                &mut steps,
                watch,
            )?;
            Some((steps, left))
        })?;
        let mut finished = finished.into_iter();
        for (large, parts) in large.iter_mut().zip(&cuts) {
            let Some(parts) = parts else { continue };
            let before = large.remainder.corners.len();
            let of_parts = finished.by_ref().take(parts.len());
            large.remainder = Remainder::join(of_parts.map(|(of_part, left)| {
                steps.extend(of_part);
                left
            }));
            let left = large.remainder.corners.len() as f64;
            large.shrinks = left <= MAX_LEFT * before as f64;
        }
        Ok(true)
    }

    /// Does jobs `0..count`, in as many threads as there are, and returns their
    /// results in order. A job returns nothing when it was told to stop.
    fn work<T: Send>(
        &self,
        count: usize,
        progress: &mut Progress<'_>,
        job: impl Fn(usize, &mut Worker, ProgressCallback<'_>) -> Option<T> + Sync,
    ) -> Result<Vec<T>, Error> {
        let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
        let (next, ended) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let run = |go_on: &mut dyn FnMut() -> bool| {
            // Counts a job that ends in a panic too: nobody may wait for it.
            struct CountOnDrop<'a>(&'a AtomicUsize);
            impl Drop for CountOnDrop<'_> {
                fn drop(&mut self) {
                    self.0.fetch_add(1, Ordering::Release);
                }
            }
            let mut worker = Worker::default();
            let mut watch = |collapses: usize| {
                self.vertices_done.fetch_add(collapses, Ordering::Relaxed);
                if !go_on() {
                    self.cancelled.store(true, Ordering::Relaxed);
                }
                !self.cancelled.load(Ordering::Relaxed)
            };
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some(result) = results.get(index) else { return };
                let _counted = CountOnDrop(&ended);
                let Some(done) = job(index, &mut worker, &mut watch) else { return };
                *result.lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
            }
        };
        let total = self.source.mesh.positions.len().max(1) as f32;
        thread::scope(|scope| {
            for _ in 1..self.threads.min(count) {
                scope.spawn(|| run(&mut || true));
            }
            let mut told = Ok(());
            let mut tell = || {
                let done = self.vertices_done.load(Ordering::Relaxed) as f32;
                told = progress.report((done / total).min(1.0));
                told.is_ok()
            };
            run(&mut tell);
            while ended.load(Ordering::Acquire) < count && !self.cancelled.load(Ordering::Relaxed) {
                thread::sleep(WATCH_INTERVAL);
                if !tell() {
                    self.cancelled.store(true, Ordering::Relaxed);
                }
            }
            told
        })?;
        let done =
            results.into_iter().map(|r| r.into_inner().unwrap_or_else(PoisonError::into_inner));
        done.collect::<Option<Vec<T>>>().ok_or_else(Error::cancelled)
    }
}

/// Runs of shells with about [`BATCH`] vertices each, large ones not counted.
fn batches<'a>(shells: &Shells, is_large: impl Fn(&usize) -> bool) -> Vec<Job<'a>> {
    let mut batches = Vec::new();
    let (mut start, mut vertices) = (0, 0);
    for shell in 0..shells.len() {
        if !is_large(&shell) {
            vertices += shells.vertex_range(shell).len();
        }
        if vertices >= BATCH || shell + 1 == shells.len() {
            batches.push(Job::Shells(start..shell + 1));
            (start, vertices) = (shell + 1, 0);
        }
    }
    batches
}

/// Removes the last vertex of each shell as soon as the shell has no triangles. It joins the last
/// vertex of the shell that vanishes last.
pub(crate) fn remove_collapsed_shells(shells: &Shells, steps: &mut Vec<Step>) {
    let mut shell_of = vec![0_u32; shells.vertices.len()];
    for shell in 0..shells.len() {
        for &vertex in &shells.vertices[shells.vertex_range(shell)] {
            shell_of[vertex as usize] = shell as u32;
        }
    }
    let mut is_left = vec![true; shells.vertices.len()];
    let mut ends = vec![(0.0_f64, 0.0_f32); shells.len()];
    for step in steps.iter() {
        is_left[step.removed as usize] = false;
        let (rank, error) = &mut ends[shell_of[step.removed as usize] as usize];
        (*rank, *error) = (rank.max(step.rank), error.max(step.error));
    }
    let left = (0..).zip(is_left).filter_map(|(vertex, is_left)| is_left.then_some(vertex));
    let end = |vertex: u32| ends[shell_of[vertex as usize] as usize];
    let left: Vec<u32> = left.collect();
    let Some(&kept) = left.iter().max_by(|&&a, &&b| end(a).0.total_cmp(&end(b).0)) else { return };
    steps.extend(left.iter().filter(|&&removed| removed != kept).map(|&removed| {
        let (rank, error) = end(removed);
        Step { removed, kept, rank, error }
    }));
}

/// Steps in order of rank; of equal ones, and of one shell, in the order in
/// which they were done.
pub(crate) fn merge(mut steps: Vec<Step>) -> Vec<Collapse> {
    steps.sort_by(|a, b| a.rank.total_cmp(&b.rank));
    let mut error = 0.0_f32;
    let entry = |step: &Step| {
        error = error.max(step.error);
        Collapse { removed: step.removed, kept: step.kept, error }
    };
    steps.iter().map(entry).collect()
}
