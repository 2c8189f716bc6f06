//! Shows that this process goes on while it loads.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use busbar_protocol::pictures::PictureMemory;

const PERIOD: Duration = Duration::from_millis(100);

/// Beats until it is dropped. What hangs meanwhile is found by how long a start may take.
pub(super) struct Beater {
    _ends: Option<Sender<()>>,
}

impl Beater {
    pub(super) fn start(memory: &PictureMemory) -> Self {
        let memory = memory.clone();
        let (ends, ended) = channel::<()>();
        let work = move || {
            while ended.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                memory.beat();
            }
        };
        let spawned = std::thread::Builder::new().name("beater".into()).spawn(work);
        Self { _ends: spawned.ok().map(|_| ends) }
    }
}
