//! The view as a web page, for the iframe of an HMI.
//!
//! A viewer is started offscreen and watched as for any host program (`busbar_client`). What
//! changes of its picture goes to each page over a WebSocket, and hands and commands come
//! back. A page marks its picture dead by itself, whatever became of viewer, server or
//! network: see `page/liveness.js`. `README.md` tells how to embed it.
#![doc = include_str!("../DESIGN.md")]

mod access;
mod encode;
mod hub;
mod message;
mod options;
mod pacing;
mod picture;
pub mod probe;
mod routes;
mod server;
mod session;
mod steering;
mod token;

pub use options::{MAX_CLIENTS, Options, Origin, OriginError};
pub use server::{ServeError, Server};
pub use token::{Token, TokenError};
