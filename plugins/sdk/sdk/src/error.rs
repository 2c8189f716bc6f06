//! Errors of calls, which cross the C boundary as a status and a sentence.

use busbar_plugin_abi as abi;

use crate::boundary::checked_mut;

/// Error of a call: who must act, and a sentence with fault and remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    status: abi::BusbarStatusNumber,
    message: String,
}

impl Error {
    /// Creates an error of settings or of an address.
    pub fn settings(message: impl Into<String>) -> Self {
        Self { status: abi::BUSBAR_INVALID_SETTINGS, message: message.into() }
    }

    /// Creates an error of something outside: a file, a device, memory.
    pub fn failed(message: impl Into<String>) -> Self {
        Self { status: abi::BUSBAR_FAILED, message: message.into() }
    }

    /// Creates the error of a call that the host asked to stop.
    pub fn cancelled() -> Self {
        Self { status: abi::BUSBAR_CANCELLED, message: "cancelled".into() }
    }

    pub(crate) fn argument(message: impl Into<String>) -> Self {
        Self { status: abi::BUSBAR_INVALID_ARGUMENT, message: message.into() }
    }

    pub(crate) fn buffer(message: impl Into<String>) -> Self {
        Self { status: abi::BUSBAR_BUFFER_TOO_SMALL, message: message.into() }
    }

    pub(crate) fn internal(message: impl Into<String>) -> Self {
        Self { status: abi::BUSBAR_INTERNAL, message: message.into() }
    }

    /// Returns the sentence with fault and remedy.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Writes the message into the caller's struct, cut at a character.
    ///
    /// # Safety
    /// `into` is null or points to a `BusbarError` that may be written.
    pub(crate) unsafe fn write(self, into: *mut abi::BusbarError) -> abi::BusbarStatusNumber {
        // SAFETY: the caller vouches for the pointer.
        if let Ok(into) = unsafe { checked_mut(into, "the error") } {
            let len = self.message.floor_char_boundary(into.message.len());
            into.message[..len].copy_from_slice(&self.message.as_bytes()[..len]);
            into.message_len = len as u32;
            into.status = self.status;
        }
        self.status
    }
}

impl std::fmt::Display for Error {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}
