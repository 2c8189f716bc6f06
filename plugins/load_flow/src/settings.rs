//! Flows as they are configured.

/// Flows of one overlay.
const MAX_FLOWS: usize = 5_000;

/// Settings of the overlay.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Where power flows.
    #[schemars(length(max = MAX_FLOWS))]
    pub flows: Vec<FlowSettings>,
}

/// Power that flows from one piece of equipment to another.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowSettings {
    /// Id of the equipment that the tag of active power is bound to.
    pub measured_at: String,
    /// Id of the equipment that positive power comes from.
    pub from: String,
    /// Id of the equipment that it goes to.
    pub to: String,
    /// Rated apparent power, MVA.
    pub rating_mva: f64,
}

impl Settings {
    /// What makes no sense, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.flows.len() > MAX_FLOWS {
            return Some(format!("name at most {MAX_FLOWS} flows"));
        }
        self.flows.iter().find_map(|flow| {
            let FlowSettings { measured_at, from, to, rating_mva } = flow;
            if !rating_mva.is_finite() || *rating_mva <= 0.0 {
                return Some(format!("{measured_at}: a rating of {rating_mva} MVA is none"));
            }
            (from == to).then(|| format!("{measured_at}: it flows from '{from}' to itself"))
        })
    }
}
