//! Verdicts of overlay plugins, read from the C ABI.

use busbar_overlay_picture::{MAX_PART_BYTES, OverlayBinding, VerdictRating, Verdicts};
use busbar_plugin_abi as abi;
use busbar_tags::TagHandle;
use busbar_types::{Verdict, VerdictSeverity};

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
        let is_assumed = raw.flags & abi::BUSBAR_VERDICT_FLAG_ASSUMED != 0;
        let basis = raw.basis_offset..basis_end;
        let rating = VerdictRating { verdict, severity: severity(raw.flags), is_assumed };
        read.push_on_basis(raw.equipment, rating, reason, basis);
    }
    Ok(read)
}

/// Returns the severity that flags give an abnormal verdict; of two the greater one.
fn severity(flags: u32) -> VerdictSeverity {
    let has = |flag| flags & flag != 0;
    match (has(abi::BUSBAR_VERDICT_FLAG_WARNING), has(abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM)) {
        (_, true) => VerdictSeverity::PerhapsAlarm,
        (true, false) => VerdictSeverity::Warning,
        (false, false) => VerdictSeverity::Alarm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_abnormal_verdict_is_an_alarm_unless_it_says_otherwise() {
        let read = |flags| {
            let raw = abi::BusbarOverlayVerdict {
                equipment: 0,
                verdict: abi::BUSBAR_VERDICT_ABNORMAL,
                flags,
                reason_offset: 0,
                reason_len: 0,
                basis_offset: 0,
                basis_count: 0,
            };
            let verdicts = read(&[raw], &[], "", &[]).expect("it keeps the rules");
            let found = verdicts.iter().next().map(|of| (of.severity, of.is_assumed));
            found.expect("it is there")
        };
        let [assumed, warning, perhaps] = [
            abi::BUSBAR_VERDICT_FLAG_ASSUMED,
            abi::BUSBAR_VERDICT_FLAG_WARNING,
            abi::BUSBAR_VERDICT_FLAG_PERHAPS_ALARM,
        ];
        assert_eq!(read(0), (VerdictSeverity::Alarm, false));
        assert_eq!(read(assumed), (VerdictSeverity::Alarm, true));
        assert_eq!(read(warning | assumed), (VerdictSeverity::Warning, true));
        assert_eq!(read(perhaps), (VerdictSeverity::PerhapsAlarm, false));
        assert_eq!(read(warning | perhaps), (VerdictSeverity::PerhapsAlarm, false));
        assert_eq!(read(1 << 31), (VerdictSeverity::Alarm, false), "a flag of a later release");
    }
}
