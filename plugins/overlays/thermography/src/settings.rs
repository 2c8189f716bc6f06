//! Settings of the overlay: contacts, their peers and air, and the rule that grades them.

use crate::rules::{Grading, Part, Rule};

/// Pieces of equipment of one overlay.
pub(crate) const MAX_EQUIPMENT: usize = 10_000;
/// Endings of ids that tell phases apart.
pub(crate) const MAX_PHASES: usize = 12;
/// Areas with an air of their own.
const MAX_AREAS: usize = 1_000;

/// Settings of the overlay: temperatures of contacts, bound to each phase's equipment in the
/// role `contact_temperature`, and of the air in the role `ambient`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Ids of the equipment that is judged, each phase for itself; equipment that has a tag
    /// in the role of the temperatures is judged as well.
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
    /// Rule that grades contacts.
    #[serde(default)]
    pub rule: Rule,
    /// Part that is measured; give parts with other limits an overlay of their own.
    #[serde(default)]
    pub part: Part,
    /// Rise over the air below which phases are not compared, K (DL/T 664).
    #[serde(default = "default_least_rise")]
    #[schemars(range(min = 1.0, max = 50.0))]
    pub least_rise: f64,
    /// Rise over the air above which a contact without other phases has a defect, K (DL/T
    /// 664 by GB/T 11022-2011, table 3: bare bolted connections in air).
    #[serde(default = "default_greatest_rise")]
    #[schemars(range(min = 5.0, max = 200.0))]
    pub greatest_rise: f64,
    /// Distance below the air from which on a contact's temperature is a fault, K.
    #[serde(default = "default_tolerance")]
    #[schemars(range(min = 0.5, max = 50.0))]
    pub ambient_tolerance: f64,
    /// Areas with an air of their own. Elsewhere the nearest tag in the role `ambient`
    /// counts, by the designations that ids begin with.
    #[serde(default)]
    #[schemars(length(max = MAX_AREAS))]
    pub areas: Vec<Area>,
    /// Rated current of the contacts, A: rises are corrected to it by the tag in the role
    /// `load_role`. Without it contacts are judged at the load that they have.
    #[serde(default)]
    #[schemars(range(min = 1.0, max = 100_000.0))]
    pub rated_current: Option<f64>,
    /// Role of the current, at the contact, its device, or what that belongs to.
    #[serde(default = "default_load_role")]
    pub load_role: String,
    /// Exponent of the current that the rise goes with: 2 by the loss, less with convection.
    #[serde(default = "default_load_exponent")]
    #[schemars(range(min = 1.0, max = 2.5))]
    pub load_exponent: f64,
    /// Ids of equipment that is known to have no telemetry: it is shown as unknown, is no
    /// peer, and `busbar check` does not ask for its tags.
    #[serde(default)]
    #[schemars(length(max = MAX_EQUIPMENT))]
    pub untelemetered: Vec<String>,
    /// Declares that the air has no telemetry: contacts are judged by what is left.
    #[serde(default)]
    pub ambient_untelemetered: bool,
}

/// Area with an air of its own.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// Id of the equipment that has the tag in the role `ambient`.
    pub ambient: String,
    /// Ids of the equipment in it, or the designations that these begin with, such as `=Q1`.
    #[schemars(length(min = 1, max = MAX_EQUIPMENT))]
    pub equipment: Vec<String>,
}

fn default_phases() -> Vec<String> {
    ["-L1", "-L2", "-L3"].map(str::to_owned).into()
}

fn default_role() -> String {
    "contact_temperature".into()
}

fn default_load_role() -> String {
    "load_current".into()
}

/// Rise that differences need, as substations of the standard's country keep it.
fn default_least_rise() -> f64 {
    10.0
}

fn default_greatest_rise() -> f64 {
    50.0
}

/// Contacts cool below the air under a clear sky at night, and sensors err.
fn default_tolerance() -> f64 {
    5.0
}

fn default_load_exponent() -> f64 {
    2.0
}

impl Settings {
    /// Finds the first fault of the settings, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.equipment.len().max(self.untelemetered.len()) > MAX_EQUIPMENT {
            return Some(format!("equipment: name at most {MAX_EQUIPMENT}"));
        }
        if !(2..=MAX_PHASES).contains(&self.phases.len()) {
            return Some(format!("phases: give 2 to {MAX_PHASES} endings"));
        }
        if self.areas.len() > MAX_AREAS {
            return Some(format!("areas: give at most {MAX_AREAS}"));
        }
        let is_faulty = |area: &Area| !(1..=MAX_EQUIPMENT).contains(&area.equipment.len());
        if let Some(place) = self.areas.iter().position(is_faulty) {
            return Some(format!("areas[{place}].equipment: name 1 to {MAX_EQUIPMENT}"));
        }
        let ranges = [
            ("least_rise", Some(self.least_rise), 1.0..=50.0),
            ("greatest_rise", Some(self.greatest_rise), 5.0..=200.0),
            ("ambient_tolerance", Some(self.ambient_tolerance), 0.5..=50.0),
            ("rated_current", self.rated_current, 1.0..=100_000.0),
            ("load_exponent", Some(self.load_exponent), 1.0..=2.5),
        ];
        ranges.into_iter().find_map(|(name, value, range)| {
            let value = value.filter(|value| !range.contains(value))?;
            Some(format!("{name} is {value}: give {} to {}", range.start(), range.end()))
        })
    }

    /// Rule with its limits.
    pub(crate) fn grading(&self) -> Grading {
        let Self { rule, part, least_rise, greatest_rise, .. } = *self;
        Grading { rule, part, least_rise, greatest_rise }
    }
}
