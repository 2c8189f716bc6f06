//! Modbus TCP telemetry: reads registers and bits of one device or gateway.
//!
//! The JSON of settings and tag addresses is described in the crate's
//! README.md. One thread serves one connection; it only ever reads.

mod address;
mod backoff;
mod connection;
mod decode;
mod plan;
mod session;
mod settings;
#[cfg(test)]
mod tests;

use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

use busbar_plugin_sdk::{
    Error, Host, LogLevel, Plugin, SampleSink, TagSpec, Telemetry, export_plugin,
};
use tokio::sync::oneshot;

use crate::session::Session;
pub use crate::settings::Settings;
use crate::settings::Config;

/// How long `stop` waits for the thread.
const STOP_LIMIT: Duration = Duration::from_millis(1500);
/// How long the thread waits for a name lookup that hangs in the system.
const LOOKUP_LIMIT: Duration = Duration::from_millis(500);

/// The plugin.
pub struct ModbusAdapter {
    config: Config,
    host: Host,
    running: Option<Running>,
}

struct Running {
    /// Dropped to end the thread.
    stop: oneshot::Sender<()>,
    /// Disconnected when the thread has ended.
    ended: mpsc::Receiver<()>,
    thread: JoinHandle<()>,
}

impl Plugin for ModbusAdapter {
    const ID: &'static str = "busbar.modbus";
    const NAME: &'static str = "Modbus TCP";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Reads registers, coils and inputs over Modbus TCP.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        Ok(Self {
            config: settings.parse()?,
            host,
            running: None,
        })
    }
}

impl Telemetry for ModbusAdapter {
    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        self.stop();
        let points = address::parse(&tags, &self.config)?;
        if points.is_empty() {
            return Ok(());
        }
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .max_blocking_threads(1)
            .build()
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let session = Session::new(self.config.clone(), points, sink, self.host.clone());
        let (stop, stopped) = oneshot::channel();
        let (ending, ended) = mpsc::channel::<()>();
        let thread = std::thread::Builder::new()
            .name("busbar-modbus".into())
            .spawn(move || {
                let _ending = ending;
                runtime.block_on(async {
                    tokio::select! {
                        biased;
                        _ = stopped => {}
                        () = session.run() => {}
                    }
                });
                runtime.shutdown_timeout(LOOKUP_LIMIT);
            })
            .map_err(|error| Error::failed(format!("cannot start a thread: {error}")))?;
        self.running = Some(Running {
            stop,
            ended,
            thread,
        });
        Ok(())
    }

    fn stop(&mut self) {
        let Some(Running {
            stop,
            ended,
            thread,
        }) = self.running.take()
        else {
            return;
        };
        drop(stop);
        let endpoint = self.config.endpoint();
        if ended.recv_timeout(STOP_LIMIT) == Err(mpsc::RecvTimeoutError::Timeout) {
            let message = format!("{endpoint}: the thread did not end in time; left behind");
            self.host.log(LogLevel::Error, &message);
        } else if thread.join().is_err() {
            let message = format!("{endpoint}: the thread had panicked; please report this");
            self.host.log(LogLevel::Error, &message);
        }
    }
}

impl Drop for ModbusAdapter {
    fn drop(&mut self) {
        self.stop();
    }
}

export_plugin!(ModbusAdapter: telemetry);
