//! One verdict for each piece of equipment, of all the sensors that it has.

use busbar_plugin_sdk::{Canvas, Error, Judgment, Verdict, VerdictSeverity};

/// Verdict by one sensor, or set of sensors, of a piece.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SensorVerdict {
    /// Index of the equipment described.
    pub(crate) equipment: usize,
    pub(crate) verdict: Verdict,
    /// Severity of an abnormal verdict.
    pub(crate) severity: VerdictSeverity,
    pub(crate) reason: String,
    /// Default that it rests on; empty for none.
    pub(crate) assumption: String,
    /// Bindings that it rests on.
    pub(crate) rests_on: Vec<usize>,
}

/// Gives the most urgent verdict on each piece; those by sensors of one piece come one after
/// the other. A normal one rests on all of its sensors.
pub(crate) fn give_verdicts(
    verdicts: &[SensorVerdict],
    canvas: &mut Canvas<'_>,
) -> Result<(), Error> {
    let urgency = |of: &&SensorVerdict| match of.verdict {
        Verdict::Normal => (0, VerdictSeverity::default()),
        Verdict::Unknown => (1, VerdictSeverity::default()),
        Verdict::Abnormal => (2, of.severity),
    };
    for piece in verdicts.chunk_by(|a, b| a.equipment == b.equipment) {
        let Some(worst) = piece.iter().max_by_key(urgency) else { continue };
        let basis = match worst.verdict {
            Verdict::Normal => canvas.basis(piece.iter().flat_map(|of| of.rests_on.clone()))?,
            _ => canvas.basis(worst.rests_on.iter().copied())?,
        };
        // A sensor of which nothing is known may be that of an alarm.
        let is_doubted = piece.iter().any(|of| of.verdict == Verdict::Unknown);
        let severity = match worst.severity {
            VerdictSeverity::Warning if is_doubted => VerdictSeverity::PerhapsAlarm,
            severity => severity,
        };
        let judgment = Judgment {
            verdict: worst.verdict,
            severity,
            reason: &worst.reason,
            assumption: &worst.assumption,
        };
        canvas.judge(worst.equipment, basis, &judgment)?;
    }
    Ok(())
}
