//! TCP connections to a device by name, within a deadline.

use std::fmt::Debug;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::time::Duration;

use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpStream, lookup_host};
use tokio::time::{Instant, timeout_at};

use crate::tls::is_tls_error;
use crate::{Endpoint, TlsClient};

/// Addresses of one name that are tried, so that each has a useful share of the deadline.
pub const MAX_ADDRESSES: usize = 8;

/// Byte stream of a connection, encrypted or not.
pub trait ByteStream: AsyncRead + AsyncWrite + Debug + Send + Unpin {}
impl<T: AsyncRead + AsyncWrite + Debug + Send + Unpin> ByteStream for T {}

/// Error of an attempt to connect.
#[derive(Debug, Error)]
pub enum ConnectError {
    /// Error of the system, in words.
    #[error("{0}")]
    System(String),
    /// No answer within the limit.
    #[error("no connection within {} ms; is the address right, and the device on?", .0.as_millis())]
    Timeout(Duration),
    /// No answer of the name service within the limit.
    #[error("the name was not found within {} ms; is the name service up?", .0.as_millis())]
    LookupTimeout(Duration),
    /// Name without an address, as the name service says.
    #[error("the name has no address")]
    NoAddress,
    /// Errors of all addresses tried.
    #[error("{}", .0.iter().map(|(address, fault)| format!("{address}: {fault}"))
        .collect::<Vec<_>>().join("; "))]
    NoneConnects(Vec<(SocketAddr, ConnectError)>),
    /// Certificate of the device or of this client that was refused.
    #[error("no secure connection: {0}")]
    Insecure(String),
    /// No complete handshake within the limit.
    #[error("no secure connection within {} ms; does the device speak TLS on this port?",
        .0.as_millis())]
    InsecureTimeout(Duration),
}

/// Connector to endpoints: over TCP, or through memory where a test simulates time, which sockets
/// do not.
pub trait Dial: Send + Sync {
    /// Connects within `limit`, name lookup and handshake included.
    fn dial<'a>(&'a self, endpoint: &'a Endpoint, limit: Duration) -> DialFuture<'a>;
}

/// Future of a connection, or of the error in words for operators.
pub type DialFuture<'a> =
    Pin<Box<dyn Future<Output = Result<Box<dyn ByteStream>, ConnectError>> + 'a>>;

/// Connector to endpoints over TCP.
pub struct TcpDial {
    /// Encryption of the connections; none for plain TCP.
    pub tls: Option<TlsClient>,
}

impl Dial for TcpDial {
    fn dial<'a>(&'a self, endpoint: &'a Endpoint, limit: Duration) -> DialFuture<'a> {
        Box::pin(connect(endpoint, self.tls.as_ref(), limit))
    }
}

/// Connects within `limit`, name lookup and TLS handshake included.
///
/// # Errors
/// In words for operators.
async fn connect(
    endpoint: &Endpoint,
    tls: Option<&TlsClient>,
    limit: Duration,
) -> Result<Box<dyn ByteStream>, ConnectError> {
    let deadline = Instant::now() + limit;
    let addresses = timeout_at(deadline, lookup_host((&*endpoint.host, endpoint.port)))
        .await
        .map_err(|_| ConnectError::LookupTimeout(limit))?
        .map_err(|error| system(&error))?;
    let stream = connect_any(addresses.take(MAX_ADDRESSES).collect(), deadline).await?;
    // Messages are small, and each waits for its answer.
    stream.set_nodelay(true).map_err(|error| system(&error))?;
    let Some(tls) = tls else { return Ok(Box::new(stream)) };
    let encrypted = timeout_at(deadline, tls.handshake(endpoint, stream)).await;
    Ok(Box::new(encrypted.map_err(|_| ConnectError::InsecureTimeout(limit))??))
}

/// Connects to the first address that accepts. Each has an equal share of the time that is left, so
/// that a silent one does not block the others.
async fn connect_any(
    addresses: Vec<SocketAddr>,
    deadline: Instant,
) -> Result<TcpStream, ConnectError> {
    let mut faults = Vec::new();
    for (address, to_try) in addresses.iter().zip((1..=addresses.len() as u32).rev()) {
        let now = Instant::now();
        let share = deadline.saturating_duration_since(now) / to_try;
        let fault = match timeout_at(now + share, TcpStream::connect(address)).await {
            Ok(Ok(stream)) => return Ok(stream),
            Ok(Err(error)) => system(&error),
            Err(_) => ConnectError::Timeout(share),
        };
        faults.push((*address, fault));
    }
    Err(if faults.len() > 1 {
        ConnectError::NoneConnects(faults)
    } else {
        // The only address is the endpoint, which the report names anyway.
        faults.pop().map_or(ConnectError::NoAddress, |(_, fault)| fault)
    })
}

fn system(error: &io::Error) -> ConnectError {
    ConnectError::System(describe_io_error(error))
}

/// Describes an I/O error without its number, where the system has words for it.
pub fn describe_io_error(error: &io::Error) -> String {
    match error.kind() {
        kind @ (io::ErrorKind::ConnectionRefused
        | io::ErrorKind::ConnectionReset
        | io::ErrorKind::ConnectionAborted
        | io::ErrorKind::BrokenPipe
        | io::ErrorKind::HostUnreachable
        | io::ErrorKind::NetworkUnreachable
        | io::ErrorKind::PermissionDenied
        | io::ErrorKind::ResourceBusy
        | io::ErrorKind::TimedOut) => kind.to_string(),
        io::ErrorKind::UnexpectedEof if is_tls_error(error) => {
            "the device ended the secure connection; does it trust our certificate?".into()
        }
        _ => error.to_string(),
    }
}

#[cfg(test)]
#[path = "connect_tests.rs"]
mod tests;
