//! Readings of all inputs of a frame, by which equipment is judged.

use crate::contradiction::name_of_source;
use crate::source_reading::SourceReading;
use crate::state::Input;
use crate::switch_reading::SwitchReading;
use crate::topology::{Switch, Topology};
use crate::voltage::VoltageEvidence;

/// Readings of a frame that may differ from those before.
#[derive(Clone, Debug, Default)]
pub struct ChangedReadings {
    /// Switches that may have changed, with their readings.
    pub switches: Vec<(Switch, SwitchReading)>,
    /// Readings of all sources.
    pub sources: Vec<SourceReading>,
    /// Readings of all instrument transformers.
    pub voltages: Vec<VoltageEvidence>,
}

/// Readings of all inputs of one frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Readings {
    /// Readings of switches, in the topology's order.
    pub switches: Vec<SwitchReading>,
    /// Readings of all sources.
    pub sources: Vec<SourceReading>,
    /// Readings of all instrument transformers.
    pub voltages: Vec<VoltageEvidence>,
}

impl Readings {
    /// Tells why an input is unknown, or what is remarkable of it.
    pub fn explain(&self, topology: &Topology, input: Input) -> String {
        let (id, words) = match input {
            Input::Switch(switch) => {
                let id = topology.switches[switch].as_str();
                (id, self.switches[switch].condition.explain(id))
            }
            Input::Source(source) => {
                let id = name_of_source(topology, source);
                (id, self.sources[source].condition.explain(id))
            }
        };
        if words.is_empty() { format!("{id} is not known") } else { words }
    }

    /// Bindings that an input rests on.
    pub fn bindings(&self, input: Input) -> &[u32] {
        match input {
            Input::Switch(switch) => &self.switches[switch].basis,
            Input::Source(source) => &self.sources[source].basis,
        }
    }
}
