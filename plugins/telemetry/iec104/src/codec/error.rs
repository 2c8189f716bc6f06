//! Errors of frames and data units.

use thiserror::Error;

/// Bytes that are no frame. The stream cannot be followed any further.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum FrameError {
    /// A frame begins with something else than 68h (5.1).
    #[error("a frame begins with {0:02X}h instead of 68h; is it a 104 station?")]
    Start(u8),
    /// A length that no frame has (5.1).
    #[error("a frame of {0} bytes; 4 to 253 are allowed")]
    Length(u8),
    /// A frame that carries data where its kind has none, or none where it has.
    #[error("a frame with control field {0:02X?} of {1} bytes")]
    Control([u8; 4], u8),
}

/// A frame that carries no valid data unit. Those after it may be well.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum AsduError {
    /// Ends before the six bytes of its header.
    #[error("a data unit of {0} bytes; its header alone has 6")]
    Header(usize),
    /// Number and type of objects say another length.
    #[error("type {type_id}: {count} objects take {wanted} bytes, there are {found}")]
    Length {
        /// Type identification of the data unit.
        type_id: u8,
        /// Objects that it claims to have.
        count: u8,
        /// Bytes after the header that these would take.
        wanted: usize,
        /// Bytes that there are.
        found: usize,
    },
    /// No object at all.
    #[error("type {0} without an object")]
    Empty(u8),
    /// A sequence of objects passes the last address.
    #[error("objects from address {0} on pass the last address, 16777215")]
    Address(u32),
}
