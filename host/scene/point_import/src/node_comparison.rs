//! Judgment of one tag against one node: agreements and contradictions.
//!
//! A contradiction (another number, another phase, another kind of equipment) excludes the node.
//! So does an omission that leaves several nodes of the station open: one that is missing from
//! the model must not be taken for its neighbour.
//!
//! What contradicts (another number, another phase, another kind of equipment) is no
//! small minus but the end of it, and so is what is left open where the station has
//! several: whichever is missing from the model must not be taken for its neighbour.

mod omissions;

use std::collections::{BTreeSet, HashMap};

use crate::catalogue::{Catalogue, Node};
use crate::facts::Fact;
use crate::lexicon::{self, Axis};

/// Confidence of a match by a synonym.
const SYNONYM: f64 = 0.97;
/// Confidence of a match where only one side names a number.
const NUMBERLESS: f64 = 0.9;
/// Confidence of a match where the quantity alone implies the equipment.
const IMPLIED: f64 = 0.85;
/// Share of a name's weight lost by what the tag leaves out of it.
const LEFT_OUT: f64 = 0.5;
/// Confidence factor of another node where the model has a part for such values.
const NOT_THE_PART: f64 = 0.8;

/// Query for a node: facts about the place and the quantities of a tag.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Query {
    /// Facts that the node must have; nothing else in the query names it.
    pub(crate) required: Vec<Fact>,
    /// Facts that the node must not contradict.
    pub(crate) optional: Vec<Fact>,
    /// Kinds of quantities in the query.
    pub(crate) quantities: BTreeSet<String>,
    /// Words outside lexicon and model, which may name the place.
    pub(crate) unknown: Vec<String>,
    /// True where all tags have some unknown words.
    pub(crate) has_common_words: bool,
}

/// Facts of all tags of a list together.
#[derive(Debug, Default)]
pub(crate) struct ListFacts {
    /// Numbers, by their concept.
    pub(crate) numbers: HashMap<String, BTreeSet<u32>>,
    /// Concepts and numbers by axis.
    pub(crate) places: HashMap<Axis, BTreeSet<(String, Option<u32>)>>,
}

/// Result of comparing a tag with a node.
#[derive(Clone, Debug, Default)]
pub(crate) struct ComparisonResult {
    /// 0 to 1; of a node that is out, how near it is.
    pub(crate) confidence: f64,
    /// Contradiction that excludes the node.
    pub(crate) against: Option<String>,
    pub(crate) agreed: Vec<String>,
}

/// Relation of a tag's fact to those of the node.
enum FactRelation {
    /// The same, or one of both without a number; which fact, how sure.
    Agrees(usize, f64),
    Contradicts(usize),
    /// Said before, in other words.
    Repeats,
    Missing,
}

/// Compares the query with a node.
pub(crate) fn compare_node(
    query: &Query,
    node: &Node,
    model: &Catalogue,
    list: &ListFacts,
) -> ComparisonResult {
    let mut case = Comparison {
        query,
        node,
        model,
        list,
        covered: vec![0.0; node.facts.len()],
        agreed: Vec::new(),
        against: None,
        said: 0.0,
        confirmed: 0.0,
    };
    case.compare_required();
    case.compare_optional();
    case.cover_implied();
    case.check_omissions();
    case.check_kind();
    if let Some(word) = query.unknown.first() {
        case.object(format!("'{word}' is a name that this node does not have"));
    }
    case.verdict()
}

struct Comparison<'a> {
    query: &'a Query,
    node: &'a Node,
    model: &'a Catalogue,
    list: &'a ListFacts,
    /// Confidence for each fact of the node that the tag covers.
    covered: Vec<f64>,
    agreed: Vec<String>,
    against: Option<String>,
    /// Weight of the tag's facts, and of those that the node has.
    said: f64,
    confirmed: f64,
}

impl Comparison<'_> {
    /// Records an objection; the first one is reported.
    fn object(&mut self, reason: String) {
        self.against.get_or_insert(reason);
    }

    fn compare_required(&mut self) {
        let (query, mut order) = (self.query, Vec::new());
        // The same words first: T1-TA1 says "transformer" twice.
        let has_text = |fact: &Fact| self.node.facts.iter().any(|own| own.text == fact.text);
        order.extend(query.required.iter().filter(|f| has_text(f)));
        order.extend(query.required.iter().filter(|f| !has_text(f)));
        for fact in order {
            let weight = self.model.weight(fact);
            match self.standing(fact) {
                FactRelation::Agrees(index, sure) => {
                    self.covered[index] = sure;
                    self.said += weight;
                    self.confirmed += weight * sure;
                    self.agreed.push(fact.shown());
                    self.check_number(fact, index);
                }
                FactRelation::Repeats => {}
                FactRelation::Contradicts(index) => {
                    self.said += weight;
                    let own = self.node.facts[index].shown();
                    self.object(format!("the tag says {}, the node {own}", fact.shown()));
                }
                FactRelation::Missing => {
                    self.said += weight * 0.5;
                    if !self.may_lack(fact) {
                        self.object(format!("the node does not say {}", fact.shown()));
                    }
                }
            }
        }
    }

    fn compare_optional(&mut self) {
        for fact in &self.query.optional {
            match self.standing(fact) {
                FactRelation::Agrees(index, sure) => {
                    self.covered[index] = sure * SYNONYM;
                    self.agreed.push(format!("{} beside", fact.shown()));
                    self.check_number(fact, index);
                }
                FactRelation::Contradicts(index) => {
                    let own = self.node.facts[index].shown();
                    self.object(format!("beside it says {}, the node {own}", fact.shown()));
                }
                FactRelation::Repeats | FactRelation::Missing => {}
            }
        }
    }

    fn standing(&self, fact: &Fact) -> FactRelation {
        let facts = self.node.facts.iter().enumerate();
        let same_text =
            facts.clone().filter(|(i, own)| self.covered[*i] == 0.0 && own.text == fact.text);
        let same_text = same_text.filter(|(_, own)| fact.readings.contains(own.first()));
        let same_concept = facts.clone().filter(|(_, own)| fact.readings.contains(own.first()));
        let open = same_concept.clone().filter(|(i, _)| self.covered[*i] == 0.0);
        let exact = same_text.clone().find(|(_, own)| own.number == fact.number);
        if let Some((index, _)) = exact {
            return FactRelation::Agrees(index, 1.0);
        }
        let Some((index, own)) = same_text.chain(open).next() else {
            let again = |own: &Fact| own.number == fact.number || fact.number.is_none();
            let said: Vec<_> = same_concept.collect();
            if said.iter().any(|(_, own)| again(own)) {
                return FactRelation::Repeats;
            }
            let other_level = facts
                .clone()
                .find(|(_, own)| fact.axis() == Axis::Level && own.axis() == Axis::Level);
            let other = said.first().copied().or(other_level);
            return other
                .map_or(FactRelation::Missing, |(index, _)| FactRelation::Contradicts(index));
        };
        let sure = if own.text == fact.text { 1.0 } else { SYNONYM };
        match (fact.number, own.number) {
            (a, b) if a == b => FactRelation::Agrees(index, sure),
            (Some(_), Some(_)) => FactRelation::Contradicts(index),
            _ => FactRelation::Agrees(index, sure * NUMBERLESS),
        }
    }

    /// Checks a fact for which one side has no number: the number may be needed to tell nodes
    /// apart.
    fn check_number(&mut self, fact: &Fact, index: usize) {
        let own = &self.node.facts[index];
        match (fact.number, own.number) {
            (None, Some(_)) if !own.is_context && self.model.needs_number(own.first()) => {
                self.object(format!("there are several, and the tag does not say {}", own.shown()));
            }
            (Some(_), None) => {
                let numbers = self.list.numbers.get(&own.first().concept);
                if numbers.is_some_and(|numbers| numbers.len() > 1) {
                    let name = own.shown();
                    self.object(format!(
                        "the list has several of {name}, the model does not number them"
                    ));
                }
            }
            _ => {}
        }
    }

    /// Reports whether a node may lack a fact of the tag.
    fn may_lack(&self, fact: &Fact) -> bool {
        let places = |axis| self.list.places.get(&axis).map_or(0, BTreeSet::len);
        let is_transformer = self.has(lexicon::TRANSFORMER);
        match fact.axis() {
            Axis::Level if is_transformer => true,
            axis @ (Axis::Station | Axis::Level | Axis::Bay) => {
                let has_axis = self.node.facts.iter().any(|own| own.axis() == axis);
                !has_axis && places(axis) == 1
            }
            Axis::Winding => is_transformer && !self.has_axis(Axis::Winding),
            Axis::Phase => {
                let own = self.node.facts.iter().filter(|own| !own.is_context);
                let mut kinds = own.filter(|own| matches!(own.axis(), Axis::Device | Axis::Part));
                !self.has_axis(Axis::Phase) && !kinds.any(|own| self.model.has_phases(own.first()))
            }
            _ => false,
        }
    }

    fn has(&self, concept: &str) -> bool {
        self.node.facts.iter().any(|own| own.first().concept == concept)
    }

    fn has_axis(&self, axis: Axis) -> bool {
        self.node.facts.iter().any(|own| own.axis() == axis)
    }

    fn verdict(self) -> ComparisonResult {
        let (mut all, mut left_out) = (0.0, 0.0);
        for (weight, covered) in self.node.weights.iter().zip(&self.covered) {
            all += weight;
            left_out += weight * (1.0 - covered);
        }
        let share = if self.said > 0.0 { self.confirmed / self.said } else { 0.0 };
        let rest = if all > 0.0 { 1.0 - LEFT_OUT * left_out / all } else { 0.0 };
        let confidence = (share * rest).clamp(0.0, 1.0);
        ComparisonResult { confidence, against: self.against, agreed: self.agreed }
    }
}
