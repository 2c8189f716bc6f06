//! A connection to a device, or to the devices of a serial line: one request at a
//! time, each with a deadline.

use std::io;
use std::sync::Arc;
use std::time::Duration;

use busbar_link::{ConnectError, Dial, Endpoint, describe_io_error, is_tls_error};
use thiserror::Error;
use tokio::time::timeout;
use tokio_modbus::client::{Client, Context, tcp};
use tokio_modbus::prelude::{Request, Response, Slave, SlaveContext};
use tokio_modbus::{Error as ModbusError, ExceptionCode, ProtocolError};

use crate::address::Table;
use crate::bus::{Bus, SharedLate};
use crate::decode::Cells;
use crate::marked::Marked;
use crate::plan::Block;
use crate::settings::Config;
use crate::transport::Transport;

const OTHER_FUNCTION: &str = "it is of another function";

/// Fault of a link, or of a device of a serial line that did not answer. After any of them a
/// network connection is dropped: a late answer never passes for that of a later request.
#[derive(Debug, Error)]
pub(crate) enum LinkFault {
    #[error("{0}")]
    Connect(#[from] ConnectError),
    #[error("{0}")]
    Port(String),
    #[error("no answer within {} ms to a read of {what}", .limit.as_millis())]
    NoAnswer { what: String, limit: Duration },
    #[error("{what}: the answer cannot be used: {why}")]
    Answer { what: String, why: String },
    #[error("unit {0} is out of step: its answers are those of former requests")]
    OutOfStep(u8),
    #[error("the line does not fall silent: is another master on it, or the baud rate wrong?")]
    Noise,
    #[error("{0}")]
    Lost(String),
}

impl LinkFault {
    pub(crate) fn no_answer(block: &Block, limit: Duration) -> Self {
        Self::NoAnswer { what: describe(block), limit }
    }
}

/// Answer of a device to a read of one block.
#[derive(Debug)]
pub(crate) enum Reply {
    Registers(Vec<u16>),
    Bits(Vec<bool>),
    Exception(ExceptionCode),
    /// One device of a serial line gave no answer that can be used; the others may.
    None(LinkFault),
}

impl Reply {
    /// Returns the cells from `first` on, counted within the reply.
    pub(crate) fn cells(&self, first: usize, count: usize) -> Option<Cells<'_>> {
        let range = first..first.checked_add(count)?;
        match self {
            Self::Registers(all) => all.get(range).map(Cells::Registers),
            Self::Bits(all) => all.get(range).map(Cells::Bits),
            Self::Exception(_) | Self::None(_) => None,
        }
    }
}

/// Makes connections, one after the other.
pub(crate) struct Connector {
    transport: Transport,
    limit: Duration,
    dial: Arc<dyn Dial>,
    late: SharedLate,
}

impl Connector {
    pub(crate) fn new(config: &Config, dial: Arc<dyn Dial>) -> Self {
        let transport = config.transport.clone();
        Self { transport, limit: config.timeout, dial, late: SharedLate::default() }
    }

    /// Connects within the deadline.
    pub(crate) async fn open(&self) -> Result<Connection, LinkFault> {
        match &self.transport {
            Transport::Tcp { endpoint, .. } => self.open_network(endpoint).await,
            Transport::Serial(line) => {
                Bus::open(line, self.limit, self.late.clone()).map(Connection::Serial)
            }
        }
    }

    async fn open_network(&self, endpoint: &Endpoint) -> Result<Connection, LinkFault> {
        let stream = self.dial.dial(endpoint, self.limit).await?;
        let client = tcp::attach(Marked::new(stream, fastrand::u16(..)));
        Ok(Connection::Network(Network { client, limit: self.limit }))
    }
}

pub(crate) enum Connection {
    Network(Network),
    Serial(Bus),
}

impl Connection {
    /// Reads a block. On an error the connection must be dropped.
    pub(crate) async fn read(&mut self, block: &Block) -> Result<Reply, LinkFault> {
        match self {
            Self::Network(network) => network.read(block).await,
            Self::Serial(bus) => bus.read(block).await,
        }
    }
}

/// A TCP connection, encrypted or not.
pub(crate) struct Network {
    client: Context,
    limit: Duration,
}

impl Network {
    async fn read(&mut self, block: &Block) -> Result<Reply, LinkFault> {
        self.client.set_slave(Slave(block.unit));
        match timeout(self.limit, self.client.call(request(block))).await {
            Err(_) => Err(LinkFault::no_answer(block, self.limit)),
            Ok(Err(error)) => Err(fault(block, &error)),
            Ok(Ok(Err(exception))) => Ok(Reply::Exception(exception)),
            Ok(Ok(Ok(response))) => checked(block, response),
        }
    }
}

/// Returns the request that reads a block.
pub(crate) fn request(block: &Block) -> Request<'static> {
    let (first, count) = (block.first, block.count);
    match block.table {
        Table::Coil => Request::ReadCoils(first, count),
        Table::Discrete => Request::ReadDiscreteInputs(first, count),
        Table::Holding => Request::ReadHoldingRegisters(first, count),
        Table::Input => Request::ReadInputRegisters(first, count),
    }
}

/// `Client::call` has matched transaction, unit and function; the length is
/// left to us.
pub(crate) fn checked(block: &Block, response: Response) -> Result<Reply, LinkFault> {
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

/// Translates an error of the client into the fault of the link.
pub(crate) fn fault(block: &Block, error: &ModbusError) -> LinkFault {
    let why = match error {
        ModbusError::Protocol(ProtocolError::HeaderMismatch { .. }) => {
            "it belongs to another request or unit".into()
        }
        ModbusError::Protocol(ProtocolError::FunctionCodeMismatch { .. }) => OTHER_FUNCTION.into(),
        ModbusError::Transport(error) if is_tls_error(error) => {
            return LinkFault::Lost(describe_io_error(error));
        }
        ModbusError::Transport(error) => match error.kind() {
            io::ErrorKind::InvalidData
            | io::ErrorKind::InvalidInput
            | io::ErrorKind::UnexpectedEof => error.to_string(),
            io::ErrorKind::ConnectionReset
            | io::ErrorKind::ConnectionAborted
            | io::ErrorKind::BrokenPipe
            | io::ErrorKind::HostUnreachable
            | io::ErrorKind::NetworkUnreachable
            | io::ErrorKind::TimedOut => return LinkFault::Lost(describe_io_error(error)),
            // The client gives the errno of some earlier call at end of stream.
            _ => return LinkFault::Lost("the device closed the connection".into()),
        },
    };
    LinkFault::Answer { what: describe(block), why }
}

/// Formats the block for messages, such as `holding register 100 to 109 of unit 1`.
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
