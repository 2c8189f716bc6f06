//! Limit of the machine: the bytes of a read of 125 registers, to and fro, without any protocol.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};

/// Number of registers in one request, as many as it may ask for (Modbus Application Protocol
/// V1.1b3, 6.3).
pub(crate) const REGISTERS: u32 = 125;
/// Length of a request, bytes: header, function, first register and count (Modbus Application
/// Protocol V1.1b3, 6.3).
const REQUEST_BYTES: usize = 7 + 5;
/// Length of an answer, bytes: header, function, count of bytes, registers.
const ANSWER_BYTES: usize = 7 + 2 + 2 * REGISTERS as usize;

/// Measures exchanges a second over loopback, one at a time.
pub(crate) fn exchanges_per_second(duration: Duration) -> Result<f64> {
    let listener = TcpListener::bind("127.0.0.1:0")?;
    let mut client = TcpStream::connect(listener.local_addr()?)?;
    client.set_nodelay(true)?;
    let server = std::thread::spawn(move || answer(&listener));
    let (mut count, begun) = (0_u32, Instant::now());
    let mut bytes = [0; ANSWER_BYTES];
    while begun.elapsed() < duration {
        client.write_all(&bytes[..REQUEST_BYTES])?;
        client.read_exact(&mut bytes)?;
        count += 1;
    }
    let rate = f64::from(count) / begun.elapsed().as_secs_f64();
    drop(client);
    server.join().ok().context("the server panicked")??;
    Ok(rate)
}

/// Answers one client until it closes.
fn answer(listener: &TcpListener) -> Result<()> {
    let (mut stream, _) = listener.accept()?;
    stream.set_nodelay(true)?;
    let mut bytes = [0; ANSWER_BYTES];
    while stream.read_exact(&mut bytes[..REQUEST_BYTES]).is_ok() {
        stream.write_all(&bytes)?;
    }
    Ok(())
}
