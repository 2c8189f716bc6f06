//! One connection: sockets around a [`Session`], for ever.

use std::cell::RefCell;
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::{Duration, Instant, SystemTime};

use thiserror::Error;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpStream, lookup_host};
use tokio::time::{sleep, sleep_until, timeout, timeout_at};

use crate::backoff::Backoff;
use crate::hub::Hub;
use crate::session::{Event, Session, SessionFault};
use crate::settings::{Config, Endpoint};
use crate::tls::Tls;

/// Addresses of one name that are tried, so that each has a useful share of
/// the deadline.
const MAX_ADDRESSES: usize = 8;
/// Bytes that are read at once.
const CHUNK_BYTES: usize = 16 * 1024;
/// A connection that held so long deserves a quick second try.
const STABLE_AFTER: Duration = Duration::from_secs(10);

/// Why a connection ended, or was not made.
#[derive(Debug, Error)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(String),
    #[error(
        "no connection within {} ms (t0); is the address right, and the station on?",
        .0.as_millis()
    )]
    ConnectTimeout(Duration),
    #[error("the name has no address")]
    NoAddress,
    /// By address.
    #[error("{}", .0.iter().map(|(address, fault)| format!("{address}: {fault}"))
        .collect::<Vec<_>>().join("; "))]
    NoneConnects(Vec<(SocketAddr, LinkFault)>),
    #[error("no secure connection: {0}")]
    Tls(String),
    #[error("{0}")]
    Session(#[from] SessionFault),
    #[error("the station took no data for {} ms (t1)", .0.as_millis())]
    Blocked(Duration),
    #[error("{0}")]
    Lost(String),
}

/// A byte stream, encrypted or not.
trait Stream: AsyncRead + AsyncWrite + Unpin {}
impl<T: AsyncRead + AsyncWrite + Unpin> Stream for T {}

/// One of a station's connections.
pub(crate) struct Link {
    pub(crate) hub: Rc<RefCell<Hub>>,
    pub(crate) index: usize,
    pub(crate) endpoint: Endpoint,
    pub(crate) config: Config,
    pub(crate) tls: Option<Tls>,
}

impl Link {
    /// Serves for ever; drop the future to end it.
    pub(crate) async fn run(self) -> Infallible {
        let Config { reconnect_min, reconnect_max, .. } = self.config;
        let mut backoff = Backoff::new(reconnect_min, reconnect_max, fastrand::Rng::new());
        loop {
            let started = Instant::now();
            let Err(fault) = self.serve().await;
            if started.elapsed() >= STABLE_AFTER {
                backoff.reset();
            }
            let delay = backoff.next_delay();
            self.hub.borrow_mut().note_lost(self.index, &fault, delay);
            sleep(delay).await;
        }
    }

    async fn serve(&self) -> Result<Infallible, LinkFault> {
        let limit = self.config.connect_timeout;
        let stream = timeout(limit, self.connect())
            .await
            .map_err(|_| LinkFault::ConnectTimeout(limit))??;
        self.hub.borrow_mut().note_connected(self.index);
        self.converse(stream).await
    }

    async fn connect(&self) -> Result<Box<dyn Stream>, LinkFault> {
        let deadline = Instant::now() + self.config.connect_timeout;
        let Endpoint { host, port } = &self.endpoint;
        let addresses = lookup_host((host.as_str(), *port))
            .await
            .map_err(|error| LinkFault::Connect(in_words(&error)))?;
        let stream = connect_any(addresses.take(MAX_ADDRESSES).collect(), deadline).await?;
        // Frames are small, and acknowledgements are waited for.
        stream.set_nodelay(true).map_err(|error| LinkFault::Connect(in_words(&error)))?;
        let Some(tls) = &self.tls else { return Ok(Box::new(stream)) };
        let insecure = |what: String| LinkFault::Tls(what);
        let name =
            tls.server_name(&self.endpoint).map_err(|error| insecure(error.message().into()))?;
        let connected = tls.connector().connect(name, stream).await;
        Ok(Box::new(connected.map_err(|error| insecure(in_words(&error)))?))
    }

    async fn converse(&self, mut stream: Box<dyn Stream>) -> Result<Infallible, LinkFault> {
        let mut active = self.hub.borrow().watch_active();
        let mut session = Session::new(self.config.parameters, Instant::now());
        let mut chunk = vec![0; CHUNK_BYTES];
        loop {
            let is_active = *active.borrow_and_update() == Some(self.index);
            self.advance(&mut session, is_active)?;
            self.write(&mut stream, session.take_output()).await?;
            let deadline = self.deadline(&session, is_active);
            tokio::select! {
                read = stream.read(&mut chunk) => {
                    let count = read.map_err(|error| LinkFault::Lost(in_words(&error)))?;
                    self.receive(&mut session, chunk.get(..count).unwrap_or_default())?;
                }
                () = sleep_until(deadline.into()) => {}
                // The hub outlives its connections, so this never fails.
                _ = active.changed() => {}
            }
        }
    }

    /// Does what is due.
    fn advance(&self, session: &mut Session, is_active: bool) -> Result<(), LinkFault> {
        let now = Instant::now();
        session.tick(now)?;
        if is_active {
            session.start(now);
        }
        if is_active && session.is_started() {
            let mut hub = self.hub.borrow_mut();
            while let Some(asdu) = hub.station.next_request(now) {
                session.send(asdu, now)?;
            }
        }
        Ok(())
    }

    fn deadline(&self, session: &Session, is_active: bool) -> Instant {
        let of_session = session.deadline();
        let of_station = if is_active { self.hub.borrow().station.deadline() } else { None };
        of_station.map_or(of_session, |deadline| deadline.min(of_session))
    }

    fn receive(&self, session: &mut Session, bytes: &[u8]) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Err(LinkFault::Lost("the station closed the connection".into()));
        }
        let (now, received) = (Instant::now(), SystemTime::now());
        let mut hub = self.hub.borrow_mut();
        let outcome = session.receive(bytes, now, |event| match event {
            Event::Started => hub.note_started(self.index, now),
            Event::Asdu(asdu) => hub.station.heed(asdu, received, now),
        });
        hub.station.flush();
        Ok(outcome?)
    }

    async fn write(&self, stream: &mut Box<dyn Stream>, bytes: Vec<u8>) -> Result<(), LinkFault> {
        if bytes.is_empty() {
            return Ok(());
        }
        let limit = self.config.parameters.t1;
        let written = async {
            stream.write_all(&bytes).await?;
            stream.flush().await
        };
        timeout(limit, written)
            .await
            .map_err(|_| LinkFault::Blocked(limit))?
            .map_err(|error| LinkFault::Lost(in_words(&error)))
    }
}

/// Connects to the first address that lets us. Each has an equal share of the
/// time that is left, so that one that stays silent does not hide the others.
async fn connect_any(
    addresses: Vec<SocketAddr>,
    deadline: Instant,
) -> Result<TcpStream, LinkFault> {
    let mut faults = Vec::new();
    for (address, to_try) in addresses.iter().zip((1..=addresses.len() as u32).rev()) {
        let now = Instant::now();
        let share = deadline.saturating_duration_since(now) / to_try;
        let fault = match timeout_at((now + share).into(), TcpStream::connect(address)).await {
            Ok(Ok(stream)) => return Ok(stream),
            Ok(Err(error)) => LinkFault::Connect(in_words(&error)),
            Err(_) => LinkFault::ConnectTimeout(share),
        };
        faults.push((*address, fault));
    }
    Err(if faults.len() > 1 {
        LinkFault::NoneConnects(faults)
    } else {
        // The only address is the endpoint, which the report names anyway.
        faults.pop().map_or(LinkFault::NoAddress, |(_, fault)| fault)
    })
}

/// An I/O error without its number, where the system has words for it.
fn in_words(error: &io::Error) -> String {
    match error.kind() {
        kind @ (io::ErrorKind::ConnectionRefused
        | io::ErrorKind::ConnectionReset
        | io::ErrorKind::ConnectionAborted
        | io::ErrorKind::BrokenPipe
        | io::ErrorKind::HostUnreachable
        | io::ErrorKind::NetworkUnreachable
        | io::ErrorKind::PermissionDenied
        | io::ErrorKind::TimedOut) => kind.to_string(),
        _ => error.to_string(),
    }
}
