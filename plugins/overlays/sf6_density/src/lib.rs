//! SF6 density of gas compartments, as the pressure that it has at 20 °C: against the
//! thresholds for alarm and lock-out, and how fast it falls.

mod assessment;
mod compartments;
mod equation_of_state;
mod gas_state;
mod kept_trends;
mod mixture;
mod outcome;
mod piece_verdicts;
mod readings;
mod settings;
mod theil_sen;
mod trend;

use std::collections::HashMap;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    TagValue, Verdict,
};
pub use equation_of_state::{
    EquationOfState, REFERENCE, ZERO_CELSIUS, air_pressure, pressure, vapor_pressure,
    virial_density,
};
pub use mixture::MixtureSettings;
pub use settings::{PressureUnit, Settings};
pub use trend::{Loss, Sample, Trend};

use assessment::assess;
use compartments::{Compartment, Layout, layout};
use gas_state::GasModel;
use kept_trends::KeptTrends;
use outcome::{Outcome, judge};
use piece_verdicts::{SensorVerdict, give_verdicts};
use readings::{Neighbors, PressureReading, read_contacts, read_pressure};

/// Trends worked out in one frame: each takes some 0.1 ms, once a day.
const MAX_TRENDS_A_FRAME: usize = 16;
/// Error of the compensation, % a kelvin of drift: of sensors, and of a temperature that is
/// not quite that of the gas.
const COMPENSATION_ERROR: f64 = 0.01;

/// Overlay of gas densities.
pub struct Sf6Density {
    settings: Settings,
    gas: GasModel,
    /// Gas of a filled compartment, in the quantity that losses are shares of.
    filling: Option<f64>,
    layout: Layout,
    /// Trends of the compartments, in their order.
    trends: Vec<(TrendKey, Trend)>,
    kept: Option<KeptTrends>,
}

/// Place and tags that a trend is of: it stays for as long as these do.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct TrendKey([String; 3]);

impl TrendKey {
    fn equipment(&self) -> &str {
        &self.0[0]
    }

    fn new(compartment: &Compartment) -> Self {
        let tag = |input: &Option<compartments::Input>| {
            input.as_ref().map_or_else(String::new, |input| input.tag_id.clone())
        };
        Self([
            compartment.node_id.clone(),
            tag(&compartment.pressure),
            tag(&compartment.temperature),
        ])
    }
}

impl Plugin for Sf6Density {
    const ID: &'static str = "sf6_density";
    const NAME: &'static str = "SF6 density";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "SF6 density at 20 °C against alarm and lock-out, and its loss a year.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let gas = settings.gas().map_err(Error::settings)?;
        let filling = gas.quantity(settings.absolute(settings.filling), 20.0);
        let mut layout = layout(&settings, gas.assumption(), &[]);
        // No bindings came yet that anything could be found of.
        layout.findings.clear();
        let kept = KeptTrends::new(&settings, filling, host);
        Ok(Self { settings, gas, filling, layout, trends: Vec::new(), kept })
    }
}

impl Overlay for Sf6Density {
    fn describe(&self) -> Description {
        let entry = |name: &str, color, pattern| LegendEntry { name: name.into(), color, pattern };
        Description {
            legend: vec![
                entry("SF6 low", [0xd9, 0x8a, 0x1c], Pattern::Striped),
                entry("SF6 lock-out", [0xc0, 0x22, 0x2b], Pattern::Crossed),
                entry("SF6 attention", [0xc9, 0xa2, 0x27], Pattern::Dotted),
            ],
            equipment: self.layout.equipment.clone(),
            findings: self.layout.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.layout = layout(&self.settings, self.gas.assumption(), &bindings);
        let mut before: HashMap<TrendKey, Trend> =
            std::mem::take(&mut self.trends).into_iter().collect();
        let new = || Trend::new(self.settings.trend_days * 86_400.0, COMPENSATION_ERROR);
        let trend = |compartment: &Compartment| {
            let key = TrendKey::new(compartment);
            let trend = before.remove(&key).unwrap_or_else(new);
            (key, trend)
        };
        self.trends = self.layout.compartments.iter().map(trend).collect();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        if let Some(kept) = &mut self.kept {
            kept.restore(frame.unix_nanos(), &mut self.trends);
        }
        let Self { settings, gas, filling, layout, trends, kept } = self;
        let neighbors = Neighbors::new(settings, &layout.compartments, &values);
        let mut verdicts = Vec::with_capacity(layout.compartments.len());
        let mut updates_left = MAX_TRENDS_A_FRAME;
        for (compartment, (_, trend)) in layout.compartments.iter().zip(&mut *trends) {
            let temperature = neighbors.temperature(settings, compartment, &values);
            let pressure = read_pressure(settings, compartment, &values);
            let assessment = pressure
                .as_ref()
                .map_err(String::clone)
                .and_then(|pressure| assess(settings, gas, pressure.range, temperature.range));
            let reading = pressure
                .as_ref()
                .ok()
                .filter(|_| assessment.as_ref().is_ok_and(|assessment| assessment.is_exact));
            let celsius = temperature.range.low;
            let quantity = reading.and_then(|of| gas.quantity(of.range.low, celsius));
            if let Some((quantity, filling)) = quantity.zip(*filling) {
                let percent = 100.0 * quantity / filling;
                trend.follow_origin(compartment.origin(&values));
                trend.push(frame.unix_nanos(), Sample { percent, celsius });
            }
            if trend.is_due() && updates_left > 0 {
                updates_left -= 1;
                trend.update();
            }
            let loss = trend.loss();
            let contact = read_contacts(&compartment.contacts, &values);
            let doubt = temperature.doubt.as_deref();
            let doubt = pressure.as_ref().ok().and_then(|of| of.doubt.as_deref()).or(doubt);
            let doubt = doubt.filter(|_| pressure.is_ok());
            let outcome = judge(settings, &assessment, contact, loss, doubt);
            let is_exact = temperature.doubt.is_none();
            let pressure = pressure.as_ref().ok();
            verdicts.push(show(compartment, (&outcome, pressure, is_exact), canvas)?);
        }
        if let Some(kept) = kept {
            kept.save(trends);
        }
        give_verdicts(&verdicts, canvas)
    }
}

impl Drop for Sf6Density {
    fn drop(&mut self) {
        if let Some(kept) = &mut self.kept {
            kept.close(&self.trends);
        }
    }
}

/// Shows state and label of a compartment where it is abnormal; returns the verdict on it.
fn show(
    compartment: &Compartment,
    (outcome, pressure, has_temperature): (&Outcome, Option<&PressureReading>, bool),
    canvas: &mut Canvas<'_>,
) -> Result<SensorVerdict, Error> {
    let temperature = compartment.temperature.as_ref().filter(|_| has_temperature);
    let air = compartment.air.iter().filter(|_| {
        compartment.is_gauge
            && pressure.is_some_and(|of| of.assumption.is_empty() && of.doubt.is_none())
    });
    let inputs = compartment.pressure.iter().chain(temperature).chain(air);
    let mut rests_on: Vec<usize> = inputs.map(|input| input.binding).collect();
    match outcome.contact {
        Some(contact) => rests_on = vec![contact],
        None if outcome.verdict == Verdict::Normal => rests_on.extend(&compartment.contacts),
        None => {}
    }
    if outcome.verdict == Verdict::Unknown {
        rests_on.clear();
    }
    let more = pressure.map_or("", |pressure| pressure.assumption);
    let assumption = match (compartment.assumption.as_str(), more) {
        (assumption, "") => assumption.to_owned(),
        ("", more) => more.to_owned(),
        (assumption, more) => format!("{assumption}, {more}"),
    };
    if let Some((entry, severity)) = outcome.shown {
        canvas.state_on(rests_on.iter().copied(), compartment.equipment, entry)?;
        if let Some(binding) = rests_on.first() {
            let caption = "SF6 at 20 °C";
            canvas.line(*binding, compartment.node, severity, caption, &outcome.text)?;
        }
    }
    Ok(SensorVerdict {
        equipment: compartment.equipment,
        verdict: outcome.verdict,
        severity: outcome.severity,
        reason: outcome.reason.clone(),
        assumption: if outcome.contact.is_some() { String::new() } else { assumption },
        rests_on,
    })
}

busbar_plugin_sdk::export_plugin!(Sf6Density: overlay);

#[cfg(test)]
mod kept_trend_tests;
#[cfg(test)]
mod leak_tests;
#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
