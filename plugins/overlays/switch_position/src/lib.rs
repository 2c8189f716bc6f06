//! Switch positions: double points (IEC 61850-7-3) as positions that the host shows by moving
//! blades and flags, and a verdict on each switch.

mod motion;
mod settings;
mod switches;
mod travel;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, Judgment, Overlay, OverlayFrame, Plugin, TagValue,
    Value, Verdict, VerdictSeverity,
};
pub use settings::{Settings, SwitchSettings};
use switches::{SwitchVerdict, Switches};
pub use travel::Travel;

/// Overlay plugin for switch positions.
pub struct SwitchPosition {
    settings: Settings,
    mechanisms: Vec<String>,
    switches: Switches,
}

impl Plugin for SwitchPosition {
    const ID: &'static str = "switch_position";
    const NAME: &'static str = "Switch position";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Blades and flags of switches by their positions.";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let mut mechanisms: Vec<String> =
            settings.switches.iter().map(|switch| switch.mechanism.clone()).collect();
        mechanisms.sort();
        mechanisms.dedup();
        let switches = Switches::new(&settings, &mechanisms, &[]);
        let switches = Switches { findings: Vec::new(), ..switches };
        Ok(Self { settings, mechanisms, switches })
    }
}

impl Overlay for SwitchPosition {
    fn describe(&self) -> Description {
        Description {
            equipment: self.switches.equipment.clone(),
            mechanisms: self.mechanisms.clone(),
            findings: self.switches.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let switches = Switches::new(&self.settings, &self.mechanisms, &bindings);
        let before = std::mem::replace(&mut self.switches, switches);
        self.switches.keep_history(before);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let unix_nanos = frame.unix_nanos();
        let mut verdicts: Vec<Vec<SwitchVerdict>> = Vec::new();
        verdicts.resize_with(self.switches.equipment.len(), Vec::new);
        for switch in &mut self.switches.list {
            if let Ok(tag) = &switch.tag {
                // The host shows as not known what is not good, whatever is drawn.
                let travelled = match values[tag.binding].value {
                    Some(Value::DoublePoint(point)) => switch.travel.at(point, unix_nanos),
                    _ => None,
                };
                canvas.position(tag.binding, switch.equipment, switch.mechanism, travelled)?;
            }
            verdicts[switch.equipment].push(switch.judge(&values, unix_nanos));
        }
        for (equipment, own) in verdicts.iter().enumerate() {
            let worst = own.iter().max_by_key(|of| urgency(of.verdict));
            if let Some(SwitchVerdict { verdict, reason, assumption, binding }) = worst {
                let basis = match verdict {
                    Verdict::Normal => canvas.basis(own.iter().filter_map(|of| of.binding))?,
                    _ => canvas.basis(*binding)?,
                };
                let severity = VerdictSeverity::Alarm;
                let judgment = Judgment { verdict: *verdict, severity, reason, assumption };
                canvas.judge(equipment, basis, &judgment)?;
            }
        }
        Ok(())
    }
}

/// Ranks verdicts by urgency: the most urgent one of a piece of equipment's switches is shown.
fn urgency(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Normal => 0,
        Verdict::Unknown => 1,
        Verdict::Abnormal => 2,
    }
}

busbar_plugin_sdk::export_plugin!(SwitchPosition: overlay);

#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
