//! Validation of pointers, structs and texts at the C boundary.

use std::panic::{AssertUnwindSafe, catch_unwind};

use busbar_plugin_abi as abi;

use crate::Error;

/// Runs the body of a call: no panic leaves, and errors become a status.
///
/// # Safety
/// `error` is null or may be written.
pub(crate) unsafe fn guard(
    error: *mut abi::BusbarError,
    work: impl FnOnce() -> Result<(), Error>,
) -> abi::BusbarStatusNumber {
    let result = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let what = payload
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".into());
        Err(Error::internal(format!("the plugin panicked: {what}")))
    });
    match result {
        Ok(()) => abi::BUSBAR_OK,
        // SAFETY: the caller vouches for `error`.
        Err(reason) => unsafe { reason.write(error) },
    }
}

/// Checks a struct that is passed alone: not null, aligned, and as long as this version of the SDK
/// needs. Its first word has its size.
///
/// # Safety
/// `pointer` is null or leads to a struct of some version of `T`, alive for `'a`.
pub(crate) unsafe fn checked_ref<'a, T>(pointer: *const T, what: &str) -> Result<&'a T, Error> {
    if pointer.is_null() || !pointer.is_aligned() {
        return Err(Error::argument(format!("{what} is null or misaligned")));
    }
    // SAFETY: every version of the struct starts with its size.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    if size < size_of::<T>() {
        let (least, what) = (size_of::<T>(), format!("{what} of {size} bytes"));
        return Err(Error::argument(format!("{what} is too small: it needs {least}")));
    }
    // SAFETY: checked as far as can be; the caller vouches for the rest.
    Ok(unsafe { &*pointer })
}

/// Checks a struct that the callee fills in, as [`checked_ref`] does.
///
/// # Safety
/// As for [`checked_ref`], and nobody else uses it during `'a`.
pub(crate) unsafe fn checked_mut<'a, T>(pointer: *mut T, what: &str) -> Result<&'a mut T, Error> {
    // SAFETY: the caller vouches for the pointer.
    unsafe { checked_ref(pointer.cast_const(), what)? };
    // SAFETY: as above, and nobody else uses it.
    Ok(unsafe { &mut *pointer })
}

/// # Safety
/// `ptr` leads to `count` elements that live for `'a`, or `count` is 0.
pub(crate) unsafe fn slice<'a, T>(ptr: *const T, count: usize) -> Result<&'a [T], Error> {
    if count == 0 {
        return Ok(&[]);
    }
    let fits = count <= isize::MAX as usize / size_of::<T>().max(1);
    if ptr.is_null() || !ptr.is_aligned() || !fits {
        return Err(Error::argument("an array is null, misaligned or too long"));
    }
    // SAFETY: checked as far as can be; the caller vouches for the rest.
    Ok(unsafe { std::slice::from_raw_parts(ptr, count) })
}

/// # Safety
/// `text` leads to `len` bytes that live for `'a`.
pub(crate) unsafe fn text<'a>(text: abi::BusbarStr) -> Result<&'a str, Error> {
    // SAFETY: the caller vouches for the bytes.
    let bytes = unsafe { slice(text.ptr, text.len)? };
    std::str::from_utf8(bytes).map_err(|_| Error::argument("a text is not UTF-8"))
}

/// # Safety
/// `into` has room for all of `from`.
pub(crate) unsafe fn copy_out<T: Copy>(from: &[T], into: *mut T) -> Result<(), Error> {
    if from.is_empty() {
        return Ok(());
    }
    if into.is_null() || !into.is_aligned() {
        return Err(Error::argument("an output buffer is null or misaligned"));
    }
    // SAFETY: the caller vouches for the room; the host's buffer is not ours.
    unsafe { std::ptr::copy_nonoverlapping(from.as_ptr(), into, from.len()) };
    Ok(())
}

/// Writes a value as JSON.
///
/// # Safety
/// `output` is null or valid as the ABI demands.
pub(crate) unsafe fn write_json(
    value: &impl serde::Serialize,
    output: *mut abi::BusbarTextOutput,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointer.
    let output = unsafe { checked_mut(output, "the text output")? };
    let json = serde_json::to_string(value)
        .map_err(|error| Error::internal(format!("it cannot be told as JSON: {error}")))?;
    output.len = u32::try_from(json.len()).unwrap_or(u32::MAX);
    if output.len > output.capacity {
        return Err(Error::buffer(format!("the text takes {} bytes", json.len())));
    }
    // SAFETY: the host gives room for `capacity` bytes.
    unsafe { copy_out(json.as_bytes(), output.text) }
}
