//! Facts in a name about the equipment that it means, and the vocabulary of a model.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::lexicon::{Axis, LEXICON, PHASE, WINDING};

/// Number that stands for "between phases": no single phase.
pub(crate) const BETWEEN: u32 = 12;

/// A meaning that a word can have.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Reading {
    pub(crate) axis: Axis,
    pub(crate) concept: String,
}

/// Fact stated by a name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Fact {
    /// The word or phrase, in small letters.
    pub(crate) text: String,
    pub(crate) number: Option<u32>,
    /// Possible readings, at least one; exactly one in a node's name.
    pub(crate) readings: Vec<Reading>,
    /// True for a fact about the location of the equipment, as opposed to the equipment itself.
    pub(crate) is_context: bool,
    /// True where some node of the model has the word.
    pub(crate) is_of_model: bool,
}

/// Words of a model's nodes and their use.
#[derive(Debug, Default)]
pub(crate) struct Vocabulary {
    /// Readings by text and by whether a number follows.
    usage: HashMap<(String, bool), Vec<Reading>>,
    numbered: HashMap<(String, u32), ()>,
}

/// Hints that tell a phase from a unit of measurement.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Hint {
    /// Unit in small letters.
    pub(crate) unit: String,
    /// True where the tag is a state, as opposed to a measured value.
    pub(crate) is_state: bool,
    /// True for prose, where a single letter is no phase.
    pub(crate) is_prose: bool,
}

pub(crate) static PHRASES: LazyLock<HashMap<&'static str, Vec<(Axis, &'static str)>>> =
    LazyLock::new(|| {
        let mut phrases: HashMap<_, Vec<_>> = HashMap::new();
        for &(axis, concept, words) in LEXICON {
            for &word in words {
                phrases.entry(word).or_default().push((axis, concept));
            }
        }
        phrases
    });

/// Phrases of several words, written as one.
pub(crate) static GLUED: LazyLock<HashMap<String, &'static str>> = LazyLock::new(|| {
    let phrases = PHRASES.keys().filter(|phrase| phrase.contains(' '));
    phrases.map(|phrase| (phrase.replace(' ', ""), *phrase)).collect()
});

impl Reading {
    pub(crate) fn new(axis: Axis, concept: &str) -> Self {
        Self { axis, concept: concept.to_owned() }
    }
}

impl Fact {
    pub(crate) fn new(text: &str, number: Option<u32>, axis: Axis, concept: &str) -> Self {
        let is_context = matches!(axis, Axis::Station | Axis::Level | Axis::Bay);
        let readings = vec![Reading::new(axis, concept)];
        Self { text: text.to_owned(), number, readings, is_context, is_of_model: false }
    }

    /// Creates a fact that any of these concepts satisfies: the equipment at which a quantity is
    /// measured.
    pub(crate) fn implied(concepts: &[&str]) -> Self {
        let reading = |axis| concepts.iter().map(move |concept| Reading::new(axis, concept));
        let readings = reading(Axis::Part).chain(reading(Axis::Device)).collect();
        let (text, is_context, is_of_model) = (String::new(), false, false);
        Self { text, number: None, readings, is_context, is_of_model }
    }

    pub(crate) fn phase(text: &str, number: u32) -> Self {
        Self::new(text, Some(number), Axis::Phase, PHASE)
    }

    /// The reading that a node's fact has, and a tag's most likely one.
    pub(crate) fn first(&self) -> &Reading {
        &self.readings[0]
    }

    pub(crate) fn axis(&self) -> Axis {
        self.first().axis
    }

    /// Reports whether the fact may concern the quantity and not the place.
    pub(crate) fn is_soft(&self) -> bool {
        let soft = |r: &Reading| matches!(r.axis, Axis::Quantity | Axis::Neutral);
        self.readings.iter().any(soft)
    }

    /// Returns the fact as people write it.
    pub(crate) fn shown(&self) -> String {
        let reading = self.first();
        let name = match reading.axis {
            Axis::Word | Axis::Neutral => &self.text,
            _ => &reading.concept,
        };
        match (self.number, reading.axis) {
            (Some(BETWEEN), Axis::Phase) => "between phases".into(),
            (Some(number), Axis::Phase) if number <= 3 => format!("phase L{number}"),
            (Some(_), Axis::Phase) => "neutral".into(),
            (Some(number), _) => format!("{name} {number}"),
            (None, _) => name.clone(),
        }
    }
}

impl Vocabulary {
    pub(crate) fn add(&mut self, fact: &Fact) {
        let usage = self.usage.entry((fact.text.clone(), fact.number.is_some())).or_default();
        if !usage.contains(fact.first()) {
            usage.push(fact.first().clone());
        }
        if let Some(number) = fact.number {
            self.numbered.insert((fact.text.clone(), number), ());
        }
    }

    pub(crate) fn usage(&self, text: &str, has_number: bool) -> Option<&[Reading]> {
        self.usage.get(&(text.to_owned(), has_number)).map(Vec::as_slice)
    }

    pub(crate) fn has(&self, text: &str, number: u32) -> bool {
        self.numbered.contains_key(&(text.to_owned(), number))
    }
}

/// The readings of a word or phrase in the lexicon.
pub(crate) fn lexical(text: &str, has_number: bool) -> Vec<Reading> {
    let with_number = has_number.then(|| PHRASES.get(format!("{text}#").as_str())).flatten();
    // With a number, Q is a bay and no reactive power.
    let found = with_number.or_else(|| PHRASES.get(text)).into_iter().flatten();
    found.map(|&(axis, concept)| Reading::new(axis, concept)).collect()
}

/// A word or phrase as a fact: as the model uses it, or as the field does.
pub(crate) fn fact_of(
    text: &str,
    number: Option<u32>,
    vocabulary: Option<&Vocabulary>,
) -> Option<Fact> {
    let known = lexical(text, number.is_some());
    let used = vocabulary.and_then(|v| v.usage(text, number.is_some())).unwrap_or_default();
    let mut readings = used.to_vec();
    // A quantity stays one, though a node may have the word too.
    let is_soft = known.iter().any(|r| matches!(r.axis, Axis::Quantity | Axis::Neutral));
    let is_numbered_part = number.is_some() && !used.is_empty();
    if used.is_empty() || is_soft && !is_numbered_part {
        readings.extend(known.into_iter().filter(|r| !used.contains(r)));
    }
    let first = readings.first()?;
    let is_context = matches!(first.axis, Axis::Station | Axis::Level | Axis::Bay);
    let winding = |r: &Reading| (r.axis == Axis::Winding).then(|| r.concept.parse().ok()).flatten();
    if let Some(winding) = winding(first) {
        return Some(Fact::new(text, Some(winding), Axis::Winding, WINDING));
    }
    let is_of_model = !used.is_empty();
    Some(Fact { text: text.to_owned(), number, readings, is_context, is_of_model })
}
