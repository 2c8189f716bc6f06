//! Moves the bytes of one connection, and loses, delays or spoils them.

use std::io;
use std::time::Duration;

use busbar_plugin_sdk::simulation::FaultKind;
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf};
use tokio::net::TcpStream;
use tokio::net::tcp::{ReadHalf as TcpReadHalf, WriteHalf as TcpWriteHalf};
use tokio::time::sleep;

use crate::link::Link;

/// Bytes that are moved at once.
const PIECE_BYTES: usize = 1 << 14;
/// The longest that a connection lives while connections are reset.
const MAX_RESET_LIFE: Duration = Duration::from_millis(400);
/// Bytes of garbage instead of an answer.
const GARBAGE_BYTES: std::ops::RangeInclusive<usize> = 1..=64;
/// Set in the first of them: no frame begins so in the protocols that are served.
const NO_START: u8 = 0x80;

/// How a connection ends.
enum End {
    Closed,
    Reset,
}

/// Until either end is gone, or a fault ends it.
pub(crate) async fn run(
    mut client: TcpStream,
    protocol: DuplexStream,
    link: &Link,
    mut random: fastrand::Rng,
) {
    // Without it answers are late, which is no failure.
    let _ = client.set_nodelay(true);
    let life = MAX_RESET_LIFE.mul_f64(random.f64());
    let end = {
        let (from_client, to_client) = client.split();
        let (from_protocol, to_protocol) = tokio::io::split(protocol);
        tokio::select! {
            end = cut(link, life) => end,
            _ = listen(from_client, to_protocol, link) => End::Closed,
            _ = answer(from_protocol, to_client, link, random) => End::Closed,
        }
    };
    if let End::Reset = end {
        // A connection that is gone already needs no reset.
        let _ = client.set_zero_linger();
    }
}

/// Waits for what ends the connection.
async fn cut(link: &Link, life: Duration) -> End {
    loop {
        let fault = link.fault_kind();
        match fault {
            Some(FaultKind::LinkLoss) => return End::Closed,
            Some(FaultKind::Reset) => {
                sleep(life).await;
                return End::Reset;
            }
            _ => link.changed().await,
        }
        // What was lost meanwhile is missing in the stream.
        if let Some(FaultKind::HalfOpen | FaultKind::Garbage) = fault {
            return End::Reset;
        }
    }
}

async fn listen(
    mut from: TcpReadHalf<'_>,
    mut to: WriteHalf<DuplexStream>,
    link: &Link,
) -> io::Result<()> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        while link.fault_kind() == Some(FaultKind::HalfOpen) {
            link.changed().await;
        }
        match from.read(&mut piece).await? {
            0 => return Ok(()),
            count => to.write_all(&piece[..count]).await?,
        }
    }
}

async fn answer(
    mut from: ReadHalf<DuplexStream>,
    mut to: TcpWriteHalf<'_>,
    link: &Link,
    mut random: fastrand::Rng,
) -> io::Result<()> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let count = from.read(&mut piece).await?;
        if count == 0 {
            return Ok(());
        }
        sleep(link.delay()).await;
        match link.fault_kind() {
            Some(FaultKind::HalfOpen) => {}
            Some(FaultKind::Garbage) => to.write_all(&garbage(&mut random)).await?,
            _ => to.write_all(&piece[..count]).await?,
        }
    }
}

fn garbage(random: &mut fastrand::Rng) -> Vec<u8> {
    let mut bytes = vec![0; random.usize(GARBAGE_BYTES)];
    random.fill(&mut bytes);
    bytes[0] |= NO_START;
    bytes
}
