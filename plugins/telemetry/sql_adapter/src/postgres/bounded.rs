//! A stream from a server that is not trusted: it counts messages as they come.
//!
//! The client library keeps a message in memory as long as it is, which can be a gigabyte,
//! and answers whatever way of authentication a server asks for.

use std::future::Future;
use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_postgres::tls::{ChannelBinding, TlsConnect, TlsStream};

/// The longest message taken, bytes: a row with all its columns, or an error.
pub(crate) const MAX_MESSAGE_BYTES: u32 = 1 << 20;
/// A message begins with its type and its length, which counts itself (PostgreSQL 17,
/// 53.7, as all below).
const HEADER_BYTES: usize = 5;
/// Authentication requests: type, and the code of a password in clear text.
const AUTHENTICATION: u8 = b'R';
const CLEARTEXT_PASSWORD: [u8; 4] = [0, 0, 0, 3];

/// Server message beyond the limits.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq, Eq)]
pub(crate) enum OversizedMessage {
    /// A message of this many bytes.
    #[error("a row of {0} bytes; at most {MAX_MESSAGE_BYTES} are taken: select less text")]
    Long(u32),
    /// A request for the password.
    #[error(
        "the server asks for the password in clear text over a connection that is not encrypted; \
         it was not sent: use sslmode verify-full, or scram-sha-256 in the server's pg_hba.conf"
    )]
    ClearTextPassword,
}

/// Position of a stream within its messages.
#[derive(Clone, Copy, Debug, Default)]
struct Messages {
    /// The header so far, and of authentication requests the code.
    head: [u8; HEADER_BYTES + CLEARTEXT_PASSWORD.len()],
    head_len: usize,
    /// Bytes to come of the message whose header was read.
    left: u32,
    is_encrypted: bool,
}

impl Messages {
    /// Takes the next bytes.
    fn advance(&mut self, mut bytes: &[u8]) -> Result<(), OversizedMessage> {
        while let [first, ..] = bytes {
            if self.head_len >= HEADER_BYTES {
                let taken = bytes.len().min(self.left as usize);
                self.look_into(&bytes[..taken])?;
                self.left -= taken as u32;
                bytes = &bytes[taken..];
            } else {
                self.head[self.head_len] = *first;
                self.head_len += 1;
                bytes = &bytes[1..];
                if self.head_len == HEADER_BYTES {
                    let [_, length @ .., _, _, _, _] = self.head;
                    let length = u32::from_be_bytes(length);
                    if length > MAX_MESSAGE_BYTES {
                        return Err(OversizedMessage::Long(length));
                    }
                    // A length that does not count itself is for the client to refuse.
                    self.left = length.saturating_sub(4);
                }
            }
            if self.head_len >= HEADER_BYTES && self.left == 0 {
                self.head_len = 0;
            }
        }
        Ok(())
    }

    /// Looks for a request for the password.
    fn look_into(&mut self, body: &[u8]) -> Result<(), OversizedMessage> {
        let code = &mut self.head[self.head_len..];
        let taken = body.len().min(code.len());
        code[..taken].copy_from_slice(&body[..taken]);
        self.head_len += taken;
        let is_request = self.head[0] == AUTHENTICATION
            && self.head_len == self.head.len()
            && self.head[HEADER_BYTES..] == CLEARTEXT_PASSWORD;
        if is_request && taken > 0 && !self.is_encrypted {
            return Err(OversizedMessage::ClearTextPassword);
        }
        Ok(())
    }
}

/// Reports whether a stream that arrives in these pieces is accepted.
///
/// # Errors
/// The first [`OversizedMessage`] in it.
pub(crate) fn check_stream<'a>(
    pieces: impl IntoIterator<Item = &'a [u8]>,
    is_encrypted: bool,
) -> Result<(), OversizedMessage> {
    let mut messages = Messages { is_encrypted, ..Messages::default() };
    pieces.into_iter().try_for_each(|piece| messages.advance(piece))
}

/// A stream of messages, each of bounded length.
pub(crate) struct Bounded<S> {
    stream: S,
    messages: Messages,
}

impl<S> Bounded<S> {
    pub(crate) fn plain(stream: S) -> Self {
        Self { stream, messages: Messages::default() }
    }

    fn encrypted(stream: S) -> Self {
        let messages = Messages { is_encrypted: true, ..Messages::default() };
        Self { stream, messages }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Bounded<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        buf: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buf.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(cx, buf))?;
        Poll::Ready(self.messages.advance(&buf.filled()[before..]).map_err(io::Error::other))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Bounded<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(cx, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

impl<S: TlsStream + Unpin> TlsStream for Bounded<S> {
    fn channel_binding(&self) -> ChannelBinding {
        self.stream.channel_binding()
    }
}

/// Makes encrypted streams bounded: what they bring can be counted only once it is
/// decrypted.
pub(crate) struct BoundedTls<C>(pub(crate) C);

impl<S, C> TlsConnect<S> for BoundedTls<C>
where
    C: TlsConnect<S>,
    C::Future: 'static,
{
    type Stream = Bounded<C::Stream>;
    type Error = C::Error;
    type Future = Pin<Box<dyn Future<Output = Result<Self::Stream, Self::Error>>>>;

    fn connect(self, stream: S) -> Self::Future {
        let connecting = self.0.connect(stream);
        Box::pin(async move { connecting.await.map(Bounded::encrypted) })
    }
}

#[cfg(test)]
#[path = "bounded_tests.rs"]
mod tests;
