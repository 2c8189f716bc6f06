//! File that keeps the states of a plugin's equipment across restarts.
//!
//! The file is JSON with a version. It is replaced as a whole (atomic rename): written beside
//! its place, synchronized, then renamed. A damaged file is told and not used.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Host, LogLevel};

/// Sets of states that wait to be written; a later one replaces what does not fit.
const MAX_WAITING: usize = 1;
/// Key of the version in the document.
const VERSION_KEY: &str = "version";

/// Layout of a state file.
#[derive(Clone, Copy, Debug)]
pub struct StateFileLayout {
    /// Version of the states' layout; a file of another one is not used.
    pub version: u32,
    /// Key that the states stand under, such as `transformers`.
    pub key: &'static str,
    /// Longest file that is read or written, bytes.
    pub max_bytes: u64,
    /// Name of what begins anew without the file, for messages, such as `temperatures`.
    pub subject: &'static str,
}

/// Keeps states by the ids of their equipment, and writes them on a thread of its own.
pub struct StateFile<T> {
    path: PathBuf,
    layout: StateFileLayout,
    host: Host,
    writer: Option<Writer<T>>,
    has_told_fault: bool,
}

/// Thread that encodes and writes states.
struct Writer<T> {
    waiting: SyncSender<BTreeMap<String, T>>,
    thread: JoinHandle<()>,
    fault: Arc<Mutex<Option<String>>>,
}

/// State that says whether its numbers can be those of equipment.
pub trait StoredState: Serialize + DeserializeOwned + Send + 'static {
    /// Reports whether the state can be used; a file with one that cannot is damaged.
    fn is_plausible(&self) -> bool;
}

/// Returns the fault of a setting that names a state file, in words: its path is not
/// absolute.
pub fn state_file_fault(path: &str) -> Option<String> {
    (!Path::new(path).is_absolute()).then(|| {
        format!(
            "state_file: '{path}' is no absolute path; ${{folder}}/ before it is the folder of \
             the configuration"
        )
    })
}

impl<T: StoredState> StateFile<T> {
    /// Creates the file's handle. Nothing is read or written yet.
    pub fn new(path: &str, layout: StateFileLayout, host: Host) -> Self {
        let path = PathBuf::from(path);
        Self { path, layout, host, writer: None, has_told_fault: false }
    }

    /// Reads the states by equipment. A file that is damaged, too long or of another version
    /// is logged and gives none.
    pub fn read(&self) -> HashMap<String, T> {
        read(&self.path, &self.layout).unwrap_or_else(|fault| {
            let (path, subject) = (self.path.display(), self.layout.subject);
            let words = format!(
                "{path}: {fault}; {subject} begin anew, as after a time that was not seen; the \
                 file is replaced"
            );
            self.host.log(LogLevel::Warning, &words);
            HashMap::new()
        })
    }

    /// Hands the states to the writer. While the writer is busy, they wait for the next call.
    pub fn write(&mut self, states: BTreeMap<String, T>) {
        self.tell_fault();
        if self.writer.is_none() {
            self.writer = self.start_writer();
        }
        if let Some(writer) = &self.writer {
            // Where the disk is slow, the states of the next time are written.
            let _ = writer.waiting.try_send(states);
        }
    }

    /// Writes the last states, and returns once they are on the disk.
    pub fn close(&mut self, states: &BTreeMap<String, T>) {
        if let Some(Writer { waiting, thread, .. }) = self.writer.take() {
            drop(waiting);
            let _ = thread.join();
        }
        if let Err(fault) = write(&self.path, &self.layout, states) {
            self.log_fault(&fault);
        }
    }

    fn start_writer(&mut self) -> Option<Writer<T>> {
        let (sender, waiting) = sync_channel(MAX_WAITING);
        let fault = Arc::default();
        let (path, layout, told) = (self.path.clone(), self.layout, Arc::clone(&fault));
        let builder = std::thread::Builder::new().name("states".into());
        match builder.spawn(move || write_all(&path, &layout, &waiting, &told)) {
            Ok(thread) => Some(Writer { waiting: sender, thread, fault }),
            Err(error) => {
                self.log_fault(&error.to_string());
                None
            }
        }
    }

    fn tell_fault(&mut self) {
        let fault = self
            .writer
            .as_ref()
            .and_then(|writer| writer.fault.lock().unwrap_or_else(PoisonError::into_inner).take());
        if let Some(fault) = fault {
            self.log_fault(&fault);
        }
    }

    /// Logs the first fault alone: the next ones come with each write.
    fn log_fault(&mut self, fault: &str) {
        if std::mem::replace(&mut self.has_told_fault, true) {
            return;
        }
        let (path, subject) = (self.path.display(), self.layout.subject);
        let words = format!(
            "{path} cannot be written: {fault}; give it a folder that can be written, with room, or \
             {subject} begin anew after a restart"
        );
        self.host.log(LogLevel::Error, &words);
    }
}

fn write_all<T: StoredState>(
    path: &Path,
    layout: &StateFileLayout,
    waiting: &Receiver<BTreeMap<String, T>>,
    told: &Mutex<Option<String>>,
) {
    while let Ok(states) = waiting.recv() {
        if let Err(fault) = write(path, layout, &states) {
            *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(fault);
        }
    }
}

fn write<T: StoredState>(
    path: &Path,
    layout: &StateFileLayout,
    states: &BTreeMap<String, T>,
) -> Result<(), String> {
    let StateFileLayout { version, key, max_bytes, .. } = *layout;
    let states = serde_json::to_string(states).map_err(|error| error.to_string())?;
    let text = format!("{{\"{VERSION_KEY}\":{version},\"{key}\":{states}}}");
    if text.len() as u64 > max_bytes {
        return Err(format!("it would be longer than {max_bytes} bytes"));
    }
    replace(path, &text)
}

/// Replaces a file as a whole.
fn replace(path: &Path, text: &str) -> Result<(), String> {
    let name = path.file_name().ok_or("its path names no file")?.to_string_lossy();
    let beside = path.with_file_name(format!(".{name}.{}", std::process::id()));
    let written = File::create(&beside)
        .and_then(|mut file| {
            file.write_all(text.as_bytes())?;
            file.sync_all()
        })
        .and_then(|()| std::fs::rename(&beside, path));
    written.map_err(|error| {
        // The file may not be there; the first fault is what counts.
        let _ = std::fs::remove_file(&beside);
        error.to_string()
    })
}

fn read<T: StoredState>(
    path: &Path,
    layout: &StateFileLayout,
) -> Result<HashMap<String, T>, String> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(HashMap::new()),
        Err(error) => return Err(error.to_string()),
    };
    let is_file = file.metadata().is_ok_and(|metadata| metadata.is_file());
    if !is_file {
        return Err("it is no plain file".to_owned());
    }
    let StateFileLayout { version, key, max_bytes, .. } = *layout;
    let mut text = String::new();
    let length = file.take(max_bytes + 1).read_to_string(&mut text);
    if length.map_err(|error| error.to_string())? as u64 > max_bytes {
        return Err(format!("it is longer than {max_bytes} bytes"));
    }
    let damaged = |error: serde_json::Error| format!("it is damaged: {error}");
    let mut document: serde_json::Map<String, serde_json::Value> =
        serde_json::from_str(&text).map_err(damaged)?;
    let found = document.remove(VERSION_KEY).unwrap_or_default();
    if found != version {
        return Err(format!("it has version {found}, not {version}"));
    }
    let states = document.remove(key).ok_or_else(|| format!("it is damaged: no '{key}'"))?;
    let states: HashMap<String, T> = serde_json::from_value(states).map_err(damaged)?;
    match states.iter().find(|(_, state)| !state.is_plausible()) {
        Some((equipment, _)) => Err(format!("it is damaged at '{equipment}'")),
        None => Ok(states),
    }
}

#[cfg(test)]
#[path = "state_file_tests.rs"]
mod tests;
