//! Thermography: contacts judged by those of the other phases and by the surroundings,
//! after DL/T 664 or ANSI/NETA MTS.

mod bounds;
mod contacts;
mod judgment;
mod nearest;
mod piece_verdicts;
mod rules;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Severity, TagValue, Verdict,
};
pub use rules::{Contact, Grading, Part, Rule};
pub use settings::{Area, Settings};

use contacts::{BoundContact, Layout, layout};
use judgment::{ContactJudgment, judge_device};
use piece_verdicts::{SensorVerdict, give_verdicts};

/// The overlay.
pub struct Thermography {
    settings: Settings,
    layout: Layout,
}

impl Plugin for Thermography {
    const ID: &'static str = "thermography";
    const NAME: &'static str = "Thermography";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "Contacts judged by those of the other phases (DL/T 664, NETA MTS).";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if let Some(fault) = settings.fault() {
            return Err(Error::settings(fault));
        }
        let mut layout = layout(&settings, &[]);
        // No bindings came yet that anything could be found of.
        layout.findings.clear();
        Ok(Self { settings, layout })
    }
}

impl Overlay for Thermography {
    fn describe(&self) -> Description {
        let looks: &[([u8; 3], Pattern)] = match self.settings.rule {
            Rule::DlT664 => &[
                ([0xc9, 0xa2, 0x27], Pattern::Dotted),
                ([0xd9, 0x74, 0x1c], Pattern::Striped),
                ([0xc0, 0x22, 0x2b], Pattern::Crossed),
            ],
            Rule::Neta => &[
                ([0xc9, 0xa2, 0x27], Pattern::Dotted),
                ([0xd9, 0x74, 0x1c], Pattern::Striped),
                ([0xd9, 0x74, 0x1c], Pattern::Striped),
                ([0xc0, 0x22, 0x2b], Pattern::Crossed),
            ],
        };
        let grades = self.settings.rule.grades().iter().zip(looks);
        let entry = |(name, (color, pattern)): (&&str, &([u8; 3], Pattern))| LegendEntry {
            name: (*name).into(),
            color: *color,
            pattern: *pattern,
        };
        Description {
            legend: grades.map(entry).collect(),
            equipment: self.layout.equipment.clone(),
            findings: self.layout.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.layout = layout(&self.settings, &bindings);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let mut verdicts = Vec::with_capacity(self.layout.equipment.len());
        for device in &self.layout.devices {
            let judgments = judge_device(&self.settings, device, &values);
            for (contact, judgment) in device.iter().zip(judgments) {
                show(self.settings.rule, (contact, &judgment), canvas)?;
                let ContactJudgment { verdict, reason, assumption, rests_on, .. } = judgment;
                let equipment = contact.equipment;
                verdicts.push(SensorVerdict { equipment, verdict, reason, assumption, rests_on });
            }
        }
        give_verdicts(&verdicts, canvas)
    }
}

/// Shows state and label of a contact where it is abnormal.
fn show(
    rule: Rule,
    (contact, judgment): (&BoundContact, &ContactJudgment),
    canvas: &mut Canvas<'_>,
) -> Result<(), Error> {
    let ContactJudgment { verdict, grade, text, rests_on, .. } = judgment;
    let (Some(grade), Some(temperature)) = (*grade, &contact.temperature) else { return Ok(()) };
    if *verdict != Verdict::Abnormal {
        return Ok(());
    }
    canvas.state_on(rests_on.iter().copied(), contact.equipment, grade)?;
    let is_worst = grade + 1 == rule.grades().len();
    let severity = if is_worst { Severity::Alarm } else { Severity::Warning };
    canvas.line(temperature.binding, contact.node, severity, "Contact", text)
}

busbar_plugin_sdk::export_plugin!(Thermography: overlay);

#[cfg(test)]
mod silence_tests;
#[cfg(test)]
mod tests;
