//! Proxied connection with its fault.

use std::io;
use std::net::SocketAddr;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::{ReadHalf, WriteHalf};
use tokio::time::sleep;

use crate::SharedState;
use crate::fault::{ConnectionFault, ConnectionPlan};

/// Greatest number of bytes that are passed on at once.
const CHUNK_BYTES: usize = 4096;
/// Longest delay of a piece.
const MAX_DELAY_MILLIS: u64 = 40;
/// Time between two bytes of a trickle.
const TRICKLE: Duration = Duration::from_millis(150);
/// Greatest number of random bytes in one place.
const MAX_GARBAGE_BYTES: usize = 300;

pub(crate) struct Connection {
    pub(crate) plan: ConnectionPlan,
    pub(crate) shared: Arc<SharedState>,
    pub(crate) server: SocketAddr,
}

/// Forced end of a connection.
enum End {
    Reset,
    Close,
    Vanish,
}

impl Connection {
    pub(crate) async fn serve(mut self, mut client: TcpStream) {
        // Without a server the client is hung up on.
        let Ok(mut server) = TcpStream::connect(self.server).await else { return };
        let _ = (client.set_nodelay(true), server.set_nodelay(true));
        let stale =
            std::mem::take(&mut *self.shared.stale.lock().unwrap_or_else(PoisonError::into_inner));
        let shared = Arc::clone(&self.shared);
        let end = {
            let (mut from_client, to_client) = client.split();
            let (from_server, mut to_server) = server.split();
            let is_split = self.plan.fault == ConnectionFault::Split;
            let (said, has_said) = tokio::sync::oneshot::channel();
            tokio::select! {
                _ = forward_to_server(&mut from_client, &mut to_server, is_split, said) => End::Close,
                end = self.forward_to_client(from_server, to_client, stale, has_said) => {
                    end.unwrap_or(End::Close)
                }
                () = shared.hang_up.notified() => End::Close,
            }
        };
        match end {
            End::Close => {}
            End::Reset => _ = client.set_zero_linger(),
            End::Vanish => {
                drop(server);
                discard_input(&mut client).await;
            }
        }
    }

    /// Forwards the server's bytes, up to the strike of a fault.
    async fn forward_to_client(
        &mut self,
        mut from: ReadHalf<'_>,
        mut to: WriteHalf<'_>,
        stale: Vec<u8>,
        has_said: tokio::sync::oneshot::Receiver<()>,
    ) -> io::Result<End> {
        if !stale.is_empty() {
            // The sender lives as long as this.
            let _ = has_said.await;
            to.write_all(&stale).await?;
        }
        let mut chunk = [0; CHUNK_BYTES];
        let mut left = self.plan.strike_after;
        loop {
            let count = from.read(&mut chunk).await?;
            let piece = chunk.get(..count).unwrap_or_default();
            if piece.is_empty() {
                return Ok(End::Close);
            }
            let (before, after) = piece.split_at(left.min(count));
            left -= before.len();
            let strikes = !after.is_empty();
            match self.plan.fault {
                ConnectionFault::None => to.write_all(piece).await?,
                ConnectionFault::Split => write_bytes(&mut to, piece, Duration::ZERO).await?,
                ConnectionFault::Delay => {
                    let millis = self.plan.random.u64(0..=MAX_DELAY_MILLIS);
                    sleep(Duration::from_millis(millis)).await;
                    to.write_all(piece).await?;
                }
                ConnectionFault::Garbage if strikes => {
                    self.shared.note_strike();
                    let count = self.plan.random.usize(1..=MAX_GARBAGE_BYTES);
                    let garbage: Vec<u8> = (0..count).map(|_| self.plan.random.u8(..)).collect();
                    to.write_all(&garbage).await?;
                    to.write_all(piece).await?;
                }
                ConnectionFault::Swap if strikes => {
                    self.shared.note_strike();
                    let mut stale =
                        self.shared.stale.lock().unwrap_or_else(PoisonError::into_inner);
                    *stale = piece.to_vec();
                    return Ok(End::Close);
                }
                ConnectionFault::Garbage | ConnectionFault::Swap => to.write_all(piece).await?,
                fault => {
                    to.write_all(before).await?;
                    if strikes && let Some(end) = self.strike(fault, &mut to, after).await? {
                        return Ok(end);
                    }
                }
            }
        }
    }

    async fn strike(
        &self,
        fault: ConnectionFault,
        to: &mut WriteHalf<'_>,
        after: &[u8],
    ) -> io::Result<Option<End>> {
        self.shared.note_strike();
        Ok(match fault {
            ConnectionFault::Reset => Some(End::Reset),
            ConnectionFault::Vanish => Some(End::Vanish),
            ConnectionFault::Trickle => {
                write_bytes(to, after, TRICKLE).await?;
                None
            }
            _ => Some(End::Close),
        })
    }
}

/// Forwards the client's bytes; `said` is used at the first of them.
async fn forward_to_server(
    from: &mut ReadHalf<'_>,
    to: &mut WriteHalf<'_>,
    is_split: bool,
    said: tokio::sync::oneshot::Sender<()>,
) -> io::Result<()> {
    let mut chunk = [0; CHUNK_BYTES];
    let mut said = Some(said);
    loop {
        let count = from.read(&mut chunk).await?;
        let piece = chunk.get(..count).unwrap_or_default();
        if piece.is_empty() {
            return Ok(());
        }
        if let Some(said) = said.take() {
            let _ = said.send(());
        }
        if is_split {
            write_bytes(to, piece, Duration::ZERO).await?;
        } else {
            to.write_all(piece).await?;
        }
    }
}

async fn write_bytes(to: &mut WriteHalf<'_>, bytes: &[u8], pause: Duration) -> io::Result<()> {
    for byte in bytes {
        to.write_all(std::slice::from_ref(byte)).await?;
        to.flush().await?;
        // Also lets others go on.
        sleep(pause).await;
    }
    Ok(())
}

/// Discards the client's bytes without an answer until it closes.
async fn discard_input(client: &mut TcpStream) {
    let mut chunk = [0; CHUNK_BYTES];
    while let Ok(1..) = client.read(&mut chunk).await {}
}
