//! A view in another process, for programs in Rust; `libbusbar` is this for those in C.
//!
//! The viewer is a process of its own, which a [`View`] starts, watches and starts again:
//! nothing that happens there can touch the program that embeds it. Here is no Vulkan and
//! no plugin, only a socket, shared memory and one thread a view. No call waits for the
//! viewer or for a disk.

#[cfg(not(target_os = "linux"))]
compile_error!("unsupported system: a viewer is watched by means of Linux");

mod events;
mod frames;
mod hatch;
mod outbox;
mod process;
mod restarts;
mod shared;
mod view;
mod wanted;
mod watch;

pub use events::Event;
pub use frames::{Copied, Given};
pub use shared::Full;
pub use view::{Listener, Options, View};
