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
    /// The nodes that a piece of equipment is at.
    nodes_of: Vec<Vec<Node>>,
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
            nodes_of: topology.nodes_of_equipment(),
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
        Description {
            legend: self.settings.legend(),
            equipment: self.topology.equipment.clone(),
            ..Description::default()
        }
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

        for piece in 0..self.nodes_of.len() {
            // Of what is between nodes, the more urgent one shows; then the first level.
            let here = |&node: &usize| (states[node], Reverse(self.topology.levels[node]));
            let Some((state, Reverse(level))) = self.nodes_of[piece].iter().map(here).max() else {
                continue;
            };
            let basis = self.basis_of(piece, (state, level), &states);
            let after_levels = self.settings.levels.len();
            let entry = |state| match state {
                State::Energised => level,
                State::Dead => after_levels,
                State::Earthed => after_levels + 1,
                State::Unknown => after_levels + 2,
            };
            match basis.len() {
                0 => canvas.state(any, piece, entry(state))?,
                1..=MAX_BINDINGS_A_STATE => canvas.state_on(basis, piece, entry(state))?,
                // Nobody could tell in time when it holds no longer.
                _ => canvas.state(any, piece, entry(State::Unknown))?,
            }
        }
        Ok(())
    }
}

impl EnergisationOverlay {
    /// The bindings that a piece of equipment's state and level rest on.
    fn basis_of(
        &mut self,
        piece: usize,
        (state, level): (State, usize),
        states: &[State],
    ) -> BTreeSet<usize> {
        let Self { topology, energisation, switch_bindings, source_bindings, .. } = self;
        let own = self.switch_of[piece].and_then(|switch| switch_bindings[switch]);
        let mut basis: BTreeSet<usize> = own.into_iter().collect();
        let mut rest_on = |node| {
            energisation.basis(node, |input| {
                basis.extend(match input {
                    Input::Switch(switch) => switch_bindings[switch],
                    Input::Source(source) => source_bindings[source].flatten(),
                });
            });
        };
        let mut nodes = self.nodes_of[piece].iter().copied();
        if state == State::Energised {
            // What is so at one end is so whatever becomes of the other.
            let decides = |&node: &usize| (states[node], topology.levels[node]) == (state, level);
            nodes.find(decides).into_iter().for_each(rest_on);
        } else {
            nodes.for_each(&mut rest_on);
        }
        basis
    }

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
