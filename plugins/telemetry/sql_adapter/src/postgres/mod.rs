//! PostgreSQL: connections, for ever.

mod bounded;
mod session;
mod tls;
mod types;

use std::cell::RefCell;
use std::convert::Infallible;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use busbar_link::Backoff;
use busbar_plugin_sdk::Error;
use thiserror::Error as ThisError;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpStream, UnixStream, lookup_host};
use tokio::time::{sleep, timeout, timeout_at};
use tokio_postgres::config::SslMode;
use tokio_postgres::error::SqlState;
use tokio_postgres::tls::MakeTlsConnect;
use tokio_postgres::{Client, NoTls};

pub(crate) use self::bounded::check_stream;
use self::bounded::{Bounded, BoundedTls, OversizedMessage};
use self::session::{Messages, Session, messages};
use self::tls::Tls;
use crate::point_states::{PointStates, shown};
use crate::settings::{Config, Postgres};

/// Addresses of one name that are tried, so that each has a useful share of the deadline.
const MAX_ADDRESSES: usize = 8;
/// A connection that held so long deserves a quick second try.
const STABLE_AFTER: Duration = Duration::from_secs(10);
/// Name of this client in the server's list of sessions.
const APPLICATION: &str = "busbar";

/// Access parameters of a server.
pub(crate) struct Access {
    server: Postgres,
    tls: Option<Tls>,
}

impl Access {
    /// Reads certificates, and whether the password can be read.
    ///
    /// # Errors
    /// [`Error::settings`] that names the file or variable at fault.
    pub(crate) fn load(server: Postgres) -> Result<Self, Error> {
        let tls = server.tls.as_ref().map(Tls::load).transpose()?;
        if let Some(password) = &server.password {
            password.read().map_err(|error| {
                Error::settings(format!("postgres.password: {}", error.message()))
            })?;
        }
        Ok(Self { server, tls })
    }
}

/// Reason for which a connection ended, or was not made.
#[derive(Debug, ThisError)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(String),
    #[error(
        "no connection within {} ms (connect_seconds); is the address right, and the server on?",
        .0.as_millis()
    )]
    ConnectTimeout(Duration),
    #[error("postgres.password: {0}")]
    Password(String),
    #[error("{0}")]
    Refused(String),
    #[error("{what} was not answered within {} ms: the server hangs, or the network", .limit.as_millis())]
    Silent { what: String, limit: Duration },
    #[error("{0}")]
    OversizedMessage(#[from] OversizedMessage),
    #[error("{0}")]
    Lost(String),
}

/// Serves for ever; drop the future to end it.
pub(crate) async fn serve(
    access: &Access,
    config: &Config,
    point_states: PointStates,
) -> Infallible {
    let mut backoff = Backoff::new(config.reconnect);
    let point_states = RefCell::new(point_states);
    let mut session = Session::new(config, access.server.keepalive, &point_states);
    point_states.borrow().open();
    loop {
        let started = Instant::now();
        let fault = match connect(access).await {
            Ok((client, messages)) => session.run(client, messages).await,
            Err(fault) => fault,
        };
        if started.elapsed() >= STABLE_AFTER {
            backoff.reset();
        }
        let delay = backoff.next_delay();
        point_states.borrow_mut().note_lost(&fault.to_string(), delay);
        sleep(delay).await;
    }
}

async fn connect(access: &Access) -> Result<(Client, Messages), LinkFault> {
    let limit = access.server.connect_timeout;
    timeout(limit, log_in(access)).await.map_err(|_| LinkFault::ConnectTimeout(limit))?
}

async fn log_in(access: &Access) -> Result<(Client, Messages), LinkFault> {
    let server = &access.server;
    let mut login = tokio_postgres::Config::new();
    login.user(&server.user).dbname(&server.database).application_name(APPLICATION);
    if let Some(password) = &server.password {
        // Read each time: it may have been replaced.
        let password =
            password.read().map_err(|error| LinkFault::Password(error.message().to_owned()))?;
        login.password(password.reveal());
    }
    let stream = open_stream(server).await?;
    let fault = |error: tokio_postgres::Error| fault_of(&error);
    match &access.tls {
        None => {
            login.ssl_mode(SslMode::Disable);
            let connected = login.connect_raw(Bounded::plain(stream), NoTls).await;
            connected.map_err(fault).map(|(client, connection)| (client, messages(connection)))
        }
        Some(Tls { connector, server_name }) => {
            login.ssl_mode(SslMode::Require);
            let connect =
                MakeTlsConnect::<Stream>::make_tls_connect(&mut connector.clone(), server_name);
            let connect = connect.map_err(|error| LinkFault::Connect(error.to_string()))?;
            let connected = login.connect_raw(stream, BoundedTls(connect)).await;
            connected.map_err(fault).map(|(client, connection)| (client, messages(connection)))
        }
    }
}

/// A byte stream, over whatever.
trait ByteStream: AsyncRead + AsyncWrite + Unpin + Send {}
impl<T: AsyncRead + AsyncWrite + Unpin + Send> ByteStream for T {}
type Stream = Box<dyn ByteStream>;

async fn open_stream(server: &Postgres) -> Result<Stream, LinkFault> {
    let Postgres { host, port, connect_timeout, .. } = server;
    let in_words = |error: io::Error| LinkFault::Connect(in_words(&error));
    if host.starts_with('/') {
        let path = format!("{host}/.s.PGSQL.{port}");
        let stream = UnixStream::connect(path).await.map_err(in_words)?;
        return Ok(Box::new(stream));
    }
    let deadline = Instant::now() + *connect_timeout;
    let addresses = lookup_host((host.as_str(), *port)).await.map_err(in_words)?;
    let stream = connect_any(addresses.take(MAX_ADDRESSES).collect(), deadline).await?;
    // Requests are small, and answers are waited for.
    stream.set_nodelay(true).map_err(in_words)?;
    Ok(Box::new(stream))
}

/// Connects to the first address that lets us. Each has an equal share of the time that
/// is left, so that one that stays silent does not hide the others.
async fn connect_any(
    addresses: Vec<SocketAddr>,
    deadline: Instant,
) -> Result<TcpStream, LinkFault> {
    let mut fault = LinkFault::Connect("the name has no address".into());
    for (address, to_try) in addresses.iter().zip((1..=addresses.len() as u32).rev()) {
        let now = Instant::now();
        let share = deadline.saturating_duration_since(now) / to_try;
        fault = match timeout_at((now + share).into(), TcpStream::connect(address)).await {
            Ok(Ok(stream)) => return Ok(stream),
            Ok(Err(error)) => LinkFault::Connect(in_words(&error)),
            Err(_) => LinkFault::ConnectTimeout(share),
        };
    }
    Err(fault)
}

/// Converts an error of the client library to a fault of the connection.
fn fault_of(error: &tokio_postgres::Error) -> LinkFault {
    if let Some(refusal) = error.as_db_error() {
        let remedy = match *refusal.code() {
            SqlState::INVALID_PASSWORD | SqlState::INVALID_AUTHORIZATION_SPECIFICATION => {
                ": see postgres.user and postgres.password in the settings, and the server's \
                 pg_hba.conf"
            }
            SqlState::INVALID_CATALOG_NAME => ": see postgres.database in the settings",
            _ => "",
        };
        return LinkFault::Refused(shown(&format!("{}{remedy}", refusal.message())));
    }
    let mut source = std::error::Error::source(error);
    let mut text = error.to_string();
    while let Some(cause) = source {
        if let Some(excess) = cause.downcast_ref::<OversizedMessage>() {
            return LinkFault::OversizedMessage(*excess);
        }
        // An error of I/O hides what it was made from.
        if let Some(io) = cause.downcast_ref::<io::Error>()
            && let Some(excess) =
                io.get_ref().and_then(|inner| inner.downcast_ref::<OversizedMessage>())
        {
            return LinkFault::OversizedMessage(*excess);
        }
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    LinkFault::Lost(shown(&text))
}

/// An I/O error without its number, where the system has words for it.
fn in_words(error: &io::Error) -> String {
    match error.kind() {
        kind @ (io::ErrorKind::ConnectionRefused
        | io::ErrorKind::ConnectionReset
        | io::ErrorKind::HostUnreachable
        | io::ErrorKind::NetworkUnreachable
        | io::ErrorKind::NotFound
        | io::ErrorKind::PermissionDenied
        | io::ErrorKind::TimedOut) => kind.to_string(),
        _ => error.to_string(),
    }
}
