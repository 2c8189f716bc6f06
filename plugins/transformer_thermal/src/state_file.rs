//! File that keeps the states of transformers across restarts.
//!
//! The file is JSON with a version. It is replaced as a whole: written beside its place,
//! synchronized, then renamed.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use busbar_plugin_sdk::{Host, LogLevel};

use crate::transformer::State;

/// Version of the file's layout.
const VERSION: u32 = 1;
/// Longest file that is read, bytes: that of all transformers, and more.
const MAX_FILE_BYTES: u64 = 8 << 20;
/// Documents that wait to be written; a later one replaces what does not fit.
const MAX_WAITING: usize = 1;

/// Contents of the file.
#[derive(serde::Serialize, serde::Deserialize)]
struct Document {
    version: u32,
    transformers: BTreeMap<String, Entry>,
}

/// State of a transformer, and the parameters that it belongs to.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Entry {
    pub(crate) parameters: String,
    pub(crate) state: State,
}

/// File of states with its writer.
pub(crate) struct StateFile {
    path: PathBuf,
    host: Host,
    writer: Option<Writer>,
    has_told_fault: bool,
}

/// Thread that writes documents.
struct Writer {
    documents: SyncSender<String>,
    thread: JoinHandle<()>,
    fault: Arc<Mutex<Option<String>>>,
}

impl StateFile {
    pub(crate) fn new(path: &str, host: Host) -> Self {
        Self { path: PathBuf::from(path), host, writer: None, has_told_fault: false }
    }

    /// Reads the states, by equipment; none where there is no file, or no readable one.
    pub(crate) fn read(&self) -> HashMap<String, Entry> {
        match read(&self.path) {
            Ok(states) => states,
            Err(fault) => {
                let path = self.path.display();
                let words = format!(
                    "{path}: {fault}; temperatures begin anew, as after a time that was not seen; \
                     the file is replaced"
                );
                self.host.log(LogLevel::Warning, &words);
                HashMap::new()
            }
        }
    }

    /// Hands the states to the writer; what it is busy with waits for the next time.
    pub(crate) fn write(&mut self, states: BTreeMap<String, Entry>) {
        self.tell_fault();
        let document = Document { version: VERSION, transformers: states };
        let Ok(text) = serde_json::to_string(&document) else { return };
        if self.writer.is_none() {
            self.writer = self.start_writer();
        }
        if let Some(writer) = &self.writer {
            // Where the disk is slow, the states of a minute later are written.
            let _ = writer.documents.try_send(text);
        }
    }

    /// Writes the last states and waits for them.
    pub(crate) fn close(&mut self, states: BTreeMap<String, Entry>) {
        let document = Document { version: VERSION, transformers: states };
        if let Some(Writer { documents, thread, .. }) = self.writer.take() {
            drop(documents);
            let _ = thread.join();
        }
        let text = serde_json::to_string(&document).map_err(|error| error.to_string());
        if let Err(fault) = text.and_then(|text| replace(&self.path, &text)) {
            self.log_fault(&fault);
        }
    }

    fn start_writer(&mut self) -> Option<Writer> {
        let (documents, waiting) = sync_channel(MAX_WAITING);
        let fault = Arc::default();
        let (path, told) = (self.path.clone(), Arc::clone(&fault));
        let builder = std::thread::Builder::new().name("states".into());
        match builder.spawn(move || write_all(&path, &waiting, &told)) {
            Ok(thread) => Some(Writer { documents, thread, fault }),
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

    /// Logs the first fault alone: the next ones come each minute.
    fn log_fault(&mut self, fault: &str) {
        if std::mem::replace(&mut self.has_told_fault, true) {
            return;
        }
        let path = self.path.display();
        let words = format!(
            "{path} cannot be written: {fault}; make its folder writable, or temperatures begin \
             anew after a restart"
        );
        self.host.log(LogLevel::Error, &words);
    }
}

fn write_all(path: &Path, waiting: &Receiver<String>, told: &Mutex<Option<String>>) {
    while let Ok(text) = waiting.recv() {
        if let Err(fault) = replace(path, &text) {
            *told.lock().unwrap_or_else(PoisonError::into_inner) = Some(fault);
        }
    }
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

fn read(path: &Path) -> Result<HashMap<String, Entry>, String> {
    let file = match File::open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(HashMap::new()),
        Err(error) => return Err(error.to_string()),
    };
    let is_file = file.metadata().is_ok_and(|metadata| metadata.is_file());
    if !is_file {
        return Err("it is no plain file".to_owned());
    }
    let mut text = String::new();
    let length = file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text);
    if length.map_err(|error| error.to_string())? as u64 > MAX_FILE_BYTES {
        return Err(format!("it is longer than {MAX_FILE_BYTES} bytes"));
    }
    let document: Document =
        serde_json::from_str(&text).map_err(|error| format!("it is damaged: {error}"))?;
    if document.version != VERSION {
        return Err(format!("it has version {}, not {VERSION}", document.version));
    }
    match document.transformers.iter().find(|(_, entry)| !entry.state.is_plausible()) {
        Some((equipment, _)) => Err(format!("it is damaged at '{equipment}'")),
        None => Ok(document.transformers.into_iter().collect()),
    }
}
