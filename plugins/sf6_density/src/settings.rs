//! Compartments as they are configured.

use crate::gas::EquationOfState;

/// Pieces of equipment of one overlay.
const MAX_EQUIPMENT: usize = 10_000;
/// Mean air pressure at sea level (ISO 2533), MPa.
const ATMOSPHERE: f64 = 0.101_325;

/// Settings of the overlay: compartments whose pressure and gas temperature (°C) are bound to
/// them in the roles `sf6_pressure` and `sf6_temperature`. Pressures are those at 20 °C.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Ids of the equipment that states are shown at.
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
    /// Pressure of a filled compartment.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub filling: f64,
    /// At this pressure and below it an alarm is due; less than `filling`.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub alarm: f64,
    /// At this pressure and below it a breaker must not switch; less than `alarm`.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub lock_out: f64,
    /// Unit of all pressures, tags included.
    #[serde(default)]
    pub unit: PressureUnit,
    /// Whether all pressures are above that of the air, as gauges show them.
    #[serde(default)]
    pub gauge: bool,
    /// How pressure follows temperature.
    #[serde(default)]
    pub equation: EquationOfState,
    /// Hours over which the loss of gas is worked out.
    #[serde(default = "default_trend_hours")]
    #[schemars(range(min = 0.01, max = 87_660.0))]
    pub trend_hours: f64,
}

/// Unit of pressures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
pub enum PressureUnit {
    /// 0.1 MPa.
    #[default]
    #[serde(rename = "bar")]
    Bar,
    /// Megapascal.
    #[serde(rename = "MPa")]
    Mpa,
}

/// A month: losses below a percent a year drown in what the weather does in less.
fn default_trend_hours() -> f64 {
    730.5
}

impl Settings {
    /// What makes no sense, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let Self { filling, alarm, lock_out, trend_hours, .. } = *self;
        if self.equipment.len() > MAX_EQUIPMENT {
            return Some(format!("name at most {MAX_EQUIPMENT} pieces of equipment"));
        }
        if !(0.0 < lock_out && lock_out < alarm && alarm < filling && filling <= 30.0) {
            return Some(format!(
                "lock_out {lock_out}, alarm {alarm} and filling {filling} must rise in this order"
            ));
        }
        let hours = (0.01..=87_660.0).contains(&trend_hours);
        (!hours).then(|| format!("trend_hours is {trend_hours}: give 0.01 to 87660"))
    }

    /// A pressure as it would be at 20 °C, in the same unit.
    pub(crate) fn at_20(&self, pressure: f64, celsius: f64) -> Option<f64> {
        let unit = match self.unit {
            PressureUnit::Bar => 0.1,
            PressureUnit::Mpa => 1.0,
        };
        let air = if self.gauge { ATMOSPHERE } else { 0.0 };
        let normalised = self.equation.at_reference(pressure * unit + air, celsius)?;
        Some((normalised - air) / unit)
    }
}
