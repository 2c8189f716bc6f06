//! The proxy as a program: prints `READY port`, and works until it is killed.
#![allow(clippy::print_stdout, reason = "the port is this program's output")]

use std::net::{SocketAddr, ToSocketAddrs};

use anyhow::{Context, Result};
use clap::Parser;
use fault_proxy::{ConnectionFault, FaultProxy, FaultScript};

/// A TCP proxy that breaks connections in seeded ways.
#[derive(Parser)]
struct Arguments {
    /// The server, as host:port.
    server: String,
    /// Port to listen at, on the local host; any that is free by default.
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Seed of all random decisions.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Faults of connections, one of these to each.
    #[arg(long = "fault", value_enum, required = true)]
    faults: Vec<ConnectionFault>,
    /// Greatest number of bytes to the client before a fault strikes.
    #[arg(long, default_value_t = 2000)]
    max_bytes: usize,
}

fn main() -> Result<()> {
    let Arguments { server, port, seed, faults, max_bytes } = Arguments::parse();
    let script = FaultScript { seed, faults, max_bytes };
    let proxy = FaultProxy::start_on(port, resolve(&server)?, script)
        .with_context(|| format!("cannot listen at port {port}"))?;
    println!("READY {}", proxy.port());
    loop {
        std::thread::park();
    }
}

fn resolve(server: &str) -> Result<SocketAddr> {
    let addresses = server.to_socket_addrs();
    let mut addresses = addresses.with_context(|| format!("'{server}' is no host:port"))?;
    addresses.next().with_context(|| format!("'{server}' has no address"))
}
