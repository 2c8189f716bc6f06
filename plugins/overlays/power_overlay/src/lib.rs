//! Live values as labels at the equipment, colour for the abnormal, and a verdict on every
//! piece of equipment by the limits of its tags.

mod format;
mod pieces;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Overlay, OverlayFrame, Plugin, Severity, TagValue,
};
use pieces::Piece;

/// Settings of the overlay.
#[derive(Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Settings {
    /// Colours equipment with a value outside its normal band.
    tint: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { tint: true }
    }
}

struct PowerOverlay {
    settings: Settings,
    bindings: Vec<Binding>,
    pieces: Vec<Piece>,
}

impl Plugin for PowerOverlay {
    const ID: &'static str = "power_overlay";
    const NAME: &'static str = "Power overlay";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Live values at the equipment; colour for the abnormal.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        Ok(Self { settings, bindings: Vec::new(), pieces: Vec::new() })
    }
}

impl Overlay for PowerOverlay {
    fn describe(&self) -> Description {
        Description {
            equipment: self.pieces.iter().map(|piece| piece.id.clone()).collect(),
            findings: pieces::findings(&self.bindings),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.pieces = pieces::pieces(&bindings);
        self.bindings = bindings;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        for (index, (binding, tag)) in self.bindings.iter().zip(&values).enumerate() {
            let value = tag.value.as_ref();
            let severity = value.map_or(Severity::Normal, |value| pieces::severity(binding, value));
            let text = format::value(value, &binding.unit);
            canvas.line(index, binding.node, severity, &binding.tag_name, &text)?;
            if self.settings.tint && severity > Severity::Normal {
                canvas.tint(index, binding.node, severity)?;
            }
        }
        for (equipment, piece) in self.pieces.iter().enumerate() {
            piece.judge(equipment, (&self.bindings, &values), canvas)?;
        }
        Ok(())
    }
}

busbar_plugin_sdk::export_plugin!(PowerOverlay: overlay);
