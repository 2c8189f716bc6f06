//! The device that the adapter reads, simulated: every tag at its address.

mod bank;
mod encode;

use std::future::{Ready, ready};
use std::sync::Arc;

use busbar_plugin_sdk::{Error, Host, LogLevel, Simulation};
use device_server::{ACCEPT_PAUSE, DeviceServer, FaultyLink};
use tokio::net::{TcpListener, TcpStream};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;
use tokio_modbus::{ExceptionCode, Request, Response, SlaveRequest};

use crate::address::{self, Table};
use crate::settings::Config;
use crate::transport::Transport;
pub(crate) use bank::Bank;

/// Starts a device at the host and port of the settings.
pub(crate) fn start(
    config: &Config,
    simulation: Simulation,
    host: &Host,
) -> Result<DeviceServer, Error> {
    let Transport::Tcp { endpoint, tls: None } = &config.transport else {
        return Err(Error::settings(
            "settings: a simulated device listens on plain TCP: leave \"tls\" and \"serial\" away, \
             and name \"host\" and \"port\", to simulate",
        ));
    };
    let (bank, remark) = bank(config, &simulation)?;
    if let Some(remark) = remark {
        host.log(LogLevel::Warning, &remark);
    }
    let link = FaultyLink::new(simulation.faults, simulation.seed, config.timeout);
    let endpoints = [(endpoint.host.clone(), endpoint.port)];
    let name = format!("modbus-sim:{}", endpoint.port);
    DeviceServer::start(&name, &endpoints, link, host, move |listeners, link| {
        serve(listeners, link, Arc::new(bank))
    })
}

/// Builds the cells of the device, and a remark on tags that share cells.
pub(crate) fn bank(
    config: &Config,
    simulation: &Simulation,
) -> Result<(Bank, Option<String>), Error> {
    let points = address::parse(&simulation.specs(), config)?;
    let signals = simulation.tags.iter().map(|tag| tag.signal.clone());
    Bank::new(points.into_iter().zip(signals).collect())
}

async fn serve(listeners: Vec<TcpListener>, link: FaultyLink, bank: Arc<Bank>) {
    let Some(listener) = listeners.into_iter().next() else { return };
    let server = Server::new(listener);
    let connected = |stream: TcpStream, _| {
        let client = Client { bank: Arc::clone(&bank), link: link.clone() };
        ready(Ok(link.admit(stream).map(|transport| (client, transport))))
    };
    loop {
        // A client that breaks the protocol loses its connection, no more.
        if server.serve(&connected, drop).await.is_err() {
            tokio::time::sleep(ACCEPT_PAUSE).await;
        }
    }
}

/// The device as one client sees it.
struct Client {
    bank: Arc<Bank>,
    link: FaultyLink,
}

impl Service for Client {
    type Request = SlaveRequest<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, SlaveRequest { slave: unit, request }: Self::Request) -> Self::Future {
        self.link.count_messages(1);
        // The device's own clock may be wrong: values follow the true one.
        let (_, now) = self.link.now();
        let read = |table, first, count| self.bank.read(unit, table, first, count, now);
        let bits = |cells: Vec<u16>| cells.into_iter().map(|cell| cell != 0).collect();
        ready(match request {
            Request::ReadCoils(first, count) => {
                read(Table::Coil, first, count).map(bits).map(Response::ReadCoils)
            }
            Request::ReadDiscreteInputs(first, count) => {
                read(Table::Discrete, first, count).map(bits).map(Response::ReadDiscreteInputs)
            }
            Request::ReadHoldingRegisters(first, count) => {
                read(Table::Holding, first, count).map(Response::ReadHoldingRegisters)
            }
            Request::ReadInputRegisters(first, count) => {
                read(Table::Input, first, count).map(Response::ReadInputRegisters)
            }
            // What is simulated cannot be written.
            _ => Err(ExceptionCode::IllegalFunction),
        })
    }
}

#[cfg(test)]
#[path = "year_tests.rs"]
mod tests;
