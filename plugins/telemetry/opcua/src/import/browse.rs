//! Variables of a server's address space below some nodes, by the shortest path to each.

use std::collections::{BTreeMap, HashSet};

use async_opcua::types::{NodeClass, NodeId, ReferenceDescription, ReferenceTypeId};

use super::references::{Browser, Direction, References};
use crate::fault::{Fault, in_words};

/// Most nodes that are browsed; further ones are left out, with a remark.
const MAX_NODES: usize = 200_000;
/// Levels below the nodes that browsing begins at.
const MAX_LEVELS: usize = 32;
/// Bytes of a way; longer ones are no tag's id.
const MAX_PATH_BYTES: usize = 1024;
/// Nodes that cannot be browsed and are named.
const MAX_NAMED: usize = 20;

/// Variable that browsing found.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variable {
    pub(super) node: NodeId,
    /// Path of browse names from the start of browsing, separated by dots.
    pub(super) path: String,
    pub(super) display_name: String,
    /// Node of each property, by browse name.
    pub(super) properties: BTreeMap<String, NodeId>,
}

/// Variables that were found, and remarks on those that were left out.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) variables: Vec<Variable>,
    pub(super) remarks: Vec<String>,
}

/// Finds all variables below these nodes, each by its shortest path, independently of the order of
/// the server's answers. Standard nodes are left out where `skips_standard`.
///
/// # Errors
/// Fault of browsing one of `roots`, or of the connection.
pub(super) async fn variables_below(
    browser: &mut Browser<'_>,
    roots: &[NodeId],
    skips_standard: bool,
) -> Result<Found, Fault> {
    let mut walk = Walk::from(roots, skips_standard);
    for depth in 0.. {
        if walk.level.is_empty() {
            break;
        }
        if depth == MAX_LEVELS {
            walk.remark(&format!("what is deeper than {MAX_LEVELS} levels"));
            break;
        }
        let nodes: Vec<_> = walk.level.iter().map(|place| place.node.clone()).collect();
        // Nodes beyond the limit are not looked at, but the last ones have properties.
        let direction = if walk.is_full { Direction::Properties } else { Direction::Down };
        let (results, is_cut) = browser.references(&nodes, direction).await?;
        if let (0, Some(status)) = (depth, results.iter().find_map(|r| r.as_ref().err())) {
            return Err(Fault::Refused { what: "browsing", status: *status });
        }
        let below = walk.take(results, browser);
        walk.go_down(below, browser);
        if is_cut {
            walk.remark("a part of the references");
        }
    }
    Ok(walk.end())
}

/// Node whose references are asked for.
struct Place {
    path: String,
    node: NodeId,
    /// Index of the variable, where the node is one.
    variable: Option<usize>,
}

/// State of a breadth-first walk through the address space.
struct Walk {
    found: Found,
    seen: HashSet<NodeId>,
    level: Vec<Place>,
    skips_standard: bool,
    /// True once the limit of nodes is reached.
    is_full: bool,
    /// Number of nodes that cannot be browsed.
    refused: usize,
}

impl Walk {
    fn from(roots: &[NodeId], skips_standard: bool) -> Self {
        let root =
            |node: &NodeId| Place { path: String::new(), node: node.clone(), variable: None };
        Self {
            found: Found::default(),
            seen: roots.iter().cloned().collect(),
            level: roots.iter().map(root).collect(),
            skips_standard,
            is_full: false,
            refused: 0,
        }
    }

    fn remark(&mut self, what: &str) {
        let text = format!("{what} is left out: name nodes further down to begin at");
        self.found.remarks.push(text);
    }

    /// Takes the references of a level: properties to their variables, the others as ways
    /// to the next level, in order.
    fn take(
        &mut self,
        results: Vec<References>,
        browser: &Browser<'_>,
    ) -> Vec<(String, ReferenceDescription)> {
        let mut below = Vec::new();
        for (place, result) in std::mem::take(&mut self.level).into_iter().zip(results) {
            let references = match result {
                Ok(references) => references,
                Err(status) => {
                    self.refused += 1;
                    if self.refused <= MAX_NAMED {
                        let text = format!("{}: not browsed: {}", place.path, in_words(status));
                        self.found.remarks.push(text);
                    }
                    continue;
                }
            };
            for reference in references {
                let name = reference.browse_name.name.as_ref();
                if !is_property(&reference) {
                    below.push((join(&place.path, name), reference));
                    continue;
                }
                let variable = place.variable.and_then(|at| self.found.variables.get_mut(at));
                if let (Some(variable), Some(node)) = (variable, browser.here(&reference)) {
                    variable.properties.insert(name.to_owned(), node);
                }
            }
        }
        below.sort_by_cached_key(|(path, reference)| (path.clone(), reference.node_id.to_string()));
        below
    }

    /// Goes to the nodes that were not seen yet.
    fn go_down(&mut self, below: Vec<(String, ReferenceDescription)>, browser: &Browser<'_>) {
        for (path, reference) in below {
            let Some(node) = browser.here(&reference) else { continue };
            if self.skips_standard && node.namespace == 0 || self.seen.contains(&node) {
                continue;
            }
            if self.seen.len() >= MAX_NODES {
                self.is_full = true;
                return self.remark(&format!("what is beyond {MAX_NODES} nodes"));
            }
            self.seen.insert(node.clone());
            let variable = (reference.node_class == NodeClass::Variable).then(|| {
                self.found.variables.push(Variable {
                    node: node.clone(),
                    path: path.clone(),
                    display_name: reference.display_name.text.to_string(),
                    properties: BTreeMap::new(),
                });
                self.found.variables.len() - 1
            });
            self.level.push(Place { path, node, variable });
        }
    }

    fn end(mut self) -> Found {
        if self.refused > MAX_NAMED {
            let text = format!("and {} more were not browsed", self.refused - MAX_NAMED);
            self.found.remarks.push(text);
        }
        self.found
    }
}

fn is_property(reference: &ReferenceDescription) -> bool {
    reference.reference_type_id == ReferenceTypeId::HasProperty
}

/// `A.B`; a name in one line, without blanks around it.
fn join(path: &str, name: &str) -> String {
    let name: String = name.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let name = match name.trim() {
        "" => "_",
        name => name,
    };
    let mut path = if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    path.truncate(path.floor_char_boundary(MAX_PATH_BYTES));
    path
}
