//! Topology processing: what is energised, dead, earthed or unknown, by the positions of
//! switches.

mod adjacency;
mod basis;
mod borders;
mod branch_kind;
mod bridges;
mod contradiction;
mod findings;
mod judgment;
mod legend;
mod measured_unit;
mod names;
mod network;
mod placement_log;
mod placements;
mod reachability;
mod readings;
mod reasons;
mod rows;
mod settings;
mod source_reading;
mod state;
mod switch_condition;
mod switch_reading;
mod topology;
mod topology_error;
mod voltage;
mod voltage_doubt;

use busbar_plugin_sdk::{
    Basis, Binding, Canvas, Description, Error, Host, Judgment, Overlay, OverlayFrame, Plugin,
    Quality, TagValue, Value, Verdict, VerdictSeverity,
};

pub use adjacency::{Adjacency, Arc};
pub use basis::MAX_BASIS;
pub use branch_kind::{BranchKind, EarthKind};
pub use contradiction::{Contradiction, Contradictions};
pub use judgment::{Judgments, PieceJudgment, PieceState, Standing};
pub use measured_unit::MeasuredUnit;
pub use network::Network;
pub use reachability::{Certainty, Step};
pub use readings::{ChangedReadings, Readings};
pub use reasons::{MAX_REASON_BYTES, Text};
pub use rows::Rows;
pub use settings::{
    BranchSettings, Color, EarthSettings, HandDressedPosition, LevelSettings, MAX_LEVELS,
    MAX_PLACEMENTS, NodeSettings, PlacementKind, PlacementSettings, Settings, SourceSettings,
};
pub use source_reading::{
    MIN_POWER_SHARE, SourceCondition, SourceReading, SourceTag, SourceWiring,
};
pub use state::{Energisation, Input, Position, State};
pub use switch_condition::{Pole, SwitchCondition, SwitchRole};
pub use switch_reading::{BindingList, Contact, Placed, SwitchReading, SwitchWiring};
pub use topology::{
    Branch, Earth, Equipment, MAX_BRANCHES, MAX_NODES, Node, Source, Switch, Topology,
};
pub use topology_error::TopologyError;
pub use voltage::{
    ABSENT_AGAIN_BELOW, ABSENT_BELOW, MAX_PLAUSIBLE, PRESENT_FROM, PRESENT_UNTIL, Phase, PhaseTag,
    VoltageBand, VoltageEvidence, VoltageMemory, VoltageWiring,
};

use placement_log::PlacementLog;

/// Overlay of the states of a network.
pub struct EnergisationOverlay {
    settings: Settings,
    /// The network as it is configured.
    topology: Topology,
    network: Network,
    /// Hysteresis of the voltages of sources, in their order.
    source_memories: Vec<VoltageMemory>,
    /// Values that the judgments were worked out of.
    values: Vec<(Option<Value>, Quality)>,
    judgments: Judgments,
    placement_log: PlacementLog,
    host: Host,
}

impl Plugin for EnergisationOverlay {
    const ID: &'static str = "energisation";
    const NAME: &'static str = "Energisation";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str =
        "What is energised, dead, earthed or unknown, by the positions of switches.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        let fault = |error: TopologyError| Error::settings(error.to_string());
        let topology = Topology::new(&settings).map_err(fault)?;
        let network = Network::new(&settings, &topology, &[]).map_err(fault)?;
        placement_log::log_settings(&settings, &host);
        Ok(Self {
            settings,
            topology,
            network,
            source_memories: Vec::new(),
            values: Vec::new(),
            judgments: Judgments::default(),
            placement_log: PlacementLog::default(),
            host,
        })
    }
}

impl Overlay for EnergisationOverlay {
    fn describe(&self) -> Description {
        Description {
            legend: self.settings.legend(),
            equipment: self.topology.equipment.clone(),
            findings: self.network.findings.clone(),
            ..Description::default()
        }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        self.network = Network::new(&self.settings, &self.topology, &bindings)
            .map_err(|error| Error::settings(error.to_string()))?;
        self.source_memories = vec![VoltageMemory::default(); self.network.sources.len()];
        self.values.clear();
        self.judgments = Judgments::default();
        self.placement_log = PlacementLog::default();
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        self.update(&values);
        // What rests on no tag of its own rests on all of them: one stands for it.
        let is_good = |tag: &TagValue| tag.quality == Quality::Good;
        let any = values.iter().position(is_good).or((!values.is_empty()).then_some(0));
        let Self { judgments, settings, .. } = self;
        // Pieces share lists of bindings.
        let mut lists: Vec<Option<Basis>> = vec![None; judgments.list_count()];
        for (piece, judgment) in judgments.pieces.iter().enumerate() {
            let Some(judgment) = judgment else {
                let judgment = Judgment::unknown("it is at no node of the network");
                canvas.judge(piece, Basis::NONE, &judgment)?;
                continue;
            };
            let bindings = judgments.basis(judgment.basis).iter().map(|binding| *binding as usize);
            let list = &mut lists[judgment.basis as usize];
            let basis = match *list {
                Some(basis) => basis,
                None => *list.insert(canvas.basis(bindings.clone())?),
            };
            let verdict = match judgment.standing {
                Standing::Normal => Verdict::Normal,
                Standing::Abnormal => Verdict::Abnormal,
                Standing::Unknown => Verdict::Unknown,
            };
            let [reason, assumption] =
                [judgment.reason, judgment.assumption].map(|text| judgments.text(text));
            let severity = VerdictSeverity::Alarm;
            canvas.judge(piece, basis, &Judgment { verdict, severity, reason, assumption })?;
            let entry = settings.legend_entry(judgment.state, judgment.level);
            match (bindings.len(), any) {
                (0, Some(any)) => canvas.state(any, piece, entry)?,
                (0, None) => {}
                _ => canvas.state_on(bindings, piece, entry)?,
            }
        }
        Ok(())
    }
}

impl EnergisationOverlay {
    /// Faults of the bindings, each as cause and remedy.
    pub fn findings(&self) -> &[String] {
        &self.network.findings
    }

    /// Judgments of the last frame, in the order of the equipment described.
    pub fn judgments(&self) -> &Judgments {
        &self.judgments
    }

    /// Judges anew where an input changed.
    fn update(&mut self, values: &[TagValue]) {
        let is_same = |(tag, (value, quality)): (&TagValue, &(Option<Value>, Quality))| {
            tag.value == *value && tag.quality == *quality
        };
        let is_judged = !self.judgments.pieces.is_empty();
        if is_judged
            && values.len() == self.values.len()
            && values.iter().zip(&self.values).all(is_same)
        {
            return;
        }
        let may_go_on = is_judged && values.len() == self.values.len();
        if may_go_on {
            let changes = self.read_changes(values);
            if !self.judgments.update(&self.network, changes) {
                return;
            }
        } else {
            let readings = self.read(values);
            self.judgments.judge(&self.network, readings);
        }
        self.placement_log.log(&self.network.topology, self.judgments.readings(), &self.host);
    }

    fn read(&mut self, values: &[TagValue]) -> Readings {
        self.values.clear();
        self.values.extend(values.iter().map(|tag| (tag.value.clone(), tag.quality)));
        let Self { network, source_memories, .. } = self;
        let sources = network.sources.iter().zip(source_memories);
        Readings {
            switches: network.switches.iter().map(|switch| switch.read(values)).collect(),
            sources: sources.map(|(source, memory)| source.read(values, memory)).collect(),
            voltages: network.voltages.iter_mut().map(|voltage| voltage.read(values)).collect(),
        }
    }

    /// Reads the switches of which a tag changed, and all sources and voltages.
    fn read_changes(&mut self, values: &[TagValue]) -> ChangedReadings {
        let Self { network, source_memories, .. } = self;
        let mut switches = Vec::new();
        for (binding, (tag, known)) in values.iter().zip(&mut self.values).enumerate() {
            let (value, quality) = &*known;
            if tag.value != *value || tag.quality != *quality {
                *known = (tag.value.clone(), tag.quality);
                switches.extend_from_slice(network.switches_of_binding.row(binding));
            }
        }
        switches.sort_unstable();
        switches.dedup();
        let read = |switch: usize| (switch, network.switches[switch].read(values));
        let sources = network.sources.iter().zip(source_memories);
        ChangedReadings {
            switches: switches.into_iter().map(read).collect(),
            sources: sources.map(|(source, memory)| source.read(values, memory)).collect(),
            voltages: network.voltages.iter_mut().map(|voltage| voltage.read(values)).collect(),
        }
    }
}

busbar_plugin_sdk::export_plugin!(EnergisationOverlay: overlay);

#[cfg(test)]
mod bench_tests;
#[cfg(test)]
mod enumeration_tests;
#[cfg(test)]
mod fault_tests;
#[cfg(test)]
mod finding_tests;
#[cfg(test)]
mod limit_tests;
#[cfg(test)]
mod operator_input_tests;
#[cfg(test)]
mod random_network;
#[cfg(test)]
mod source_tests;
#[cfg(test)]
mod test_station;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod update_tests;
#[cfg(test)]
mod voltage_tests;
#[cfg(test)]
mod winding_tests;
