//! A view in another process, for programs in Rust; `libbusbar` is this for those in C.
//!
//! The viewer is a process of its own, which a [`View`] starts, watches and starts again:
//! nothing that happens there can touch the program that embeds it. Here is no Vulkan and
//! no plugin, only a socket, shared memory and one thread a view, two for one in a window. No
//! call waits for the viewer or for a disk.
//!
//! Nothing old passes for live: [`liveness`] decides, pictures in memory are hatched, and a
//! [`WindowCover`] hatches what a viewer draws into an X11 window.
#![doc = include_str!("../DESIGN.md")]

#[cfg(not(target_os = "linux"))]
compile_error!("unsupported system: a viewer is watched by means of Linux");

mod bitmap_font;
mod cover_thread;
mod dead_mark;
mod desired_state;
mod events;
pub mod liveness;
mod outbox;
mod pictures;
mod restarts;
mod shared;
mod supervisor;
mod view;
mod viewer_process;
mod window_cover;

pub use events::{Event, Listener};
pub use pictures::{FrameCopy, FrameView, PictureState};
pub use shared::OutboxFull;
pub use view::{Options, View};
pub use window_cover::{CoverError, WindowCover};
