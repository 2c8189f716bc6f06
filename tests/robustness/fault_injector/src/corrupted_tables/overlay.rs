//! Function table of overlays, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::{active_corruption, status};
use crate::fault::{CallSite, Misbehavior};
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarOverlay; 2] =
    [overlay(size_of::<abi::BusbarOverlay>() as u32), overlay(SHORT)];

const fn overlay(struct_size: u32) -> abi::BusbarOverlay {
    let (configure, draw) = (Some(configure as _), Some(draw as _));
    abi::BusbarOverlay { struct_size, reserved: 0, configure, draw, describe: Some(describe as _) }
}

fn original() -> Option<&'static abi::BusbarOverlay> {
    sdk_table::<abi::BusbarOverlay>(abi::OVERLAY_ID)
}

unsafe extern "C" fn describe(
    plugin: *const abi::BusbarPlugin,
    description: *mut abi::BusbarOverlayDescription,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(describe) = original().and_then(|t| t.describe) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    unsafe { describe(plugin, description, error) }
}

unsafe extern "C" fn configure(
    plugin: *const abi::BusbarPlugin,
    bindings: *const abi::BusbarBinding,
    binding_count: usize,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(configure) = original().and_then(|t| t.configure) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    unsafe { status(CallSite::Configure, configure(plugin, bindings, binding_count, error), error) }
}

unsafe extern "C" fn draw(
    plugin: *const abi::BusbarPlugin,
    frame: *const abi::BusbarOverlayFrame,
    output: *mut abi::BusbarOverlayOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(draw) = original().and_then(|t| t.draw) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let drawn = unsafe { draw(plugin, frame, output, error) };
    if drawn != abi::BUSBAR_OK {
        return drawn;
    }
    // SAFETY: the SDK found it good.
    let output = unsafe { &mut *output };
    let some = output.primitive_count > 0;
    match active_corruption(CallSite::Draw) {
        Some(Misbehavior::NotUtf8) if output.text_len > 0 => {
            // SAFETY: there is text, so there is a first byte.
            unsafe { output.text.write(0xff) };
        }
        Some(Misbehavior::OutOfRange) if some => {
            // SAFETY: there is a first primitive.
            unsafe { (*output.primitives).binding = u32::MAX };
        }
        Some(Misbehavior::Overrun) => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe { output.text.add(output.text_capacity as usize).write_bytes(0x11, 8) };
        }
        Some(kind) => corrupt_verdicts(kind, output),
        None => {}
    }
    drawn
}

/// Corrupts the verdicts of a drawing, where the fault says so.
fn corrupt_verdicts(kind: Misbehavior, output: &mut abi::BusbarOverlayOutput) {
    let Some(last) = output.verdict_count.checked_sub(1) else { return };
    // SAFETY: the SDK wrote so many verdicts.
    let verdict = unsafe { &mut *output.verdicts.add(last as usize) };
    match kind {
        Misbehavior::MissingVerdict => output.verdict_count = last,
        Misbehavior::VerdictOutOfRange => verdict.equipment = u32::MAX,
        Misbehavior::UnknownWithoutReason => {
            verdict.verdict = abi::BUSBAR_VERDICT_UNKNOWN;
            verdict.reason_len = 0;
        }
        Misbehavior::SeverityOfNormal => {
            verdict.verdict = abi::BUSBAR_VERDICT_NORMAL;
            verdict.flags = abi::BUSBAR_VERDICT_FLAG_WARNING;
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corrupted(kind: Misbehavior) -> (u32, abi::BusbarOverlayVerdict) {
        let mut verdicts = [abi::BusbarOverlayVerdict {
            equipment: 0,
            verdict: abi::BUSBAR_VERDICT_NORMAL,
            flags: 0,
            reason_offset: 0,
            reason_len: 4,
            basis_offset: 0,
            basis_count: 0,
        }];
        let mut output = abi::BusbarOverlayOutput {
            struct_size: size_of::<abi::BusbarOverlayOutput>() as u32,
            primitive_capacity: 0,
            primitive_count: 0,
            text_capacity: 0,
            text_len: 0,
            reserved: 0,
            primitives: std::ptr::null_mut(),
            text: std::ptr::null_mut(),
            quantity_capacity: 0,
            quantity_count: 0,
            quantities: std::ptr::null_mut(),
            verdict_capacity: 1,
            verdict_count: 1,
            verdicts: verdicts.as_mut_ptr(),
            basis_capacity: 0,
            basis_count: 0,
            basis: std::ptr::null_mut(),
        };
        corrupt_verdicts(kind, &mut output);
        (output.verdict_count, verdicts[0])
    }

    #[test]
    fn verdicts_are_corrupted_in_each_way() {
        assert_eq!(corrupted(Misbehavior::MissingVerdict).0, 0);
        assert_eq!(corrupted(Misbehavior::VerdictOutOfRange).1.equipment, u32::MAX);
        let (_, silent) = corrupted(Misbehavior::UnknownWithoutReason);
        assert_eq!((silent.verdict, silent.reason_len), (abi::BUSBAR_VERDICT_UNKNOWN, 0));
        assert_eq!(
            corrupted(Misbehavior::SeverityOfNormal).1.flags,
            abi::BUSBAR_VERDICT_FLAG_WARNING
        );
        let (count, whole) = corrupted(Misbehavior::Overrun);
        assert_eq!((count, whole.reason_len), (1, 4));
    }
}
