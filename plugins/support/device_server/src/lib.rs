//! Listener thread of simulated devices, and connections with planned faults; independent of the
//! protocol.

mod faulty_link;
mod relay;
mod socket;
#[cfg(test)]
mod tests;

use std::net::{TcpListener, ToSocketAddrs};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{Error, Host, LogLevel, SimulationStatus};
use tokio::sync::oneshot;

pub use crate::faulty_link::{FaultyLink, MAX_CLIENTS};
pub use crate::socket::Socket;

/// Longest time that dropping a [`DeviceServer`] waits for its thread.
const STOP_LIMIT: Duration = Duration::from_millis(1500);
/// Period at which a drop checks whether the thread has ended.
const STOP_CHECK: Duration = Duration::from_millis(2);
/// Pause after a connection could not be accepted, such as for want of descriptors.
pub const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Simulated device: a thread with its listeners, which ends when this is dropped.
pub struct DeviceServer {
    link: FaultyLink,
    endpoint: String,
    host: Host,
    /// Sender that is dropped to end the thread.
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl DeviceServer {
    /// Listens at all of these names and ports, and runs the future of `serve` on a thread of this
    /// name.
    ///
    /// # Errors
    /// [`Error::failed`] when it cannot listen, with the remedy.
    pub fn start<F, S>(
        name: &str,
        endpoints: &[(String, u16)],
        link: FaultyLink,
        host: &Host,
        serve: S,
    ) -> Result<Self, Error>
    where
        F: Future<Output = ()>,
        S: FnOnce(Vec<tokio::net::TcpListener>, FaultyLink) -> F + Send + 'static,
    {
        let bound = endpoints.iter().map(listen).collect::<Result<Vec<_>, _>>()?;
        let addresses = bound.iter().filter_map(|listener| listener.local_addr().ok());
        let addresses: Vec<_> = addresses.map(|address| address.to_string()).collect();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
        let (stop, stopped) = oneshot::channel::<()>();
        let served = link.clone();
        let work = move || {
            runtime.block_on(async {
                let listeners = bound.into_iter().flat_map(tokio::net::TcpListener::from_std);
                let serving = serve(listeners.collect(), served);
                tokio::select! {
                    biased;
                    _ = stopped => {}
                    () = serving => {}
                }
            });
        };
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(work)
            .map_err(|error| Error::failed(format!("cannot start a thread: {error}")))?;
        Ok(Self {
            link,
            endpoint: addresses.join(", "),
            host: host.clone(),
            stop: Some(stop),
            thread: Some(thread),
        })
    }

    /// Returns the status of the simulation.
    pub fn status(&self) -> SimulationStatus {
        self.link.status(format!("listens at {}", self.endpoint))
    }
}

impl Drop for DeviceServer {
    fn drop(&mut self) {
        drop(self.stop.take());
        let Some(thread) = self.thread.take() else { return };
        let deadline = Instant::now() + STOP_LIMIT;
        while !thread.is_finished() && Instant::now() < deadline {
            std::thread::sleep(STOP_CHECK);
        }
        let endpoint = &self.endpoint;
        if !thread.is_finished() {
            let message = format!("{endpoint}: the thread did not end in time; left behind");
            self.host.log(LogLevel::Error, &message);
        } else if thread.join().is_err() {
            let message = format!("{endpoint}: the thread had panicked; please report this");
            self.host.log(LogLevel::Error, &message);
        }
    }
}

fn listen((name, port): &(String, u16)) -> Result<TcpListener, Error> {
    let fault = |error: std::io::Error| {
        Error::failed(format!(
            "cannot listen at {name}, port {port}: {error}; a simulator listens where the \
             settings have the device: let them name this machine, such as 127.0.0.1, and a port \
             from 1024 that nobody else has"
        ))
    };
    // The first address that lets us.
    let addresses: Vec<_> = (name.as_str(), *port).to_socket_addrs().map_err(fault)?.collect();
    let listener = TcpListener::bind(&addresses[..]).map_err(fault)?;
    listener.set_nonblocking(true).map_err(fault)?;
    Ok(listener)
}
