//! Transaction numbers that no other connection has.
//!
//! The client counts the transactions of every connection from 0. A gateway that
//! hands an answer of a connection which is gone to the next one would be believed.
//! So the numbers on the wire are those of the client, combined with a key that is
//! drawn for each connection.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Bytes of the header up to and with the length of the rest (Modbus Messaging on
/// TCP/IP V1.0b, 3.1.3).
const PREFIX_BYTES: usize = 6;

/// A connection whose transaction numbers are marked.
#[derive(Debug)]
pub(crate) struct Marked<S> {
    stream: S,
    key: [u8; 2],
    sent: Place,
    received: Place,
}

impl<S> Marked<S> {
    pub(crate) fn new(stream: S, key: u16) -> Self {
        let key = key.to_be_bytes();
        Self { stream, key, sent: Place::default(), received: Place::default() }
    }
}

/// Marks a stream that comes in pieces, or takes the mark off.
pub(crate) fn mark<'a>(pieces: impl Iterator<Item = &'a mut [u8]>, key: u16) {
    let mut place = Place::default();
    pieces.for_each(|piece| place.mark(piece, key.to_be_bytes()));
}

/// Position within a frame of the next byte.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    at: usize,
    /// Bytes after the prefix.
    rest: usize,
}

impl Place {
    /// Marks the transaction numbers in these bytes, or takes the mark off.
    fn mark(&mut self, bytes: &mut [u8], key: [u8; 2]) {
        for byte in bytes {
            match self.at {
                at @ (0 | 1) => *byte ^= key[at],
                4 => self.rest = usize::from(*byte) << 8,
                5 => self.rest |= usize::from(*byte),
                _ => {}
            }
            self.at += 1;
            if self.at >= PREFIX_BYTES + self.rest {
                *self = Self::default();
            }
        }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Marked<S> {
    fn poll_read(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let before = buffer.filled().len();
        ready!(Pin::new(&mut this.stream).poll_read(context, buffer))?;
        let received = buffer.filled_mut().get_mut(before..).unwrap_or_default();
        this.received.mark(received, this.key);
        Poll::Ready(Ok(()))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Marked<S> {
    fn poll_write(
        self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        let mut marked = bytes.to_vec();
        let mut place = this.sent;
        place.mark(&mut marked, this.key);
        let count = ready!(Pin::new(&mut this.stream).poll_write(context, &marked))?;
        // Not all may have been taken.
        marked.truncate(count);
        this.sent.mark(&mut marked, this.key);
        Poll::Ready(Ok(count))
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().stream).poll_flush(context)
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.get_mut().stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A frame of this transaction and so many bytes after the prefix.
    fn frame(transaction: u16, rest: u16) -> Vec<u8> {
        let mut frame = transaction.to_be_bytes().to_vec();
        frame.extend([0, 0]);
        frame.extend(rest.to_be_bytes());
        frame.extend((0..rest).map(|i| i as u8));
        frame
    }

    proptest! {
        #[test]
        fn numbers_are_marked_and_nothing_else(
            frames in prop::collection::vec((any::<u16>(), 0_u16..300), 1..8),
            key: u16,
            cut in 1_usize..50,
        ) {
            let plain: Vec<u8> = frames.iter().flat_map(|&(t, rest)| frame(t, rest)).collect();
            let expected: Vec<u8> =
                frames.iter().flat_map(|&(t, rest)| frame(t ^ key, rest)).collect();
            let mut marked = plain.clone();
            let mut place = Place::default();
            for piece in marked.chunks_mut(cut) {
                place.mark(piece, key.to_be_bytes());
            }
            prop_assert_eq!(&marked, &expected);
            // And the other way round.
            Place::default().mark(&mut marked, key.to_be_bytes());
            prop_assert_eq!(marked, plain);
        }
    }
}
