//! Settings: the network, and what operators placed in it.

use crate::branch_kind::{BranchKind, EarthKind};

/// Placements of one network.
pub const MAX_PLACEMENTS: usize = 10_000;
/// Voltage levels of one network.
pub const MAX_LEVELS: usize = 54;

/// Settings of the overlay: the network's connectivity nodes, and what joins, feeds and
/// earths them. Positions come from tags bound to the switches in the role `position`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Voltage levels of the network.
    #[schemars(length(min = 1, max = MAX_LEVELS))]
    pub levels: Vec<LevelSettings>,
    /// Connectivity nodes of the network.
    #[schemars(length(min = 1))]
    pub nodes: Vec<NodeSettings>,
    /// Branches that join nodes: switches, current transformers, transformers, lines.
    #[serde(default)]
    pub branches: Vec<BranchSettings>,
    /// Working earths: earth switches and portable earths. The earthing of a star point is
    /// none.
    #[serde(default)]
    pub earths: Vec<EarthSettings>,
    /// Sources that feed nodes.
    #[schemars(length(min = 1))]
    pub sources: Vec<SourceSettings>,
    /// Placements of operators, where no tag tells: portable earths, racked-out switches,
    /// positions set by hand. They stay until somebody removes them, and are logged.
    #[serde(default)]
    #[schemars(length(max = MAX_PLACEMENTS))]
    pub placements: Vec<PlacementSettings>,
}

/// Voltage level, and its colour.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelSettings {
    /// Name, as the legend shows it, such as `220 kV`.
    #[schemars(length(min = 1, max = 32))]
    pub name: String,
    /// Colour of what is energised, `#rrggbb`.
    pub color: Color,
    /// Nominal voltage between phases, kV. Where missing, it is read from the name.
    #[serde(default)]
    #[schemars(range(min = 0.001, max = 2000.0))]
    pub nominal_kv: Option<f64>,
}

/// Connectivity node, and the equipment at it.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeSettings {
    /// Name within these settings.
    pub id: String,
    /// Name of its voltage level.
    pub level: String,
    /// Ids of equipment that is at this node alone: busbars, arresters, voltage
    /// transformers.
    #[serde(default)]
    pub equipment: Vec<String>,
}

/// Joins two nodes. Between nodes of different voltage levels it is a winding, whatever its
/// kind: no earth passes it.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BranchSettings {
    /// Equipment id of the branch.
    pub equipment: String,
    /// Nodes at its two ends.
    pub between: [String; 2],
    /// Reports whether it joins them only while its position is closed. Where missing, the
    /// kind decides.
    #[serde(default)]
    pub switch: Option<bool>,
    /// Kind. Where missing, a branch within a voltage level is a conductor or a switch.
    #[serde(default)]
    pub kind: Option<BranchKind>,
    /// Says that no tag tells its position: it is unknown, unless set by hand.
    #[serde(default)]
    pub untelemetered: bool,
}

/// Working earth of a node.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EarthSettings {
    /// Equipment id of the earth.
    pub equipment: String,
    /// The node that it earths.
    pub node: String,
    /// Kind of the earth.
    #[serde(default)]
    pub kind: EarthKind,
    /// Says that no tag tells its position: it is unknown, unless set by hand.
    #[serde(default)]
    pub untelemetered: bool,
}

/// Source that feeds a node.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceSettings {
    /// Node that it feeds.
    pub node: String,
    /// Id of equipment whose tags tell whether it feeds, in the roles `source`,
    /// `active_power` and `reactive_power`. Where missing, it feeds always.
    #[serde(default)]
    pub equipment: Option<String>,
    /// Rated apparent power, MVA: power above 1 % of it is power. Where missing, any is.
    #[serde(default)]
    #[schemars(range(min = 0.000001, max = 100000.0))]
    pub rating_mva: Option<f64>,
    /// Says that no tag tells whether it feeds: it may.
    #[serde(default)]
    pub untelemetered: bool,
}

/// Something that an operator placed or set by hand.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacementSettings {
    /// Kind of the placement.
    pub kind: PlacementKind,
    /// Id of the equipment: the switch that is racked out or set by hand, or the piece that
    /// a portable earth is placed at.
    pub equipment: String,
    /// Node of a portable earth, for equipment that is at several.
    #[serde(default)]
    pub node: Option<String>,
    /// Position of a switch that is set by hand.
    #[serde(default)]
    pub position: Option<HandDressedPosition>,
    /// Person who did it.
    #[serde(default)]
    #[schemars(length(max = 64))]
    pub by: String,
    /// Date and time, as people write them.
    #[serde(default)]
    #[schemars(length(max = 64))]
    pub since: String,
}

/// Kind of a placement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlacementKind {
    /// Portable earth at equipment.
    PortableEarth,
    /// Breaker or switch withdrawn from its contacts.
    RackedOut,
    /// Position set by hand, in place of the one reported.
    HandDressed,
}

/// Position set by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HandDressedPosition {
    /// Open: the branch is parted.
    Open,
    /// Closed: the branch is joined.
    Closed,
}

/// Color in sRGB, eight bits a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(try_from = "String")]
pub struct Color(pub [u8; 3]);

impl TryFrom<String> for Color {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6);
        let number = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let number = number.ok_or_else(|| format!("'{text}' is no colour such as #7a4fb5"))?;
        let [_, red, green, blue] = number.to_be_bytes();
        Ok(Self([red, green, blue]))
    }
}

impl schemars::JsonSchema for Color {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "pattern": "^#[0-9a-fA-F]{6}$" })
    }
}

impl LevelSettings {
    /// The nominal voltage between phases, kV: as set, or as the name has it (`110 kV`,
    /// `10,5 kV`, `400 V`); `None` where neither tells.
    pub fn nominal_kv(&self) -> Option<f64> {
        if self.nominal_kv.is_some() {
            return self.nominal_kv;
        }
        let name = self.name.trim();
        let end = name.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | ',')))?;
        let number: f64 = name[..end].replace(',', ".").parse().ok()?;
        let rest = name[end..].trim_start();
        let unit = rest.find(|c: char| !c.is_ascii_alphabetic()).map_or(rest, |end| &rest[..end]);
        let factor = match unit {
            "kV" | "KV" | "kv" => 1.0,
            "V" => 1e-3,
            _ => return None,
        };
        (number > 0.0).then_some(number * factor)
    }
}
