//! Channels (7.4.4 to 7.4.6).

use std::ops::RangeInclusive;

use super::cfg::{CfgError, Revision};
use super::fields::{Fields, shorten};

/// Fields of an analogue channel in files of 1991; later ones have three more.
const ANALOG_FIELDS_1991: usize = 10;
const ANALOG_FIELDS: usize = 13;
/// Fields of a digital channel in files of 1991; later ones have two more.
const DIGITAL_FIELDS_1991: usize = 3;
const DIGITAL_FIELDS: usize = 5;
/// Longest time by which a channel is sampled beside the record's, either way.
const MAX_SKEW_MICROS: f64 = 1e6;

/// The side of the instrument transformer that values are of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The line's.
    Primary,
    /// The relay's.
    Secondary,
}

/// An analogue channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Analog {
    /// Identifier, `ch_id`.
    pub id: String,
    /// Unit, `uu`.
    pub unit: String,
    /// Multiplier: value = `a` x raw + `b`.
    pub a: f64,
    /// Offset, in units.
    pub b: f64,
    /// How long after the record's time it was sampled, nanoseconds.
    pub skew_nanos: i64,
    /// Raw values that can be.
    pub range: Option<RangeInclusive<f64>>,
    /// Primary over secondary, where the file says both.
    pub ratio: Option<f64>,
    /// Side of its values, where the file says it.
    pub side: Option<Side>,
}

/// A digital (status) channel.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Digital {
    /// Identifier, `ch_id`.
    pub id: String,
    /// State in service, where the file says it.
    pub normal: Option<bool>,
}

impl Analog {
    pub(super) fn parse(
        fields: &Fields<'_>,
        number: usize,
        revision: Revision,
    ) -> Result<Self, CfgError> {
        let id = fields.get(1).to_owned();
        let name = format!("analogue channel {number} ('{}')", shorten(&id));
        let least = if revision == Revision::Of1991 { ANALOG_FIELDS_1991 } else { ANALOG_FIELDS };
        if !(least..=ANALOG_FIELDS).contains(&fields.len()) {
            return Err(fields.fault(format!(
                "{name} has {} fields instead of {least}; no text of it may have a comma",
                fields.len()
            )));
        }
        let number = |index, what: &str| fields.number(index, &format!("{name}: {what}"));
        let a = number(5, "multiplier a")?
            .ok_or_else(|| fields.fault(format!("{name} has no multiplier a")))?;
        let b = number(6, "offset b")?.unwrap_or(0.0);
        let skew = number(7, "skew")?.unwrap_or(0.0);
        if skew.abs() > MAX_SKEW_MICROS {
            return Err(fields.fault(format!(
                "{name}: a skew of {skew} microseconds; at most {MAX_SKEW_MICROS} are possible"
            )));
        }
        let range = match (number(8, "min")?, number(9, "max")?) {
            (Some(min), Some(max)) if min < max => Some(min..=max),
            _ => None,
        };
        let ratio = match (number(10, "primary")?, number(11, "secondary")?) {
            (Some(primary), Some(secondary)) if primary > 0.0 && secondary > 0.0 => {
                Some(primary / secondary).filter(|ratio| ratio.is_normal())
            }
            _ => None,
        };
        let side = match fields.get(12) {
            "P" | "p" => Some(Side::Primary),
            "S" | "s" => Some(Side::Secondary),
            _ => None,
        };
        let unit = fields.get(4).to_owned();
        // Within a thousand million nanoseconds.
        let skew_nanos = (skew * 1000.0).round() as i64;
        Ok(Self { id, unit, a, b, skew_nanos, range, ratio, side })
    }

    /// What values are multiplied by, so that they are of a side.
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
    ) -> Result<Self, CfgError> {
        let id = fields.get(1).to_owned();
        let least = if revision == Revision::Of1991 { DIGITAL_FIELDS_1991 } else { DIGITAL_FIELDS };
        if !(DIGITAL_FIELDS_1991..=DIGITAL_FIELDS).contains(&fields.len()) {
            return Err(fields.fault(format!(
                "digital channel {number} ('{}') has {} fields instead of {least}; no text of it may have a comma",
                shorten(&id),
                fields.len()
            )));
        }
        let normal = match fields.get(fields.len() - 1) {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        };
        Ok(Self { id, normal })
    }
}
