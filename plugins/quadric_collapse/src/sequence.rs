//! All shells of a mesh to one sequence.

use std::ops::Range;
use std::sync::Mutex;
use std::sync::PoisonError;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use busbar_plugin_sdk::{Collapse, Error, Progress};

use crate::judge::Source;
use crate::reduce::{Reducer, Step};
use crate::shells::Shells;

/// Vertices that a thread takes at once, as whole shells.
const BATCH: usize = 8192;
/// Threads at most.
const MAX_THREADS: usize = 64;
/// How often progress is told while other threads work.
const WATCH_INTERVAL: Duration = Duration::from_millis(5);

/// What threads share.
struct Shared {
    next_batch: AtomicUsize,
    vertices_done: AtomicUsize,
    batches_done: AtomicUsize,
    cancelled: AtomicBool,
}

/// The steps of all shells, shell by shell, whatever the number of threads.
///
/// # Errors
/// [`Error::cancelled`].
pub(crate) fn reduce_all(
    source: Source<'_, '_>,
    progress: &mut Progress<'_>,
) -> Result<Vec<Step>, Error> {
    let batches = batches(source.shells);
    let results: Vec<Mutex<Vec<Step>>> = batches.iter().map(|_| Mutex::default()).collect();
    let shared = Shared {
        next_batch: AtomicUsize::new(0),
        vertices_done: AtomicUsize::new(0),
        batches_done: AtomicUsize::new(0),
        cancelled: AtomicBool::new(false),
    };
    let total = source.mesh.positions.len().max(1) as f32;
    let cores = thread::available_parallelism().map_or(1, |cores| cores.get());
    let threads = cores.min(MAX_THREADS).min(batches.len());
    let work = |go_on: &mut dyn FnMut() -> bool| run(source, &batches, &results, &shared, go_on);

    thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|| work(&mut || true));
        }
        let mut told = Ok(());
        let mut tell = || {
            let done = shared.vertices_done.load(Ordering::Relaxed) as f32;
            told = progress.report((done / total).min(1.0));
            told.is_ok()
        };
        work(&mut tell);
        while shared.batches_done.load(Ordering::Acquire) < batches.len()
            && !shared.cancelled.load(Ordering::Relaxed)
        {
            thread::sleep(WATCH_INTERVAL);
            if !tell() {
                shared.cancelled.store(true, Ordering::Relaxed);
            }
        }
        told
    })?;
    let mut steps = Vec::with_capacity(source.mesh.positions.len());
    for result in results {
        steps.append(&mut result.into_inner().unwrap_or_else(PoisonError::into_inner));
    }
    Ok(steps)
}

/// Takes batches until none is left, or `go_on` or another thread says stop.
fn run(
    source: Source<'_, '_>,
    batches: &[Range<usize>],
    results: &[Mutex<Vec<Step>>],
    shared: &Shared,
    go_on: &mut dyn FnMut() -> bool,
) {
    // Counts a batch that ends in a panic too: nobody may wait for it.
    struct Counted<'a>(&'a AtomicUsize);
    impl Drop for Counted<'_> {
        fn drop(&mut self) {
            self.0.fetch_add(1, Ordering::Release);
        }
    }
    let mut reducer = Reducer::default();
    loop {
        let index = shared.next_batch.fetch_add(1, Ordering::Relaxed);
        let Some(batch) = batches.get(index) else { return };
        let _counted = Counted(&shared.batches_done);
        let mut steps = Vec::new();
        for shell in batch.clone() {
            let mut watch = |collapses: usize| {
                shared.vertices_done.fetch_add(collapses, Ordering::Relaxed);
                if !go_on() {
                    shared.cancelled.store(true, Ordering::Relaxed);
                }
                !shared.cancelled.load(Ordering::Relaxed)
            };
            if !reducer.reduce(source, shell, &mut steps, &mut watch) {
                return;
            }
        }
        *results[index].lock().unwrap_or_else(PoisonError::into_inner) = steps;
    }
}

/// Runs of shells with about [`BATCH`] vertices each.
fn batches(shells: &Shells) -> Vec<Range<usize>> {
    let mut batches = Vec::new();
    let (mut start, mut vertices) = (0, 0);
    for shell in 0..shells.len() {
        vertices += shells.vertex_range(shell).len();
        if vertices >= BATCH || shell + 1 == shells.len() {
            batches.push(start..shell + 1);
            (start, vertices) = (shell + 1, 0);
        }
    }
    batches
}

/// Steps in order of rank; of equal ones those of earlier shells first, and
/// each shell's as they are.
pub(crate) fn merge(mut steps: Vec<Step>) -> Vec<Collapse> {
    steps.sort_by(|a, b| a.rank.total_cmp(&b.rank));
    let mut error = 0.0_f32;
    let entry = |step: &Step| {
        error = error.max(step.error);
        Collapse { removed: step.removed, kept: step.kept, error }
    };
    steps.iter().map(entry).collect()
}
