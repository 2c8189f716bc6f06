//! Settings of switches and their mechanisms.

/// Switches of one overlay, at most.
const MAX_SWITCHES: usize = 10_000;
/// Mechanisms of one overlay, at most: the host's limit.
const MAX_MECHANISMS: usize = 16;
/// Bytes of a mechanism's name.
const MAX_NAME_BYTES: usize = 64;
/// Longest travel time of a switch, seconds.
const MAX_TRAVEL_SECONDS: f64 = 600.0;

/// Settings of the overlay: the switches whose positions are shown.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The switches, 16 kinds of mechanisms at most.
    #[schemars(length(max = MAX_SWITCHES))]
    pub switches: Vec<SwitchSettings>,
    /// Ids of equipment without tags of positions: it is unknown, and that is no fault.
    #[serde(default)]
    #[schemars(length(max = MAX_SWITCHES))]
    pub untelemetered: Vec<String>,
}

/// Switch whose position is bound to its equipment.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SwitchSettings {
    /// Id of the equipment.
    pub equipment: String,
    /// Role of the tag of its position, a double-point.
    #[serde(default = "position")]
    #[schemars(length(min = 1, max = 200))]
    pub role: String,
    /// Mechanism that moves, as the equipment's model names it.
    #[serde(default = "main")]
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    pub mechanism: String,
    /// Usual travel time from one end to the other, seconds. A switch reported as travelling is
    /// shown at that pace, and is abnormal beyond that time. 0 stands for travel too short to be
    /// seen; travel of more than 30 s is abnormal then.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = MAX_TRAVEL_SECONDS))]
    pub travel_seconds: f64,
}

fn position() -> String {
    "position".to_owned()
}

fn main() -> String {
    "main".to_owned()
}

impl Settings {
    /// Describes an invalid setting, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.switches.len() > MAX_SWITCHES || self.untelemetered.len() > MAX_SWITCHES {
            return Some(format!("name at most {MAX_SWITCHES} switches"));
        }
        let mut mechanisms: Vec<&str> =
            self.switches.iter().map(|s| s.mechanism.as_str()).collect();
        mechanisms.sort_unstable();
        mechanisms.dedup();
        if mechanisms.len() > MAX_MECHANISMS {
            return Some(format!("name at most {MAX_MECHANISMS} kinds of mechanisms"));
        }
        self.switches.iter().find_map(|switch| {
            let SwitchSettings { equipment, mechanism, travel_seconds, .. } = switch;
            if mechanism.is_empty() || mechanism.len() > MAX_NAME_BYTES {
                let most = MAX_NAME_BYTES;
                return Some(format!("{equipment}: give a mechanism of 1 to {most} bytes"));
            }
            (!(0.0..=MAX_TRAVEL_SECONDS).contains(travel_seconds)).then(|| {
                format!(
                    "{equipment}: a switch takes 0 to {MAX_TRAVEL_SECONDS} s, not {travel_seconds}"
                )
            })
        })
    }
}
