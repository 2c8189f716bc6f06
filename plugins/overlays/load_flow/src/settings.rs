//! Settings of flows and their measuring points.

/// Flows of one overlay, at most.
const MAX_FLOWS: usize = 5_000;
/// Share of the rating that may be lost between two ends where nothing is set, percent.
pub(crate) const DEFAULT_LOSS_PERCENT: f64 = 5.0;

/// Settings of the overlay.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Flows of power between pieces of equipment.
    #[schemars(length(max = MAX_FLOWS))]
    pub flows: Vec<FlowSettings>,
    /// Ids of places of measurement without tags: their flows are unknown, and that is no
    /// fault.
    #[serde(default)]
    #[schemars(length(max = MAX_FLOWS))]
    pub untelemetered: Vec<String>,
}

/// Power that flows from one piece of equipment to another.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowSettings {
    /// Id of the equipment that the tags of active and reactive power are bound to.
    pub measured_at: String,
    /// Id of the equipment that positive power comes from.
    pub from: String,
    /// Id of the equipment that positive power goes to.
    pub to: String,
    /// Rated apparent power, MVA.
    pub rating_mva: f64,
    /// Role of the tags of active power.
    #[serde(default = "active_power")]
    #[schemars(length(min = 1, max = 200))]
    pub role: String,
    /// Role of the tags of reactive power; without such a tag the apparent power is assumed
    /// to be the active power.
    #[serde(default = "reactive_power")]
    #[schemars(length(min = 1, max = 200))]
    pub reactive_role: String,
    /// Id of the equipment at the other end where the same power is measured, in the same
    /// roles: both ends are compared, and one stands in for the other while it is bad.
    #[serde(default)]
    pub other_end: Option<String>,
    /// Direction in which the other end counts positive; either without it, so that only
    /// amounts are compared.
    #[serde(default)]
    pub other_end_counts: Option<Direction>,
    /// Largest difference of active power between both ends, percent of the rating; 5
    /// without it.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub max_loss_percent: Option<f64>,
}

/// Direction in which power counts positive at the other end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Direction of the first end: from `from` to `to`.
    Along,
    /// Direction into the line from both ends.
    Against,
}

fn active_power() -> String {
    "active_power".to_owned()
}

fn reactive_power() -> String {
    "reactive_power".to_owned()
}

impl Settings {
    /// Describes an invalid setting, if there is one.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.flows.len() > MAX_FLOWS || self.untelemetered.len() > MAX_FLOWS {
            return Some(format!("name at most {MAX_FLOWS} flows"));
        }
        self.flows.iter().find_map(FlowSettings::fault)
    }
}

impl FlowSettings {
    /// Returns the measuring points, the first end first.
    pub(crate) fn ends(&self) -> impl Iterator<Item = &str> {
        [Some(&self.measured_at), self.other_end.as_ref()].into_iter().flatten().map(String::as_str)
    }

    /// Returns the largest difference of active power between both ends, MW.
    pub(crate) fn max_loss(&self) -> f64 {
        self.max_loss_percent.unwrap_or(DEFAULT_LOSS_PERCENT) / 100.0 * self.rating_mva
    }

    fn fault(&self) -> Option<String> {
        let Self { measured_at, from, to, rating_mva, other_end, max_loss_percent, .. } = self;
        if !rating_mva.is_finite() || *rating_mva <= 0.0 {
            return Some(format!("{measured_at}: a rating of {rating_mva} MVA is none"));
        }
        if from == to {
            return Some(format!("{measured_at}: it flows from '{from}' to itself"));
        }
        if other_end.as_ref() == Some(measured_at) {
            return Some(format!(
                "{measured_at}: its other end is itself; name the equipment at the other end"
            ));
        }
        if self.role == self.reactive_role {
            let role = &self.role;
            return Some(format!("{measured_at}: '{role}' is the role of both powers"));
        }
        let is_share = |percent: &f64| (0.0..=100.0).contains(percent);
        max_loss_percent
            .filter(|percent| !is_share(percent))
            .map(|percent| format!("{measured_at}: losses of {percent} % are none; give 0 to 100"))
    }
}
