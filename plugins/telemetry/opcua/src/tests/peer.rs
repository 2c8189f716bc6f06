//! An independent server, asyncua, in a process of its own.

use std::path::Path;
use std::process::Command;

use peer_process::{Peer, PeerScript};
use serde_json::Value;

const SERVER: PeerScript = PeerScript { file: "opcua_asyncua.py", import: "import asyncua" };

/// Starts a server; `None`, said aloud, where there is no asyncua.
pub(crate) fn start(spec: &Value) -> Option<Peer> {
    SERVER.start(0, &[&spec.to_string()])
}

/// Makes certificates with keys, `NAME.der` and `NAME.pem`, each for an application URI.
pub(crate) fn make_certificates(folder: &Path, pairs: &[(&str, &str)]) {
    let mut command = Command::new(SERVER.python().expect("a peer was there before"));
    command.arg(SERVER.path()).arg("--make").arg(folder);
    for (name, uri) in pairs {
        command.args([name, uri]);
    }
    assert!(command.status().unwrap().success());
}
