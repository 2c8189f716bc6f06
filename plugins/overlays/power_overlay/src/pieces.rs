//! Verdicts on pieces of equipment by the limits and alarm roles of their tags.

use std::collections::HashMap;
use std::fmt::Write as _;

use busbar_plugin_sdk::{
    Binding, Canvas, DoublePoint, Error, Judgment, Quality, Reason, Severity, TagValue, Value,
    ValueKind, VerdictSeverity,
};

use crate::format;

/// Role whose tags are alarms: `true`, or a value outside the normal band, needs action.
pub(crate) const ALARM_ROLE: &str = "alarm";
/// Assumption about equipment whose tags have nothing to be judged by.
const NO_LIMITS: &str = "no limits are configured";

/// Piece of equipment with the bindings of its tags.
pub(crate) struct Piece {
    pub(crate) id: String,
    /// Bindings with a criterion to be judged by.
    judged: Vec<usize>,
    /// Bindings without a criterion.
    shown: Vec<usize>,
}

/// Lists the equipment that bindings name, in their order.
pub(crate) fn pieces(bindings: &[Binding]) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    for (index, binding) in bindings.iter().enumerate() {
        let place = *places.entry(&binding.node_id).or_insert_with(|| {
            let id = binding.node_id.clone();
            pieces.push(Piece { id, judged: Vec::new(), shown: Vec::new() });
            pieces.len() - 1
        });
        let piece = &mut pieces[place];
        let list = if has_criterion(binding) { &mut piece.judged } else { &mut piece.shown };
        list.push(index);
    }
    pieces
}

/// Reports whether a binding has a criterion for abnormal values.
fn has_criterion(binding: &Binding) -> bool {
    match binding.kind {
        ValueKind::F64 | ValueKind::I64 => {
            binding.limit_low.is_some() || binding.limit_high.is_some()
        }
        ValueKind::Bool => binding.role == ALARM_ROLE,
        // Both contacts at once are a fault whatever the limits.
        ValueKind::DoublePoint => true,
        // No text is abnormal by itself, but nobody knows of an alarm in words.
        ValueKind::Text => binding.role == ALARM_ROLE,
    }
}

/// Lists the faults of the bindings: alarms that are texts, which nothing tells from normal ones.
pub(crate) fn findings(bindings: &[Binding]) -> Vec<String> {
    let is_it = |of: &&Binding| of.kind == ValueKind::Text && of.role == ALARM_ROLE;
    let finding = |Binding { tag_id, role, node_id, .. }: &Binding| {
        format!(
            "the tag '{tag_id}' in the role '{role}' at '{node_id}' is a text, which is neither on \
             nor off; bind it in another role"
        )
    };
    bindings.iter().filter(is_it).map(finding).collect()
}

impl Piece {
    /// Judges the piece at the values of a frame.
    pub(crate) fn judge(
        &self,
        equipment: usize,
        (bindings, values): (&[Binding], &[TagValue]),
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        let doubt = |index: usize| doubt_of(&bindings[index], values.get(index));
        let severity = |index: usize| match &values[index].value {
            Some(value) if doubt(index).is_none() => severity(&bindings[index], value),
            _ => Severity::Normal,
        };
        let is_abnormal = |index: &usize| severity(*index) > Severity::Normal;
        let mut abnormal = self.judged.iter().copied().filter(is_abnormal);
        if let Some(first) = abnormal.next() {
            let count = 1 + abnormal.count();
            let basis = canvas.basis(self.judged.iter().copied().filter(is_abnormal))?;
            let reason = abnormal_reason(&bindings[first], values[first].value.as_ref(), count);
            let is_alarm = |index: &usize| severity(*index) == Severity::Alarm;
            let is_doubted =
                |index: &usize| bindings[*index].role == ALARM_ROLE && doubt(*index).is_some();
            let severity = VerdictSeverity::from_bounds(
                self.judged.iter().any(is_alarm),
                self.judged.iter().any(is_doubted),
            );
            let judgment = Judgment::abnormal(&reason).of_severity(severity);
            return canvas.judge(equipment, basis, &judgment);
        }
        let doubted = |list: &[usize]| list.iter().find_map(|index| Some((*index, doubt(*index)?)));
        let unknown = match self.judged.is_empty() {
            false => doubted(&self.judged),
            // Of equipment without limits a single value that is known says that it is there.
            true if self.shown.iter().any(|index| doubt(*index).is_none()) => None,
            true => doubted(&self.shown),
        };
        if let Some((index, doubt)) = unknown {
            let basis = canvas.basis([index])?;
            let reason = format!("{}: {doubt}", bindings[index].tag_id);
            return canvas.judge(equipment, basis, &Judgment::unknown(&reason));
        }
        if self.judged.is_empty() {
            let known = self.shown.iter().copied().filter(|index| doubt(*index).is_none());
            let basis = canvas.basis(known)?;
            return canvas.judge(equipment, basis, &Judgment::NORMAL.assuming(NO_LIMITS));
        }
        let basis = canvas.basis(self.judged.iter().copied())?;
        canvas.judge(equipment, basis, &Judgment::NORMAL)
    }
}

/// Describes the doubt about a value that does not count; `None` where it counts.
fn doubt_of(binding: &Binding, tag: Option<&TagValue>) -> Option<&'static str> {
    let Some(TagValue { value: Some(value), quality, .. }) = tag else {
        return Some("no value yet");
    };
    match (quality, value) {
        (Quality::Bad(Reason::Stale), _) => Some("stale"),
        (Quality::Bad(_), _) => Some("bad"),
        (Quality::Uncertain(_), _) => Some("uncertain"),
        (Quality::Good, Value::F64(number)) if !number.is_finite() => Some("not a finite number"),
        (Quality::Good, value) if !is_of(binding.kind, value.kind()) => {
            Some("a value of another type than the tag's")
        }
        (Quality::Good, Value::Text(_)) if binding.role == ALARM_ROLE => {
            Some("a text, which is neither on nor off")
        }
        (Quality::Good, _) => None,
    }
}

/// Decides whether a value fits a tag of this type: numbers stand for each other.
fn is_of(kind: ValueKind, of_value: ValueKind) -> bool {
    of_value == kind || (kind.is_quantity() && of_value.is_quantity())
}

/// Severity of a value. In the role `alarm`, outside the normal band or `true` is an alarm;
/// in any other role, outside the band is a warning. A text is normal.
pub(crate) fn severity(binding: &Binding, value: &Value) -> Severity {
    let is_alarm = binding.role == ALARM_ROLE;
    // Limits are of quantities.
    let is_outside = |value: f64| {
        binding.kind.is_quantity()
            && (binding.limit_low.is_some_and(|low| value < low)
                || binding.limit_high.is_some_and(|high| value > high))
    };
    let is_abnormal = match value {
        Value::F64(value) => is_outside(*value),
        Value::I64(value) => is_outside(*value as f64),
        Value::Bool(value) => is_alarm && *value,
        Value::DoublePoint(point) => *point == DoublePoint::BadState,
        Value::Text(_) => false,
    };
    match (is_abnormal, is_alarm) {
        (false, _) => Severity::Normal,
        (true, false) => Severity::Warning,
        (true, true) => Severity::Alarm,
    }
}

fn abnormal_reason(binding: &Binding, value: Option<&Value>, count: usize) -> String {
    let Binding { tag_id, unit, limit_low, limit_high, .. } = binding;
    let number = value.and_then(Value::as_number);
    let below = limit_low.filter(|low| number.is_some_and(|value| value < *low));
    let mut reason = format!("{tag_id}: {}", format::value(value, unit));
    // A string takes all that is written; a limit of -0 is one of 0.
    let _ = match (number, below, limit_high) {
        (Some(_), Some(low), _) => write!(reason, ", below {}", low + 0.0),
        (Some(_), None, Some(high)) => write!(reason, ", above {}", high + 0.0),
        _ => Ok(()),
    };
    if count > 1 {
        let _ = write!(reason, ", and {} more", count - 1);
    }
    reason
}

#[cfg(test)]
#[path = "pieces_tests.rs"]
mod tests;
