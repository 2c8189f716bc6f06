//! Equipment names and aliases, and the device that a scene node belongs to.

use std::collections::{BTreeMap, HashMap};

use busbar_config::EquipmentConfig;
use busbar_scene::{NodeIndex, SceneGraph};

/// The names of a piece of equipment besides its id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EquipmentNames {
    /// Descriptive name; may be empty.
    pub name: String,
    /// Other ids of the equipment.
    pub aliases: Vec<String>,
}

/// Index of the equipment's names and aliases.
#[derive(Debug, Default)]
pub struct EquipmentIndex {
    names: HashMap<NodeIndex, EquipmentNames>,
    by_alias: HashMap<String, NodeIndex>,
}

impl EquipmentIndex {
    /// Builds the index from a configuration; calls `absent` for equipment that the scene lacks.
    pub fn new(
        graph: &SceneGraph,
        equipment: &BTreeMap<String, EquipmentConfig>,
        mut absent: impl FnMut(&str, &EquipmentConfig),
    ) -> Self {
        let mut found = Self::default();
        for (id, config) in equipment {
            let Some(node) = graph.find(id) else {
                absent(id, config);
                continue;
            };
            let EquipmentConfig { name, aliases, .. } = config;
            found.by_alias.extend(aliases.iter().map(|alias| (alias.clone(), node)));
            found
                .names
                .insert(node, EquipmentNames { name: name.clone(), aliases: aliases.clone() });
        }
        found
    }

    /// Returns the names of a node besides its id.
    pub fn names(&self, node: NodeIndex) -> Option<&EquipmentNames> {
        self.names.get(&node)
    }

    /// The node of an id or an alias.
    pub fn find(&self, graph: &SceneGraph, id: &str) -> Option<NodeIndex> {
        graph.find(id).or_else(|| self.by_alias.get(id).copied())
    }

    /// The device that a node is, or is a pole or part of.
    ///
    /// The device is the nearest node upwards that the configuration names. Otherwise it is the
    /// highest ancestor with a product designation (IEC 81346-1: a `-` behind a prefix), or else
    /// the placement of the node.
    pub fn device_of(&self, graph: &SceneGraph, node: NodeIndex) -> NodeIndex {
        let way = || std::iter::successors(Some(node), |node| graph.node(*node).parent());
        let named = way().find(|node| self.names.contains_key(node));
        let product = || way().filter(|node| is_product(graph.node(*node).name())).last();
        let placed = || way().find(|node| !graph.node(*node).is_part());
        named.or_else(product).or_else(placed).unwrap_or(node)
    }
}

/// Reports whether a name is a reference designation (IEC 81346-1). Such a name begins with an
/// aspect's prefix: `=` function, `-` product, `+` location.
pub fn is_designation(name: &str) -> bool {
    name.starts_with(['=', '-', '+'])
}

/// Reports whether a name is a product designation (IEC 81346-1).
fn is_product(name: &str) -> bool {
    is_designation(name) && name.contains('-')
}

#[cfg(test)]
mod tests {
    use busbar_scene::{Placement, Transform};

    use super::*;

    fn graph(nodes: &[(&str, Option<usize>)]) -> SceneGraph {
        let placement = |(id, parent): &(&str, Option<usize>)| Placement {
            id: (*id).into(),
            parent: *parent,
            transform: Transform::default(),
            model: None,
            theta: None,
        };
        let placements: Vec<Placement> = nodes.iter().map(placement).collect();
        SceneGraph::build(&placements, &[]).expect("ids are used once")
    }

    fn equipment(graph: &SceneGraph, named: &[(&str, &[&str])]) -> EquipmentIndex {
        let config = |(id, aliases): &(&str, &[&str])| {
            let aliases = aliases.iter().map(|alias| (*alias).to_owned()).collect();
            ((*id).to_owned(), EquipmentConfig { aliases, ..EquipmentConfig::default() })
        };
        EquipmentIndex::new(graph, &named.iter().map(config).collect(), |_, _| ())
    }

    #[test]
    fn a_pole_resolves_to_its_device_and_a_bay_to_itself() {
        let graph = graph(&[
            ("=S12D1Q3", None),
            ("=S12D1Q3-QB9", Some(0)),
            ("=S12D1Q3-QB9-L1", Some(1)),
            ("gate", None),
        ]);
        let device = |id: &str, equipment: &EquipmentIndex| {
            let node = graph.find(id).expect("it is there");
            graph.node(equipment.device_of(&graph, node)).id()
        };
        let none = EquipmentIndex::default();
        assert_eq!(device("=S12D1Q3-QB9-L1", &none), "=S12D1Q3-QB9");
        assert_eq!(device("=S12D1Q3-QB9", &none), "=S12D1Q3-QB9");
        assert_eq!(device("=S12D1Q3", &none), "=S12D1Q3");
        assert_eq!(device("gate", &none), "gate");
        let pole = equipment(&graph, &[("=S12D1Q3-QB9-L1", &["pole"])]);
        assert_eq!(device("=S12D1Q3-QB9-L1", &pole), "=S12D1Q3-QB9-L1", "it has a name of its own");
    }

    #[test]
    fn all_aliases_lead_to_the_same_equipment() {
        let graph = graph(&[("=Q1-QA1", None)]);
        let equipment = equipment(&graph, &[("=Q1-QA1", &["2211", "S1/XCBR1"]), ("=Q9", &["x"])]);
        for id in ["=Q1-QA1", "2211", "S1/XCBR1"] {
            assert_eq!(equipment.find(&graph, id), Some(NodeIndex(0)), "{id}");
        }
        assert_eq!(equipment.find(&graph, "x"), None, "its equipment is not in the scene");
    }
}
