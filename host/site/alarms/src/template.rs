//! Alarm template: one alarm for each piece of equipment that an overlay judges.

use crate::{AlarmSource, AlarmSpec};

/// Separator of a template's id and the equipment's id in the id of an alarm.
const SEPARATOR: char = ':';

/// Definition of the alarms on all equipment that an overlay judges. The alarm of a piece has the
/// template's id and the equipment's, `hot:=Q1-QA1`, so that it is the same one after a restart.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmTemplate {
    spec: AlarmSpec,
}

impl AlarmTemplate {
    /// Creates a template of an alarm whose source is a verdict.
    ///
    /// # Errors
    /// The definition as it was, of any other source.
    pub fn new(spec: AlarmSpec) -> Result<Self, Box<AlarmSpec>> {
        match spec.source {
            AlarmSource::Verdict { .. } => Ok(Self { spec }),
            AlarmSource::Tag { .. } | AlarmSource::Mirrored => Err(Box::new(spec)),
        }
    }

    /// Returns the definition that the alarms share; its equipment says nothing.
    pub fn spec(&self) -> &AlarmSpec {
        &self.spec
    }

    /// Returns the plugin instance whose verdicts the alarms follow.
    pub fn overlay(&self) -> &str {
        match &self.spec.source {
            AlarmSource::Verdict { trigger, .. } => &trigger.overlay,
            AlarmSource::Tag { .. } | AlarmSource::Mirrored => "",
        }
    }

    /// Returns the id of the alarm on a piece of equipment.
    pub fn id_of(&self, equipment: &str) -> String {
        format!("{}{SEPARATOR}{equipment}", self.spec.id)
    }

    /// Returns the alarm on a piece of equipment.
    pub fn alarm_on(&self, equipment: &str) -> AlarmSpec {
        let mut spec = self.spec.clone();
        spec.id = self.id_of(equipment);
        spec.equipment = Some(equipment.to_owned());
        if let AlarmSource::Verdict { trigger, .. } = &mut spec.source {
            equipment.clone_into(&mut trigger.equipment);
        }
        spec
    }

    /// Returns the equipment of an alarm of this template, by the alarm's id; none of any other
    /// alarm.
    pub fn equipment_of<'a>(&self, alarm: &'a str) -> Option<&'a str> {
        let equipment = alarm.strip_prefix(&self.spec.id)?.strip_prefix(SEPARATOR)?;
        (!equipment.is_empty()).then_some(equipment)
    }
}
