//! The nodes of a model, found by what their names say.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use thiserror::Error;

use crate::fact_extraction::facts_of_node;
use crate::facts::{Fact, Reading, Vocabulary};
use crate::lexicon::Axis;

/// The most nodes that tags are matched with.
pub const MAX_NODES: usize = 500_000;
/// The most facts kept of a node and of those above it.
const MAX_FACTS: usize = 24;

/// A node as the scene has it.
#[derive(Clone, Copy, Debug)]
pub struct NodeName<'a> {
    /// Id in the scene, such as `T1/bushing 1U`.
    pub id: &'a str,
    /// Name without its parents, such as `bushing 1U`.
    pub name: &'a str,
    /// Index of the node that it hangs under, an earlier one.
    pub parent: Option<usize>,
}

/// More nodes than [`MAX_NODES`].
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error(
    "the model has {0} named nodes and features, and tags are matched with {MAX_NODES} at most; \
     import a smaller part of it"
)]
pub struct TooManyNodes(pub usize);

/// Node with the facts of its name.
#[derive(Debug)]
pub(crate) struct Node {
    pub(crate) id: String,
    pub(crate) facts: Vec<Fact>,
    /// Index of its container.
    pub(crate) container: u32,
    /// Weight of each fact.
    pub(crate) weights: Vec<f64>,
}

/// The nodes of a model, ready to be looked up.
#[derive(Debug, Default)]
pub struct Catalogue {
    pub(crate) nodes: Vec<Node>,
    /// Distinct lists of facts that say where equipment is.
    pub(crate) containers: Vec<Vec<Fact>>,
    pub(crate) vocabulary: Vocabulary,
    postings: HashMap<Reading, HashMap<Option<u32>, Vec<u32>>>,
    /// Kinds of equipment that have phases here.
    phased: HashSet<Reading>,
    /// Concepts that occur more than once in some container.
    numbered: HashSet<Reading>,
    /// Ids by id and by own name; `None` for a name that several have.
    by_name: HashMap<String, Option<String>>,
}

impl Catalogue {
    /// Reads the names of all nodes.
    ///
    /// # Errors
    /// More than [`MAX_NODES`].
    pub fn new(names: &[NodeName<'_>]) -> Result<Self, TooManyNodes> {
        if names.len() > MAX_NODES {
            return Err(TooManyNodes(names.len()));
        }
        let mut catalogue = Self::default();
        let mut facts: Vec<Vec<Fact>> = Vec::with_capacity(names.len());
        let mut containers: HashMap<Vec<Fact>, u32> = HashMap::new();
        for name in names {
            catalogue.add_name(name);
            let above = name.parent.map_or(&[][..], |parent| &facts[parent]);
            let all = with_own(above, name);
            let is_news = all.len() > above.len();
            if is_news {
                let container: Vec<_> = all.iter().filter(|f| f.is_context).cloned().collect();
                let next = containers.len() as u32;
                let container = *containers.entry(container).or_insert(next);
                catalogue.nodes.push(Node {
                    id: name.id.to_owned(),
                    facts: all.clone(),
                    container,
                    weights: Vec::new(),
                });
            }
            facts.push(all);
        }
        let mut sorted: Vec<_> = containers.into_iter().collect();
        sorted.sort_by_key(|(_, index)| *index);
        catalogue.containers = sorted.into_iter().map(|(facts, _)| facts).collect();
        catalogue.index();
        Ok(catalogue)
    }

    fn add_name(&mut self, name: &NodeName<'_>) {
        self.by_name.insert(name.id.to_owned(), Some(name.id.to_owned()));
        if name.name != name.id {
            let own = self.by_name.entry(name.name.to_owned());
            own.and_modify(|known| {
                // An id comes before a name that is the same.
                if known.as_deref() != Some(name.name) {
                    *known = None;
                }
            })
            .or_insert_with(|| Some(name.id.to_owned()));
        }
    }

    fn index(&mut self) {
        let mut numbers: BTreeMap<(u32, &Reading), BTreeSet<Option<u32>>> = BTreeMap::new();
        for (index, node) in self.nodes.iter().enumerate() {
            let has_phase = node.facts.iter().any(|f| f.axis() == Axis::Phase);
            for fact in &node.facts {
                let reading = fact.first();
                // Letters of phases are also letters of quantities.
                if !matches!(fact.axis(), Axis::Phase | Axis::Winding) {
                    self.vocabulary.add(fact);
                }
                let postings = self.postings.entry(reading.clone()).or_default();
                let posting = postings.entry(fact.number).or_default();
                if posting.last() != Some(&(index as u32)) {
                    posting.push(index as u32);
                }
                if has_phase && matches!(fact.axis(), Axis::Device | Axis::Part) && !fact.is_context
                {
                    self.phased.insert(reading.clone());
                }
                if !fact.is_context {
                    numbers.entry((node.container, reading)).or_default().insert(fact.number);
                }
            }
        }
        let weights: Vec<Vec<f64>> = self
            .nodes
            .iter()
            .map(|node| node.facts.iter().map(|fact| self.weight(fact)).collect())
            .collect();
        let several = numbers.into_iter().filter(|(_, numbers)| numbers.len() > 1);
        self.numbered = several.map(|((_, reading), _)| reading.clone()).collect();
        for (node, weights) in self.nodes.iter_mut().zip(weights) {
            node.weights = weights;
        }
    }

    /// The node that is called so: by its id, or by a name of its own that no other has.
    pub(crate) fn named(&self, name: &str) -> Option<&str> {
        self.by_name.get(name)?.as_deref()
    }

    /// The id of some node.
    pub(crate) fn example(&self) -> Option<&str> {
        self.nodes.last().map(|node| node.id.as_str())
    }

    /// Reports whether several nodes have this name.
    pub(crate) fn is_shared_name(&self, name: &str) -> bool {
        self.by_name.get(name).is_some_and(Option::is_none)
    }

    pub(crate) fn needs_number(&self, reading: &Reading) -> bool {
        self.numbered.contains(reading)
    }

    pub(crate) fn has_phases(&self, reading: &Reading) -> bool {
        self.phased.contains(reading)
    }

    pub(crate) fn has_concept(&self, axis: Axis, concept: &str) -> bool {
        self.postings.contains_key(&Reading { axis, concept: concept.to_owned() })
    }

    /// The nodes that agree with a fact of a tag, in order.
    pub(crate) fn nodes_of(&self, fact: &Fact) -> Vec<u32> {
        let mut nodes: Vec<u32> = Vec::new();
        for postings in fact.readings.iter().filter_map(|reading| self.postings.get(reading)) {
            let agrees = |n: Option<u32>| n == fact.number || n.is_none() || fact.number.is_none();
            let agreeing = postings.iter().filter(|(number, _)| agrees(**number));
            nodes.extend(agreeing.flat_map(|(_, posting)| posting));
        }
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Returns the weight of a fact: its inverse document frequency, the negated logarithm of the
    /// share of nodes that have it.
    pub(crate) fn weight(&self, fact: &Fact) -> f64 {
        let postings = self.postings.get(fact.first());
        let count = postings.and_then(|p| p.get(&fact.number)).map_or(1, Vec::len);
        (1.0 + self.nodes.len() as f64 / count as f64).ln()
    }
}

/// The facts of a node: of those above it, which say where it is, and its own.
fn with_own(above: &[Fact], name: &NodeName<'_>) -> Vec<Fact> {
    let mut facts: Vec<Fact> = above.to_vec();
    let inherited = facts.len();
    for fact in facts_of_node(name.name) {
        // The name of a file or of a whole model is no evidence of its own.
        if name.parent.is_none() && fact.axis() == Axis::Word {
            continue;
        }
        let says_again = |known: &Fact| {
            known.first() == fact.first() && (known.number == fact.number || fact.number.is_none())
        };
        let is_again = facts[..inherited].iter().any(says_again);
        if !is_again && facts.len() < MAX_FACTS {
            facts.push(fact);
        }
    }
    for fact in &mut facts[..inherited] {
        fact.is_context = true;
    }
    facts
}
