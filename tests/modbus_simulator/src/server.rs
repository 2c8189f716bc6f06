//! Requests in, answers out.

use std::future::{Ready, ready};
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};

use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;
use tokio_modbus::{ExceptionCode, Request, Response};

use crate::bank::Bank;

/// Clients at a time; more are closed at once.
pub(crate) const MAX_CONNECTIONS: usize = 32;

/// The device as one client sees it. Every unit id is answered.
struct Client {
    bank: Arc<Mutex<Bank>>,
    _permit: OwnedSemaphorePermit,
}

impl Service for Client {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        let mut bank = self.bank.lock().unwrap_or_else(PoisonError::into_inner);
        ready(answer(&mut bank, request))
    }
}

fn answer(bank: &mut Bank, request: Request<'_>) -> Result<Response, ExceptionCode> {
    match request {
        Request::ReadCoils(first, count) => bank.read_bits(first, count).map(Response::ReadCoils),
        Request::ReadDiscreteInputs(first, count) => {
            bank.read_bits(first, count).map(Response::ReadDiscreteInputs)
        }
        Request::ReadHoldingRegisters(first, count) => {
            bank.read_registers(first, count).map(Response::ReadHoldingRegisters)
        }
        Request::ReadInputRegisters(first, count) => {
            bank.read_registers(first, count).map(Response::ReadInputRegisters)
        }
        Request::WriteSingleCoil(first, bit) => {
            bank.write_bits(first, &[bit])?;
            Ok(Response::WriteSingleCoil(first, bit))
        }
        Request::WriteMultipleCoils(first, bits) => {
            bank.write_bits(first, &bits)?;
            Ok(Response::WriteMultipleCoils(first, bits.len() as u16))
        }
        Request::WriteSingleRegister(first, register) => {
            bank.write_registers(first, &[register])?;
            Ok(Response::WriteSingleRegister(first, register))
        }
        Request::WriteMultipleRegisters(first, registers) => {
            bank.write_registers(first, &registers)?;
            let count = registers.len() as u16;
            Ok(Response::WriteMultipleRegisters(first, count))
        }
        _ => Err(ExceptionCode::IllegalFunction),
    }
}

/// Serves clients until the listener fails; drop the future to end it.
pub(crate) async fn serve(listener: TcpListener, bank: Arc<Mutex<Bank>>) -> std::io::Result<()> {
    let places = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    let connected = |stream: TcpStream, _: SocketAddr| {
        let bank = Arc::clone(&bank);
        let permit = Arc::clone(&places).try_acquire_owned();
        async move {
            stream.set_nodelay(true)?;
            Ok(permit.ok().map(|permit| {
                let client = Client { bank, _permit: permit };
                (client, stream)
            }))
        }
    };
    // A client that breaks the protocol loses its connection, no more.
    Server::new(listener).serve(&connected, drop).await
}
