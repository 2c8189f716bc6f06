//! What is energised, dead, earthed or unknown, by the positions of switches.

mod settings;
mod state;
mod topology;
mod union_find;

use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};

use busbar_plugin_sdk::{
    Binding, Canvas, Description, DoublePoint, Error, Host, LogLevel, MAX_BINDINGS_A_STATE,
    Overlay, OverlayFrame, Plugin, Quality, TagValue, Value,
};
pub use settings::{
    BranchSettings, Color, EarthSettings, LevelSettings, NodeSettings, Settings, SourceSettings,
};
pub use state::{Energisation, Input, Position, State};
pub use topology::{
    Branch, Earth, Equipment, MAX_BRANCHES, MAX_NODES, Node, Source, Switch, Topology,
    TopologyError,
};

/// Role of a tag that is a switch's position: a double-point, or a bool that is true when
/// closed.
const POSITION: &str = "position";
/// Role of a tag that tells whether a source feeds.
const SOURCE: &str = "source";

/// The overlay.
pub struct EnergisationOverlay {
    settings: Settings,
    topology: Topology,
    /// The binding of each switch and source; none where a tag is missing.
    switch_bindings: Vec<Option<usize>>,
    /// None where a source always feeds.
    source_bindings: Vec<Option<Option<usize>>>,
    /// The switch that a piece of equipment is.
    switch_of: Vec<Option<usize>>,
    energisation: Energisation,
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
        let topology =
            Topology::new(&settings).map_err(|error| Error::settings(error.to_string()))?;
        let mut switch_of = vec![None; topology.equipment.len()];
        for branch in &topology.branches {
            switch_of[branch.equipment] = branch.switch;
        }
        for earth in &topology.earths {
            switch_of[earth.equipment] = Some(earth.switch);
        }
        Ok(Self {
            switch_bindings: vec![None; topology.switches.len()],
            source_bindings: vec![None; topology.sources.len()],
            settings,
            topology,
            switch_of,
            energisation: Energisation::default(),
            host,
        })
    }
}

impl Overlay for EnergisationOverlay {
    fn describe(&self) -> Description {
        Description { legend: self.settings.legend(), equipment: self.topology.equipment.clone() }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        let in_role = |role: &str| -> HashMap<&str, usize> {
            let bindings = bindings.iter().enumerate().filter(|(_, of)| of.role == role);
            bindings.map(|(index, binding)| (binding.node_id.as_str(), index)).collect()
        };
        let (positions, feeds) = (in_role(POSITION), in_role(SOURCE));
        let switches = self.topology.switches.iter();
        self.switch_bindings = switches.map(|id| positions.get(id.as_str()).copied()).collect();
        let feeds = |id: &String| feeds.get(id.as_str()).copied();
        let sources = self.topology.sources.iter();
        self.source_bindings = sources.map(|source| source.equipment.as_ref().map(feeds)).collect();
        // Without any bindings the settings are only tried.
        if !bindings.is_empty() {
            self.warn_of_missing_tags();
        }
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        let values: Vec<TagValue> = frame.values().collect();
        // What rests on no tag of its own rests on all of them: one stands for it.
        let is_good = |binding: &usize| values[*binding].quality == Quality::Good;
        let bound = || {
            let sources = self.source_bindings.iter().flatten();
            self.switch_bindings.iter().chain(sources).flatten().copied()
        };
        let Some(any) = bound().find(is_good).or_else(|| bound().next()) else {
            return Ok(());
        };
        let of_switch = |binding: &Option<usize>| {
            binding.map_or(Position::Unknown, |binding| position(&values[binding]))
        };
        let of_source = |binding: &Option<Option<usize>>| match binding {
            None => Position::Closed,
            Some(None) => Position::Unknown,
            Some(Some(binding)) => feeding(&values[*binding]),
        };
        let positions: Vec<Position> = self.switch_bindings.iter().map(of_switch).collect();
        let sources: Vec<Position> = self.source_bindings.iter().map(of_source).collect();
        let states = self.energisation.states(&self.topology, &positions, &sources).to_vec();

        let Topology { branches, earths, at_nodes, equipment, levels, .. } = &self.topology;
        // Of what is between nodes, the more urgent one shows; then the first level.
        let mut shown: Vec<Option<(State, Reverse<usize>)>> = vec![None; equipment.len()];
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); equipment.len()];
        let ends =
            branches.iter().flat_map(|branch| branch.ends.map(|end| (branch.equipment, end)));
        let earthed = earths.iter().map(|earth| (earth.equipment, earth.node));
        for (piece, node) in at_nodes.iter().copied().chain(ends).chain(earthed) {
            let here = Some((states[node], Reverse(levels[node])));
            shown[piece] = shown[piece].max(here);
            at[piece].push(node);
        }
        for (piece, shown) in shown.into_iter().enumerate() {
            let Some((state, Reverse(level))) = shown else { continue };
            let own = self.switch_of[piece].and_then(|switch| self.switch_bindings[switch]);
            let entry = self.settings.levels.len();
            let entry = match state {
                State::Energised => level,
                State::Dead => entry,
                State::Earthed => entry + 1,
                State::Unknown => entry + 2,
            };
            // What is energised at one end is so whatever becomes of the other.
            let decides = |&&node: &&usize| {
                state != State::Energised || (states[node], levels[node]) == (state, level)
            };
            let mut basis: BTreeSet<usize> = own.into_iter().collect();
            for &node in at[piece].iter().filter(decides) {
                self.energisation.basis(node, |input| {
                    basis.extend(match input {
                        Input::Switch(switch) => self.switch_bindings[switch],
                        Input::Source(source) => self.source_bindings[source].flatten(),
                    });
                });
                if state == State::Energised {
                    break;
                }
            }
            let unknown = self.settings.levels.len() + 2;
            match basis.len() {
                0 => canvas.state(any, piece, entry)?,
                1..=MAX_BINDINGS_A_STATE => {
                    canvas.state_on(basis, piece, entry)?;
                }
                // Nobody could tell in time when it holds no longer.
                _ => canvas.state(any, piece, unknown)?,
            }
        }
        Ok(())
    }
}

impl EnergisationOverlay {
    /// What has no tag is unknown for good: whoever wired the scene must hear of it.
    fn warn_of_missing_tags(&self) {
        let switches = self.topology.switches.iter().zip(&self.switch_bindings);
        let switches = switches.filter(|(_, binding)| binding.is_none()).map(|(id, _)| id);
        let sources = self.topology.sources.iter().zip(&self.source_bindings);
        let sources = sources.filter(|(_, binding)| **binding == Some(None));
        let sources = sources.filter_map(|(source, _)| source.equipment.as_ref());
        for (role, mut missing) in [
            (POSITION, Box::new(switches) as Box<dyn Iterator<Item = &String>>),
            (SOURCE, Box::new(sources)),
        ] {
            if let Some(first) = missing.next() {
                let more = missing.count();
                let others = if more > 0 { format!(" and {more} others") } else { String::new() };
                self.host.log(
                    LogLevel::Warning,
                    &format!("'{first}'{others}: unknown, bind tags in the role '{role}'"),
                );
            }
        }
    }
}

/// Where a switch stands, as its tag has it.
fn position(tag: &TagValue) -> Position {
    if tag.quality != Quality::Good {
        return Position::Unknown;
    }
    match tag.value {
        Some(Value::DoublePoint(DoublePoint::Off) | Value::Bool(false)) => Position::Open,
        Some(Value::DoublePoint(DoublePoint::On) | Value::Bool(true)) => Position::Closed,
        _ => Position::Unknown,
    }
}

/// Whether a source feeds, as its tag has it.
fn feeding(tag: &TagValue) -> Position {
    if tag.quality != Quality::Good {
        return Position::Unknown;
    }
    let feeds = match tag.value {
        Some(Value::F64(value)) => value > 0.0,
        Some(Value::I64(value)) => value > 0,
        Some(Value::Bool(value)) => value,
        Some(Value::DoublePoint(_)) | None => return position(tag),
    };
    if feeds { Position::Closed } else { Position::Open }
}

busbar_plugin_sdk::export_plugin!(EnergisationOverlay: overlay);

#[cfg(test)]
mod tests;
