//! The protocol's bytes (IEC 60870-5-104 Ed. 2.1, with the information elements
//! of IEC 60870-5-101 Ed. 2, 7.2): bytes in, values out, and the few requests
//! that a station which only looks may send. For the simulated station also values
//! in, bytes out.
//!
//! Pure functions: no socket, no clock, and nothing is allocated for what comes
//! in. Commands (types 45 to 64) cannot be written: there is no code for them.

mod apci;
mod asdu;
// Sums of a few bounded numbers, far from the range of i64.
#[allow(clippy::arithmetic_side_effects)]
mod calendar;
mod element;
mod encode;
mod error;
mod request;
#[allow(clippy::arithmetic_side_effects)]
mod time;

pub use apci::{Frame, Function, MAX_ASDU_BYTES, MAX_FRAME_BYTES, Sequence, split_frame};
pub use asdu::{Asdu, Body, Header, Object, Objects, cause, common_address_of, is_without_values};
pub use element::{Flags, Value};
pub use encode::{AsduWriter, answer_to, initialisation_ended, type_of};
pub use error::{AsduError, FrameError};
pub use request::Request;
pub use time::{Cp24, Cp56, TimeTag, Zone};
