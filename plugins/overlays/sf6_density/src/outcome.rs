//! Verdict on a compartment, from its density, its contact and its loss.

use busbar_plugin_sdk::{Severity, Verdict, VerdictSeverity};

use crate::assessment::{Assessment, Level};
use crate::readings::ContactState;
use crate::settings::Settings;
use crate::trend::Loss;

/// Entries of the legend.
pub(crate) const ALARM: usize = 0;
pub(crate) const LOCK_OUT: usize = 1;
pub(crate) const ATTENTION: usize = 2;
/// Loss that is told as more than this: no compartment loses so much slowly.
const MAX_TOLD_PERCENT: f64 = 100.0;

/// Verdict on a compartment, with what is drawn of it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outcome {
    pub(crate) verdict: Verdict,
    /// Severity of an abnormal verdict.
    pub(crate) severity: VerdictSeverity,
    pub(crate) reason: String,
    /// Entry of the legend, and severity, of an abnormal one.
    pub(crate) shown: Option<(usize, Severity)>,
    /// Value of the label.
    pub(crate) text: String,
    /// Contact that alone decides.
    pub(crate) contact: Option<usize>,
}

impl Outcome {
    /// Creates an abnormal outcome. `may_lock_out` where some value of what is missing locks out.
    fn abnormal(
        shown: (usize, Severity),
        may_lock_out: bool,
        reason: String,
        text: String,
    ) -> Self {
        let severity = VerdictSeverity::from_bounds(shown.1 == Severity::Alarm, may_lock_out);
        let verdict = Verdict::Abnormal;
        Self { verdict, severity, reason, shown: Some(shown), text, contact: None }
    }

    fn unknown(reason: String) -> Self {
        Self { verdict: Verdict::Unknown, reason, ..Self::normal() }
    }

    fn normal() -> Self {
        Self {
            verdict: Verdict::Normal,
            severity: VerdictSeverity::default(),
            reason: String::new(),
            shown: None,
            text: String::new(),
            contact: None,
        }
    }
}

/// Judges a compartment. `doubt` is the reason for which an input is not known.
pub(crate) fn judge(
    settings: &Settings,
    assessment: &Result<Assessment, String>,
    contact: ContactState,
    loss: Option<Loss>,
    doubt: Option<&str>,
) -> Outcome {
    let unit = settings.unit.symbol();
    let is_range = doubt.is_some();
    let pressure = |at_20: f64| {
        let at_most = if is_range { "at most " } else { "" };
        format!("{at_most}{at_20:.*} {unit}", settings.digits())
    };
    let attention = (ATTENTION, Severity::Warning);
    let reports_alarm = |calculated: &str, text: &dyn Fn() -> String| {
        let ContactState::Alarm(binding) = contact else { return None };
        let reason = format!("the density contact reports an alarm; {calculated}");
        let may_lock_out = assessment.as_ref().map_or(true, |of| of.may_lock_out);
        let shown = (ALARM, Severity::Warning);
        let outcome = Outcome::abnormal(shown, may_lock_out, reason, text());
        Some(Outcome { contact: Some(binding), ..outcome })
    };
    let assessment = match assessment {
        Ok(assessment) => assessment,
        Err(reason) => {
            return reports_alarm(reason, &|| "by the density contact".into()).unwrap_or_else(
                || {
                    let reason = match doubt {
                        Some(doubt) => format!("{doubt}; {reason}"),
                        None => reason.clone(),
                    };
                    Outcome::unknown(reason)
                },
            );
        }
    };
    let condenses = assessment.condenses == Some(true);
    let text = || {
        let condensing = if condenses { ", condensing" } else { "" };
        let loss = loss.map_or_else(String::new, |loss| told_loss(&loss));
        format!("{}{condensing}{loss}", pressure(assessment.at_20))
    };
    let shown = match assessment.level {
        Some(Level::LockOut) => Some((LOCK_OUT, Severity::Alarm, "lock-out", settings.lock_out)),
        Some(Level::Alarm) => Some((ALARM, Severity::Warning, "alarm", settings.alarm)),
        _ => None,
    };
    if let Some((entry, severity, name, threshold)) = shown {
        let mut reason =
            format!("{} at 20 °C, {name} at {threshold} {unit}", pressure(assessment.at_20));
        reason += if condenses { "; the gas condenses" } else { "" };
        reason += &doubt.map_or_else(String::new, |doubt| format!("; {doubt}"));
        if contact == ContactState::Calm {
            reason += "; the density contact reports no alarm";
        }
        return Outcome::abnormal((entry, severity), assessment.may_lock_out, reason, text());
    }
    if matches!(contact, ContactState::Alarm(_) | ContactState::Missing) {
        let calculated = match assessment.level {
            Some(_) => format!("{} calculated", pressure(assessment.at_20)),
            None => doubt.unwrap_or("the calculation is uncertain").to_owned(),
        };
        if let Some(outcome) = reports_alarm(&calculated, &text) {
            return outcome;
        }
        if !condenses {
            let reason = format!("the density contact has no good value; {calculated}");
            return Outcome::unknown(reason);
        }
    }
    if assessment.level.is_none() || assessment.condenses.is_none() {
        let doubt = doubt.unwrap_or("the inputs are not known");
        return Outcome::unknown(format!("{doubt}; the density may be above or below the alarm"));
    }
    if condenses {
        let reason = format!("the gas condenses; its vapor is {}", pressure(assessment.at_20));
        return Outcome::abnormal(attention, assessment.may_lock_out, reason, text());
    }
    if let Some(loss) = loss.filter(|loss| loss.is_daily && loss.certain > settings.leak_limit) {
        let reason = format!("more than {} %/a allowed{}", settings.leak_limit, told_loss(&loss));
        return Outcome::abnormal(attention, assessment.may_lock_out, reason, text());
    }
    Outcome::normal()
}

/// Loss for people, with what was left out.
fn told_loss(loss: &Loss) -> String {
    let mut text = match loss.percent_a_year {
        rate if rate > MAX_TOLD_PERCENT => ", falling fast".to_owned(),
        rate if rate.abs() < 0.05 => ", no loss".to_owned(),
        rate if rate < 0.0 => format!(", {:.1} %/a gained", -rate),
        rate => format!(", {rate:.1} %/a lost"),
    };
    let plural = |count: usize| if count == 1 { "" } else { "s" };
    let Loss { refills, outliers, .. } = *loss;
    if refills > 0 {
        text += &format!(", {refills} refill{}", plural(refills));
    }
    if outliers > 0 {
        text += &format!(", {outliers} outlier{} left out", plural(outliers));
    }
    text
}
