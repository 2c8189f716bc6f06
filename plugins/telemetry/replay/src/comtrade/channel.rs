//! Channels (7.4.4 to 7.4.6).

use std::ops::RangeInclusive;

use super::cfg_error::CfgError;
use super::fields::{Fields, shorten};
use super::layout::{self, Oddity};
use super::revision::Revision;

/// Fields of an analogue channel in files of 1991; later ones have three more.
const ANALOG_FIELDS_1991: usize = 10;
const ANALOG_FIELDS: usize = 13;
/// Longest time by which a channel is sampled beside the record's, either way.
const MAX_SKEW_MICROS: f64 = 1e6;

/// The side of the instrument transformer that values are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Primary side: the line's values.
    Primary,
    /// Secondary side: the relay's values.
    Secondary,
}

/// Analogue channel of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Analog {
    /// Identifier of the channel, `ch_id`.
    pub id: String,
    /// Unit of the values, `uu`.
    pub unit: String,
    /// Multiplier: value = `a` x raw + `b`.
    pub a: f64,
    /// Offset `b`, in units.
    pub b: f64,
    /// Skew: delay of the channel's sampling after the record's time, nanoseconds.
    pub skew_nanos: i64,
    /// Raw values that can be.
    pub range: Option<RangeInclusive<f64>>,
    /// Primary over secondary, where the file says both.
    pub ratio: Option<f64>,
    /// Side of its values, where the file says it.
    pub side: Option<Side>,
    /// Fault of its line, with which it has no values.
    pub fault: Option<String>,
}

/// A digital (status) channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digital {
    /// Identifier of the channel, `ch_id`.
    pub id: String,
    /// State in service, where the file says it.
    pub normal: Option<bool>,
}

impl Analog {
    /// Reads a channel line. A channel that cannot be read has a fault, which is told where its
    /// values are asked for.
    pub(super) fn parse(
        fields: &Fields<'_>,
        number: usize,
        revision: Revision,
    ) -> (Self, Option<Oddity>) {
        let Some(found) = layout::analog(fields, revision) else {
            let id = fields.get(1).to_owned();
            let fault = Self::fault_of(fields, number, revision).to_string();
            let channel = Self {
                id,
                unit: fields.get(4).to_owned(),
                a: 0.0,
                b: 0.0,
                skew_nanos: 0,
                range: None,
                ratio: None,
                side: None,
                fault: Some(fault),
            };
            return (channel, None);
        };
        let number_at = |index: usize| {
            let text = found.tail.get(index).copied().unwrap_or_default();
            text.parse::<f64>().ok().filter(|number| number.is_finite())
        };
        let skew = number_at(2).unwrap_or(0.0);
        let fault = (skew.abs() > MAX_SKEW_MICROS).then(|| {
            let name = format!("analogue channel {number} ('{}')", shorten(&found.id));
            let what = format!(
                "{name}: a skew of {skew} microseconds; at most {MAX_SKEW_MICROS} are possible"
            );
            fields.fault(what).to_string()
        });
        let range = match (number_at(3), number_at(4)) {
            (Some(min), Some(max)) if min < max => Some(min..=max),
            _ => None,
        };
        let ratio = match (number_at(5), number_at(6)) {
            (Some(primary), Some(secondary)) if primary > 0.0 && secondary > 0.0 => {
                Some(primary / secondary).filter(|ratio| ratio.is_normal())
            }
            _ => None,
        };
        let side = match found.tail.get(7).copied() {
            Some("P" | "p") => Some(Side::Primary),
            Some("S" | "s") => Some(Side::Secondary),
            _ => None,
        };
        let channel = Self {
            id: found.id,
            unit: found.unit.to_owned(),
            a: number_at(0).unwrap_or(0.0),
            b: number_at(1).unwrap_or(0.0),
            // Within a thousand million nanoseconds.
            skew_nanos: (skew.clamp(-MAX_SKEW_MICROS, MAX_SKEW_MICROS) * 1000.0).round() as i64,
            range,
            ratio,
            side,
            fault,
        };
        (channel, found.oddity)
    }

    /// The fault of a line that has no layout.
    fn fault_of(fields: &Fields<'_>, number: usize, revision: Revision) -> CfgError {
        let name = format!("analogue channel {number} ('{}')", shorten(fields.get(1)));
        let least = if revision == Revision::Of1991 { ANALOG_FIELDS_1991 } else { ANALOG_FIELDS };
        if fields.len() != least {
            return fields.fault(format!("{name} has {} fields instead of {least}", fields.len()));
        }
        let places = [(5, "multiplier a"), (6, "offset b"), (7, "skew"), (8, "min"), (9, "max")];
        let more = [(10, "primary"), (11, "secondary")];
        let read =
            |(index, what): (usize, &str)| fields.number(index, &format!("{name}: {what}")).err();
        if let Some(fault) = places.into_iter().chain(more).find_map(read) {
            return fault;
        }
        match fields.get(5) {
            "" => fields.fault(format!("{name} has no multiplier a")),
            _ => fields.fault(format!("{name}: '{}' is no side, P or S", shorten(fields.get(12)))),
        }
    }

    /// Factor by which values become those of a side.
    ///
    /// # Errors
    /// What the file does not say.
    pub fn factor_to(&self, side: Side) -> Result<f64, String> {
        let of =
            self.side.ok_or("the file does not say whether its values are primary or secondary")?;
        if of == side {
            return Ok(1.0);
        }
        let ratio = self.ratio.ok_or("the file does not say its primary and secondary ratio")?;
        Ok(if side == Side::Primary { ratio } else { ratio.recip() })
    }
}

impl Digital {
    pub(super) fn parse(
        fields: &Fields<'_>,
        number: usize,
        revision: Revision,
    ) -> Result<(Self, Option<Oddity>), CfgError> {
        let found = layout::digital(fields, revision).ok_or_else(|| {
            fields.fault(format!("digital channel {number} has no name: {} fields", fields.len()))
        })?;
        let normal = found.tail.first().map(|state| *state == "1");
        Ok((Self { id: found.id, normal }, found.oddity))
    }
}
