//! The network: connectivity nodes (IEC 61970-301), and what joins, feeds and earths them.

use std::collections::HashMap;

use crate::settings::Settings;

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
    /// Ids of nodes.
    pub nodes: Vec<String>,
    /// Voltage level of each node.
    pub levels: Vec<usize>,
    /// What joins two nodes.
    pub branches: Vec<Branch>,
    /// Branches at each node.
    pub branches_at: Vec<Vec<usize>>,
    /// Earth switches.
    pub earths: Vec<Earth>,
    /// Nodes that are fed, and by what.
    pub sources: Vec<Source>,
    /// Equipment ids of switches, in their order.
    pub switches: Vec<String>,
    /// Equipment ids of all that is shown, in their order.
    pub equipment: Vec<String>,
    /// Equipment that hangs at a node.
    pub at_nodes: Vec<(Equipment, Node)>,
}

/// Joins two nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Its ends.
    pub ends: [Node; 2],
    /// Joins them while it is closed; none where it always does.
    pub switch: Option<Switch>,
    /// What is shown.
    pub equipment: Equipment,
}

/// Earths a node while its switch is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Earth {
    /// The node.
    pub node: Node,
    /// The switch.
    pub switch: Switch,
    /// What is shown.
    pub equipment: Equipment,
}

/// Feeds a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// The node.
    pub node: Node,
    /// Equipment whose tag in the role `source` tells whether it feeds; none where it
    /// always does.
    pub equipment: Option<String>,
}

/// What is wrong with a network.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TopologyError {
    /// A name that nothing has.
    #[error("{place} names the {what} '{name}', which is not there: add it or mend the name")]
    Unknown {
        /// Where.
        place: String,
        /// What kind of thing.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A name that two things have.
    #[error("the {what} '{name}' is there twice: rename one")]
    Twice {
        /// What kind of thing.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// Both ends are the same node.
    #[error("the branch '{0}' joins a node to itself: name the node at its other end")]
    Loop(String),
    /// Too much.
    #[error("{asked} {what}; at most {limit} are taken: split the network")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many.
        asked: usize,
        /// The limit.
        limit: usize,
    },
    /// Nothing can be energised.
    #[error("no source feeds the network: name one under 'sources'")]
    NoSource,
}

/// Numbers for names, in the order in which they come.
#[derive(Default)]
struct Names {
    numbers: HashMap<String, usize>,
    names: Vec<String>,
}

impl Names {
    /// The number of a name, which may be new.
    fn number(&mut self, name: &str) -> usize {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.names.len();
        self.numbers.insert(name.to_owned(), number);
        self.names.push(name.to_owned());
        number
    }

    fn find(&self, what: &'static str, name: &str, place: &str) -> Result<usize, TopologyError> {
        let unknown =
            || TopologyError::Unknown { place: place.to_owned(), what, name: name.to_owned() };
        self.numbers.get(name).copied().ok_or_else(unknown)
    }

    fn once(&mut self, what: &'static str, name: &str) -> Result<usize, TopologyError> {
        if self.numbers.contains_key(name) {
            return Err(TopologyError::Twice { what, name: name.to_owned() });
        }
        Ok(self.number(name))
    }
}

impl Topology {
    /// Checks what was configured.
    ///
    /// # Errors
    /// The first name that is not there or there twice, or the limit exceeded.
    pub fn new(settings: &Settings) -> Result<Self, TopologyError> {
        within("nodes", settings.nodes.len(), MAX_NODES)?;
        within(
            "branches and earth switches",
            settings.branches.len() + settings.earths.len(),
            MAX_BRANCHES,
        )?;
        let (mut levels, mut nodes) = (Names::default(), Names::default());
        let (mut equipment, mut switches) = (Names::default(), Names::default());
        for level in &settings.levels {
            levels.once("voltage level", &level.name)?;
        }
        let mut topology = Self::default();
        for node in &settings.nodes {
            let place = format!("the node '{}'", node.id);
            let index = nodes.once("node", &node.id)?;
            topology.levels.push(levels.find("voltage level", &node.level, &place)?);
            for id in &node.equipment {
                topology.at_nodes.push((equipment.once("equipment", id)?, index));
            }
        }
        for branch in &settings.branches {
            let place = format!("the branch '{}'", branch.equipment);
            let [a, b] = &branch.between;
            let ends = [nodes.find("node", a, &place)?, nodes.find("node", b, &place)?];
            if ends[0] == ends[1] {
                return Err(TopologyError::Loop(branch.equipment.clone()));
            }
            let switch = branch.switch.then(|| switches.number(&branch.equipment));
            // A transformer of three windings is two branches.
            let equipment = equipment.number(&branch.equipment);
            topology.branches.push(Branch { ends, switch, equipment });
        }
        for earth in &settings.earths {
            let place = format!("the earth switch '{}'", earth.equipment);
            let node = nodes.find("node", &earth.node, &place)?;
            let switch = switches.once("switch", &earth.equipment)?;
            let equipment = equipment.number(&earth.equipment);
            topology.earths.push(Earth { node, switch, equipment });
        }
        for source in &settings.sources {
            let node = nodes.find("node", &source.node, "a source")?;
            topology.sources.push(Source { node, equipment: source.equipment.clone() });
        }
        if topology.sources.is_empty() {
            return Err(TopologyError::NoSource);
        }
        topology.nodes = nodes.names;
        topology.find_branches_at();
        topology.switches = switches.names;
        topology.equipment = equipment.names;
        Ok(topology)
    }
}

impl Topology {
    /// The nodes that each piece of equipment is at.
    pub(crate) fn nodes_of_equipment(&self) -> Vec<Vec<Node>> {
        let mut nodes_of = vec![Vec::new(); self.equipment.len()];
        let branches = self.branches.iter();
        let ends = branches.flat_map(|branch| branch.ends.map(|end| (branch.equipment, end)));
        let earthed = self.earths.iter().map(|earth| (earth.equipment, earth.node));
        for (piece, node) in self.at_nodes.iter().copied().chain(ends).chain(earthed) {
            nodes_of[piece].push(node);
        }
        nodes_of
    }

    /// Lists branches by their ends.
    pub(crate) fn find_branches_at(&mut self) {
        self.branches_at = vec![Vec::new(); self.nodes.len()];
        for (index, branch) in self.branches.iter().enumerate() {
            branch.ends.into_iter().for_each(|end| self.branches_at[end].push(index));
        }
    }
}

fn within(what: &'static str, asked: usize, limit: usize) -> Result<(), TopologyError> {
    if asked > limit { Err(TopologyError::TooMany { what, asked, limit }) } else { Ok(()) }
}
