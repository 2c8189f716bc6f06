//! Settings of the overlay: compartments, thresholds, gas, and what bounds the inputs.

use busbar_plugin_sdk::state_file_fault;

use crate::equation_of_state::EquationOfState;
use crate::gas_state::GasModel;
use crate::mixture::{Mixture, MixtureSettings};

/// Pieces of equipment of one overlay.
pub(crate) const MAX_EQUIPMENT: usize = 10_000;
/// Air pressure that gauge pressures of thresholds are above (IEC 62271-1:2017, 3.6.6), MPa.
pub(crate) const SEA_LEVEL: f64 = 0.101_3;
/// Loss of closed pressure systems that a compartment is allowed, % of the filling a year
/// (IEC 62271-203:2011, 5.15.101; IEC 62271-1:2017, 6.16.3).
const LEAK_LIMIT: f64 = 0.5;
/// Temperatures that gas of switchgear has: the coldest ambient of IEC 62271-1:2017, 4.1.4,
/// and an enclosure in the sun, °C.
const TEMPERATURE_RANGE: [f64; 2] = [-60.0, 85.0];
/// Distance of a gas temperature from the median of the others that is believed, K.
const TEMPERATURE_SPREAD: f64 = 25.0;
/// Digits behind the point that pressures are shown with at most.
const MAX_DIGITS: usize = 4;

/// Settings of the overlay: compartments whose pressure and gas temperature are bound to
/// them in the roles `sf6_pressure` and `sf6_temperature`. Thresholds are pressures at
/// 20 °C. Optional roles: `air_pressure` (of the place, not reduced to sea level) and
/// `density_contact` (true is alarm).
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Ids of the equipment that is judged; equipment that has a tag in a role of this
    /// overlay is judged as well.
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
    /// Pressure of a filled compartment.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub filling: f64,
    /// At this pressure and below it an alarm is due, in the digits shown; less than
    /// `filling`.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub alarm: f64,
    /// At this pressure and below it a breaker must not switch; less than `alarm`.
    #[schemars(range(min = 0.01, max = 30.0))]
    pub lock_out: f64,
    /// Unit of the pressures of these settings, and of tags that have no unit.
    #[serde(default)]
    pub unit: PressureUnit,
    /// Takes pressures of these settings as above 101.3 kPa, as gauges at sea level show
    /// them, and tags' as above the local air, unless their unit says otherwise: `bar(g)`,
    /// `bar(a)`.
    #[serde(default)]
    pub gauge: bool,
    /// Equation that pure SF6 is taken to obey; a `mixture` has isochores instead.
    #[serde(default)]
    pub equation: EquationOfState,
    /// Days over which the loss of gas is worked out, in whole days from 2 on.
    #[serde(default = "default_trend_days")]
    #[schemars(range(min = 0.0005, max = 3_652.5))]
    #[schemars(extend("x-busbar-formerly" = ["trend_hours"]))]
    pub trend_days: f64,
    /// Loss that is abnormal, % of the filling a year, of mass for SF6 and of pressure at
    /// 20 °C for mixtures. It is told once it is certain at 95 %.
    #[serde(default = "default_leak_limit")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub leak_limit: f64,
    /// Altitude of the station, m, by which the air pressure is worked out where no tag in
    /// the role `air_pressure` has it (ISO 2533); sea level is assumed without.
    #[serde(default)]
    #[schemars(range(min = -500.0, max = 9000.0))]
    pub altitude_metres: Option<f64>,
    /// Temperatures of gas that are believed, °C.
    #[serde(default = "default_temperature_range")]
    pub temperature_range: [f64; 2],
    /// Distance of a gas temperature from the median of the other compartments' that is
    /// believed, K.
    #[serde(default = "default_temperature_spread")]
    #[schemars(range(min = 1.0, max = 200.0))]
    pub temperature_spread: f64,
    /// Gas other than pure SF6, by its maker's isochores.
    #[serde(default)]
    pub mixture: Option<MixtureSettings>,
    /// Ids of equipment that is known to have no telemetry: it is shown as unknown, and
    /// `busbar check` does not ask for its tags.
    #[serde(default)]
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub untelemetered: Vec<String>,
    /// File that keeps the trends of gas across restarts: an absolute path, or one that
    /// `${folder}/` begins for the folder of the configuration.
    #[serde(default)]
    pub state_file: Option<String>,
}

/// Unit of the pressures of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
pub enum PressureUnit {
    /// Bar, which is 0.1 MPa.
    #[default]
    #[serde(rename = "bar")]
    Bar,
    /// Megapascal, the unit of computation.
    #[serde(rename = "MPa")]
    Mpa,
}

impl PressureUnit {
    /// Symbol of the unit.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Bar => "bar",
            Self::Mpa => "MPa",
        }
    }

    /// Returns the megapascals of one unit.
    pub fn megapascals(self) -> f64 {
        match self {
            Self::Bar => 0.1,
            Self::Mpa => 1.0,
        }
    }
}

/// A month: losses below a percent a year drown in what the weather does in less.
fn default_trend_days() -> f64 {
    30.4375
}

fn default_leak_limit() -> f64 {
    LEAK_LIMIT
}

fn default_temperature_range() -> [f64; 2] {
    TEMPERATURE_RANGE
}

fn default_temperature_spread() -> f64 {
    TEMPERATURE_SPREAD
}

impl Settings {
    /// Finds the first fault of the settings, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let Self { filling, alarm, lock_out, .. } = *self;
        if self.equipment.len().max(self.untelemetered.len()) > MAX_EQUIPMENT {
            return Some(format!("name at most {MAX_EQUIPMENT} pieces of equipment"));
        }
        if !(0.0 < lock_out && lock_out < alarm && alarm < filling && filling <= 30.0) {
            return Some(format!(
                "lock_out {lock_out}, alarm {alarm} and filling {filling} must rise in this order"
            ));
        }
        if let Some(fault) = self.state_file.as_deref().and_then(state_file_fault) {
            return Some(fault);
        }
        let [coldest, hottest] = self.temperature_range;
        if !(-100.0 <= coldest && coldest < hottest && hottest <= 200.0) {
            return Some(format!(
                "temperature_range is [{coldest}, {hottest}]: give two °C from -100 to 200 that \
                 rise"
            ));
        }
        let ranges = [
            ("trend_days", Some(self.trend_days), 0.0005..=3_652.5),
            ("leak_limit", Some(self.leak_limit), 0.01..=100.0),
            ("altitude_metres", self.altitude_metres, -500.0..=9000.0),
            ("temperature_spread", Some(self.temperature_spread), 1.0..=200.0),
        ];
        ranges.into_iter().find_map(|(name, value, range)| {
            let value = value.filter(|value| !range.contains(value))?;
            Some(format!("{name} is {value}: give {} to {}", range.start(), range.end()))
        })
    }

    /// Gas that the settings name.
    ///
    /// # Errors
    /// Fault of the mixture, in words.
    pub(crate) fn gas(&self) -> Result<GasModel, String> {
        let Some(mixture) = &self.mixture else { return Ok(GasModel::Sf6(self.equation)) };
        let filling = self.absolute(self.filling);
        Mixture::new(mixture, |pressure| self.absolute(pressure), filling).map(GasModel::Mixture)
    }

    /// Absolute pressure, MPa, of a pressure of the settings.
    pub(crate) fn absolute(&self, pressure: f64) -> f64 {
        let air = if self.gauge { SEA_LEVEL } else { 0.0 };
        pressure * self.unit.megapascals() + air
    }

    /// Pressure of the settings' kind of an absolute pressure, MPa.
    pub(crate) fn relative(&self, megapascals: f64) -> f64 {
        let air = if self.gauge { SEA_LEVEL } else { 0.0 };
        (megapascals - air) / self.unit.megapascals()
    }

    /// Digits behind the point that pressures are shown with: two of bar, three of MPa, more
    /// where a threshold has more.
    pub(crate) fn digits(&self) -> usize {
        let least = match self.unit {
            PressureUnit::Bar => 2,
            PressureUnit::Mpa => 3,
        };
        let is_exact = |digits: &usize| {
            let scale = 10_f64.powi(*digits as i32);
            let rest = |value: f64| (value * scale - (value * scale).round()).abs();
            rest(self.alarm) < 1e-6 && rest(self.lock_out) < 1e-6
        };
        (least..MAX_DIGITS).find(is_exact).unwrap_or(MAX_DIGITS)
    }
}
