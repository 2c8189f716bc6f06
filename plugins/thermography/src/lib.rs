//! Thermography: contacts judged by those of the other phases and by the surroundings,
//! after DL/T 664.

mod judge;

use std::collections::{BTreeMap, HashMap};

use busbar_plugin_sdk::{
    Binding, Canvas, Description, Error, Host, LegendEntry, Overlay, OverlayFrame, Pattern, Plugin,
    Severity, TagValue,
};
pub use judge::{Defect, LEAST_RISE, Verdict, judge};

/// Pieces of equipment of one overlay.
const MAX_EQUIPMENT: usize = 10_000;
/// Endings of ids that tell phases apart.
const MAX_PHASES: usize = 12;
/// Role of a tag that is the temperature of the air around.
const AMBIENT: &str = "ambient";

/// Settings of the overlay: temperatures of contacts, °C, bound to each phase's equipment in
/// the role `contact_temperature`, and of the air in the role `ambient`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Ids of the equipment that states are shown at, each phase for itself.
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
    /// Endings of ids that tell the phases of a device apart: those with the same id before
    /// them are compared.
    #[serde(default = "default_phases")]
    #[schemars(length(min = 2, max = MAX_PHASES))]
    pub phases: Vec<String>,
    /// Role of the temperatures.
    #[serde(default = "default_role")]
    pub role: String,
}

fn default_phases() -> Vec<String> {
    ["-L1", "-L2", "-L3"].map(str::to_owned).into()
}

fn default_role() -> String {
    "contact_temperature".into()
}

/// The overlay.
pub struct Thermography {
    settings: Settings,
    /// Contacts that are compared.
    groups: Vec<Vec<Contact>>,
    ambient: Option<usize>,
}

#[derive(Clone, Copy)]
struct Contact {
    binding: usize,
    node: u32,
    equipment: Option<usize>,
}

impl Plugin for Thermography {
    const ID: &'static str = "thermography";
    const NAME: &'static str = "Thermography";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Contacts judged by those of the other phases (DL/T 664).";
    type Settings = Settings;

    fn create(settings: Settings, _host: Host) -> Result<Self, Error> {
        if settings.equipment.len() > MAX_EQUIPMENT {
            return Err(Error::settings(format!("equipment: name at most {MAX_EQUIPMENT}")));
        }
        if !(2..=MAX_PHASES).contains(&settings.phases.len()) {
            return Err(Error::settings(format!("phases: give 2 to {MAX_PHASES} endings")));
        }
        Ok(Self { settings, groups: Vec::new(), ambient: None })
    }
}

impl Overlay for Thermography {
    fn describe(&self) -> Description {
        let entry = |name: &str, color, pattern| LegendEntry { name: name.into(), color, pattern };
        Description {
            // In the order of the classes.
            legend: vec![
                entry("general defect", [0xc9, 0xa2, 0x27], Pattern::Dotted),
                entry("serious defect", [0xd9, 0x74, 0x1c], Pattern::Striped),
                entry("critical defect", [0xc0, 0x22, 0x2b], Pattern::Crossed),
            ],
            equipment: self.settings.equipment.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let described: HashMap<&str, usize> =
            self.settings.equipment.iter().zip(0..).map(|(id, at)| (id.as_str(), at)).collect();
        let mut groups: BTreeMap<&str, Vec<Contact>> = BTreeMap::new();
        for (index, binding) in bindings.iter().enumerate() {
            let mut endings = self.settings.phases.iter();
            let device = endings.find_map(|ending| binding.node_id.strip_suffix(ending));
            if let Some(device) = device.filter(|_| binding.role == self.settings.role) {
                let equipment = described.get(binding.node_id.as_str()).copied();
                let contact = Contact { binding: index, node: binding.node, equipment };
                groups.entry(device).or_default().push(contact);
            }
        }
        self.groups = groups.into_values().collect();
        self.ambient = bindings.iter().position(|binding| binding.role == AMBIENT);
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        let Some(air) = self.ambient else { return Ok(()) };
        let ambient = values[air].good_number();
        for group in &self.groups {
            let degrees = |contact: &Contact| values[contact.binding].good_number();
            let coolest = group.iter().filter_map(degrees).reduce(f64::min);
            for contact in group {
                let known = degrees(contact).zip(coolest).zip(ambient);
                let Some(((hot, coolest), ambient)) = known else {
                    // The host shows as unknown what rests on a value that is not good.
                    if let Some(equipment) = contact.equipment {
                        canvas.state_on([contact.binding, air], equipment, 0)?;
                    }
                    continue;
                };
                let rests_on = group.iter().map(|contact| contact.binding).chain([air]);
                show(contact, rests_on, (hot, judge(hot, coolest, ambient)), canvas)?;
            }
        }
        Ok(())
    }
}

/// Shows a contact that has a defect; that rests on its peers and the air, too.
fn show(
    contact: &Contact,
    rests_on: impl Iterator<Item = usize>,
    (hot, Verdict { defect, difference }): (f64, Verdict),
    canvas: &mut Canvas<'_>,
) -> Result<(), Error> {
    let Some(defect) = defect else { return Ok(()) };
    if let Some(equipment) = contact.equipment {
        canvas.state_on(rests_on, equipment, defect as usize)?;
    }
    let severity = match defect {
        Defect::General | Defect::Serious => Severity::Warning,
        Defect::Critical => Severity::Alarm,
    };
    let difference = difference.map_or_else(String::new, |of| format!(", difference {of:.0} %"));
    let text = format!("{hot:.0} °C{difference}");
    canvas.line(contact.binding, contact.node, severity, "Contact", &text)
}

busbar_plugin_sdk::export_plugin!(Thermography: overlay);

#[cfg(test)]
mod tests;
