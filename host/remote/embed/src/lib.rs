//! libbusbar: the embeddable viewer for programs in C.
//!
//! All that it does is `busbar_client`'s; here is what C calls, and nothing of Rust leaves it.
//!
//! `include/busbar.h` is generated from [`abi`] and [`calls`].

pub mod abi;
pub mod calls;
pub mod commands;
mod strings;
mod view;

pub use view::BusbarView;
