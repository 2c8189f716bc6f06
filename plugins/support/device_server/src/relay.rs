//! Relay between socket and protocol of one connection, which loses, delays or corrupts bytes.

use std::io;
use std::time::Duration;

use busbar_plugin_sdk::simulation::FaultKind;
use tokio::io::{
    AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, DuplexStream, ReadHalf, WriteHalf,
};
use tokio::time::sleep;

use crate::faulty_link::FaultyLink;
use crate::socket::Socket;

/// Bytes moved at once.
const PIECE_BYTES: usize = 1 << 14;
/// Longest life of a connection while connections are reset.
const MAX_RESET_LIFE: Duration = Duration::from_millis(400);
/// Bytes of garbage that replace an answer.
const GARBAGE_BYTES: std::ops::RangeInclusive<usize> = 1..=64;
/// Bit set in the first byte of garbage: no frame of the protocols served begins so.
const NO_START: u8 = 0x80;

/// End of a connection.
enum End {
    Closed,
    Reset,
}

/// Relays until either end is gone, or a fault ends the connection.
pub(crate) async fn run(
    client: impl Socket,
    protocol: DuplexStream,
    link: &FaultyLink,
    mut random: fastrand::Rng,
) {
    client.prepare();
    let life = MAX_RESET_LIFE.mul_f64(random.f64());
    let (mut from_client, mut to_client) = tokio::io::split(client);
    let (from_protocol, to_protocol) = tokio::io::split(protocol);
    // In this order, so that simulated time repeats itself.
    let end = tokio::select! {
        biased;
        end = cut(link, life) => end,
        _ = listen(&mut from_client, to_protocol, link) => End::Closed,
        _ = answer(from_protocol, &mut to_client, link, random) => End::Closed,
    };
    if let End::Reset = end {
        from_client.unsplit(to_client).prepare_reset();
    }
}

/// Waits for a fault that ends the connection.
async fn cut(link: &FaultyLink, life: Duration) -> End {
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
    from: &mut (impl AsyncRead + Unpin),
    mut to: WriteHalf<DuplexStream>,
    link: &FaultyLink,
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
    to: &mut (impl AsyncWrite + Unpin),
    link: &FaultyLink,
    mut random: fastrand::Rng,
) -> io::Result<()> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let count = from.read(&mut piece).await?;
        if count == 0 {
            return Ok(());
        }
        let delay = link.delay();
        // Sleeping for no time takes up to a millisecond, the timer's step.
        if !delay.is_zero() {
            sleep(delay).await;
        }
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
