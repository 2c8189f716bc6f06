//! Tags to nodes: which node a tag is bound to, or why to none.

use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};
use std::rc::Rc;

use crate::catalogue::Catalogue;
use crate::fact_extraction::facts_of_tag;
use crate::facts::{Fact, Hint};
use crate::lexicon::{Axis, POSITION, implied_by};
use crate::node_comparison::{ComparisonResult, ListFacts, Query, compare_node};

/// The least confidence with which a tag is bound.
pub const MIN_CONFIDENCE: f64 = 0.6;
/// Least margin of confidence before the second best candidate.
pub const MIN_MARGIN: f64 = 0.08;
/// Limit of nodes compared with one tag; a name that fits more of them is too vague.
pub const MAX_CANDIDATES: usize = 64;
/// Facts that a candidate may have in common less than the best one.
const MAX_FACTS_LESS: usize = 2;
/// Candidates that a proposal lists.
pub const MAX_LISTED: usize = 3;
/// Tags that make a word common, at least.
const MIN_TAGS_OF_COMMON_WORD: usize = 5;
/// Places that a word follows which is the name of a signal, at least.
const MIN_PLACES_OF_SIGNAL: usize = 5;
/// The share of all tags that has a common word.
const COMMON_SHARE: f64 = 0.9;
/// Logical nodes of IEC 61850 that say again what equipment is meant.
const LOGICAL_NODES: [&str; 9] =
    ["xcbr", "xswi", "tctr", "tvtr", "yptr", "zsar", "sarc", "yltc", "zcap"];

/// Names of a tag in the point list.
#[derive(Clone, Copy, Debug, Default)]
pub struct TagName<'a> {
    /// Id of the tag.
    pub id: &'a str,
    /// Name shown to people; may be empty.
    pub description: &'a str,
    /// Unit; may be empty.
    pub unit: &'a str,
    /// True for a switch position.
    pub is_position: bool,
    /// True for a state, as opposed to a measured value.
    pub is_state: bool,
}

/// A node that a tag may belong to.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Id of the node in the scene.
    pub node: String,
    /// 0 to 1; of a node that is out, how near it comes.
    pub confidence: f64,
    /// Agreements, or the contradiction.
    pub reason: String,
    /// True where nothing contradicts.
    pub is_possible: bool,
}

/// Proposal of a node for a tag.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proposal {
    /// Id of the node that it is bound to; none where that is in doubt.
    pub node: Option<String>,
    /// The best nodes, at most [`MAX_LISTED`].
    pub candidates: Vec<Candidate>,
    /// Reason why the tag is bound or not.
    pub reason: String,
}

/// The nodes that agree with a fact, found once.
type Postings = HashMap<Fact, Rc<[u32]>>;

/// The words of a tag, before the list as a whole is known.
struct TagFacts {
    id: Vec<Fact>,
    description: Vec<Fact>,
}

/// Proposes a node for each tag. The same input gives the same proposals.
pub fn propose(tags: &[TagName<'_>], model: &Catalogue) -> Vec<Proposal> {
    let facts: Vec<TagFacts> = tags.iter().map(|tag| read(tag, model)).collect();
    let list = list_facts(&facts);
    let common = common_words(&facts);
    let signals = signal_words(&facts);
    let mut known: HashMap<Query, Proposal> = HashMap::new();
    let mut postings = Postings::new();
    let mut answer = |query: Query| -> Proposal {
        known
            .entry(query)
            .or_insert_with_key(|query| find(query, model, &list, &mut postings))
            .clone()
    };
    let mut propose = |(tag, facts): (&TagName<'_>, &TagFacts)| {
        let first = answer(query(tag, &facts.id, &facts.description, &common, &signals));
        if first.node.is_some() || facts.description.is_empty() {
            return first;
        }
        // An id that says nothing: what people call the tag, then.
        let second = answer(query(tag, &facts.description, &facts.id, &common, &signals));
        if second.node.is_some() { second } else { first }
    };
    tags.iter().zip(&facts).map(|(tag, facts)| propose((tag, facts))).collect()
}

fn read(tag: &TagName<'_>, model: &Catalogue) -> TagFacts {
    let unit = tag.unit.to_lowercase();
    let hint = Hint { unit, is_state: tag.is_state || tag.is_position, is_prose: false };
    let prose = Hint { is_prose: true, ..hint.clone() };
    TagFacts {
        id: facts_of_tag(tag.id, &model.vocabulary, &hint),
        description: facts_of_tag(tag.description, &model.vocabulary, &prose),
    }
}

fn list_facts(facts: &[TagFacts]) -> ListFacts {
    let mut list = ListFacts::default();
    for fact in facts.iter().flat_map(|facts| &facts.id).filter(|fact| !fact.is_soft()) {
        let reading = fact.first();
        if let Some(number) = fact.number {
            list.numbers.entry(reading.concept.clone()).or_default().insert(number);
        }
        let place = (reading.concept.clone(), fact.number);
        list.places.entry(reading.axis).or_default().insert(place);
    }
    list
}

/// Words that nearly all tags have: of the project, and of no place in it.
fn common_words(facts: &[TagFacts]) -> BTreeSet<String> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for facts in facts {
        let words: BTreeSet<&str> = facts.id.iter().map(|fact| fact.text.as_str()).collect();
        words.into_iter().for_each(|word| *counts.entry(word).or_default() += 1);
    }
    let least = (facts.len() as f64 * COMMON_SHARE).max(MIN_TAGS_OF_COMMON_WORD as f64);
    let common = counts.into_iter().filter(|(_, count)| *count as f64 >= least);
    common.map(|(word, _)| word.to_owned()).collect()
}

/// Place as a set of concepts with their numbers.
type Place<'f> = BTreeSet<(&'f str, Option<u32>)>;

/// Unknown words that follow several places: of signals, and of no place.
fn signal_words(facts: &[TagFacts]) -> BTreeSet<String> {
    let mut places: HashMap<&str, BTreeSet<Place<'_>>> = HashMap::new();
    for facts in facts.iter().flat_map(|facts| [&facts.id, &facts.description]) {
        let is_place = |fact: &&Fact| !fact.is_soft() && is_known(fact);
        let Some(last) = facts.iter().rposition(|fact| is_place(&fact)) else { continue };
        // However it is written, and whether or not it says the station.
        let is_own =
            |fact: &&Fact| is_place(fact) && !matches!(fact.axis(), Axis::Station | Axis::Level);
        let place: BTreeSet<_> = facts
            .iter()
            .filter(is_own)
            .map(|fact| (fact.first().concept.as_str(), fact.number))
            .collect();
        for fact in facts[last..].iter().filter(|fact| !is_known(fact)) {
            let places = places.entry(&fact.text).or_default();
            if places.len() < MIN_PLACES_OF_SIGNAL {
                places.insert(place.clone());
            }
        }
    }
    let signals = places.into_iter().filter(|(_, places)| places.len() >= MIN_PLACES_OF_SIGNAL);
    signals.map(|(word, _)| word.to_owned()).collect()
}

fn query(
    tag: &TagName<'_>,
    main: &[Fact],
    beside: &[Fact],
    common: &BTreeSet<String>,
    signals: &BTreeSet<String>,
) -> Query {
    let mut query = Query::default();
    for fact in main {
        if fact.is_soft() {
            add_quantity(fact, &mut query);
        } else if is_known(fact) {
            if !says_again(fact, main) {
                query.required.push(fact.clone());
            }
        } else if common.contains(&fact.text) {
            query.has_common_words = true;
        } else if !signals.contains(&fact.text) {
            query.unknown.push(fact.shown());
        }
    }
    // What stands beside may tell more, but only of what this list speaks of.
    for fact in beside {
        if fact.is_soft() {
            add_quantity(fact, &mut query);
        } else if is_known(fact) && !says_again(fact, beside) {
            query.optional.push(fact.clone());
        }
    }
    if tag.is_position && !query.quantities.contains("tap") {
        query.quantities.insert(POSITION.to_owned());
    }
    query
}

fn add_quantity(fact: &Fact, query: &mut Query) {
    let quantities = fact.readings.iter().filter(|r| r.axis == Axis::Quantity);
    query.quantities.extend(quantities.map(|r| r.concept.clone()));
}

/// Reports whether the word is one of the field or of the model.
fn is_known(fact: &Fact) -> bool {
    fact.axis() != Axis::Word || fact.is_of_model
}

/// A logical node beside the equipment's own designation.
fn says_again(fact: &Fact, all: &[Fact]) -> bool {
    let others = all.iter().filter(|other| !LOGICAL_NODES.contains(&other.text.as_str()));
    LOGICAL_NODES.contains(&fact.text.as_str())
        && others.flat_map(|other| &other.readings).any(|r| fact.readings.contains(r))
}

/// Judges the nodes that share the rarest word with the tag.
fn find(query: &Query, model: &Catalogue, list: &ListFacts, postings: &mut Postings) -> Proposal {
    let Some((nodes, is_cut)) = candidates(query, model, postings) else {
        let reason = "nothing that its name says is in the model".to_owned();
        return Proposal { reason, ..Proposal::default() };
    };
    let mut judged: Vec<(u32, ComparisonResult)> = nodes
        .into_iter()
        .map(|index| (index, compare_node(query, &model.nodes[index as usize], model, list)))
        .collect();
    judged.retain(|(_, verdict)| !verdict.agreed.is_empty() || verdict.against.is_none());
    judged.sort_by(|(i, a), (j, b)| {
        let possible = a.against.is_some().cmp(&b.against.is_some());
        possible.then(b.confidence.total_cmp(&a.confidence)).then(i.cmp(j))
    });
    let possible = judged.iter().filter(|(_, verdict)| verdict.against.is_none()).count();
    let best = judged.first().map_or(0.0, |(_, verdict)| verdict.confidence);
    let second = judged.get(1).filter(|_| possible > 1).map_or(0.0, |(_, v)| v.confidence);
    let reason = if is_cut {
        Err(format!("its name fits more than {MAX_CANDIDATES} nodes"))
    } else if possible == 0 {
        Err(judged
            .first()
            .and_then(|(_, v)| v.against.clone())
            .unwrap_or_else(|| "no node agrees with its name".into()))
    } else if best < MIN_CONFIDENCE {
        Err(format!("the best node is not sure enough: {best:.2} of {MIN_CONFIDENCE} needed"))
    } else if best - second < MIN_MARGIN {
        Err(format!("two nodes are about as likely: {best:.2} and {second:.2}"))
    } else {
        Ok(format!("agrees: {}", judged[0].1.agreed.join(", ")))
    };
    let listed = judged.into_iter().take(MAX_LISTED).map(|(index, verdict)| Candidate {
        node: model.nodes[index as usize].id.clone(),
        confidence: verdict.confidence,
        is_possible: verdict.against.is_none(),
        reason: verdict.against.unwrap_or_else(|| format!("agrees: {}", verdict.agreed.join(", "))),
    });
    let candidates: Vec<_> = listed.collect();
    Proposal {
        node: reason.is_ok().then(|| candidates[0].node.clone()),
        candidates,
        reason: reason.unwrap_or_else(|reason| reason),
    }
}

/// Nodes to judge, and whether there are more than may be.
fn candidates(
    query: &Query,
    model: &Catalogue,
    postings: &mut Postings,
) -> Option<(Vec<u32>, bool)> {
    let mut nodes_of = |fact: &Fact| -> Rc<[u32]> {
        if let Some(nodes) = postings.get(fact) {
            return Rc::clone(nodes);
        }
        let nodes: Rc<[u32]> = model.nodes_of(fact).into();
        postings.insert(fact.clone(), Rc::clone(&nodes));
        nodes
    };
    let facts = query.required.iter().chain(&query.optional);
    let mut lists: Vec<_> = facts.map(&mut nodes_of).collect();
    let rarest = lists.iter().filter(|nodes| !nodes.is_empty()).min_by_key(|nodes| nodes.len())?;
    let nodes = Rc::clone(rarest);
    // The part that such values are of, before other parts.
    let implied = query.quantities.iter().map(|quantity| implied_by(quantity));
    let implied = implied.flat_map(|concepts| concepts.iter().skip(1));
    lists.extend(implied.map(|part| nodes_of(&Fact::implied(&[part]))));
    // Those with most in common first, then those that say least besides.
    let rank = |node: u32| {
        let common = lists.iter().filter(|list| list.binary_search(&node).is_ok()).count();
        (Reverse(common), model.nodes[node as usize].facts.len(), node)
    };
    let mut ranked: Vec<_> = nodes.iter().map(|node| rank(*node)).collect();
    ranked.sort_unstable();
    let (Reverse(most), fewest, _) = *ranked.first()?;
    let is_as_good =
        |(common, facts, _): &(Reverse<usize>, usize, u32)| (common.0, *facts) == (most, fewest);
    let is_cut = ranked.get(MAX_CANDIDATES).is_some_and(is_as_good);
    ranked.truncate(MAX_CANDIDATES);
    ranked.retain(|(common, ..)| common.0 + MAX_FACTS_LESS >= most);
    Some((ranked.into_iter().map(|(.., node)| node).collect(), is_cut))
}

#[cfg(test)]
#[path = "matching_tests.rs"]
mod tests;
