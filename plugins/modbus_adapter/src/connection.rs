//! One TCP connection: one request at a time, each with a deadline.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use thiserror::Error;
use tokio::net::{TcpStream, lookup_host};
use tokio::time::{Instant, timeout, timeout_at};
use tokio_modbus::client::{Client, Context, tcp};
use tokio_modbus::prelude::{Request, Response, Slave, SlaveContext};
use tokio_modbus::{Error as ModbusError, ExceptionCode, ProtocolError};

use crate::address::Table;
use crate::decode::Cells;
use crate::plan::Block;
use crate::settings::Config;

/// Addresses of one name that are tried, so that each has a useful share of
/// the deadline.
const MAX_ADDRESSES: usize = 8;
const OTHER_FUNCTION: &str = "it is of another function";

/// Why a link went down. After any of these the connection is dropped, so that
/// a late answer can never be taken for that of a later request.
#[derive(Debug, Error)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(String),
    #[error("no connection within {} ms; is the address right, and the device on?", .0.as_millis())]
    ConnectTimeout(Duration),
    #[error("the name was not found within {} ms; is the name service up?", .0.as_millis())]
    LookupTimeout(Duration),
    #[error("the name has no address")]
    NoAddress,
    /// By address.
    #[error("{}", .0.iter().map(|(address, fault)| format!("{address}: {fault}"))
        .collect::<Vec<_>>().join("; "))]
    NoneConnects(Vec<(SocketAddr, LinkFault)>),
    #[error("no answer within {} ms to a read of {what}", .limit.as_millis())]
    NoAnswer { what: String, limit: Duration },
    #[error("{what}: the answer cannot be used: {why}")]
    Answer { what: String, why: String },
    #[error("{0}")]
    Lost(String),
}

/// What a device answered.
#[derive(Debug)]
pub(crate) enum Reply {
    Registers(Vec<u16>),
    Bits(Vec<bool>),
    Exception(ExceptionCode),
}

impl Reply {
    /// The cells from `first` on, counted within the reply.
    pub(crate) fn cells(&self, first: usize, count: usize) -> Option<Cells<'_>> {
        let range = first..first.checked_add(count)?;
        match self {
            Self::Registers(all) => all.get(range).map(Cells::Registers),
            Self::Bits(all) => all.get(range).map(Cells::Bits),
            Self::Exception(_) => None,
        }
    }
}

pub(crate) struct Connection {
    client: Context,
    limit: Duration,
}

impl Connection {
    /// Connects within the deadline.
    pub(crate) async fn open(config: &Config) -> Result<Self, LinkFault> {
        let limit = config.timeout;
        let deadline = Instant::now() + limit;
        let addresses = timeout_at(deadline, lookup_host((&*config.host, config.port)))
            .await
            .map_err(|_| LinkFault::LookupTimeout(limit))?
            .map_err(|error| LinkFault::Connect(in_words(&error)))?;
        let stream = connect_any(addresses.take(MAX_ADDRESSES).collect(), deadline).await?;
        // Requests are small and each waits for its answer.
        stream.set_nodelay(true).map_err(|error| LinkFault::Connect(in_words(&error)))?;
        Ok(Self { client: tcp::attach(stream), limit })
    }

    /// Reads a block. On an error the connection must be dropped.
    pub(crate) async fn read(&mut self, block: &Block) -> Result<Reply, LinkFault> {
        let (first, count) = (block.first, block.count);
        let request = match block.table {
            Table::Coil => Request::ReadCoils(first, count),
            Table::Discrete => Request::ReadDiscreteInputs(first, count),
            Table::Holding => Request::ReadHoldingRegisters(first, count),
            Table::Input => Request::ReadInputRegisters(first, count),
        };
        self.client.set_slave(Slave(block.unit));
        match timeout(self.limit, self.client.call(request)).await {
            Err(_) => Err(LinkFault::NoAnswer { what: describe(block), limit: self.limit }),
            Ok(Err(error)) => Err(fault(block, &error)),
            Ok(Ok(Err(exception))) => Ok(Reply::Exception(exception)),
            Ok(Ok(Ok(response))) => checked(block, response),
        }
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
        let share = deadline.saturating_duration_since(Instant::now()) / to_try;
        match connect(*address, share).await {
            Ok(stream) => return Ok(stream),
            Err(fault) => faults.push((*address, fault)),
        }
    }
    Err(if faults.len() > 1 {
        LinkFault::NoneConnects(faults)
    } else {
        // The only address is the endpoint, which the report names anyway.
        faults.pop().map_or(LinkFault::NoAddress, |(_, fault)| fault)
    })
}

async fn connect(address: SocketAddr, limit: Duration) -> Result<TcpStream, LinkFault> {
    timeout(limit, TcpStream::connect(address))
        .await
        .map_err(|_| LinkFault::ConnectTimeout(limit))?
        .map_err(|error| LinkFault::Connect(in_words(&error)))
}

/// `Client::call` has matched transaction, unit and function; the length is
/// left to us.
fn checked(block: &Block, response: Response) -> Result<Reply, LinkFault> {
    let wanted = usize::from(block.count);
    let (reply, length, wanted) = match response {
        Response::ReadCoils(bits) | Response::ReadDiscreteInputs(bits) => {
            let length = bits.len();
            // Bits come in whole bytes.
            (Reply::Bits(bits), length, wanted.next_multiple_of(8))
        }
        Response::ReadHoldingRegisters(registers) | Response::ReadInputRegisters(registers) => {
            let length = registers.len();
            (Reply::Registers(registers), length, wanted)
        }
        _ => {
            return Err(LinkFault::Answer { what: describe(block), why: OTHER_FUNCTION.into() });
        }
    };
    if length == wanted {
        return Ok(reply);
    }
    Err(LinkFault::Answer {
        what: describe(block),
        why: format!("it holds {length} where {wanted} were asked for"),
    })
}

fn fault(block: &Block, error: &ModbusError) -> LinkFault {
    let why = match error {
        ModbusError::Protocol(ProtocolError::HeaderMismatch { .. }) => {
            "it belongs to another request or unit".into()
        }
        ModbusError::Protocol(ProtocolError::FunctionCodeMismatch { .. }) => OTHER_FUNCTION.into(),
        ModbusError::Transport(error) => match error.kind() {
            io::ErrorKind::InvalidData
            | io::ErrorKind::InvalidInput
            | io::ErrorKind::UnexpectedEof => error.to_string(),
            io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::BrokenPipe
            | io::ErrorKind::HostUnreachable
            | io::ErrorKind::NetworkUnreachable
            | io::ErrorKind::TimedOut => return LinkFault::Lost(in_words(error)),
            // The client gives the errno of some earlier call at end of stream.
            _ => return LinkFault::Lost("the device closed the connection".into()),
        },
    };
    LinkFault::Answer { what: describe(block), why }
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

/// The block for messages, such as `holding register 100 to 109 of unit 1`.
pub(crate) fn describe(block: &Block) -> String {
    let Block { unit, table, first, count, .. } = block;
    match count {
        1 => format!("{table} {first} of unit {unit}"),
        _ => format!(
            "{table} {first} to {} of unit {unit}",
            u32::from(*first) + u32::from(*count) - 1
        ),
    }
}

#[cfg(test)]
#[path = "connection_tests.rs"]
mod tests;
