//! Faults of the settings that no binding could mend, each with its place and remedy.

use std::collections::HashSet;

use busbar_plugin_sdk::state_file_fault;

use crate::ageing::MAX_MOISTURE;
use crate::interval::Interval;
use crate::settings::{
    MAX_PLAUSIBLE_LOAD, MAX_STAGES, MAX_TAPS, MAX_TRANSFORMERS, PLAUSIBLE_AMBIENT, Settings,
    TransformerSettings,
};
use crate::thermal_constants::Limits;

impl Settings {
    /// Fault of the settings that no binding could mend, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        if self.transformers.is_empty() || self.transformers.len() > MAX_TRANSFORMERS {
            return Some(format!("name 1 to {MAX_TRANSFORMERS} transformers"));
        }
        if let Some(fault) = self.state_file.as_deref().and_then(state_file_fault) {
            return Some(fault);
        }
        let mut seen = HashSet::new();
        if let Some(of) = self.transformers.iter().find(|of| !seen.insert(&of.equipment)) {
            return Some(format!("'{}' is named twice; keep one of them", of.equipment));
        }
        let own = [
            ("ambient", self.ambient, PLAUSIBLE_AMBIENT),
            ("longest_step_seconds", Some(self.longest_step_seconds), Interval::new(0.6, 3_600.0)),
        ];
        own.into_iter()
            .find_map(out_of_range)
            .or_else(|| range_fault("plausible_ambient", self.plausible_ambient, PLAUSIBLE_AMBIENT))
            .or_else(|| {
                self.transformers.iter().find_map(|of| {
                    of.fault().map(|fault| format!("transformer '{}': {fault}", of.equipment))
                })
            })
    }
}

/// A number with the range that it must lie in.
type Bounded<'a> = (&'a str, Option<f64>, Interval);

fn out_of_range((name, value, range): Bounded<'_>) -> Option<String> {
    let value = value.filter(|value| !(range.low..=range.high).contains(value))?;
    Some(format!("{name} is {value}: give {} to {}", range.low, range.high))
}

fn range_fault(name: &str, [least, most]: [f64; 2], within: Interval) -> Option<String> {
    let is_within = least >= within.low && least <= most && most <= within.high;
    (!is_within).then(|| {
        format!(
            "{name} is [{least}, {most}]: give two numbers, the lesser first, from {} to {}",
            within.low, within.high
        )
    })
}

impl TransformerSettings {
    fn fault(&self) -> Option<String> {
        let ratings = [
            ("rated_power", self.rated_power, Interval::new(1e-3, 1e4)),
            ("rated_voltage", self.rated_voltage, Interval::new(0.1, 2e3)),
            ("rated_current", self.rated_current, Interval::new(0.1, 1e6)),
            ("rated_load", self.rated_load, Interval::new(1e-6, 1e9)),
            ("top_oil_rise", self.top_oil_rise, Interval::new(1.0, 200.0)),
            ("gradient", self.gradient, Interval::new(0.0, 200.0)),
            ("hot_spot_factor", self.hot_spot_factor, Interval::new(1.0, 5.0)),
            ("loss_ratio", self.loss_ratio, Interval::new(0.1, 10_000.0)),
            ("oil_minutes", self.oil_minutes, Interval::new(1.0, 1e4)),
            ("winding_minutes", self.winding_minutes, Interval::new(0.1, 1e3)),
            ("top_oil_limit", self.top_oil_limit, Interval::new(20.0, 300.0)),
            ("hot_spot_limit", self.hot_spot_limit, Interval::new(20.0, 400.0)),
            ("disagreement", Some(self.disagreement), Interval::new(1.0, 100.0)),
            ("moisture", self.moisture, Interval::new(0.0, MAX_MOISTURE)),
        ];
        let of_stages = self.stages.iter().flat_map(|of| {
            [
                ("rated_share of a stage", Some(of.rated_share), Interval::new(0.05, 2.0)),
                ("top_oil_rise of a stage", of.top_oil_rise, Interval::new(1.0, 200.0)),
                ("gradient of a stage", of.gradient, Interval::new(0.0, 200.0)),
            ]
        });
        let of_taps = self
            .taps
            .iter()
            .map(|of| ("rated_current of a tap", Some(of.rated_current), Interval::new(0.1, 1e6)));
        let plausible_load = self.plausible_load.and_then(|range| {
            range_fault("plausible_load", range, Interval::new(0.0, MAX_PLAUSIBLE_LOAD))
        });
        let out_of_range =
            ratings.into_iter().chain(of_stages).chain(of_taps).find_map(out_of_range);
        out_of_range.or(plausible_load).or_else(|| self.list_fault())
    }

    fn list_fault(&self) -> Option<String> {
        if self.stages.len() > MAX_STAGES || self.taps.len() > MAX_TAPS {
            return Some(format!("give at most {MAX_STAGES} stages and {MAX_TAPS} taps"));
        }
        let mut stages = HashSet::new();
        if let Some(of) = self.stages.iter().find(|of| !stages.insert(of.stage)) {
            return Some(format!("stage {} is given twice; keep one of them", of.stage));
        }
        let mut taps = HashSet::new();
        if let Some(of) = self.taps.iter().find(|of| !taps.insert(of.tap)) {
            return Some(format!("tap {} is given twice; keep one of them", of.tap));
        }
        let has_limits = self.top_oil_limit.is_some() && self.hot_spot_limit.is_some();
        let table = Limits::new(self.loading, self.size()).temperatures;
        (table.is_none() && !has_limits).then(|| {
            "table 2 of IEC 60076-7 sets a small transformer no temperatures for short-time \
             emergency loading; give top_oil_limit and hot_spot_limit"
                .to_owned()
        })
    }
}

#[cfg(test)]
#[path = "settings_faults_tests.rs"]
mod tests;
