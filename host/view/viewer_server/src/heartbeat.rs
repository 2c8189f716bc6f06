//! Heartbeat of the viewer's process: a thread that beats whatever the frame loop does.
//!
//! By the heartbeat and the process's CPU time, the host program's library distinguishes a slow
//! viewer from a hanging one. The frame loop's progress is reported by its iterations.

use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

use busbar_protocol::pictures::PictureMemory;

/// Time between two heartbeats.
const PERIOD: Duration = Duration::from_millis(100);

/// A thread that beats until this is dropped.
pub(super) struct Heartbeat {
    _ends: Option<Sender<()>>,
}

impl Heartbeat {
    /// LivenessInstants at once, and from then on once a period.
    pub(super) fn start(memory: &PictureMemory) -> Self {
        let memory = memory.clone();
        memory.beat();
        let (ends, ended) = channel::<()>();
        let work = move || {
            while ended.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                memory.beat();
            }
        };
        let spawned = std::thread::Builder::new().name("heartbeat".into()).spawn(work);
        Self { _ends: spawned.ok().map(|_| ends) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heartbeat_continues_until_dropped() {
        let (_, memory) = PictureMemory::create().unwrap();
        let heartbeat = Heartbeat::start(&memory);
        let first = memory.last_beat();
        assert!(first > 0);
        let start = std::time::Instant::now();
        while memory.last_beat() == first {
            assert!(start.elapsed() < PERIOD * 50, "no second beat");
            std::thread::sleep(PERIOD / 10);
        }
        assert_eq!(memory.last_turn(), 0, "the frame loop's turns are its own");
        drop(heartbeat);
        std::thread::sleep(PERIOD * 3);
        let last = memory.last_beat();
        std::thread::sleep(PERIOD * 3);
        assert_eq!(memory.last_beat(), last);
    }
}
