//! Fake streams of a checked command, which record its calls.

use std::ffi::c_void;

use busbar_plugin_abi as abi;

use crate::finding::Finding;
use crate::probe::Probe;
use crate::text;

/// A command's other end.
pub(crate) struct FakeStreams<'a> {
    input: &'a [u8],
    /// Bytes that come at once at most.
    piece: usize,
    /// Calls after which it is asked to stop.
    calls_left: usize,
    pub(crate) was_stopped: bool,
    calls_after_stop: usize,
    too_long: usize,
    bad_texts: usize,
    bad_levels: usize,
}

impl<'a> FakeStreams<'a> {
    pub(crate) fn new(input: &'a [u8], piece: usize, calls: usize) -> Self {
        Self {
            input,
            piece,
            calls_left: calls,
            was_stopped: false,
            calls_after_stop: 0,
            too_long: 0,
            bad_texts: 0,
            bad_levels: 0,
        }
    }

    /// The table that leads here, for as long as this stays where it is.
    pub(crate) fn table(&mut self) -> abi::BusbarCommandStreams {
        abi::BusbarCommandStreams {
            struct_size: size_of::<abi::BusbarCommandStreams>() as u32,
            reserved: 0,
            context: std::ptr::from_mut(self).cast(),
            read: Some(read),
            write: Some(write),
            diagnose: Some(diagnose),
        }
    }

    /// Admits the next call unless the streams were stopped.
    fn admit(&mut self) -> bool {
        if self.was_stopped {
            self.calls_after_stop += 1;
        }
        self.was_stopped |= self.calls_left == 0;
        self.calls_left = self.calls_left.saturating_sub(1);
        !self.was_stopped
    }

    /// Reports broken rules of the calls as findings.
    pub(crate) fn report_faults(&self, probe: &Probe, what: &str) {
        let limit = abi::BUSBAR_MAX_CHUNK;
        for (count, fault, remedy) in [
            (self.too_long, format!("writes of null or of more than {limit} bytes"), "cut them"),
            (self.bad_texts, "diagnostics that are not UTF-8".into(), "write UTF-8"),
            (self.bad_levels, "diagnostics of unknown level".into(), "use BUSBAR_LOG_*"),
            (
                self.calls_after_stop,
                "calls of streams that had asked to stop".into(),
                "return BUSBAR_CANCELLED at once",
            ),
        ] {
            if count > 0 {
                probe.find(Finding::new(format!("`run` with {what}: {count} {fault}"), remedy));
            }
        }
    }
}

/// # Safety
/// `context` is that of a table whose streams live.
unsafe fn streams<'a>(context: *mut c_void) -> &'a mut FakeStreams<'a> {
    // SAFETY: the caller vouches for it; calls come one after another.
    unsafe { &mut *context.cast::<FakeStreams<'a>>() }
}

unsafe extern "C" fn read(context: *mut c_void, buffer: *mut u8, capacity: usize) -> i64 {
    // SAFETY: the plugin hands back what it got.
    let streams = unsafe { streams(context) };
    if !streams.admit() {
        return -1;
    }
    let count = streams.piece.min(capacity).min(streams.input.len());
    let (piece, rest) = streams.input.split_at(count);
    streams.input = rest;
    if !buffer.is_null() {
        // SAFETY: the plugin gives room for `capacity` bytes.
        unsafe { buffer.copy_from_nonoverlapping(piece.as_ptr(), count) };
    }
    count as i64
}

unsafe extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> u32 {
    // SAFETY: the plugin hands back what it got.
    let streams = unsafe { streams(context) };
    if len > abi::BUSBAR_MAX_CHUNK || (bytes.is_null() && len > 0) {
        streams.too_long += 1;
    } else if len > 0 {
        // SAFETY: the plugin gives `len` bytes; reading them shows whether it does.
        let bytes = unsafe { std::slice::from_raw_parts(bytes, len) };
        std::hint::black_box(bytes.iter().fold(0_u8, |sum, byte| sum ^ byte));
    }
    u32::from(streams.admit())
}

unsafe extern "C" fn diagnose(
    context: *mut c_void,
    level: u32,
    _line: u64,
    message: abi::BusbarStr,
) {
    // SAFETY: the plugin hands back what it got.
    let streams = unsafe { streams(context) };
    streams.bad_texts += usize::from(text::read(message).is_err());
    let known = abi::BUSBAR_LOG_ERROR..=abi::BUSBAR_LOG_DEBUG;
    streams.bad_levels += usize::from(!known.contains(&level));
}
