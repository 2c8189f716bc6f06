//! Inter-process protocol of Busbar: messages, framing, descriptor passing and shared memory.
//!
//! [`framing`] makes messages of bytes, [`socket`] carries them with descriptors,
//! [`memory`] is shared. Those serve a plugin's process as well; [`message`] and
//! [`pictures`] are what a host program's library and its viewer share. [`progress`] tells a
//! process that is slow from one that hangs.
//!
//! Invariant: nothing that comes from the other side is used before it is checked: a
//! length before memory is taken for it, a size before a pixel is reached by it.

#[cfg(not(target_os = "linux"))]
compile_error!("unsupported system: processes share memory and descriptors as on Linux");

mod check;
pub mod framing;
pub mod memory;
pub mod message;
mod origin_list;
pub mod pictures;
pub mod progress;
pub mod socket;
