//! Gas compartments as they are bound to tags: roles, units, and what is missing.

use std::collections::{BTreeMap, HashMap};

use busbar_plugin_sdk::designations::nearest;
use busbar_plugin_sdk::units::{PressureReference, Quantity, UnitConversion};
use busbar_plugin_sdk::{Binding, Origin, TagValue, ValueKind};

use crate::settings::Settings;

/// Role of a tag that is a compartment's pressure.
pub(crate) const PRESSURE: &str = "sf6_pressure";
/// Role of a tag that is the temperature of its gas.
pub(crate) const TEMPERATURE: &str = "sf6_temperature";
/// Role of a tag that is the pressure of the air at the place.
pub(crate) const AIR_PRESSURE: &str = "air_pressure";
/// Role of a tag that is the alarm contact of a density monitor.
pub(crate) const DENSITY_CONTACT: &str = "density_contact";

/// Input of a compartment.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Input {
    /// Index of the binding.
    pub(crate) binding: usize,
    pub(crate) tag_id: String,
    pub(crate) conversion: UnitConversion,
}

/// Gas compartment: the equipment that pressure and temperature are bound to.
#[derive(Clone, Debug)]
pub(crate) struct Compartment {
    pub(crate) node: u32,
    pub(crate) node_id: String,
    /// Index of the equipment described.
    pub(crate) equipment: usize,
    pub(crate) pressure: Option<Input>,
    /// Reports whether the pressure is above that of the air.
    pub(crate) is_gauge: bool,
    pub(crate) temperature: Option<Input>,
    /// Air pressures that are equally near.
    pub(crate) air: Vec<Input>,
    pub(crate) contacts: Vec<usize>,
    /// Reason why it is unknown for as long as the bindings stay.
    pub(crate) missing: Option<String>,
    /// Defaults that its verdicts rest on.
    pub(crate) assumption: String,
}

impl Compartment {
    /// Origins of the values that its density is worked out of.
    pub(crate) fn origin(&self, values: &[TagValue]) -> Origin {
        let air = self.air.iter().filter(|_| self.is_gauge);
        let inputs = self.pressure.iter().chain(&self.temperature).chain(air);
        let origins = inputs.filter_map(|input| Some(values.get(input.binding)?.origin));
        origins.fold(Origin::LIVE, Origin::union)
    }
}

/// Compartments with their equipment and the faults of their bindings.
#[derive(Clone, Debug, Default)]
pub(crate) struct Layout {
    pub(crate) equipment: Vec<String>,
    pub(crate) compartments: Vec<Compartment>,
    pub(crate) findings: Vec<String>,
}

/// Bindings of one piece of equipment by their roles.
#[derive(Default)]
struct Bound<'b> {
    node: u32,
    pressures: Vec<(usize, &'b Binding)>,
    temperatures: Vec<(usize, &'b Binding)>,
    contacts: Vec<usize>,
}

/// Lays out the compartments that settings and bindings name.
pub(crate) fn layout(settings: &Settings, assumption: &str, bindings: &[Binding]) -> Layout {
    let mut layout = Layout::default();
    let mut indices: HashMap<&str, usize> = HashMap::new();
    let mut bound: BTreeMap<usize, Bound> = BTreeMap::new();
    let names = settings.equipment.iter().chain(&settings.untelemetered).map(String::as_str);
    let of_bindings = bindings.iter().filter(|binding| {
        [PRESSURE, TEMPERATURE, DENSITY_CONTACT].contains(&binding.role.as_str())
    });
    for id in names.chain(of_bindings.map(|binding| binding.node_id.as_str())) {
        indices.entry(id).or_insert_with(|| {
            layout.equipment.push(id.to_owned());
            layout.equipment.len() - 1
        });
    }
    let mut air = Vec::new();
    for (index, binding) in bindings.iter().enumerate() {
        if binding.role == AIR_PRESSURE {
            air.extend(input(settings, (index, binding), &mut layout.findings).ok());
        }
        let Some(equipment) = indices.get(binding.node_id.as_str()) else { continue };
        let piece = bound.entry(*equipment).or_default();
        match binding.role.as_str() {
            PRESSURE => piece.pressures.push((index, binding)),
            TEMPERATURE => piece.temperatures.push((index, binding)),
            DENSITY_CONTACT => {
                layout.findings.extend(contact_finding(binding));
                piece.contacts.push(index);
            }
            _ => continue,
        }
        piece.node = binding.node;
    }
    for (equipment, id) in layout.equipment.iter().enumerate() {
        let piece = bound.remove(&equipment).unwrap_or_default();
        // A second pressure is a second compartment, with the second temperature.
        for place in 0..piece.pressures.len().max(1) {
            let mut builder = Builder { settings, findings: &mut layout.findings, id };
            let air = nearest(id, &air, |input| bindings[input.binding].node_id.as_str());
            let compartment = builder.compartment(&piece, place, air, assumption);
            layout.compartments.push(Compartment { equipment, ..compartment });
        }
    }
    layout
}

struct Builder<'l> {
    settings: &'l Settings,
    findings: &'l mut Vec<String>,
    id: &'l str,
}

impl Builder<'_> {
    fn compartment(
        &mut self,
        piece: &Bound<'_>,
        place: usize,
        air: Vec<Input>,
        assumption: &str,
    ) -> Compartment {
        let Self { settings, id, .. } = *self;
        let mut missing = None;
        let mut assumed: Vec<String> = Vec::new();
        let is_untelemetered = settings.untelemetered.iter().any(|of| of == id);
        let is_silent = is_untelemetered && piece.pressures.is_empty();
        if is_silent {
            missing = Some("declared untelemetered in the settings".into());
        }
        let pressure = self.of_role(PRESSURE, piece.pressures.get(place), is_silent, &mut missing);
        let temperature = piece.temperatures.get(place).or(piece.temperatures.first());
        // Without a temperature the pressure may still decide.
        let temperature = self.of_role(TEMPERATURE, temperature, is_silent, &mut None);
        for (input, wanted) in [(&pressure, settings.unit.symbol()), (&temperature, "°C")] {
            let input = input.as_ref().filter(|input| input.conversion.is_assumed);
            assumed.extend(input.map(|input| format!("{} in {wanted}", input.tag_id)));
        }
        let reference = pressure.as_ref().and_then(|input| input.conversion.reference);
        let is_gauge = reference.map_or(settings.gauge, |of| of == PressureReference::Gauge);
        if is_gauge && air.is_empty() && settings.altitude_metres.is_none() {
            assumed.push("air pressure of sea level".into());
        }
        assumed.extend((!assumption.is_empty()).then(|| assumption.to_owned()));
        Compartment {
            node: piece.node,
            node_id: id.to_owned(),
            equipment: 0,
            pressure,
            is_gauge,
            temperature,
            air,
            contacts: piece.contacts.clone(),
            missing,
            assumption: assumed.join(", "),
        }
    }

    /// The input in a role; adds a finding where it is missing or of no use.
    fn of_role(
        &mut self,
        role: &str,
        bound: Option<&(usize, &Binding)>,
        is_silent: bool,
        missing: &mut Option<String>,
    ) -> Option<Input> {
        let Some(bound) = bound else {
            if !is_silent {
                missing.get_or_insert_with(|| format!("no tag in the role '{role}'"));
                self.findings.push(format!(
                    "'{}' has no tag in the role '{role}'; bind one to it, or name it in \
                     `untelemetered`",
                    self.id
                ));
            }
            return None;
        };
        match input(self.settings, *bound, self.findings) {
            Ok(input) => Some(input),
            Err(reason) => {
                missing.get_or_insert(reason);
                None
            }
        }
    }
}

/// Describes the fault of a density contact that can tell neither alarm nor calm.
fn contact_finding(binding: &Binding) -> Option<String> {
    let Binding { tag_id, role, node_id, .. } = binding;
    (binding.kind == ValueKind::Text).then(|| {
        format!(
            "the tag '{tag_id}' in the role '{role}' at '{node_id}' is a text, which is neither on \
             nor off; bind one of the kind bool or double_point"
        )
    })
}

/// Reads a binding as an input; adds a finding where its unit or kind is of no use.
fn input(
    settings: &Settings,
    (index, binding): (usize, &Binding),
    findings: &mut Vec<String>,
) -> Result<Input, String> {
    let (quantity, unit) = match binding.role.as_str() {
        TEMPERATURE => (Quantity::Temperature, "°C"),
        _ => (Quantity::Pressure, settings.unit.symbol()),
    };
    if !binding.kind.is_quantity() {
        findings.push(format!(
            "the tag '{}' in the role '{}' at '{}' is no number; bind one of the kind f64 or i64",
            binding.tag_id, binding.role, binding.node_id
        ));
        return Err(format!("{} is no number", binding.tag_id));
    }
    match UnitConversion::for_binding(binding, quantity, unit) {
        Ok(conversion) => Ok(Input { binding: index, tag_id: binding.tag_id.clone(), conversion }),
        Err(finding) => {
            findings.push(finding);
            Err(format!("{} has the unit '{}'", binding.tag_id, binding.unit))
        }
    }
}
