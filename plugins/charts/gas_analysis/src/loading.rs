//! Reads and judges the samples of a file beside the calls of the host: a million take long.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::history::Page;
use crate::judged::{self, Judged};
use crate::settings::{FleetSettings, Settings};
use crate::source::{self, Readings};

/// Time between two looks whether reading is done.
const LOOK: Duration = Duration::from_millis(5);

/// All samples of a file, judged, by transformer and in the order of time.
pub(crate) struct Loaded {
    pub(crate) histories: BTreeMap<String, Vec<Judged>>,
    /// Rows that are none, in words.
    pub(crate) faults: Vec<String>,
    /// Number of samples that were left out.
    pub(crate) left_out: usize,
}

/// A file that is being read.
pub(crate) struct Loading {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Loaded, String>>>,
}

impl Loading {
    /// Begins to read on a thread.
    ///
    /// # Errors
    /// That there is no thread to be had, in words.
    pub(crate) fn begin(fleet: FleetSettings, settings: Settings) -> Result<Self, String> {
        let ends = Arc::new(AtomicBool::new(false));
        let theirs = ends.clone();
        let work = move || {
            let readings = source::read(&fleet, &theirs)?;
            judge_all(readings, &settings, &theirs)
        };
        let thread = std::thread::Builder::new().name("samples".into()).spawn(work);
        let thread = thread.map_err(|error| format!("no thread to read samples with: {error}"))?;
        Ok(Self { ends, thread: Some(thread) })
    }

    /// Returns the samples that were read, if that is done within `patience`.
    pub(crate) fn take(&mut self, patience: Duration) -> Option<Result<Loaded, String>> {
        let end = Instant::now() + patience;
        while !self.thread.as_ref()?.is_finished() {
            if Instant::now() >= end {
                return None;
            }
            std::thread::sleep(LOOK);
        }
        let broken = |_| Err("reading samples broke off; please report this".to_owned());
        Some(self.thread.take()?.join().unwrap_or_else(broken))
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It looks at every row whether it is to end.
            let _ = thread.join();
        }
    }
}

fn judge_all(readings: Readings, settings: &Settings, ends: &AtomicBool) -> Result<Loaded, String> {
    let Readings { mut all, equipment, mut faults, mut left_out, .. } = readings;
    all.sort_by_key(|reading| (reading.equipment, reading.unix_nanos));
    let mut histories: BTreeMap<String, Vec<Judged>> = BTreeMap::new();
    for own in all.chunk_by(|a, b| a.equipment == b.equipment) {
        let id = &equipment[own[0].equipment as usize];
        let mut page = Page::default();
        let mut history: Vec<Judged> = Vec::with_capacity(own.len());
        for reading in own {
            if ends.load(Ordering::Relaxed) {
                return Err("it was to end".into());
            }
            if history.last().is_some_and(|last| last.unix_nanos == reading.unix_nanos) {
                left_out += 1;
                if faults.len() < source::MAX_FAULTS {
                    faults.push(format!("'{id}' has two samples of one instant; one is left out"));
                }
                continue;
            }
            let measured = (reading.sample, reading.extras);
            history.push(judged::of_laboratory(reading.unix_nanos, measured, &mut page, settings));
        }
        histories.insert(id.clone(), history);
    }
    Ok(Loaded { histories, faults, left_out })
}
