//! Room for a text that a plugin writes, with bytes behind it that it must leave alone.

use busbar_plugin_abi as abi;
use serde::de::DeserializeOwned;

use crate::finding::{Finding, Stop};
use crate::probe::Probe;

/// Bytes that are tried first.
const FIRST_BYTES: usize = 16 << 10;
/// Bytes behind the room.
const BEYOND: usize = 64;
/// Byte value of the guard behind a buffer.
const CANARY: u8 = 0xa5;

/// Room for a text.
pub(super) struct TextBuffer {
    bytes: Vec<u8>,
    pub(super) output: abi::BusbarTextOutput,
}

impl TextBuffer {
    pub(super) fn with_capacity(capacity: usize) -> Self {
        let mut bytes = vec![CANARY; capacity + BEYOND];
        let output = abi::BusbarTextOutput {
            struct_size: size_of::<abi::BusbarTextOutput>() as u32,
            capacity: capacity as u32,
            len: 0,
            reserved: 0,
            text: bytes.as_mut_ptr(),
        };
        Self { bytes, output }
    }

    /// Returns the written text, where it keeps the rules.
    fn text(&self, call: &str) -> Result<&str, Finding> {
        self.check_guard(call)?;
        let room = &self.bytes[..self.output.capacity as usize];
        let Some(text) = room.get(..self.output.len as usize) else {
            let fault = format!("`{call}` claims {} bytes, beyond the end", self.output.len);
            return Err(Finding::new(
                fault,
                "return BUSBAR_BUFFER_TOO_SMALL where it does not fit",
            ));
        };
        let not_utf8 =
            || Finding::new(format!("`{call}` wrote text that is not UTF-8"), "write it");
        std::str::from_utf8(text).map_err(|_| not_utf8())
    }

    fn check_guard(&self, call: &str) -> Result<(), Finding> {
        let beyond = &self.bytes[self.output.capacity as usize..];
        if beyond.iter().all(|byte| *byte == CANARY) {
            return Ok(());
        }
        let fault = format!("`{call}` wrote beyond the end of the text");
        Err(Finding::new(fault, "keep to `capacity`"))
    }
}

/// Calls for JSON with as large a buffer as it needs; none where the plugin refuses with a
/// message.
pub(super) fn ask<T: DeserializeOwned>(
    probe: &Probe,
    call: &str,
    max_bytes: usize,
    ask: impl Fn(*mut abi::BusbarTextOutput, *mut abi::BusbarError) -> abi::BusbarStatusNumber,
) -> Result<Option<T>, Stop> {
    let mut capacity = FIRST_BYTES;
    loop {
        let (mut room, mut error) =
            (TextBuffer::with_capacity(capacity), abi::BusbarError::empty());
        let status = ask(&mut room.output, &mut error);
        let needed = room.output.len as usize;
        if status == abi::BUSBAR_BUFFER_TOO_SMALL && needed > capacity && needed <= max_bytes {
            capacity = needed;
            continue;
        }
        if status != abi::BUSBAR_OK {
            probe.expect_refused(call, status, &error, &[abi::BUSBAR_FAILED]);
            return Ok(None);
        }
        let text = room.text(call)?;
        let told = serde_json::from_str(text).map_err(|error| {
            Finding::new(
                format!("`{call}` wrote JSON that is not as agreed: {error}"),
                "see the SDK",
            )
        })?;
        return Ok(Some(told));
    }
}

/// Checks that a call without room reports its size, and then fits.
pub(super) fn check_required_size(
    probe: &Probe,
    call: &str,
    ask: impl Fn(*mut abi::BusbarTextOutput, *mut abi::BusbarError) -> abi::BusbarStatusNumber,
) {
    let mut error = abi::BusbarError::empty();
    let mut room = TextBuffer::with_capacity(0);
    let status = ask(&mut room.output, &mut error);
    let case = format!("{call} without room");
    if !probe.expect_status(&case, status, &error, &[abi::BUSBAR_BUFFER_TOO_SMALL]) {
        return;
    }
    let mut exact = TextBuffer::with_capacity(room.output.len as usize);
    let status = ask(&mut exact.output, &mut error);
    let case = format!("{call} with the room that it asked for");
    probe.expect_status(&case, status, &error, &[abi::BUSBAR_OK]);
    if let Err(finding) = room.check_guard(call).and(exact.text(call).map(drop)) {
        probe.find(finding);
    }
}
