//! Bindings that are watched, equipment, and verdicts on it.

use std::collections::{HashMap, HashSet};

use busbar_plugin_sdk::units::UnitConversion;
use busbar_plugin_sdk::{
    Binding, Canvas, Error, Judgment, Quality, Reason, Severity, TagValue, Value, VerdictSeverity,
};

use crate::settings::{QuantitySettings, Settings};

/// A binding that is judged as a quantity.
pub(crate) struct Watched {
    pub(crate) binding: usize,
    pub(crate) node: u32,
    pub(crate) piece: usize,
    pub(crate) quantity: usize,
    /// Unit of what is shown.
    pub(crate) unit: String,
    tag_id: String,
    node_id: String,
    /// Conversion to the unit of the thresholds, or the reason why there is none.
    conversion: Result<UnitConversion, &'static str>,
}

/// A piece of equipment with its watched bindings.
pub(crate) struct Piece {
    pub(crate) id: String,
    /// Named by the settings: its states are shown.
    pub(crate) is_listed: bool,
    is_untelemetered: bool,
    watched: Vec<usize>,
}

/// Finds the bindings in the roles of quantities, and what is wrong with them.
pub(crate) fn watch(settings: &Settings, bindings: &[Binding]) -> (Vec<Watched>, Vec<String>) {
    let (mut watched, mut findings) = (Vec::new(), Vec::new());
    let mut places = places(settings);
    let untelemetered: HashSet<&String> = settings.untelemetered.iter().collect();
    let needs_tags = settings.equipment.iter().any(|id| !untelemetered.contains(id));
    for (quantity, of) in settings.quantities.iter().enumerate() {
        let in_role = || bindings.iter().enumerate().filter(|(_, one)| one.role == of.role);
        let unit = unit_of(of, in_role().map(|(_, binding)| binding));
        if let Err(finding) = &unit {
            findings.push(finding.clone());
        }
        if needs_tags && in_role().next().is_none() {
            let (name, role) = (&of.name, &of.role);
            findings.push(format!(
                "no tag has the role '{role}' of the quantity '{name}'; bind tags in that role, \
                 or remove the quantity"
            ));
        }
        for (index, binding) in in_role() {
            let next = places.len();
            let piece = *places.entry(binding.node_id.clone()).or_insert(next);
            let conversion = match &unit {
                Err(_) => Err("the quantity has no unit, and its tags have several"),
                Ok(unit) => conversion(binding, unit, &mut findings),
            };
            watched.push(Watched {
                binding: index,
                node: binding.node,
                piece,
                quantity,
                unit: unit.clone().unwrap_or_default(),
                tag_id: binding.tag_id.clone(),
                node_id: binding.node_id.clone(),
                conversion,
            });
        }
    }
    (watched, findings)
}

/// Indices of the equipment that the settings name, without repetitions.
fn places(settings: &Settings) -> HashMap<String, usize> {
    let mut places = HashMap::new();
    for id in &settings.equipment {
        let next = places.len();
        places.entry(id.clone()).or_insert(next);
    }
    places
}

/// The unit of the thresholds: that of the settings, or the only one that tags have.
fn unit_of<'b>(
    of: &QuantitySettings,
    bindings: impl Iterator<Item = &'b Binding>,
) -> Result<String, String> {
    if let Some(unit) = &of.unit {
        return Ok(unit.clone());
    }
    let mut first: Option<&str> = None;
    for unit in bindings.map(|binding| binding.unit.trim()).filter(|unit| !unit.is_empty()) {
        match first {
            Some(other) if other != unit => {
                let name = &of.name;
                return Err(format!(
                    "the quantity '{name}' has tags in '{other}' and in '{unit}'; give it the \
                     setting `unit`, that of its thresholds"
                ));
            }
            _ => first = Some(unit),
        }
    }
    Ok(first.unwrap_or_default().to_owned())
}

fn conversion(
    binding: &Binding,
    unit: &str,
    findings: &mut Vec<String>,
) -> Result<UnitConversion, &'static str> {
    if !binding.kind.is_quantity() {
        let Binding { tag_id, role, node_id, .. } = binding;
        findings.push(format!(
            "the tag '{tag_id}' in the role '{role}' at '{node_id}' is no number; bind one of the \
             type f64 or i64"
        ));
        return Err("no number");
    }
    UnitConversion::of_binding_to(binding, unit).map_err(|finding| {
        findings.push(finding);
        "its unit cannot be converted"
    })
}

/// Lists the equipment of the settings and of watched bindings; what no tag is bound to is a
/// finding.
pub(crate) fn pieces(
    settings: &Settings,
    watched: &[Watched],
    findings: &mut Vec<String>,
) -> Vec<Piece> {
    let untelemetered: HashSet<&str> = settings.untelemetered.iter().map(String::as_str).collect();
    let piece = |id: &str, is_listed| Piece {
        id: id.to_owned(),
        is_listed,
        is_untelemetered: untelemetered.contains(id),
        watched: Vec::new(),
    };
    let mut listed: Vec<(String, usize)> = places(settings).into_iter().collect();
    listed.sort_by_key(|(_, place)| *place);
    let mut pieces: Vec<Piece> = listed.iter().map(|(id, _)| piece(id, true)).collect();
    for (index, one) in watched.iter().enumerate() {
        if one.piece == pieces.len() {
            pieces.push(piece(&one.node_id, false));
        }
        pieces[one.piece].watched.push(index);
    }
    let silent = pieces.iter().filter(|piece| piece.watched.is_empty() && !piece.is_untelemetered);
    findings.extend(silent.map(|piece| {
        format!(
            "no tag at '{}' has the role of a quantity; bind one, or name it in `untelemetered`",
            piece.id
        )
    }));
    pieces
}

impl Watched {
    /// The value in the unit of the thresholds, or the reason why there is none.
    pub(crate) fn value(&self, tag: &TagValue) -> Result<f64, &'static str> {
        let conversion = self.conversion?;
        match (tag.quality, &tag.value) {
            (_, None) => Err("no value yet"),
            (Quality::Bad(Reason::Stale), _) => Err("stale"),
            (Quality::Bad(_), _) => Err("bad"),
            (Quality::Uncertain(_), _) => Err("uncertain"),
            (Quality::Good, Some(Value::Bool(_) | Value::DoublePoint(_) | Value::Text(_))) => {
                Err("no number")
            }
            (Quality::Good, Some(_)) => {
                let value = tag.number().map(|number| conversion.apply(number));
                value.filter(|value| value.is_finite()).ok_or("not a finite number")
            }
        }
    }

    /// Words for the default that its judgment rests on.
    fn assumption(&self) -> Option<String> {
        let unit = &self.unit;
        let is_assumed = self.conversion.is_ok_and(|conversion| conversion.is_assumed);
        is_assumed.then(|| format!("{} is in {unit} as its thresholds are", self.tag_id))
    }
}

impl Piece {
    /// Judges the piece: abnormal by what is known, else unknown by what is not.
    pub(crate) fn judge(
        &self,
        equipment: usize,
        (watched, quantities): (&[Watched], &[QuantitySettings]),
        values: &[TagValue],
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        if self.watched.is_empty() {
            let basis = canvas.basis([])?;
            let reason = match self.is_untelemetered {
                true => "declared untelemetered",
                false => "no tag has the role of a quantity",
            };
            return canvas.judge(equipment, basis, &Judgment::unknown(reason));
        }
        let (mut abnormal, mut unknown) = (Vec::new(), None);
        for one in self.watched.iter().map(|index| &watched[*index]) {
            let of = &quantities[one.quantity];
            match one.value(&values[one.binding]) {
                Ok(value) if of.judge(value) > Severity::Normal => {
                    let (name, shown) = (&of.name, number(value, &one.unit));
                    let threshold = match of.judge(value) {
                        Severity::Alarm => format!("alarm from {}", of.alarm + 0.0),
                        _ => format!("attention from {}", of.attention + 0.0),
                    };
                    let is_alarm = of.judge(value) == Severity::Alarm;
                    abnormal.push((is_alarm, one, format!("{name}: {shown}, {threshold}")));
                }
                Ok(_) => {}
                Err(doubt) => {
                    unknown.get_or_insert((one, doubt));
                }
            }
        }
        if let Some((_, first, reason)) = abnormal.iter().max_by_key(|(is_alarm, ..)| *is_alarm) {
            let basis = canvas.basis(abnormal.iter().map(|(_, one, _)| one.binding))?;
            let reason = match abnormal.len() {
                1 => reason.clone(),
                count => format!("{reason}, and {} more", count - 1),
            };
            let assumption = first.assumption().unwrap_or_default();
            let is_alarm = abnormal.iter().any(|(is_alarm, ..)| *is_alarm);
            let severity = VerdictSeverity::from_bounds(is_alarm, unknown.is_some());
            let judgment = Judgment::abnormal(&reason).of_severity(severity).assuming(&assumption);
            return canvas.judge(equipment, basis, &judgment);
        }
        if let Some((one, doubt)) = unknown {
            let basis = canvas.basis([one.binding])?;
            let reason = format!("{}: {doubt}", one.tag_id);
            return canvas.judge(equipment, basis, &Judgment::unknown(&reason));
        }
        let all = || self.watched.iter().map(|index| &watched[*index]);
        let basis = canvas.basis(all().map(|one| one.binding))?;
        let assumption = all().find_map(Watched::assumption).unwrap_or_default();
        canvas.judge(equipment, basis, &Judgment::NORMAL.assuming(&assumption))
    }
}

/// A number of two digits behind the point with its unit, and no minus before a zero.
pub(crate) fn number(value: f64, unit: &str) -> String {
    let text = format!("{value:.2}");
    let digits = text.strip_prefix('-').filter(|rest| rest.chars().all(|c| matches!(c, '0' | '.')));
    let text = digits.unwrap_or(&text);
    if unit.is_empty() { text.to_owned() } else { format!("{text} {unit}") }
}
