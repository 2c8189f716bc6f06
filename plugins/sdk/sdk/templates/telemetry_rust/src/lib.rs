//! Telemetry plugin `my_plugin`: reads lines `NAME VALUE` from a TCP server.
use std::io::{BufRead, BufReader, Error as IoError, Read};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use busbar_plugin_sdk::{Error, Host, LinkState, Plugin, Reason, StopToken, Sample, SampleSink};
use busbar_plugin_sdk::{TagSpec, Telemetry, Worker, export_plugin};

/// Longest time to connect, and longest silence that is not a fault.
const TIMEOUT: Duration = Duration::from_secs(1);
/// Longest line, in bytes.
const MAX_LINE_BYTES: u64 = 256;

#[derive(serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// Address of the server, HOST:PORT.
    #[schemars(example = "127.0.0.1:7070")]
    address: String,
}

struct MyPlugin {
    settings: Settings,
    host: Host,
    worker: Option<Worker>,
}

impl Plugin for MyPlugin {
    const ID: &'static str = "com.example.my_plugin";
    const NAME: &'static str = "MyPlugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads lines of names and values over TCP.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self { settings, host, worker: None })
    }
}

impl Telemetry for MyPlugin {
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        TagSpec::parse_all::<String>(tags).map(drop)
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        let (names, address) = (TagSpec::parse_all(&tags)?, self.settings.address.clone());
        let session = move |sink: &_, running: &_| read(&address, &names, sink, running);
        self.worker = Some(Worker::serve(&self.host, "my_plugin", &tags, sink, session)?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

type Tags = [(String, TagSpec)];

fn read(at: &str, tags: &Tags, sink: &SampleSink, running: &StopToken) -> Result<(), IoError> {
    let address = at.to_socket_addrs()?.next().ok_or(IoError::other("no address of this name"))?;
    let stream = TcpStream::connect_timeout(&address, TIMEOUT)?;
    stream.set_read_timeout(Some(TIMEOUT))?;
    sink.report_link(LinkState::Up, at);
    let (mut lines, mut line) = (BufReader::new(stream), String::new());
    while running.is_running() && lines.by_ref().take(MAX_LINE_BYTES).read_line(&mut line)? > 0 {
        let (name, text) = line.trim().split_once(' ').unwrap_or_default();
        for (_, tag) in tags.iter().filter(|(other, _)| other == name) {
            let bad = Sample::bad(tag.tag, Reason::Configuration);
            sink.publish(&[tag.kind.parse(text).map_or(bad, |value| Sample::good(tag.tag, value))]);
        }
        line.clear();
    }
    Ok(())
}

export_plugin!(MyPlugin: telemetry);

#[cfg(test)]
mod tests;
