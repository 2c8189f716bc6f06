//! Building blocks of adapters to network devices: endpoints, TLS, reconnection, connections, the
//! event loop of a plugin's thread, and rate-limited log lines.
//!
//! It knows no protocol, and nothing of the plugin ABI: plugins import it beside
//! the SDK.
//!
//! ```
//! use std::time::Duration;
//! use busbar_link::{Endpoint, SettingsFaults, IoLoop};
//!
//! let mut faults = SettingsFaults::default();
//! let endpoint = Endpoint::parse("", "device.example", 0, &mut faults);
//! assert_eq!(faults.into_result().unwrap_err(), "port: 0 is not within 1 to 65535");
//! assert_eq!(endpoint.to_string(), "device.example:0");
//!
//! let io_loop = IoLoop::new(1)?;
//! let stopped = std::future::ready(());
//! io_loop.run_until(stopped, std::future::pending());
//! # Ok::<(), std::io::Error>(())
//! ```

mod backoff;
mod connect;
mod endpoint;
mod io_loop;
mod notices;
mod settings_faults;
#[cfg(feature = "testing")]
pub mod testing;
mod tls;

pub use backoff::{Backoff, MIN_RETRY_MILLIS, ReconnectBounds, ReconnectSettings};
pub use connect::{
    ByteStream, ConnectError, Dial, DialFuture, MAX_ADDRESSES, TcpDial, describe_io_error,
};
pub use endpoint::{Endpoint, MAX_HOST_BYTES};
pub use io_loop::IoLoop;
pub use notices::{Notice, Notices, TELL_INTERVAL};
pub use settings_faults::SettingsFaults;
pub use tls::{TlsClient, TlsError, TlsFiles, TlsSettings, is_tls_error};
