//! Top-oil and hot-spot temperatures of transformers from their load, by IEC 60076-7, with
//! the loss of life of their paper. What nobody saw is kept between bounds.

mod ageing;
mod assessment;
mod input_search;
mod inputs;
mod interval;
mod loss_of_life;
mod model;
mod operating_point;
mod ratings;
mod settings;
mod settings_faults;
mod temperature_band;
mod thermal_constants;
mod transformer;

use std::collections::{BTreeMap, HashMap};
use std::time::{Duration, Instant};

pub use ageing::Oxygen;
use busbar_plugin_sdk::{
    Basis, Binding, Canvas, Description, Error, Host, Judgment, LogLevel, Overlay, OverlayFrame,
    Plugin, Severity, StateFile, StateFileLayout, TagValue,
};
pub use model::{Parameters, Temperatures};
pub use settings::{
    Cooling, Loading, Settings, Size, StageSettings, TapSettings, TransformerSettings,
};

use crate::assessment::{Assessment, Estimate, degrees, per_unit};
use crate::inputs::Inputs;
use crate::transformer::{Entry, Transformer};

/// Wall-clock time between two writings of the states.
const SAVE_INTERVAL: Duration = Duration::from_secs(60);

/// Layout of the file that keeps the states of all transformers.
const STATE_FILE: StateFileLayout = StateFileLayout {
    version: 1,
    key: "transformers",
    max_bytes: 8 << 20,
    subject: "temperatures",
};

/// Overlay of transformer temperatures.
pub struct TransformerThermal {
    settings: Settings,
    transformers: Vec<Transformer>,
    states: Option<StateFile<Entry>>,
    /// States of the file that no frame has taken yet.
    restored: HashMap<String, Entry>,
    last_save: Instant,
    has_drawn: bool,
    host: Host,
}

impl Plugin for TransformerThermal {
    const ID: &'static str = "transformer_thermal";
    const NAME: &'static str = "Transformer temperatures";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Top-oil and hot-spot temperatures of transformers from their load, by IEC 60076-7.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let states =
            settings.state_file.as_ref().map(|file| StateFile::new(file, STATE_FILE, host.clone()));
        let restored = states.as_ref().map(StateFile::read).unwrap_or_default();
        let transformers =
            settings.transformers.iter().map(|of| Transformer::new(of, &settings)).collect();
        Ok(Self {
            settings,
            transformers,
            states,
            restored,
            last_save: Instant::now(),
            has_drawn: false,
            host,
        })
    }
}

impl Overlay for TransformerThermal {
    fn describe(&self) -> Description {
        let of_inputs = |of: &Transformer| of.inputs.findings.clone();
        Description {
            equipment: self.settings.transformers.iter().map(|of| of.equipment.clone()).collect(),
            findings: self.transformers.iter().flat_map(of_inputs).collect(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let (_, ambient) = self.settings.fixed_ambient();
        for (transformer, settings) in self.transformers.iter_mut().zip(&self.settings.transformers)
        {
            let inputs = Inputs::new(settings, &bindings);
            let mut assumptions = settings.assumptions();
            assumptions.extend(ambient.clone().filter(|_| inputs.ambient.is_none()));
            assumptions.extend(inputs.assumptions.iter().cloned());
            transformer.bind(inputs, &assumptions);
        }
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let now = frame.unix_nanos();
        self.restore(now);
        self.has_drawn = true;
        let settings = &self.settings.transformers;
        for (index, (transformer, settings)) in
            self.transformers.iter_mut().zip(settings).enumerate()
        {
            draw_transformer(index, transformer, settings, now, &values, canvas)?;
        }
        if self.last_save.elapsed() >= SAVE_INTERVAL {
            self.last_save = Instant::now();
            let entries = self.entries();
            if let Some(states) = &mut self.states {
                states.write(entries);
            }
        }
        Ok(())
    }
}

impl TransformerThermal {
    /// Takes the states of the file that are of these parameters and not of a time to come.
    fn restore(&mut self, now: i64) {
        if self.restored.is_empty() {
            return;
        }
        let mut restored = std::mem::take(&mut self.restored);
        for (transformer, settings) in self.transformers.iter_mut().zip(&self.settings.transformers)
        {
            let Some(entry) = restored.remove(&settings.equipment) else { continue };
            let refusal = match () {
                () if entry.parameters != transformer.fingerprint() => "of other parameters",
                () if entry.state.unix_nanos > now => "of a time that is still to come",
                () => {
                    transformer.state = Some(entry.state);
                    continue;
                }
            };
            let equipment = &settings.equipment;
            let words = format!(
                "the state that was kept of '{equipment}' is {refusal}; its temperatures begin anew"
            );
            self.host.log(LogLevel::Warning, &words);
        }
    }

    fn entries(&self) -> BTreeMap<String, Entry> {
        let entry = |(transformer, settings): (&Transformer, &TransformerSettings)| {
            let parameters = transformer.fingerprint();
            Some((settings.equipment.clone(), Entry { parameters, state: transformer.state? }))
        };
        self.transformers.iter().zip(&self.settings.transformers).filter_map(entry).collect()
    }
}

impl Drop for TransformerThermal {
    /// Keeps the states, unless the settings were only tried.
    fn drop(&mut self) {
        let entries = self.entries();
        if let Some(states) = self.states.as_mut().filter(|_| self.has_drawn) {
            states.close(&entries);
        }
    }
}

/// Draws and judges one transformer.
fn draw_transformer(
    index: usize,
    transformer: &mut Transformer,
    settings: &TransformerSettings,
    now: i64,
    values: &[TagValue],
    canvas: &mut Canvas<'_>,
) -> Result<(), Error> {
    if settings.untelemetered {
        let unknown = Judgment::unknown("declared untelemetered");
        return canvas.judge(index, Basis::NONE, &unknown);
    }
    let (point, estimate) = transformer.advance(now, settings, values);
    let cause = transformer.last_doubt.as_str();
    let assessment = Assessment::new(&estimate, &point, settings, &transformer.inputs, cause);
    let basis = canvas.basis(point.used.iter().copied())?;
    let is_good = estimate.hot_spot.width() <= assessment::GOOD_WIDTH;
    let assumption = transformer.assumption(is_good || settings.plausible_load.is_some());
    let judgment = Judgment {
        verdict: assessment.verdict,
        severity: assessment.severity,
        reason: &assessment.reason,
        assumption: &assumption,
    };
    canvas.judge(index, basis, &judgment)?;
    let Some((node, binding)) = transformer.inputs.label else { return Ok(()) };
    let label = Label { node, binding: point.weakest_binding(&transformer.inputs, binding) };
    label.temperatures(&estimate, &assessment, canvas)?;
    label.ageing(transformer, &estimate, canvas)?;
    let [_, _, severity] = assessment.severities;
    label.line(canvas, severity, "Load", &per_unit(point.load))
}

/// Place of a transformer's lines.
struct Label {
    node: u32,
    binding: usize,
}

impl Label {
    fn line(
        &self,
        canvas: &mut Canvas<'_>,
        severity: Severity,
        caption: &str,
        text: &str,
    ) -> Result<(), Error> {
        canvas.line(self.binding, self.node, severity, caption, text)
    }

    fn temperatures(
        &self,
        estimate: &Estimate,
        assessment: &Assessment,
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        let source = |is_measured| if is_measured { "measured" } else { "model" };
        let top_oil = format!("Top oil ({})", source(estimate.is_top_oil_measured));
        let hot_spot = format!("Hot spot ({})", source(estimate.is_hot_spot_measured));
        let [oil_severity, winding_severity, _] = assessment.severities;
        for (caption, value, severity) in [
            (top_oil, estimate.top_oil, oil_severity),
            (hot_spot, estimate.hot_spot, winding_severity),
        ] {
            self.line(canvas, severity, &caption, &degrees(value))?;
            if severity > Severity::Normal {
                canvas.tint(self.binding, self.node, severity)?;
            }
        }
        Ok(())
    }

    fn ageing(
        &self,
        transformer: &Transformer,
        estimate: &Estimate,
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        let paper = &transformer.paper;
        let assumed = if paper.is_assumed_dry() { " (dry, oxygen-free paper assumed)" } else { "" };
        let rate = estimate.hot_spot.map(|degrees| paper.ageing_rate(degrees));
        let rate = match estimate.hot_spot.width() <= assessment::GOOD_WIDTH {
            true => format!("× {:.2}", paper.ageing_rate(estimate.hot_spot.middle())),
            false => format!("× {:.2} to × {:.2}", rate.low, rate.high),
        };
        self.line(canvas, Severity::Normal, "Ageing", &format!("{rate}{assumed}"))?;
        let Some(life) = transformer.state.map(|state| state.life) else { return Ok(()) };
        let hours = match life.hours.width() < 0.1 {
            true => format!("{:.1} h", life.hours.middle()),
            false => format!("between {:.1} and {:.1} h", life.hours.low, life.hours.high),
        };
        let text = format!("{hours} in {:.1} h", life.counted_hours);
        self.line(canvas, Severity::Normal, "Loss of life", &text)
    }
}

busbar_plugin_sdk::export_plugin!(TransformerThermal: overlay);

#[cfg(test)]
mod tests;
