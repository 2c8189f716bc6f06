//! libbusbar: a viewer in another program.
//!
//! The viewer is a process of its own, which this library starts, watches and starts again:
//! nothing that happens there can touch the program that embeds it. Here is no Vulkan and
//! no plugin, only a socket, shared memory and one thread a view.
//!
//! `include/busbar.h` is generated from [`abi`] and [`calls`].

#[cfg(not(target_os = "linux"))]
compile_error!("unsupported system: libbusbar watches its viewer by means of Linux");

pub mod abi;
pub mod calls;
pub mod commands;
mod events;
mod frames;
mod hatch;
mod outbox;
mod process;
mod restarts;
mod shared;
mod strings;
mod view;
mod wanted;
mod watch;

pub use view::BusbarView;
