//! A serial port that remembers when a byte last came or went.

use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, ReadBuf};
use tokio::time::{Instant, timeout_at};
use tokio_serial::{DataBits, SerialPortBuilderExt, SerialStream, StopBits};

use crate::transport::{Parity, SerialLine};

/// Bytes that are thrown away at once.
const CHUNK_BYTES: usize = 256;
/// Longest wait for a silent line.
const MAX_NOISE: Duration = Duration::from_secs(5);

/// A port, locked for us alone. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct Port(Arc<Mutex<Wire>>);

#[derive(Debug)]
struct Wire {
    stream: SerialStream,
    busy_at: Instant,
}

/// The line never fell silent.
#[derive(Debug)]
pub(crate) struct Noise;

impl Port {
    /// Opens the device file of a line and locks it.
    ///
    /// # Errors
    /// In words, with the remedy.
    pub(crate) fn open(line: &SerialLine) -> Result<Self, String> {
        let builder = tokio_serial::new(&line.device, line.baud_rate)
            .data_bits(DataBits::Eight)
            .parity(match line.parity {
                Parity::Even => tokio_serial::Parity::Even,
                Parity::Odd => tokio_serial::Parity::Odd,
                Parity::None => tokio_serial::Parity::None,
            })
            .stop_bits(if line.has_two_stop_bits { StopBits::Two } else { StopBits::One });
        let opened = builder.open_native_async().map_err(|error| {
            format!(
                "the port cannot be opened: {error}; is it plugged in, may this user open it, and \
                 is no other program using it?"
            )
        });
        Ok(Self(Arc::new(Mutex::new(Wire { stream: opened?, busy_at: Instant::now() }))))
    }

    /// Discards incoming bytes until the line was silent for a while, and not since `start`.
    ///
    /// # Errors
    /// Faults of the system; within, [`Noise`] after [`MAX_NOISE`].
    pub(crate) async fn fall_silent(
        &mut self,
        silence: Duration,
        start: Option<Instant>,
    ) -> io::Result<Result<(), Noise>> {
        let give_up = Instant::now() + silence + MAX_NOISE;
        let mut chunk = [0; CHUNK_BYTES];
        loop {
            let busy_at = self.lock().busy_at;
            let silent_at = start.map_or(busy_at, |start| busy_at.max(start)) + silence;
            if silent_at > give_up {
                return Ok(Err(Noise));
            }
            match timeout_at(silent_at, self.read(&mut chunk)).await {
                Err(_) => return Ok(Ok(())),
                Ok(Ok(0)) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(read) => _ = read?,
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Wire> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl AsyncRead for Port {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let mut wire = self.lock();
        let polled = Pin::new(&mut wire.stream).poll_read(context, buffer);
        if buffer.filled().len() > before {
            wire.busy_at = Instant::now();
        }
        polled
    }
}

impl AsyncWrite for Port {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let mut wire = self.lock();
        wire.busy_at = Instant::now();
        Pin::new(&mut wire.stream).poll_write(context, bytes)
    }

    fn poll_flush(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        // The stream's own waits, and blocks, until the last bit is on the line.
        Poll::Ready(Ok(()))
    }

    fn poll_shutdown(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }
}
