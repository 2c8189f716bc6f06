//! Contacts as they are bound to tags: their peers, their air, their load, and what is
//! missing.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use busbar_plugin_sdk::Binding;
use busbar_plugin_sdk::designations::{is_within, nearest};
use busbar_plugin_sdk::units::{Quantity, UnitConversion};

use crate::settings::Settings;

/// Role of a tag that is the temperature of the air around.
pub(crate) const AMBIENT: &str = "ambient";

/// Input: a tag with the conversion of its unit; none where that is of no use.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Input {
    /// Index of the binding.
    pub(crate) binding: usize,
    pub(crate) tag_id: String,
    pub(crate) conversion: Option<UnitConversion>,
}

/// Contact of one phase.
#[derive(Clone, Debug)]
pub(crate) struct BoundContact {
    pub(crate) node: u32,
    /// Index of the equipment described.
    pub(crate) equipment: usize,
    /// Temperature; `None` where no tag has it.
    pub(crate) temperature: Option<Input>,
    /// Airs that are equally near; empty where no tag has any.
    pub(crate) ambients: Vec<Input>,
    /// Loads that are equally near.
    pub(crate) loads: Vec<Input>,
    /// Defaults that its verdicts rest on.
    pub(crate) assumption: String,
    /// Reports whether the settings declare it untelemetered.
    pub(crate) is_untelemetered: bool,
}

/// Contacts, by device, with the faults of their bindings.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    pub(crate) equipment: Vec<String>,
    pub(crate) devices: Vec<Vec<BoundContact>>,
    pub(crate) findings: Vec<String>,
}

/// Lays out the contacts that settings and bindings name.
pub(crate) fn layout(settings: &Settings, bindings: &[Binding]) -> Layout {
    let mut layout = Layout::default();
    let mut indices: HashMap<&str, usize> = HashMap::new();
    let names = settings.equipment.iter().chain(&settings.untelemetered).map(String::as_str);
    let of_role = || bindings.iter().filter(|binding| binding.role == settings.role);
    for id in names.chain(of_role().map(|binding| binding.node_id.as_str())) {
        indices.entry(id).or_insert_with(|| {
            layout.equipment.push(id.to_owned());
            layout.equipment.len() - 1
        });
    }
    let findings = &mut layout.findings;
    let mut inputs = |role: &str, quantity, unit| -> Vec<Input> {
        let bindings = bindings.iter().enumerate().filter(|(_, binding)| binding.role == role);
        bindings.map(|binding| input(binding, quantity, unit, findings)).collect()
    };
    let temperatures = inputs(&settings.role, Quantity::Temperature, "°C");
    let ambients = inputs(AMBIENT, Quantity::Temperature, "°C");
    let loads = match settings.rated_current {
        Some(_) => inputs(&settings.load_role, Quantity::Current, "A"),
        None => Vec::new(),
    };
    let mut of_piece: BTreeMap<usize, Vec<Input>> = BTreeMap::new();
    for temperature in temperatures {
        let id = bindings[temperature.binding].node_id.as_str();
        of_piece.entry(indices[id]).or_default().push(temperature);
    }
    let places = Places { settings, bindings, ambients, loads };
    places.find_missing_areas(&mut layout.findings);
    let mut devices: BTreeMap<&str, Vec<BoundContact>> = BTreeMap::new();
    let mut loadless = BTreeSet::new();
    for (equipment, id) in layout.equipment.iter().enumerate() {
        let temperatures = of_piece.remove(&equipment).unwrap_or_default();
        let is_untelemetered =
            temperatures.is_empty() && settings.untelemetered.iter().any(|of| of == id);
        if temperatures.is_empty() && !is_untelemetered {
            layout.findings.push(format!(
                "'{id}' has no tag in the role '{}'; bind one to it, or name it in \
                 `untelemetered`",
                settings.role
            ));
        }
        let device = device_of(settings, id);
        let contact = places.contact(id, device);
        if settings.rated_current.is_some() && contact.loads.is_empty() && !is_untelemetered {
            loadless.insert(device);
        }
        // A second sensor is a second contact of the same piece.
        let sensors = temperatures.len().max(1);
        let mut temperatures = temperatures.into_iter();
        for _ in 0..sensors {
            let temperature = temperatures.next();
            let contact = BoundContact { equipment, is_untelemetered, ..contact.clone() };
            devices.entry(device).or_default().push(contact.with(temperature, bindings));
        }
    }
    layout.findings.extend(loadless.iter().map(|device| {
        format!(
            "'{device}' has no tag in the role '{}' to correct its load by; bind one to it, or \
             leave `rated_current` away",
            settings.load_role
        )
    }));
    let has_contacts = devices.values().flatten().any(|contact| !contact.is_untelemetered);
    if has_contacts && places.ambients.is_empty() && !settings.ambient_untelemetered {
        layout.findings.push(format!(
            "no tag is in the role '{AMBIENT}'; bind one to equipment in the same air, or set \
             `ambient_untelemetered`"
        ));
    }
    layout.devices = devices.into_values().collect();
    layout
}

/// Id without the ending that tells its phase.
fn device_of<'i>(settings: &Settings, id: &'i str) -> &'i str {
    let mut endings = settings.phases.iter().filter(|ending| !ending.is_empty());
    endings.find_map(|ending| id.strip_suffix(ending.as_str())).unwrap_or(id)
}

/// Tags that several contacts share.
struct Places<'l> {
    settings: &'l Settings,
    bindings: &'l [Binding],
    ambients: Vec<Input>,
    loads: Vec<Input>,
}

impl Places<'_> {
    fn id_of(&self, input: &Input) -> &str {
        &self.bindings[input.binding].node_id
    }

    fn find_missing_areas(&self, findings: &mut Vec<String>) {
        for (place, area) in self.settings.areas.iter().enumerate() {
            if !self.ambients.iter().any(|input| self.id_of(input) == area.ambient) {
                findings.push(format!(
                    "areas[{place}]: '{}' has no tag in the role '{AMBIENT}'; bind one to it, or \
                     name the equipment that has it",
                    area.ambient
                ));
            }
        }
    }

    /// Contact without its temperature.
    fn contact(&self, id: &str, device: &str) -> BoundContact {
        let (ambients, assumed) = self.ambients_of(id);
        let mut assumptions: Vec<String> = assumed.into_iter().collect();
        let loads = match self.settings.rated_current {
            Some(_) => self.loads_of(id, device),
            None => {
                assumptions.push("load as it is, no `rated_current`".into());
                Vec::new()
            }
        };
        BoundContact {
            node: 0,
            equipment: 0,
            temperature: None,
            ambients,
            loads,
            assumption: assumptions.join(", "),
            is_untelemetered: false,
        }
    }

    /// Air of a contact: of its area, else the nearest, with what is assumed.
    fn ambients_of(&self, id: &str) -> (Vec<Input>, Option<String>) {
        let longest = |area: &crate::settings::Area| {
            let around = area.equipment.iter().filter(|of| is_within(id, of));
            around.map(String::len).max()
        };
        let areas = self.settings.areas.iter().filter_map(|area| Some((longest(area)?, area)));
        if let Some((_, area)) = areas.max_by_key(|(length, _)| *length) {
            let of_area = self.ambients.iter().filter(|of| self.id_of(of) == area.ambient);
            return (of_area.cloned().collect(), None);
        }
        let mut near = nearest(id, &self.ambients, |input| self.id_of(input));
        // One tag may be bound to several places.
        let mut known = BTreeSet::new();
        near.retain(|input| known.insert(input.tag_id.clone()));
        let tags: BTreeSet<_> = self.ambients.iter().map(|input| &input.tag_id).collect();
        let assumed = near.first().filter(|_| tags.len() > 1);
        (
            near.clone(),
            assumed.map(|input| format!("air of {}, the nearest by its id", input.tag_id)),
        )
    }

    /// Loads at the contact, else at its device, else at the nearest that it belongs to.
    fn loads_of(&self, id: &str, device: &str) -> Vec<Input> {
        let belongs = |input: &&Input| {
            let at = self.id_of(input);
            at == id || at == device || is_within(id, at)
        };
        let around = self.loads.iter().filter(belongs);
        let longest = around.clone().map(|input| self.id_of(input).len()).max();
        around.filter(|input| Some(self.id_of(input).len()) == longest).cloned().collect()
    }
}

impl BoundContact {
    fn with(self, temperature: Option<Input>, bindings: &[Binding]) -> Self {
        let node = temperature.as_ref().map_or(0, |input| bindings[input.binding].node);
        let units = temperature.iter().chain(&self.ambients).chain(&self.loads);
        let is_assumed =
            |input: &&Input| input.conversion.is_some_and(|conversion| conversion.is_assumed);
        let mut assumed: Vec<String> =
            units.filter(is_assumed).map(|input| format!("{} in °C or A", input.tag_id)).collect();
        assumed.extend((!self.assumption.is_empty()).then(|| self.assumption.clone()));
        Self { node, temperature, assumption: assumed.join(", "), ..self }
    }
}

/// Reads a binding as an input; adds a finding where its unit or kind is of no use.
fn input(
    (index, binding): (usize, &Binding),
    quantity: Quantity,
    unit: &str,
    findings: &mut Vec<String>,
) -> Input {
    let conversion = match UnitConversion::for_binding(binding, quantity, unit) {
        _ if !binding.kind.is_quantity() => {
            findings.push(format!(
                "the tag '{}' in the role '{}' at '{}' is no number; bind one of the kind f64 or \
                 i64",
                binding.tag_id, binding.role, binding.node_id
            ));
            None
        }
        Ok(conversion) => Some(conversion),
        Err(finding) => {
            findings.push(finding);
            None
        }
    };
    Input { binding: index, tag_id: binding.tag_id.clone(), conversion }
}
