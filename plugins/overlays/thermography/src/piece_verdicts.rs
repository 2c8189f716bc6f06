//! One verdict for each piece of equipment, of all the sensors that it has.

use busbar_plugin_sdk::{Canvas, Error, Judgment, Verdict, VerdictSeverity};

/// Verdict by one sensor, or set of sensors, of a piece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SensorVerdict<'v> {
    /// Index of the equipment described.
    pub(crate) equipment: usize,
    pub(crate) verdict: Verdict,
    /// Severity of an abnormal verdict.
    pub(crate) severity: VerdictSeverity,
    pub(crate) reason: &'v str,
    /// Default that it rests on; empty for none.
    pub(crate) assumption: &'v str,
    /// Bindings that it rests on.
    pub(crate) rests_on: &'v [usize],
}

/// Gives the most urgent verdict on each piece; those by sensors of one piece come one after
/// the other. A normal one rests on all of its sensors.
pub(crate) fn give_verdicts(
    verdicts: &[SensorVerdict<'_>],
    canvas: &mut Canvas<'_>,
) -> Result<(), Error> {
    let urgency = |of: &&SensorVerdict<'_>| match of.verdict {
        Verdict::Normal => (0, VerdictSeverity::default()),
        Verdict::Unknown => (1, VerdictSeverity::default()),
        Verdict::Abnormal => (2, of.severity),
    };
    for piece in verdicts.chunk_by(|a, b| a.equipment == b.equipment) {
        let Some(worst) = piece.iter().max_by_key(urgency) else { continue };
        let basis = match worst.verdict {
            Verdict::Normal => canvas.basis(piece.iter().flat_map(|of| of.rests_on).copied())?,
            _ => canvas.basis(worst.rests_on.iter().copied())?,
        };
        // A sensor of which nothing is known may be that of an alarm.
        let is_doubted = piece.iter().any(|of| of.verdict == Verdict::Unknown);
        let severity = match worst.severity {
            VerdictSeverity::Warning if is_doubted => VerdictSeverity::PerhapsAlarm,
            severity => severity,
        };
        let SensorVerdict { verdict, reason, assumption, .. } = *worst;
        let judgment = Judgment { verdict, severity, reason, assumption };
        canvas.judge(worst.equipment, basis, &judgment)?;
    }
    Ok(())
}
