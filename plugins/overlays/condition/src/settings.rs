//! Quantities as they are configured.

use busbar_plugin_sdk::Severity;

/// Quantities of one overlay: each has two entries of the legend's 64.
const MAX_QUANTITIES: usize = 32;
/// Pieces of equipment of one overlay.
const MAX_EQUIPMENT: usize = 10_000;
/// Bytes of a quantity's name: the legend adds what is wrong with it.
const MAX_NAME_BYTES: usize = 48;
/// Bytes of a unit.
const MAX_UNIT_BYTES: usize = 16;

/// Settings of the overlay: what is judged of the equipment, and how.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Quantities that are monitored.
    #[schemars(length(min = 1, max = MAX_QUANTITIES))]
    pub quantities: Vec<QuantitySettings>,
    /// Ids of the equipment that states are shown at.
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
    /// Ids of equipment without tags: its verdict is unknown, and that is no fault.
    #[serde(default)]
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub untelemetered: Vec<String>,
}

/// A quantity, whose tags are bound in a role of its own.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuantitySettings {
    /// Name for people, at most 48 bytes.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    pub name: String,
    /// Role of its tags.
    #[schemars(length(min = 1, max = 200))]
    pub role: String,
    /// Unit of the thresholds, which tags in other units are converted to; without it all
    /// tags must have the same one.
    #[serde(default)]
    #[schemars(length(max = MAX_UNIT_BYTES))]
    pub unit: Option<String>,
    /// From here on it needs attention, in that unit.
    pub attention: f64,
    /// From here on it is an alarm.
    pub alarm: f64,
    /// To which side of the thresholds it is bad.
    #[serde(default)]
    pub bad: Side,
}

/// A side of a threshold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// At it and above.
    #[default]
    Above,
    /// At it and below.
    Below,
}

impl QuantitySettings {
    /// Grades a value by the thresholds.
    pub(crate) fn judge(&self, value: f64) -> Severity {
        let reaches = |threshold: f64| match self.bad {
            Side::Above => value >= threshold,
            Side::Below => value <= threshold,
        };
        match () {
            () if reaches(self.alarm) => Severity::Alarm,
            () if reaches(self.attention) => Severity::Warning,
            () => Severity::Normal,
        }
    }
}

impl Settings {
    /// Finds the first fault of the settings, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.quantities.is_empty() || self.quantities.len() > MAX_QUANTITIES {
            return Some(format!("name 1 to {MAX_QUANTITIES} quantities"));
        }
        if self.equipment.len() > MAX_EQUIPMENT || self.untelemetered.len() > MAX_EQUIPMENT {
            return Some(format!("name at most {MAX_EQUIPMENT} pieces of equipment"));
        }
        self.quantities.iter().find_map(|of| {
            let name = &of.name;
            let rises = match of.bad {
                Side::Above => of.attention < of.alarm,
                Side::Below => of.attention > of.alarm,
            };
            if name.is_empty() || name.len() > MAX_NAME_BYTES {
                return Some(format!("'{name}': give a name of 1 to {MAX_NAME_BYTES} bytes"));
            }
            if of.unit.as_ref().is_some_and(|unit| unit.len() > MAX_UNIT_BYTES) {
                return Some(format!("'{name}': give a unit of at most {MAX_UNIT_BYTES} bytes"));
            }
            (!rises).then(|| {
                let (attention, alarm) = (of.attention, of.alarm);
                format!("{name}: alarm {alarm} must be beyond attention {attention}")
            })
        })
    }
}
