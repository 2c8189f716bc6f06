//! The network: connectivity nodes (IEC 61970-301), and what joins, feeds and earths them.

use crate::adjacency::Adjacency;
use crate::branch_kind::{BranchKind, EarthKind};
use crate::bridges::find_arcs_to_sources;
use crate::names::Names;
use crate::rows::Rows;
use crate::settings::{BranchSettings, EarthSettings, MAX_LEVELS, MAX_PLACEMENTS, Settings};
use crate::topology_error::TopologyError;

/// Connectivity nodes of one network.
pub const MAX_NODES: usize = 100_000;
/// Branches and earth switches of one network.
pub const MAX_BRANCHES: usize = 200_000;

/// Index of a connectivity node.
pub type Node = usize;
/// Index of a piece of equipment among those that are shown.
pub type Equipment = usize;
/// Index of a switch, and of its position.
pub type Switch = usize;

/// A network, checked: every index is that of something there.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Ids of all nodes.
    pub nodes: Vec<String>,
    /// Voltage level of each node.
    pub levels: Vec<usize>,
    /// Branches that join two nodes.
    pub branches: Vec<Branch>,
    /// Branches at each node.
    pub adjacency: Adjacency,
    /// Tells by each end of a branch, in the order of [`Adjacency::arcs`], whether a source
    /// may lie beyond it.
    pub leads_to_source: Vec<bool>,
    /// Working earths of nodes.
    pub earths: Vec<Earth>,
    /// Nodes that are fed, and by what.
    pub sources: Vec<Source>,
    /// Sources at each node.
    pub sources_at: Rows,
    /// Equipment ids of switches, in their order.
    pub switches: Vec<String>,
    /// Equipment ids of all that is shown, in their order.
    pub equipment: Vec<String>,
    /// Equipment that hangs at a node.
    pub at_nodes: Vec<(Equipment, Node)>,
}

/// Branch that joins two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// The nodes at its ends.
    pub ends: [Node; 2],
    /// Joins them while it is closed; none where it always does.
    pub switch: Option<Switch>,
    /// The equipment that it is.
    pub equipment: Equipment,
    /// Reports whether no earth passes it: it has windings, or is no conductor.
    pub stops_earth: bool,
}

/// Earths a node while its switch is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Earth {
    /// The node that it earths.
    pub node: Node,
    /// The earth switch, or the placing of a portable earth.
    pub switch: Switch,
    /// The equipment that it is.
    pub equipment: Equipment,
}

/// Source that feeds a node.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The node that it feeds.
    pub node: Node,
    /// Equipment whose tags tell whether it feeds; none where it always does.
    pub equipment: Option<String>,
    /// Rated apparent power, MVA.
    pub rating_mva: Option<f64>,
}

/// Names of a network while it is read.
#[derive(Default)]
struct Reader {
    levels: Names,
    nodes: Names,
    equipment: Names,
    switches: Names,
    topology: Topology,
}

impl Topology {
    /// Checks what was configured.
    ///
    /// # Errors
    /// The first name that is not there or there twice, or the limit exceeded.
    pub fn new(settings: &Settings) -> Result<Self, TopologyError> {
        let branches = settings.branches.len() + settings.earths.len();
        within("voltage levels", settings.levels.len(), MAX_LEVELS)?;
        within("nodes", settings.nodes.len(), MAX_NODES)?;
        within("branches and earth switches", branches, MAX_BRANCHES)?;
        within("sources", settings.sources.len(), MAX_BRANCHES)?;
        within("placements", settings.placements.len(), MAX_PLACEMENTS)?;
        let mut reader = Reader::default();
        reader.read_levels(settings)?;
        reader.read_nodes(settings)?;
        settings.branches.iter().try_for_each(|branch| reader.read_branch(branch))?;
        settings.earths.iter().try_for_each(|earth| reader.read_earth(earth))?;
        reader.read_sources(settings)?;
        let Reader { nodes, equipment, switches, mut topology, .. } = reader;
        topology.nodes = nodes.into_names();
        topology.switches = switches.into_names();
        topology.equipment = equipment.into_names();
        topology.adjacency = Adjacency::new(topology.nodes.len(), &topology.branches);
        let sources = topology.sources.iter().enumerate();
        let at_nodes = sources.map(|(index, source)| (source.node, index));
        topology.sources_at = Rows::new(topology.nodes.len(), at_nodes);
        topology.leads_to_source = find_arcs_to_sources(&topology);
        Ok(topology)
    }

    /// Adds an earth that is placed where none is configured, and gives its switch.
    pub(crate) fn add_earth(&mut self, nodes: &[Node], equipment: Equipment) -> Switch {
        let switch = self.switches.len();
        self.switches.push(self.equipment[equipment].clone());
        self.earths.extend(nodes.iter().map(|&node| Earth { node, switch, equipment }));
        switch
    }

    /// Lists the nodes that each piece of equipment is at.
    pub(crate) fn nodes_of_equipment(&self) -> Rows {
        let branches = self.branches.iter();
        let ends = branches.flat_map(|branch| branch.ends.map(|end| (branch.equipment, end)));
        let earthed = self.earths.iter().map(|earth| (earth.equipment, earth.node));
        let pairs = self.at_nodes.iter().copied().chain(ends).chain(earthed);
        Rows::new(self.equipment.len(), pairs)
    }
}

impl Reader {
    fn read_levels(&mut self, settings: &Settings) -> Result<(), TopologyError> {
        for level in &settings.levels {
            self.levels.once("voltage level", &level.name)?;
            let place = || format!("the voltage level '{}'", level.name);
            in_range(place, "nominal_kv", level.nominal_kv, 0.001..=2_000.0, "0.001 to 2000 kV")?;
        }
        Ok(())
    }

    fn read_nodes(&mut self, settings: &Settings) -> Result<(), TopologyError> {
        for node in &settings.nodes {
            let place = format!("the node '{}'", node.id);
            let index = self.nodes.once("node", &node.id)?;
            let level = self.levels.find("voltage level", &node.level, &place)?;
            self.topology.levels.push(level);
            for id in &node.equipment {
                let piece = self.equipment.once("equipment", id)?;
                self.topology.at_nodes.push((piece, index));
            }
        }
        Ok(())
    }

    fn read_branch(&mut self, branch: &BranchSettings) -> Result<(), TopologyError> {
        let BranchSettings { equipment: id, between: [a, b], switch, kind, .. } = branch;
        let place = format!("the branch '{id}'");
        let ends = [self.nodes.find("node", a, &place)?, self.nodes.find("node", b, &place)?];
        if ends[0] == ends[1] {
            return Err(TopologyError::Loop(id.clone()));
        }
        let is_switch_by_kind = kind.is_some_and(BranchKind::is_switch);
        if is_switch_by_kind && *switch == Some(false) {
            return Err(TopologyError::Kind(id.clone()));
        }
        let switch = switch.unwrap_or(is_switch_by_kind).then(|| self.switches.number(id));
        // A transformer of three windings is two branches.
        let equipment = self.equipment.number(id);
        let [a, b] = ends.map(|end| self.topology.levels[end]);
        let stops_earth = a != b || kind.is_some_and(BranchKind::stops_earth);
        self.topology.branches.push(Branch { ends, switch, equipment, stops_earth });
        Ok(())
    }

    fn read_earth(&mut self, earth: &EarthSettings) -> Result<(), TopologyError> {
        let id = &earth.equipment;
        let place = format!("the earth switch '{id}'");
        let node = self.nodes.find("node", &earth.node, &place)?;
        if earth.kind == EarthKind::StarPoint {
            // The earthing of a star point is shown, and earths nothing to work on.
            let piece = self.equipment.number(id);
            self.topology.at_nodes.push((piece, node));
            return Ok(());
        }
        let switch = self.switches.once("switch", id)?;
        let equipment = self.equipment.number(id);
        self.topology.earths.push(Earth { node, switch, equipment });
        Ok(())
    }

    fn read_sources(&mut self, settings: &Settings) -> Result<(), TopologyError> {
        for source in &settings.sources {
            let node = self.nodes.find("node", &source.node, "a source")?;
            let place = || format!("the source at the node '{}'", source.node);
            let range = 1e-6..=100_000.0;
            in_range(place, "rating_mva", source.rating_mva, range, "0.000001 to 100000 MVA")?;
            if let Some(id) = &source.equipment
                && self.equipment.get(id).is_none()
            {
                let piece = self.equipment.number(id);
                self.topology.at_nodes.push((piece, node));
            }
            let equipment = source.equipment.clone();
            let rating_mva = source.rating_mva;
            self.topology.sources.push(Source { node, equipment, rating_mva });
        }
        if self.topology.sources.is_empty() { Err(TopologyError::NoSource) } else { Ok(()) }
    }
}

fn within(what: &'static str, asked: usize, limit: usize) -> Result<(), TopologyError> {
    if asked > limit { Err(TopologyError::TooMany { what, asked, limit }) } else { Ok(()) }
}

fn in_range(
    place: impl Fn() -> String,
    setting: &'static str,
    value: Option<f64>,
    taken: std::ops::RangeInclusive<f64>,
    range: &'static str,
) -> Result<(), TopologyError> {
    match value.filter(|value| !taken.contains(value)) {
        None => Ok(()),
        Some(value) => {
            let value = value.to_string();
            Err(TopologyError::Range { place: place(), setting, value, range })
        }
    }
}
