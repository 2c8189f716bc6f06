//! The network as it is configured.

use busbar_plugin_sdk::LegendEntry;
use busbar_plugin_sdk::Pattern;

/// Settings of the overlay: the network's connectivity nodes, and what joins, feeds and
/// earths them. Positions come from tags bound to the switches in the role `position`.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Voltage levels.
    #[schemars(length(min = 1, max = 32))]
    pub levels: Vec<LevelSettings>,
    /// Connectivity nodes.
    #[schemars(length(min = 1))]
    pub nodes: Vec<NodeSettings>,
    /// What joins nodes: switches, current transformers, transformers, lines.
    #[serde(default)]
    pub branches: Vec<BranchSettings>,
    /// Earth switches.
    #[serde(default)]
    pub earths: Vec<EarthSettings>,
    /// What feeds nodes.
    #[schemars(length(min = 1))]
    pub sources: Vec<SourceSettings>,
}

/// A voltage level.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LevelSettings {
    /// Name, as the legend shows it, such as `220 kV`.
    #[schemars(length(min = 1, max = 32))]
    pub name: String,
    /// Colour of what is energised, `#rrggbb`.
    pub color: Color,
}

/// A connectivity node.
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

/// Joins two nodes.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BranchSettings {
    /// Equipment id.
    pub equipment: String,
    /// The nodes.
    pub between: [String; 2],
    /// Whether it joins them only while its position is closed.
    #[serde(default)]
    pub switch: bool,
}

/// An earth switch.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EarthSettings {
    /// Equipment id.
    pub equipment: String,
    /// The node that it earths.
    pub node: String,
}

/// Feeds a node.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SourceSettings {
    /// The node.
    pub node: String,
    /// Id of equipment with a tag in the role `source`: it feeds while that is true or
    /// more than 0. Where missing, it feeds always.
    #[serde(default)]
    pub equipment: Option<String>,
}

/// sRGB.
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

/// Of what is dead: a grey.
const DEAD: [u8; 3] = [0x4a, 0x4e, 0x54];
/// Of what is earthed (IEC 60445: green and yellow is the protective conductor).
const EARTHED: [u8; 3] = [0x5f, 0xa8, 0x2d];
/// Of what is not known.
const UNKNOWN: [u8; 3] = [0x9c, 0x1f, 0x8c];

impl Settings {
    /// The legend: each level energised, then dead, earthed and unknown.
    pub fn legend(&self) -> Vec<LegendEntry> {
        let entry = |name: String, color, pattern| LegendEntry { name, color, pattern };
        let energised = |level: &LevelSettings| {
            entry(format!("{} energised", level.name), level.color.0, Pattern::Solid)
        };
        let others = [
            entry("dead".into(), DEAD, Pattern::Dotted),
            entry("earthed".into(), EARTHED, Pattern::Crossed),
            entry("unknown".into(), UNKNOWN, Pattern::Striped),
        ];
        self.levels.iter().map(energised).chain(others).collect()
    }
}
