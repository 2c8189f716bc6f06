//! SF6 density of gas compartments, as the pressure that it has at 20 °C: against the
//! thresholds for alarm and lock-out, and how fast it falls.

mod gas;
mod settings;
mod trend;

use std::collections::HashMap;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Quality, Severity, TagValue,
};
pub use gas::{EquationOfState, REFERENCE, pressure};
pub use settings::{PressureUnit, Settings};
pub use trend::Trend;

/// Role of a tag that is a compartment's pressure.
const PRESSURE: &str = "sf6_pressure";
/// Role of a tag that is the temperature of its gas.
const TEMPERATURE: &str = "sf6_temperature";
/// Entries of the legend.
const ALARM: usize = 0;
const LOCK_OUT: usize = 1;
/// A loss that is told as more than this: no compartment loses so much slowly.
const MAX_TOLD_PERCENT: f64 = 100.0;

/// The overlay.
pub struct Sf6Density {
    settings: Settings,
    compartments: Vec<Compartment>,
    /// Equipment of the description, by which states are named.
    equipment: Vec<String>,
}

/// A gas compartment: the equipment that pressure and temperature are bound to.
struct Compartment {
    node: u32,
    equipment: Option<usize>,
    pressure: usize,
    temperature: usize,
    trend: Trend,
}

impl Plugin for Sf6Density {
    const ID: &'static str = "sf6_density";
    const NAME: &'static str = "SF6 density";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "SF6 density at 20 °C against alarm and lock-out, and its loss a year.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let equipment = settings.equipment.clone();
        Ok(Self { settings, compartments: Vec::new(), equipment })
    }
}

impl Overlay for Sf6Density {
    fn describe(&self) -> Description {
        let entry = |name: &str, color, pattern| LegendEntry { name: name.into(), color, pattern };
        Description {
            legend: vec![
                entry("SF6 low", [0xd9, 0x8a, 0x1c], Pattern::Striped),
                entry("SF6 lock-out", [0xc0, 0x22, 0x2b], Pattern::Crossed),
            ],
            equipment: self.equipment.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let in_role = |role| {
            let bindings = bindings.iter().enumerate();
            bindings.filter(move |(_, binding)| binding.role == role)
        };
        let temperatures: HashMap<&str, usize> =
            in_role(TEMPERATURE).map(|(index, of)| (of.node_id.as_str(), index)).collect();
        let described: HashMap<&str, usize> =
            self.equipment.iter().zip(0..).map(|(id, index)| (id.as_str(), index)).collect();
        let compartment = |(pressure, binding): (usize, &Binding)| {
            Some(Compartment {
                node: binding.node,
                equipment: described.get(binding.node_id.as_str()).copied(),
                pressure,
                temperature: *temperatures.get(binding.node_id.as_str())?,
                trend: Trend::new(self.settings.trend_hours * 3600.0),
            })
        };
        self.compartments = in_role(PRESSURE).filter_map(compartment).collect();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let settings = &self.settings;
        for compartment in &mut self.compartments {
            let Compartment { node, equipment, pressure, temperature, .. } = *compartment;
            // It rests on the worse of the two.
            let is_bad = |index: &usize| values[*index].quality != Quality::Good;
            let rests_on = Some(temperature).filter(is_bad).unwrap_or(pressure);
            let [read, celsius] = [pressure, temperature].map(|index| values[index].good_number());
            let Some(normalised) = read.zip(celsius).and_then(|(p, t)| settings.at_20(p, t)) else {
                // The host shows as unknown what rests on a value that is not good.
                if let (Some(equipment), true) = (equipment, is_bad(&rests_on)) {
                    canvas.state_on([pressure, temperature], equipment, ALARM)?;
                }
                continue;
            };
            compartment.trend.push(frame.unix_nanos(), normalised);
            let (entry, severity) = match normalised {
                p if p <= settings.lock_out => (LOCK_OUT, Severity::Alarm),
                p if p <= settings.alarm => (ALARM, Severity::Warning),
                _ => continue,
            };
            if let Some(equipment) = equipment {
                canvas.state_on([pressure, temperature], equipment, entry)?;
            }
            let loss = compartment.trend.percent_a_year(settings.filling);
            let text = words(normalised, settings.unit, loss);
            canvas.line(rests_on, node, severity, "SF6 at 20 °C", &text)?;
        }
        Ok(())
    }
}

/// The pressure, and its loss where it is known.
fn words(pressure: f64, unit: PressureUnit, loss: Option<f64>) -> String {
    let pressure = match unit {
        PressureUnit::Bar => format!("{pressure:.2} bar"),
        PressureUnit::Mpa => format!("{pressure:.3} MPa"),
    };
    match loss {
        None => pressure,
        Some(loss) if loss > MAX_TOLD_PERCENT => format!("{pressure}, falling fast"),
        Some(loss) => format!("{pressure}, {loss:.1} %/a lost"),
    }
}

busbar_plugin_sdk::export_plugin!(Sf6Density: overlay);

#[cfg(test)]
mod tests;
