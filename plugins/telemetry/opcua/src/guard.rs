//! Frame validation of a server's byte stream, so that no client buffers what is malformed or too
//! large.

use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

use async_opcua::types::StatusCode;
use thiserror::Error;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

use crate::fault::in_words;

/// Longest chunk, bytes, as Hello announces it to servers (OPC 10000-6, 7.1.2.3).
pub(crate) const MAX_CHUNK_BYTES: u32 = 65_536;
/// Length of a header: type, kind of chunk, size (OPC 10000-6, 7.1.2.2), bytes.
const HEADER_BYTES: usize = 8;
/// Bytes of an error's body that are kept.
const MAX_ERROR_BYTES: usize = 512;
/// Message types that a server may send.
const ERROR: &[u8; 3] = b"ERR";
const TYPES: [&[u8; 3]; 5] = [b"ACK", ERROR, b"OPN", b"MSG", b"CLO"];

/// Reason for which bytes are no frames of a server.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub(crate) enum FrameFault {
    /// Unknown message type, so probably another protocol.
    #[error("what came is no OPC UA over TCP; is the port right?")]
    Type,
    /// Chunk size outside the limits that were agreed.
    #[error("a chunk of {0} bytes, where 9 to {MAX_CHUNK_BYTES} are agreed")]
    Size(u32),
}

/// Frame parser that follows a stream of bytes.
#[derive(Debug, Default)]
pub(crate) struct FrameGuard {
    header: [u8; HEADER_BYTES],
    /// Bytes of the header that came.
    filled: usize,
    /// Bytes of the frame that are still to come.
    left: usize,
    /// The body of an error: status code, length, text (OPC 10000-6, 7.1.2.5).
    error: Vec<u8>,
}

impl FrameGuard {
    /// Looks at the bytes that came next.
    ///
    /// # Errors
    /// A frame fault, as soon as the bytes can be no frame.
    pub(crate) fn pass(&mut self, mut bytes: &[u8]) -> Result<(), FrameFault> {
        while let Some(&first) = bytes.first() {
            if self.left > 0 {
                let (body, rest) = bytes.split_at(self.left.min(bytes.len()));
                if self.header.starts_with(ERROR) {
                    let room = MAX_ERROR_BYTES.saturating_sub(self.error.len());
                    self.error.extend(body.iter().take(room));
                }
                self.left = self.left.saturating_sub(body.len());
                bytes = rest;
                continue;
            }
            if let Some(place) = self.header.get_mut(self.filled) {
                *place = first;
            }
            self.filled = self.filled.saturating_add(1);
            bytes = bytes.get(1..).unwrap_or_default();
            if self.filled == HEADER_BYTES {
                self.left = self.check()?;
                self.filled = 0;
            }
        }
        Ok(())
    }

    /// Returns the server's reason for ending the connection, from its error message.
    fn refusal(&self) -> Option<String> {
        let (status, rest) = self.error.split_first_chunk()?;
        let status = in_words(StatusCode::from(u32::from_le_bytes(*status)));
        let text = String::from_utf8_lossy(rest.get(4..).unwrap_or_default());
        Some(format!("the server ended the connection: {status}: {}", text.trim()))
    }

    /// Checks a complete header; returns the number of bytes that follow it.
    fn check(&self) -> Result<usize, FrameFault> {
        let [a, b, c, _, size @ ..] = self.header;
        if !TYPES.contains(&&[a, b, c]) {
            return Err(FrameFault::Type);
        }
        let size = u32::from_le_bytes(size);
        let left = (size as usize).checked_sub(HEADER_BYTES).filter(|left| *left > 0);
        left.filter(|_| size <= MAX_CHUNK_BYTES).ok_or(FrameFault::Size(size))
    }
}

/// Shared reason for the end of a stream, for callers that see only the end.
#[derive(Clone, Debug, Default)]
pub(crate) struct LastWords(Arc<Mutex<Option<String>>>);

impl LastWords {
    /// Takes the reason that was noted first.
    pub(crate) fn take(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    fn note(&self, words: impl FnOnce() -> String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(words);
    }
}

/// A stream whose incoming bytes are frames, or an error.
#[derive(Debug)]
pub(crate) struct Guarded<S> {
    /// Stream behind a lock that is never contended: it only makes the type shareable.
    stream: Mutex<S>,
    guard: FrameGuard,
    words: LastWords,
}

impl<S> Guarded<S> {
    pub(crate) fn new(stream: S, words: LastWords) -> Self {
        Self { stream: Mutex::new(stream), guard: FrameGuard::default(), words }
    }
}

fn inner<S: Unpin>(stream: &mut Mutex<S>) -> Pin<&mut S> {
    Pin::new(stream.get_mut().unwrap_or_else(PoisonError::into_inner))
}

impl<S: AsyncRead + Unpin> AsyncRead for Guarded<S> {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let Self { stream, guard, words } = self.get_mut();
        let before = buffer.filled().len();
        let read = std::task::ready!(inner(stream).poll_read(context, buffer));
        if let Err(error) = &read {
            words.note(|| busbar_link::describe_io_error(error));
        }
        read?;
        let came = buffer.filled().get(before..).unwrap_or_default();
        if came.is_empty() {
            words.note(|| "the server closed the connection".into());
        }
        let passed = guard.pass(came);
        if let Some(refusal) = guard.refusal() {
            words.note(|| refusal);
        }
        Poll::Ready(passed.map_err(|fault| {
            words.note(|| fault.to_string());
            io::Error::new(io::ErrorKind::InvalidData, fault)
        }))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Guarded<S> {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        inner(&mut self.get_mut().stream).poll_write(context, bytes)
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        inner(&mut self.get_mut().stream).poll_flush(context)
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        inner(&mut self.get_mut().stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frame(size: u32) -> Vec<u8> {
        let mut bytes = b"MSGF".to_vec();
        bytes.extend(size.to_le_bytes());
        bytes.resize(size as usize, 7);
        bytes
    }

    proptest! {
        #[test]
        fn frames_pass_in_whatever_pieces(
            sizes in prop::collection::vec(9_u32..300, 1..20), piece in 1_usize..50,
        ) {
            let bytes: Vec<_> = sizes.iter().flat_map(|size| frame(*size)).collect();
            let mut guard = FrameGuard::default();
            for piece in bytes.chunks(piece) {
                prop_assert_eq!(guard.pass(piece), Ok(()));
            }
            prop_assert_eq!((guard.left, guard.filled), (0, 0));
        }

        #[test]
        fn no_bytes_let_it_wait_for_more_than_a_chunk(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let mut guard = FrameGuard::default();
            let _ = guard.pass(&bytes);
            prop_assert!(guard.left < MAX_CHUNK_BYTES as usize);
        }
    }

    #[test]
    fn other_protocols_and_sizes_are_refused() {
        let mut guard = FrameGuard::default();
        assert_eq!(guard.pass(b"HTTP/1.1 400"), Err(FrameFault::Type));
        for size in [0, 8, MAX_CHUNK_BYTES + 1, u32::MAX] {
            let header = [b"MSGF".as_slice(), &size.to_le_bytes()].concat();
            assert_eq!(FrameGuard::default().pass(&header), Err(FrameFault::Size(size)));
        }
    }
}
