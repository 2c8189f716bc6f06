//! Measuring points at the ends of flows, and judgments by their tags.

use busbar_plugin_sdk::units::{Quantity, UnitConversion};
use busbar_plugin_sdk::{Binding, Quality, Reason, TagValue, Value};

use crate::settings::FlowSettings;

/// Tag of active or reactive power.
pub(crate) struct PowerTag {
    pub(crate) binding: usize,
    pub(crate) node: u32,
    pub(crate) tag_id: String,
    /// Conversion to MW or Mvar, or the reason why there is none.
    conversion: Result<UnitConversion, &'static str>,
}

/// Measuring point of a flow.
pub(crate) struct End {
    pub(crate) id: String,
    pub(crate) is_untelemetered: bool,
    pub(crate) active: Vec<PowerTag>,
    pub(crate) reactive: Vec<PowerTag>,
}

/// Judgment on a flow by one of its ends.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum EndJudgment {
    /// Apparent power that is certainly above the rating.
    Above {
        reason: String,
        basis: Vec<usize>,
    },
    /// Apparent power within the rating, by what is measured.
    Within {
        has_reactive: bool,
        basis: Vec<usize>,
    },
    Unknown {
        reason: String,
        basis: Vec<usize>,
    },
}

impl End {
    /// Finds the tags of one end of a flow; adds what they lack to the findings.
    pub(crate) fn new(
        (id, is_untelemetered): (&str, bool),
        flow: &FlowSettings,
        (bindings, own): (&[Binding], &[usize]),
        findings: &mut Vec<String>,
    ) -> Self {
        let mut tags = |role: &str, quantity, unit| -> Vec<PowerTag> {
            let in_role = own.iter().filter(|index| bindings[**index].role == role);
            in_role
                .map(|&index| {
                    let binding = &bindings[index];
                    PowerTag {
                        binding: index,
                        node: binding.node,
                        tag_id: binding.tag_id.clone(),
                        conversion: conversion(binding, quantity, unit, findings),
                    }
                })
                .collect()
        };
        let active = tags(&flow.role, Quantity::ActivePower, "MW");
        let reactive = tags(&flow.reactive_role, Quantity::ReactivePower, "Mvar");
        if active.is_empty() && !is_untelemetered {
            let role = &flow.role;
            findings.push(format!(
                "no tag at '{id}' has the role '{role}'; bind one, or name it in `untelemetered`"
            ));
        }
        Self { id: id.to_owned(), is_untelemetered, active, reactive }
    }

    /// Judges a flow of this rating by the tags of this end.
    pub(crate) fn judge(&self, rating_mva: f64, values: &[TagValue]) -> EndJudgment {
        let of = |tag: &PowerTag| tag.value(values).ok();
        let largest = |tags: &[PowerTag]| -> f64 {
            tags.iter().filter_map(of).map(f64::abs).fold(0.0, f64::max)
        };
        let (active, reactive) = (largest(&self.active), largest(&self.reactive));
        let apparent = active.hypot(reactive);
        if apparent > rating_mva {
            let known = |tags: &[PowerTag]| -> Vec<usize> {
                tags.iter().filter(|tag| of(tag).is_some()).map(|tag| tag.binding).collect()
            };
            // What is above the rating by itself needs no other value.
            let basis = match (active > rating_mva, reactive > rating_mva) {
                (true, _) => known(&self.active),
                (false, true) => known(&self.reactive),
                (false, false) => [known(&self.active), known(&self.reactive)].concat(),
            };
            let (apparent, percent) = (digits(apparent), apparent / rating_mva * 100.0);
            let reason = format!(
                "{}: {apparent} MVA, {percent:.0} % of the rating of {rating_mva} MVA",
                self.id
            );
            return EndJudgment::Above { reason, basis };
        }
        let tags = || self.active.iter().chain(&self.reactive);
        if self.active.is_empty() {
            let reason = match self.is_untelemetered {
                true => format!("{}: declared untelemetered", self.id),
                false => format!("{}: no tag of active power", self.id),
            };
            return EndJudgment::Unknown { reason, basis: Vec::new() };
        }
        let doubted = tags().find_map(|tag| Some((tag, tag.value(values).err()?)));
        match doubted {
            Some((tag, doubt)) => {
                let reason = format!("{}: {doubt}", tag.tag_id);
                EndJudgment::Unknown { reason, basis: vec![tag.binding] }
            }
            None => EndJudgment::Within {
                has_reactive: !self.reactive.is_empty(),
                basis: tags().map(|tag| tag.binding).collect(),
            },
        }
    }

    /// Returns the assumption about units that its tags lack.
    pub(crate) fn assumption(&self) -> Option<String> {
        let unit = |tags: &[PowerTag], unit: &str| {
            let tag = tags.iter().find(|tag| tag.conversion.is_ok_and(|of| of.is_assumed))?;
            Some(format!("{} is in {unit}", tag.tag_id))
        };
        unit(&self.active, "MW").or_else(|| unit(&self.reactive, "Mvar"))
    }
}

impl PowerTag {
    /// Returns the power in MW or Mvar, or the reason why there is none.
    pub(crate) fn value(&self, values: &[TagValue]) -> Result<f64, &'static str> {
        let conversion = self.conversion?;
        let tag = values.get(self.binding).ok_or("no value yet")?;
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

    /// Returns the last power whatever its quality; none where a value that is called good is none.
    pub(crate) fn last(&self, values: &[TagValue]) -> Option<f64> {
        let tag = values.get(self.binding)?;
        if tag.quality == Quality::Good {
            return self.value(values).ok();
        }
        let last = self.conversion.ok()?.apply(tag.number()?);
        last.is_finite().then_some(last)
    }
}

fn conversion(
    binding: &Binding,
    quantity: Quantity,
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
    UnitConversion::for_binding(binding, quantity, unit).map_err(|finding| {
        findings.push(finding);
        "its unit cannot be converted"
    })
}

/// Formats a power with up to three significant digits, and no minus before a zero.
pub(crate) fn digits(power: f64) -> String {
    let digits = match power.abs() {
        size if size >= 99.95 => 0,
        size if size >= 9.995 => 1,
        _ => 2,
    };
    let text = format!("{power:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_owned(),
        _ => text,
    }
}
