//! What a client is connected by.

use tokio::io::{AsyncRead, AsyncWrite, DuplexStream};
use tokio::net::TcpStream;

/// A connection to a client: over TCP, or through memory where a test simulates time.
pub trait Socket: AsyncRead + AsyncWrite + Send + Unpin + 'static {
    /// Before the first byte: what is written goes at once.
    fn prepare(&self);

    /// Before it is dropped: the client is to see a reset, not an end.
    fn prepare_reset(&self);
}

impl Socket for TcpStream {
    fn prepare(&self) {
        // Without it answers are late, which is no failure.
        let _ = self.set_nodelay(true);
    }

    fn prepare_reset(&self) {
        // A connection that is gone already needs no reset.
        let _ = self.set_zero_linger();
    }
}

/// Waits for nothing, and knows no reset: its end is all that a client sees.
impl Socket for DuplexStream {
    fn prepare(&self) {}

    fn prepare_reset(&self) {}
}
