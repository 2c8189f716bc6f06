//! Corruption of results, by the kind of the armed fault.

use busbar_plugin_sdk::abi;

use crate::fault::{CallSite, Misbehavior, is_set};

/// Text of bytes that are not UTF-8.
pub(crate) const NOT_UTF8: abi::BusbarStr = abi::BusbarStr { ptr: BAD_BYTES.as_ptr(), len: 4 };

pub(crate) static BAD_BYTES: [u8; 4] = [b'a', 0xff, 0xfe, b'z'];

/// Returns the kind of fault that corrupts this call, which was counted already.
pub(crate) fn active_corruption(at: CallSite) -> Option<Misbehavior> {
    let kinds = [
        Misbehavior::WrongStructSize,
        Misbehavior::NotUtf8,
        Misbehavior::NullResult,
        Misbehavior::NotFinite,
    ]
    .into_iter()
    .chain([Misbehavior::OutOfRange, Misbehavior::Overrun, Misbehavior::MissingVerdict])
    .chain([
        Misbehavior::VerdictOutOfRange,
        Misbehavior::UnknownWithoutReason,
        Misbehavior::SeverityOfNormal,
    ]);
    kinds.into_iter().find(|&kind| is_set(kind, at))
}

/// Writes a message that is not UTF-8.
///
/// # Safety
/// `error` is null or may be written.
pub(crate) unsafe fn error(error: *mut abi::BusbarError) {
    // SAFETY: the caller vouches for it.
    if let Some(error) = unsafe { error.as_mut() } {
        error.status = abi::BUSBAR_FAILED;
        error.message[..4].copy_from_slice(&BAD_BYTES);
        error.message_len = 4;
    }
}

/// Corrupts a text that was written, where the fault says so.
///
/// # Safety
/// `output` is null, or good and written.
pub(crate) unsafe fn text(at: CallSite, output: *mut abi::BusbarTextOutput) {
    // SAFETY: the caller vouches for it.
    let Some(output) = (unsafe { output.as_mut() }) else { return };
    match active_corruption(at) {
        Some(Misbehavior::NotUtf8) if output.len > 0 => {
            // SAFETY: there is text, so there is a first byte.
            unsafe { output.text.write(0xff) };
        }
        Some(Misbehavior::Overrun) => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe { output.text.add(output.capacity as usize).write_bytes(0x11, 8) };
        }
        _ => {}
    }
}

/// Returns a status, after its error was corrupted where the fault says so.
///
/// # Safety
/// `into` is null or may be written.
pub(crate) unsafe fn status(
    at: CallSite,
    status: abi::BusbarStatusNumber,
    into: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    if active_corruption(at) != Some(Misbehavior::NotUtf8) || status != abi::BUSBAR_OK {
        return status;
    }
    // SAFETY: the caller vouches for it.
    unsafe { error(into) };
    abi::BUSBAR_FAILED
}
