//! Connection to a client of a simulated device.

use tokio::io::{AsyncRead, AsyncWrite, DuplexStream};
use tokio::net::TcpStream;

/// Connection to a client: over TCP, or through memory where a test simulates time.
pub trait Socket: AsyncRead + AsyncWrite + Send + Unpin + 'static {
    /// Prepares the connection before the first byte: writes are sent at once.
    fn prepare(&self);

    /// Prepares a reset before the drop: the client sees a reset, not an end.
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

/// Does nothing: a stream in memory has no delay and no reset, and a client sees its end alone.
impl Socket for DuplexStream {
    fn prepare(&self) {}

    fn prepare_reset(&self) {}
}
