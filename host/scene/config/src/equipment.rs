//! Names of equipment besides their ids.

use std::collections::HashMap;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::alarm_rules::check_equipment;
use crate::item_names::{item_pointer, name_fault, named};
use crate::placement_rules::Equipment;
use crate::report::Report;
use crate::{MAX_ALIASES, MAX_NAME_BYTES, join_pointer, suggestions};

/// Names of a piece of equipment besides its id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EquipmentConfig {
    /// Name shown to people; may be empty.
    pub name: String,
    /// Other ids of it: of IEC 61850, CIM or the site. Each is one equipment's alone.
    pub aliases: Vec<String>,
    /// JSON pointer of the entry.
    pub pointer: String,
}

/// Names of a piece of equipment besides its id.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Equipment")]
pub(crate) struct RawEquipment {
    /// Name shown to people; may be empty.
    #[schemars(length(max = MAX_NAME_BYTES), extend("examples" = ["Transformer 1"]))]
    name: String,
    /// Other ids by which it can be found: of IEC 61850, CIM or
    /// the site.
    #[schemars(length(max = MAX_ALIASES), inner(length(min = 1, max = MAX_NAME_BYTES)))]
    #[schemars(extend("examples" = [["S12D1Q1/XCBR1", "2211"]]))]
    aliases: Vec<String>,
}

impl RawEquipment {
    pub(crate) fn resolve(self, pointer: String) -> EquipmentConfig {
        EquipmentConfig { name: self.name, aliases: self.aliases, pointer }
    }
}

/// Reports equipment that is not in the scene, and ids that would mean two pieces.
pub(crate) fn check<'d>(document: &'d Value, equipment: &Equipment<'d>, report: &mut Report<'_>) {
    let mut owners: HashMap<&str, &str> = HashMap::new();
    for (id, facts) in named(document, "equipment") {
        let pointer = item_pointer("equipment", id);
        check_equipment(id, equipment, &pointer, report);
        let aliases = facts["aliases"].as_array().into_iter().flatten();
        for (index, alias) in aliases.enumerate() {
            let Some(alias) = alias.as_str() else { continue };
            let pointer = join_pointer(&join_pointer(&pointer, "aliases"), index);
            if let Some((cause, remedy)) = name_fault(alias, "alias") {
                report.error(&pointer, cause, remedy);
            }
            let owner = owners.insert(alias, id);
            if let Some(owner) = owner.or(equipment.contains_key(alias).then_some(alias)) {
                let (alias, owner) = (suggestions::shown(alias), suggestions::shown(owner));
                let cause = format!("the alias '{alias}' is one of '{owner}' already");
                report.error(&pointer, cause, "remove it from one of the two");
            }
        }
    }
}
