//! Condition monitoring: quantities against a threshold of attention and one of alarm,
//! such as arrester currents, partial discharge, loss factors, core currents.

mod judging;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Quality, Severity, TagValue,
};
use judging::{Piece, Watched};
pub use settings::{QuantitySettings, Settings, Side};

const ATTENTION: [u8; 3] = [0xc9, 0xa2, 0x27];
const ALARM: [u8; 3] = [0xc0, 0x22, 0x2b];

/// Overlay of monitored quantities.
pub struct Condition {
    settings: Settings,
    watched: Vec<Watched>,
    /// Equipment of the settings, then what else tags in the roles are bound to.
    pieces: Vec<Piece>,
    findings: Vec<String>,
}

impl Plugin for Condition {
    const ID: &'static str = "condition";
    const NAME: &'static str = "Condition";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Monitored quantities against attention and alarm.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let pieces = judging::pieces(&settings, &[], &mut Vec::new());
        Ok(Self { settings, watched: Vec::new(), pieces, findings: Vec::new() })
    }
}

impl Overlay for Condition {
    fn describe(&self) -> Description {
        let entries = |of: &QuantitySettings| {
            let entry = |what: &str, color, pattern| LegendEntry {
                name: format!("{} {what}", of.name),
                color,
                pattern,
            };
            [
                entry("attention", ATTENTION, Pattern::Dotted),
                entry("alarm", ALARM, Pattern::Crossed),
            ]
        };
        Description {
            legend: self.settings.quantities.iter().flat_map(entries).collect(),
            equipment: self.pieces.iter().map(|piece| piece.id.clone()).collect(),
            findings: self.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        (self.watched, self.findings) = judging::watch(&self.settings, &bindings);
        self.pieces = judging::pieces(&self.settings, &self.watched, &mut self.findings);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        // Of what is wrong at a piece of equipment, the worst shows: it comes last.
        let mut shown: Vec<(Severity, usize, usize, usize)> = Vec::new();
        for watched in &self.watched {
            let of = &self.settings.quantities[watched.quantity];
            let tag = &values[watched.binding];
            let value = watched.value(tag).ok();
            let severity = value.map_or(Severity::Normal, |value| of.judge(value));
            let is_listed = self.pieces[watched.piece].is_listed;
            // The host shows as unknown what rests on a value that is not good.
            if is_listed && (severity > Severity::Normal || tag.quality != Quality::Good) {
                let entry = 2 * watched.quantity + usize::from(severity == Severity::Alarm);
                shown.push((severity, watched.binding, watched.piece, entry));
            }
            if let (Some(value), true) = (value, severity > Severity::Normal) {
                let text = judging::number(value, &watched.unit);
                canvas.line(watched.binding, watched.node, severity, &of.name, &text)?;
            }
        }
        shown.sort_by_key(|(severity, ..)| *severity);
        for (_, binding, equipment, entry) in shown {
            canvas.state(binding, equipment, entry)?;
        }
        for (equipment, piece) in self.pieces.iter().enumerate() {
            let quantities = &self.settings.quantities;
            piece.judge(equipment, (&self.watched, quantities), &values, canvas)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(Condition: overlay);

#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
