//! Verdicts of overlay plugins, read from the C ABI.

use busbar_overlay_picture::{MAX_PART_BYTES, OverlayBinding, Verdicts};
use busbar_plugin_abi as abi;
use busbar_tags::TagHandle;
use busbar_types::Verdict;

/// Reads verdicts from the buffers of a plugin.
///
/// # Errors
/// The rule that a verdict breaks, in words.
pub(crate) fn read(
    raw: &[abi::BusbarOverlayVerdict],
    basis: &[u32],
    text: &str,
    bindings: &[OverlayBinding],
) -> Result<Verdicts, String> {
    let tag_of = |index: &u32| bindings.get(*index as usize).map(|binding| binding.tag);
    let basis: Option<Vec<TagHandle>> = basis.iter().map(tag_of).collect();
    let basis = basis.ok_or("a verdict rests on a binding that does not exist")?;
    let mut read = Verdicts::with_basis(basis, raw.len());
    for raw in raw {
        let verdict = Verdict::from_code(raw.verdict)
            .ok_or_else(|| format!("a verdict is the unknown one {}", raw.verdict))?;
        if raw.reason_len as usize > MAX_PART_BYTES {
            return Err("the reason of a verdict is too long".into());
        }
        let start = raw.reason_offset as usize;
        let reason = text.get(start..start + raw.reason_len as usize);
        let reason = reason.ok_or("a verdict names text that is not there")?;
        let basis_end = raw.basis_offset.checked_add(raw.basis_count);
        let basis_end = basis_end.ok_or("a verdict names a basis that is not there")?;
        let is_assumed = raw.flags & abi::BUSBAR_VERDICT_ASSUMED != 0;
        let basis = raw.basis_offset..basis_end;
        read.push_on_basis(raw.equipment, verdict, is_assumed, reason, basis);
    }
    Ok(read)
}
