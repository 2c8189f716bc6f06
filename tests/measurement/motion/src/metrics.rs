//! Metrics that a viewer serves for Prometheus.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

use anyhow::{Context, Result};

const MAX_WAIT: Duration = Duration::from_secs(5);
const MAX_BYTES: u64 = 4 << 20;

/// Returns the value of a counter.
pub(crate) fn counter(address: SocketAddr, name: &str) -> Result<f64> {
    let mut stream = TcpStream::connect_timeout(&address, MAX_WAIT)
        .with_context(|| format!("no metrics at {address}"))?;
    stream.set_read_timeout(Some(MAX_WAIT))?;
    write!(stream, "GET /metrics HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n")?;
    let mut text = String::new();
    stream.take(MAX_BYTES).read_to_string(&mut text)?;
    let value = text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok());
    value.with_context(|| format!("no counter {name} at {address}"))
}
