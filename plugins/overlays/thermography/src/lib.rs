//! Thermography: contacts judged by those of the other phases and by the surroundings,
//! after DL/T 664 or ANSI/NETA MTS.

mod bounds;
mod contacts;
mod judgment;
mod piece_verdicts;
mod rules;
mod settings;

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Quality, Severity, TagValue, Value, Verdict,
};
pub use rules::{Contact, Grading, Part, Rule};
pub use settings::{Area, Settings};

use contacts::{BoundContact, Layout, layout};
use judgment::{ContactJudgment, judge_device};
use piece_verdicts::{SensorVerdict, give_verdicts};

/// Overlay of contact temperatures.
pub struct Thermography {
    settings: Settings,
    layout: Layout,
    /// Values that `judgments` are of: contacts change once in many frames.
    judged: Vec<(Option<Value>, Quality)>,
    /// Judgments on the contacts, by device.
    judgments: Vec<Vec<ContactJudgment>>,
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
        Ok(Self { settings, layout, judged: Vec::new(), judgments: Vec::new() })
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
        self.judgments.clear();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let is_judged = |of: &TagValue, (value, quality): &(Option<Value>, Quality)| {
            of.value == *value && of.quality == *quality
        };
        let are_judged = values.len() == self.judged.len()
            && values.iter().zip(&self.judged).all(|(of, judged)| is_judged(of, judged));
        if self.judgments.is_empty() || !are_judged {
            let judge = |device: &Vec<BoundContact>| judge_device(&self.settings, device, &values);
            self.judgments = self.layout.devices.iter().map(judge).collect();
            self.judged = values.into_iter().map(|of| (of.value, of.quality)).collect();
        }
        let contacts = self.layout.devices.iter().flatten();
        let contacts = contacts.zip(self.judgments.iter().flatten());
        for (contact, judgment) in contacts.clone() {
            show(self.settings.rule, (contact, judgment), canvas)?;
        }
        let verdicts: Vec<SensorVerdict<'_>> = contacts
            .map(|(contact, judgment)| SensorVerdict {
                equipment: contact.equipment,
                verdict: judgment.verdict,
                severity: judgment.severity,
                reason: &judgment.reason,
                assumption: &judgment.assumption,
                rests_on: &judgment.rests_on,
            })
            .collect();
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
