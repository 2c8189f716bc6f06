//! Independent stations in processes of their own.

use peer_process::{Peer, PeerScript};
use serde_json::Value;

/// Peer script with lib60870-C behind c104.
pub(super) const C104: PeerScript = PeerScript { file: "iec104_c104.py", import: "import c104" };
/// hat-drivers, in Python throughout.
pub(super) const HAT: PeerScript =
    PeerScript { file: "iec104_hat.py", import: "from hat.drivers import iec104" };

/// Starts a station; `None`, said aloud, where there is none of the kind.
pub(super) fn start(kind: PeerScript, spec: &Value) -> Option<Peer> {
    kind.start(0, &[&spec.to_string()])
}
