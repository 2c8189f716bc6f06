//! Mosquitto, and clients beside it, in processes of their own.

use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use peer_process::{PeerScript, skip};
use tempfile::TempDir;

const PATIENCE: Duration = Duration::from_secs(10);

/// Mosquitto broker of a test, on a free port.
pub(super) struct Broker {
    child: Option<Child>,
    folder: TempDir,
    pub(super) port: u16,
}

impl Broker {
    /// Starts a broker that lets everybody in; `None`, said aloud, where there is none.
    pub(super) fn start() -> Option<Self> {
        Self::start_with("allow_anonymous true\n")
    }

    /// Starts a broker with these lines in its configuration, after its listener.
    pub(super) fn start_with(lines: &str) -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let port =
            TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap().port();
        let text = format!(
            "listener {port} 127.0.0.1\nuser root\npersistence false\nlog_type error\n{lines}"
        );
        std::fs::write(folder.path().join("mosquitto.conf"), text).unwrap();
        let mut broker = Self { child: None, folder, port };
        broker.resume()?;
        Some(broker)
    }

    /// Starts it again after [`Broker::kill`], on its port.
    pub(super) fn resume(&mut self) -> Option<()> {
        let path = program()?;
        let configuration = self.folder.path().join("mosquitto.conf");
        let child = Command::new(path).arg("-c").arg(configuration).spawn().unwrap();
        self.child = Some(child);
        let deadline = Instant::now() + PATIENCE;
        while TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)).is_err() {
            assert!(Instant::now() < deadline, "mosquitto does not listen at {}", self.port);
            std::thread::sleep(Duration::from_millis(10));
        }
        Some(())
    }

    pub(super) fn kill(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }

    /// Stops it, as if its machine hung, or lets it go on.
    pub(super) fn signal(&self, name: &str) {
        let id = self.child.as_ref().unwrap().id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Returns the path of the Mosquitto program, if it is installed.
fn program() -> Option<PathBuf> {
    let found = ["/usr/sbin/mosquitto", "/usr/local/sbin/mosquitto"].map(PathBuf::from);
    let found = found.into_iter().find(|path| path.is_file());
    if found.is_none() {
        skip("there is no mosquitto: install the package mosquitto");
    }
    found
}

const PUBLISHER: PeerScript =
    PeerScript { file: "mqtt_publisher.py", import: "import paho.mqtt.client" };
const NODE: PeerScript = PeerScript { file: "sparkplug_node.py", import: "import pysparkplug" };

/// A client in Python that obeys.
pub(super) struct Client(peer_process::Peer);

impl Client {
    /// Starts a publisher by paho-mqtt.
    pub(super) fn publisher(port: u16, spec: &serde_json::Value) -> Option<Self> {
        Some(Self(PUBLISHER.start(port, &[&spec.to_string()])?))
    }

    /// Starts an edge node by pysparkplug.
    pub(super) fn node(port: u16, group: &str, edge_node: &str) -> Option<Self> {
        Some(Self(NODE.start(port, &[group, edge_node])?))
    }

    /// Gives a command and waits until it is carried out.
    #[track_caller]
    pub(super) fn command(&mut self, command: &serde_json::Value) {
        self.0.command(command);
    }

    /// Publishes a text under a topic.
    #[track_caller]
    pub(super) fn publish(&mut self, topic: &str, payload: &str) {
        self.command(&serde_json::json!({"publish": {"topic": topic, "payload": payload}}));
    }

    /// Publishes a text as a retained message.
    #[track_caller]
    pub(super) fn retain(&mut self, topic: &str, payload: &str) {
        let message = serde_json::json!({"topic": topic, "payload": payload, "retain": true});
        self.command(&serde_json::json!({ "publish": message }));
    }
}
