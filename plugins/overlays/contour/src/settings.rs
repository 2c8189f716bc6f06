//! A contour as it is configured.

/// Pieces of equipment of one overlay.
const MAX_EQUIPMENT: usize = 10_000;
const MAX_NAME_BYTES: usize = 64;
const MAX_UNIT_BYTES: usize = 16;
const MIN_REACH_METRES: f64 = 0.1;
const MAX_REACH_METRES: f64 = 1000.0;

/// Settings of the overlay: one quantity.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Name of the quantity for people.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    pub name: String,
    /// Unit of the quantity, which tags in other units are converted to.
    #[serde(default)]
    #[schemars(length(max = MAX_UNIT_BYTES))]
    pub unit: String,
    /// Role of its tags.
    #[schemars(length(min = 1, max = 200))]
    pub role: String,
    /// Ids of the equipment that it is measured at.
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
    /// Ids of equipment without a tag: its verdict is unknown, and that is no fault.
    #[serde(default)]
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub untelemetered: Vec<String>,
    /// Radius around a piece of equipment in which its value counts, metres.
    #[schemars(range(min = MIN_REACH_METRES, max = MAX_REACH_METRES))]
    pub reach_metres: f64,
    /// Lower end of the normal band; none where low is good. Only what lies outside of the
    /// band is coloured.
    #[serde(default)]
    pub low: Option<f64>,
    /// Upper end of the normal band; none where high is good.
    #[serde(default)]
    pub high: Option<f64>,
    /// From one line of equal value to the next, in the unit.
    pub step: f64,
    /// Shows the contour before an operator switches it on.
    #[serde(default)]
    pub shown: bool,
}

impl Settings {
    /// Decides whether a level is outside the normal band.
    pub(crate) fn is_outside(&self, level: f64) -> bool {
        self.low.is_some_and(|low| level < low) || self.high.is_some_and(|high| level > high)
    }

    /// Finds the first fault of the settings, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let Self { name, unit, equipment, reach_metres, low, high, step, .. } = self;
        if name.is_empty() || name.len() > MAX_NAME_BYTES || unit.len() > MAX_UNIT_BYTES {
            let (name, unit) = (MAX_NAME_BYTES, MAX_UNIT_BYTES);
            return Some(format!("give a name of 1 to {name} bytes, and a unit of at most {unit}"));
        }
        if equipment.len() > MAX_EQUIPMENT || self.untelemetered.len() > MAX_EQUIPMENT {
            return Some(format!("name at most {MAX_EQUIPMENT} pieces of equipment"));
        }
        if !(MIN_REACH_METRES..=MAX_REACH_METRES).contains(reach_metres) {
            let (least, most) = (MIN_REACH_METRES, MAX_REACH_METRES);
            return Some(format!("values reach {least} to {most} m, not {reach_metres}"));
        }
        if !step.is_finite() || *step <= 0.0 {
            return Some(format!("a step of {step} leads nowhere"));
        }
        match (low, high) {
            (Some(low), Some(high)) if low >= high => {
                Some(format!("the normal band from {low} to {high} is empty"))
            }
            (None, None) => Some("name the normal band: low, high or both".to_owned()),
            _ => None,
        }
    }
}
