//! A TCP proxy that breaks connections, for tests: what it does to the Nth
//! connection depends on the seed and N alone.
//!
//! ```
//! use fault_proxy::{ConnectionFault, FaultProxy, FaultScript};
//!
//! let script = FaultScript { seed: 7, faults: vec![ConnectionFault::Reset], max_bytes: 100 };
//! let proxy = FaultProxy::start(([127, 0, 0, 1], 1).into(), script)?;
//! assert_ne!(proxy.port(), 0);
//! assert_eq!(proxy.connections(), 0);
//! # Ok::<(), std::io::Error>(())
//! ```

mod connection;
#[cfg(target_os = "linux")]
mod drill;
mod fault;
#[cfg(target_os = "linux")]
mod usage;

use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use tokio::sync::{Notify, oneshot};
use tokio::task::JoinSet;

use crate::connection::Connection;
#[cfg(target_os = "linux")]
pub use crate::drill::{ALL_FAULTS, ENDLESS_FAULTS, MAX_DRILL, check_stamps};
pub use crate::fault::{ConnectionFault, ConnectionPlan, FaultScript};
#[cfg(target_os = "linux")]
pub use crate::usage::ResourceUsage;

/// Greatest number of open connections; further ones wait.
pub const MAX_OPEN: usize = 256;

/// Running proxy on a local port; it ends with all of its connections when dropped.
pub struct FaultProxy {
    port: u16,
    shared: Arc<SharedState>,
    /// Sender whose drop ends the thread.
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// State that all connections share.
#[derive(Default)]
pub(crate) struct SharedState {
    connections: AtomicU64,
    strikes: AtomicU64,
    /// Bytes of the server for a connection that is gone.
    pub(crate) stale: Mutex<Vec<u8>>,
    pub(crate) hang_up: Notify,
}

impl FaultProxy {
    /// Starts a proxy on a free port.
    ///
    /// # Errors
    /// When no port or no thread is available.
    pub fn start(server: SocketAddr, script: FaultScript) -> io::Result<Self> {
        Self::start_on(0, server, script)
    }

    /// Starts a proxy on this port of the local host; 0 is any free one.
    ///
    /// # Errors
    /// When the port is taken, or no thread is available.
    pub fn start_on(port: u16, server: SocketAddr, script: FaultScript) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        let shared = Arc::new(SharedState::default());
        let (stop, stopped) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let handed = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("fault_proxy".into()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    _ = stopped => {}
                    () = accept(listener, server, &script, &handed) => {}
                }
            });
        })?;
        Ok(Self { port, shared, stop: Some(stop), thread: Some(thread) })
    }

    /// Returns the port that the proxy listens at.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// Returns the number of connections so far.
    pub fn connections(&self) -> u64 {
        self.shared.connections.load(Ordering::Relaxed)
    }

    /// Returns the number of faults that have struck so far.
    pub fn strikes(&self) -> u64 {
        self.shared.strikes.load(Ordering::Relaxed)
    }
}

impl FaultProxy {
    /// Closes all open connections.
    pub fn hang_up(&self) {
        self.shared.hang_up.notify_waiters();
    }
}

impl Drop for FaultProxy {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            // It panicked if a test did; that one is told.
            let _ = thread.join();
        }
    }
}

impl SharedState {
    pub(crate) fn note_strike(&self) {
        self.strikes.fetch_add(1, Ordering::Relaxed);
    }
}

async fn accept(
    listener: TcpListener,
    server: SocketAddr,
    script: &FaultScript,
    shared: &Arc<SharedState>,
) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let mut open = JoinSet::new();
    loop {
        while open.len() >= MAX_OPEN {
            open.join_next().await;
        }
        while open.try_join_next().is_some() {}
        // A client that is gone already is no fault of ours.
        let Ok((client, _)) = listener.accept().await else { continue };
        let index = shared.connections.fetch_add(1, Ordering::Relaxed);
        let connection =
            Connection { plan: script.plan(index), shared: Arc::clone(shared), server };
        open.spawn(connection.serve(client));
    }
}

#[cfg(test)]
#[path = "proxy_tests.rs"]
mod tests;
