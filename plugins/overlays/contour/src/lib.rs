//! Contour: levels of one quantity at equipment, whose course over the ground the host
//! works out and draws; a verdict on each piece by the normal band.

mod levels;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Overlay, OverlayFrame, Plugin, TagValue,
};
use levels::Piece;
pub use settings::Settings;

/// Overlay of a contour.
pub struct Contour {
    settings: Settings,
    pieces: Vec<Piece>,
    findings: Vec<String>,
}

impl Plugin for Contour {
    const ID: &'static str = "contour";
    const NAME: &'static str = "Contour";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "The course of a quantity over the ground.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let (pieces, _) = levels::pieces(&settings, &[]);
        Ok(Self { settings, pieces, findings: Vec::new() })
    }
}

impl Overlay for Contour {
    fn describe(&self) -> Description {
        let Settings { name, unit, reach_metres, low, high, step, .. } = &self.settings;
        Description {
            equipment: self.pieces.iter().map(|piece| piece.id.clone()).collect(),
            contour: Some(busbar_plugin_sdk::Contour {
                name: name.clone(),
                unit: unit.clone(),
                reach_metres: *reach_metres,
                low: *low,
                high: *high,
                step: *step,
            }),
            starts_hidden: !self.settings.shown,
            findings: self.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        (self.pieces, self.findings) = levels::pieces(&self.settings, &bindings);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        for (equipment, piece) in self.pieces.iter().enumerate() {
            for level in &piece.levels {
                if let Some(value) = level.drawn(&values[level.binding]) {
                    canvas.level(level.binding, equipment, value)?;
                }
            }
            piece.judge(equipment, &self.settings, &values, canvas)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(Contour: overlay);

#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
