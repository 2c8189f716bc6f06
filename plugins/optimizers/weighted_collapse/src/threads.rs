//! Deterministic parallelism: work on fixed parts, in as many threads as the machine grants.

use std::{panic, thread};

/// The most threads that one mesh is worked on with.
pub const MAX_THREADS: usize = 16;

/// A mesh with fewer triangles is done before a second thread has started.
const MIN_TRIANGLES_FOR_THREADS: usize = 100_000;

/// Returns the number of threads for a mesh, as the caller and the machine allow.
pub(crate) fn count(triangles: usize, max_threads: usize) -> usize {
    if triangles < MIN_TRIANGLES_FOR_THREADS {
        return 1;
    }
    let granted = thread::available_parallelism().map_or(1, usize::from);
    granted.min(max_threads).clamp(1, MAX_THREADS)
}

/// Does all jobs, each thread a run of them, and returns their results in the
/// order of the jobs.
pub(crate) fn map<T: Send, R: Send>(
    jobs: Vec<T>,
    threads: usize,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    let share = jobs.len().div_ceil(threads.max(1));
    let mut jobs = jobs.into_iter();
    let work = &work;
    thread::scope(|scope| {
        let first: Vec<T> = jobs.by_ref().take(share).collect();
        let mut others = Vec::new();
        while jobs.len() > 0 {
            let run: Vec<T> = jobs.by_ref().take(share).collect();
            others.push(scope.spawn(move || run.into_iter().map(work).collect::<Vec<R>>()));
        }
        let mut results: Vec<R> = first.into_iter().map(work).collect();
        for other in others {
            results.extend(other.join().unwrap_or_else(|fault| panic::resume_unwind(fault)));
        }
        results
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_jobs() {
        for threads in 1..6 {
            let squares = map((0..7).collect(), threads, |i: i32| i * i);
            assert_eq!(squares, [0, 1, 4, 9, 16, 25, 36]);
        }
        assert!(map(Vec::new(), 3, |i: i32| i).is_empty());
    }

    #[test]
    fn small_meshes_and_wary_callers_get_one_thread() {
        assert_eq!(count(10, 8), 1);
        assert_eq!(count(10_000_000, 1), 1);
        assert_eq!(count(10_000_000, 0), 1);
        assert!(count(10_000_000, usize::MAX) <= MAX_THREADS);
    }
}
