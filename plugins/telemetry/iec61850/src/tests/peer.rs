//! libiec61850's server in a process of its own.

use peer_process::{Peer, PeerScript};
use serde_json::Value;

const SERVER: PeerScript =
    PeerScript { file: "iec61850_server.py", import: "import pyiec61850.pyiec61850" };

/// Starts a server; `None`, said aloud, where there is no library.
pub(crate) fn start(spec: &Value) -> Option<Peer> {
    SERVER.start(0, &[&spec.to_string()])
}
