//! The server: connections within limits, and its end.

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::runtime::Runtime;
use tokio::sync::{Semaphore, watch};
use tokio::time::{sleep, timeout};

use crate::access::Access;
use crate::hub::Hub;
use crate::options::{MAX_CLIENTS, Options};
use crate::routes::{RouteState, router};

/// Connections that ask something at the same time; further ones wait to be taken.
const MAX_CONNECTIONS: usize = 32;
/// Longest times to send a request's headers, and to answer a request.
const MAX_HEADERS: Duration = Duration::from_secs(5);
const MAX_REQUEST: Duration = Duration::from_secs(20);
/// Bytes of a request's headers.
const MAX_HEADER_BYTES: usize = 16 << 10;
/// Pause after a connection that could not be accepted, such as for want of descriptors.
const ACCEPT_PAUSE: Duration = Duration::from_millis(100);
/// Longest time that pages have to receive the end of the server.
const CLOSE_GRACE: Duration = Duration::from_millis(500);
const THREADS: usize = 2;

/// Reason for which a server does not start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The address cannot be had.
    #[error(
        "cannot listen at {address}: {source}\n  remedy: choose an address of this machine and a \
         port that no other program has, with --listen"
    )]
    Listen {
        /// Address that was to be listened at.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// Others could listen in.
    #[error(
        "{0} can be reached from other machines, and nothing here is encrypted\n  remedy: listen \
         at 127.0.0.1 and put a proxy with TLS before it, or say --insecure-remote where the \
         network is yours alone"
    )]
    Remote(SocketAddr),
    /// Too many or too few pages.
    #[error("{0} pages at once; give 1 to {MAX_CLIENTS}")]
    Clients(usize),
    /// System without threads or descriptors.
    #[error("the system does not let a server start: {0}")]
    System(#[from] io::Error),
}

/// A server, until it is dropped.
pub struct Server {
    runtime: Option<Runtime>,
    hub: Arc<Hub>,
    stop: watch::Sender<bool>,
    places: Arc<Semaphore>,
    max_clients: usize,
    address: SocketAddr,
}

impl Server {
    /// Listens, and starts the viewer.
    ///
    /// # Errors
    /// The address cannot be had or must not; the system has nothing left.
    pub fn start(options: &Options) -> Result<Self, ServeError> {
        if !options.listen.ip().is_loopback() && !options.insecure_remote {
            return Err(ServeError::Remote(options.listen));
        }
        if !(1..=MAX_CLIENTS).contains(&options.max_clients) {
            return Err(ServeError::Clients(options.max_clients));
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(THREADS)
            .thread_name("web server")
            .enable_all()
            .build()?;
        let listen = |source| ServeError::Listen { address: options.listen, source };
        let listener = std::net::TcpListener::bind(options.listen).map_err(listen)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let hub = Hub::start(options)?;
        let (stop, stopping) = watch::channel(false);
        let origins = options.allowed_origins.clone();
        let (places, max_clients) =
            (Arc::new(Semaphore::new(options.max_clients)), options.max_clients);
        let site = Arc::new(RouteState {
            access: Access::new(options.token.clone(), origins, address.port()),
            hub: hub.clone(),
            places: places.clone(),
            max_clients,
            stopping,
        });
        let within = runtime.enter();
        runtime.spawn(accept(TcpListener::from_std(listener)?, router(site)));
        drop(within);
        Ok(Self { runtime: Some(runtime), hub, stop, places, max_clients, address })
    }

    /// Returns the address that the server listens at.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the process id of the viewer, while there is one. For diagnosis.
    pub fn viewer(&self) -> Option<u32> {
        self.hub.viewer()
    }

    /// Returns the time since the last poll of the viewer: more than moments where this server
    /// hangs. A viewer that hangs is polled all the same, and started again.
    pub fn silence(&self) -> Duration {
        self.hub.silence()
    }

    /// Returns the reason for which there never was a scene to serve, once that is known. After a
    /// first scene, the viewer is started again and again instead.
    pub fn failure(&self) -> Option<String> {
        self.hub.failure()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let Some(runtime) = self.runtime.take() else { return };
        self.stop.send_replace(true);
        // Each page has a place until it has heard of the end.
        let start = Instant::now();
        while self.places.available_permits() < self.max_clients && start.elapsed() < CLOSE_GRACE {
            std::thread::sleep(Duration::from_millis(1));
        }
        runtime.shutdown_background();
    }
}

/// Takes connections, so many at once.
async fn accept(listener: TcpListener, router: Router) {
    let free = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    loop {
        let Ok(permit) = free.clone().acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let answered = answer(stream, router.clone());
                tokio::spawn(async move {
                    // One that is too slow goes; so does one that breaks the protocol.
                    let _ = timeout(MAX_REQUEST, answered).await;
                    drop(permit);
                });
            }
            Err(error) => {
                tracing::warn!("a connection is not taken: {error}");
                sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// Answers one request; a socket goes on in a task of its own.
async fn answer(stream: TcpStream, router: Router) -> hyper::Result<()> {
    // LivenessInstants and pictures must not wait for each other.
    let _ = stream.set_nodelay(true);
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(MAX_HEADERS)
        .max_buf_size(MAX_HEADER_BYTES)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(router))
        .with_upgrades()
        .await
}
