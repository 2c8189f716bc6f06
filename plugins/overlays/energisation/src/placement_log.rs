//! Log of placements: portable earths, racked-out switches, and positions set by hand.

use busbar_plugin_sdk::{Host, LogLevel};

use crate::readings::Readings;
use crate::settings::{PlacementKind, Settings};
use crate::switch_condition::SwitchCondition;
use crate::topology::Topology;

/// Lines that one frame may log; the rest is counted.
const MAX_LINES: usize = 32;

/// Placements that were told last.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlacementLog {
    /// By switches: what was placed there when it was last known.
    told: Vec<Option<SwitchCondition>>,
}

impl PlacementLog {
    /// Logs what was placed, and what was taken away. A tag that is not good tells neither.
    pub(crate) fn log(&mut self, topology: &Topology, readings: &Readings, host: &Host) {
        let lines = self.changes(topology, readings);
        for line in lines.iter().take(MAX_LINES) {
            host.log(LogLevel::Info, line);
        }
        if let Some(more) = lines.len().checked_sub(MAX_LINES).filter(|more| *more > 0) {
            host.log(LogLevel::Info, &format!("{more} more placements changed"));
        }
    }

    /// Tells what changed since the last call.
    pub(crate) fn changes(&mut self, topology: &Topology, readings: &Readings) -> Vec<String> {
        self.told.resize(readings.switches.len(), None);
        let mut lines = Vec::new();
        let switches = topology.switches.iter().zip(&readings.switches);
        for ((id, reading), told) in switches.zip(&mut self.told) {
            let placed = match reading.condition {
                condition if condition.is_fault() => continue,
                SwitchCondition::Settled => None,
                condition => Some(condition),
            };
            if placed == *told {
                continue;
            }
            lines.push(match (placed, *told) {
                (Some(placed), _) => placed.explain(id),
                (None, Some(told)) => format!("no longer so: {}", told.explain(id)),
                (None, None) => continue,
            });
            *told = placed;
        }
        lines
    }
}

/// Logs the placements of the settings.
pub(crate) fn log_settings(settings: &Settings, host: &Host) {
    for placement in settings.placements.iter().take(MAX_LINES) {
        let what = match placement.kind {
            PlacementKind::PortableEarth => "portable earth placed",
            PlacementKind::RackedOut => "racked out",
            PlacementKind::HandDressed => "position set by hand",
        };
        let mut line = format!("settings: {what} at '{}'", placement.equipment);
        for (joint, text) in [(" by ", &placement.by), (" since ", &placement.since)] {
            if !text.is_empty() {
                line += joint;
                line += text;
            }
        }
        host.log(LogLevel::Info, &line);
    }
    if let Some(more) = settings.placements.len().checked_sub(MAX_LINES).filter(|more| *more > 0) {
        host.log(LogLevel::Info, &format!("settings: {more} more placements"));
    }
}
