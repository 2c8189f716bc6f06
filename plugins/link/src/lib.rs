//! What adapters to network devices share: settings of endpoints, encryption and
//! reconnecting, the connection itself, the event loop of a plugin's thread, and log lines
//! that are limited in number.
//!
//! It knows no protocol, and nothing of the plugin ABI: plugins import it beside
//! the SDK.
//!
//! ```
//! use std::time::Duration;
//! use busbar_link::{Endpoint, Faults, IoLoop};
//!
//! let mut faults = Faults::default();
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
mod faults;
mod io_loop;
mod notices;
#[cfg(feature = "testing")]
pub mod testing;
mod tls;

pub use backoff::{Backoff, MIN_RETRY_MILLIS, Reconnect, ReconnectSettings};
pub use connect::{ByteStream, ConnectFault, Dial, Dialing, MAX_ADDRESSES, TcpDial, in_words};
pub use endpoint::{Endpoint, MAX_HOST_BYTES};
pub use faults::Faults;
pub use io_loop::IoLoop;
pub use notices::{Notice, Notices, TELL_INTERVAL};
pub use tls::{TlsClient, TlsFault, TlsFiles, TlsSettings, is_of_tls};
