//! Equipment with its levels, and verdicts on it by the normal band.

use std::collections::{HashMap, HashSet};

use busbar_plugin_sdk::units::UnitConversion;
use busbar_plugin_sdk::{
    Binding, Canvas, Error, Judgment, Quality, Reason, TagValue, Value, VerdictSeverity,
};

use crate::settings::Settings;

/// A piece of equipment with its levels.
pub(crate) struct Piece {
    pub(crate) id: String,
    is_untelemetered: bool,
    pub(crate) levels: Vec<Level>,
}

/// A binding that is a level.
pub(crate) struct Level {
    pub(crate) binding: usize,
    tag_id: String,
    /// Conversion to the contour's unit, or the reason why there is none.
    conversion: Result<UnitConversion, &'static str>,
}

/// Lists the equipment of the settings with its levels, and what bindings lack.
pub(crate) fn pieces(settings: &Settings, bindings: &[Binding]) -> (Vec<Piece>, Vec<String>) {
    let untelemetered: HashSet<&String> = settings.untelemetered.iter().collect();
    let (mut pieces, mut findings) = (Vec::new(), Vec::new());
    let mut places: HashMap<&str, usize> = HashMap::new();
    for id in &settings.equipment {
        places.entry(id).or_insert_with(|| {
            let is_untelemetered = untelemetered.contains(id);
            pieces.push(Piece { id: id.clone(), is_untelemetered, levels: Vec::new() });
            pieces.len() - 1
        });
    }
    for (index, binding) in bindings.iter().enumerate().filter(|(_, b)| b.role == settings.role) {
        let Some(place) = places.get(binding.node_id.as_str()) else { continue };
        let level = Level {
            binding: index,
            tag_id: binding.tag_id.clone(),
            conversion: conversion(binding, &settings.unit, &mut findings),
        };
        pieces[*place].levels.push(level);
    }
    let silent = pieces.iter().filter(|piece| piece.levels.is_empty() && !piece.is_untelemetered);
    findings.extend(silent.map(|piece| {
        let (id, role) = (&piece.id, &settings.role);
        format!("no tag at '{id}' has the role '{role}'; bind one, or name it in `untelemetered`")
    }));
    (pieces, findings)
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

impl Level {
    /// The level that is drawn, good or not: the host marks what is not. None where a value
    /// that is called good is no level.
    pub(crate) fn drawn(&self, tag: &TagValue) -> Option<f64> {
        match self.value(tag) {
            Ok(value) => Some(value),
            Err(_) if tag.quality == Quality::Good => None,
            Err(_) => {
                let last = tag.number().zip(self.conversion.ok());
                let last = last.map(|(number, conversion)| conversion.apply(number));
                Some(last.filter(|value| value.is_finite()).unwrap_or_default())
            }
        }
    }

    /// The level in the contour's unit, or the reason why there is none.
    fn value(&self, tag: &TagValue) -> Result<f64, &'static str> {
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
}

impl Piece {
    /// Judges the piece: abnormal outside the band, else unknown by what is not known.
    pub(crate) fn judge(
        &self,
        equipment: usize,
        settings: &Settings,
        values: &[TagValue],
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        if self.levels.is_empty() {
            let basis = canvas.basis([])?;
            let reason = match self.is_untelemetered {
                true => "declared untelemetered".to_owned(),
                false => format!("no tag has the role '{}'", settings.role),
            };
            return canvas.judge(equipment, basis, &Judgment::unknown(&reason));
        }
        let value = |level: &Level| level.value(&values[level.binding]);
        let is_abnormal = |level: &&Level| value(level).is_ok_and(|v| settings.is_outside(v));
        let abnormal = || self.levels.iter().filter(is_abnormal);
        let assumption = |level: &Level| {
            let is_assumed = level.conversion.is_ok_and(|conversion| conversion.is_assumed);
            is_assumed.then(|| format!("{} is in {}", level.tag_id, settings.unit))
        };
        if let Some(first) = abnormal().next() {
            let basis = canvas.basis(abnormal().map(|level| level.binding))?;
            let reason = outside(&first.tag_id, value(first).unwrap_or_default(), settings);
            let assumption = assumption(first).unwrap_or_default();
            let judgment = Judgment::abnormal(&reason)
                .of_severity(VerdictSeverity::Warning)
                .assuming(&assumption);
            return canvas.judge(equipment, basis, &judgment);
        }
        let doubt = self.levels.iter().find_map(|level| Some((level, value(level).err()?)));
        if let Some((level, doubt)) = doubt {
            let basis = canvas.basis([level.binding])?;
            let reason = format!("{}: {doubt}", level.tag_id);
            return canvas.judge(equipment, basis, &Judgment::unknown(&reason));
        }
        let basis = canvas.basis(self.levels.iter().map(|level| level.binding))?;
        let assumption = self.levels.iter().find_map(assumption).unwrap_or_default();
        canvas.judge(equipment, basis, &Judgment::NORMAL.assuming(&assumption))
    }
}

fn outside(tag_id: &str, value: f64, settings: &Settings) -> String {
    let Settings { unit, low, high, .. } = settings;
    let limit = match (low.filter(|low| value < *low), high) {
        (Some(low), _) => format!("below {}", low + 0.0),
        (None, high) => format!("above {}", high.unwrap_or_default() + 0.0),
    };
    let value = format!("{value:.2}");
    let unsigned =
        value.strip_prefix('-').filter(|rest| !rest.contains(|c| ('1'..='9').contains(&c)));
    let value = unsigned.unwrap_or(&value);
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    format!("{tag_id}: {value}{unit}, {limit}")
}
