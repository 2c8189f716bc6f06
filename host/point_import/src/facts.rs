//! Words to facts: what a name says about the equipment that it means.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::lexicon::{
    ALSO_QUANTITIES, Axis, BAY, BETWEEN_PHASES, BUSHING, LEVELS, LEXICON, NOISE, PHASE,
    PHASE_QUANTITIES, PHASES, STATION, WINDING,
};
use crate::words::{Word, as_plain, words};

/// Words of the longest phrase in the lexicon.
const MAX_PHRASE_WORDS: usize = 3;
/// The shortest word that is looked for within another one, in bytes.
const MIN_GLUED_BYTES: usize = 3;
/// What "between phases" counts as: no single phase.
pub(crate) const BETWEEN: u32 = 12;

/// A meaning that a word can have.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Reading {
    pub(crate) axis: Axis,
    pub(crate) concept: String,
}

/// Something that a name says.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Fact {
    /// The word or phrase, in small letters.
    pub(crate) text: String,
    pub(crate) number: Option<u32>,
    /// At least one; those of a node's name have one.
    pub(crate) readings: Vec<Reading>,
    /// Whether it says where the equipment is, rather than which it is.
    pub(crate) is_context: bool,
    /// Whether some node of the model has the word.
    pub(crate) is_of_model: bool,
}

/// How words are used by the nodes of a model.
#[derive(Debug, Default)]
pub(crate) struct Vocabulary {
    /// By text and whether a number is behind it.
    usage: HashMap<(String, bool), Vec<Reading>>,
    numbered: HashMap<(String, u32), ()>,
}

/// What helps to tell a phase from a unit of measure.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Hint {
    /// In small letters.
    pub(crate) unit: String,
    /// Whether the tag is a state, and so no measured value.
    pub(crate) is_state: bool,
    /// Whether the text is prose, where a single letter is no phase.
    pub(crate) is_prose: bool,
}

static PHRASES: LazyLock<HashMap<&'static str, Vec<(Axis, &'static str)>>> = LazyLock::new(|| {
    let mut phrases: HashMap<_, Vec<_>> = HashMap::new();
    for &(axis, concept, words) in LEXICON {
        for &word in words {
            phrases.entry(word).or_default().push((axis, concept));
        }
    }
    phrases
});

/// Phrases of several words, written as one.
static GLUED: LazyLock<HashMap<String, &'static str>> = LazyLock::new(|| {
    let phrases = PHRASES.keys().filter(|phrase| phrase.contains(' '));
    phrases.map(|phrase| (phrase.replace(' ', ""), *phrase)).collect()
});

impl Reading {
    fn new(axis: Axis, concept: &str) -> Self {
        Self { axis, concept: concept.to_owned() }
    }
}

impl Fact {
    fn new(text: &str, number: Option<u32>, axis: Axis, concept: &str) -> Self {
        let is_context = matches!(axis, Axis::Station | Axis::Level | Axis::Bay);
        let readings = vec![Reading::new(axis, concept)];
        Self { text: text.to_owned(), number, readings, is_context, is_of_model: false }
    }

    /// What has one of these names, whichever: where a quantity is found.
    pub(crate) fn implied(concepts: &[&str]) -> Self {
        let reading = |axis| concepts.iter().map(move |concept| Reading::new(axis, concept));
        let readings = reading(Axis::Part).chain(reading(Axis::Device)).collect();
        let (text, is_context, is_of_model) = (String::new(), false, false);
        Self { text, number: None, readings, is_context, is_of_model }
    }

    fn phase(text: &str, number: u32) -> Self {
        Self::new(text, Some(number), Axis::Phase, PHASE)
    }

    /// The reading that a node's fact has, and a tag's most likely one.
    pub(crate) fn first(&self) -> &Reading {
        &self.readings[0]
    }

    pub(crate) fn axis(&self) -> Axis {
        self.first().axis
    }

    /// Whether it may be about what is reported and not about where.
    pub(crate) fn is_soft(&self) -> bool {
        let soft = |r: &Reading| matches!(r.axis, Axis::Quantity | Axis::Neutral);
        self.readings.iter().any(soft)
    }

    /// As people would write it.
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

    fn usage(&self, text: &str, has_number: bool) -> Option<&[Reading]> {
        self.usage.get(&(text.to_owned(), has_number)).map(Vec::as_slice)
    }

    fn has(&self, text: &str, number: u32) -> bool {
        self.numbered.contains_key(&(text.to_owned(), number))
    }
}

/// What a node's name says.
pub(crate) fn of_node(name: &str) -> Vec<Fact> {
    let words: Vec<_> = words(name);
    let words: Vec<_> = words.into_iter().filter(|w| !NOISE.contains(&w.text.as_str())).collect();
    let mut facts = read(&words, None, &Hint { is_state: true, ..Hint::default() });
    for fact in &mut facts {
        // A node is where a value is shown: its words name things.
        if fact.is_soft() {
            let hard =
                fact.readings.iter().find(|r| !matches!(r.axis, Axis::Quantity | Axis::Neutral));
            let reading = hard.cloned().unwrap_or(Reading::new(Axis::Word, &fact.text));
            fact.readings = vec![reading];
        }
        fact.readings.truncate(1);
        fact.is_of_model = true;
    }
    without_repeats(facts)
}

/// What a tag's id or description says, read by a model's own use of words.
pub(crate) fn of_tag(text: &str, vocabulary: &Vocabulary, hint: &Hint) -> Vec<Fact> {
    let mut plain = Vec::new();
    let prose = hint.is_prose.then(|| without_articles(text));
    for word in words(prose.as_deref().unwrap_or(text)) {
        let split = if word.is_gas { as_plain(&word) } else { Vec::new() };
        match split.as_slice() {
            // The model has an H 2: then it is no hydrogen.
            [one] if one.number.is_some_and(|n| vocabulary.has(&one.text, n)) => {
                plain.extend(split);
            }
            _ => plain.extend(unglued(word, vocabulary)),
        }
    }
    without_repeats(read(&plain, Some(vocabulary), hint))
}

/// Prose without single small letters, and without one at its beginning: "a" is no phase.
fn without_articles(text: &str) -> String {
    let mut words = text.split_whitespace().enumerate().filter(|(i, word)| {
        word.len() > 1 || *i > 0 && !word.starts_with(|c: char| c.is_ascii_lowercase())
    });
    let mut kept = String::with_capacity(text.len());
    words.by_ref().for_each(|(_, word)| {
        kept += word;
        kept.push(' ');
    });
    kept
}

/// `MECHANISMBOX` is two words, as far as they are known.
fn unglued(word: Word, vocabulary: &Vocabulary) -> Vec<Word> {
    let text = word.text.as_str();
    let is_known = |text: &str| {
        let has_phrase =
            PHRASES.contains_key(text) || PHRASES.contains_key(format!("{text}#").as_str());
        has_phrase
            || vocabulary.usage(text, false).is_some()
            || vocabulary.usage(text, true).is_some()
    };
    if text.len() < 2 * MIN_GLUED_BYTES || is_known(text) {
        return vec![word];
    }
    let parts: Option<Vec<&str>> = GLUED.get(text).map(|phrase| phrase.split(' ').collect());
    let parts = parts.or_else(|| {
        let cuts = MIN_GLUED_BYTES..=text.len() - MIN_GLUED_BYTES;
        let mut cuts = cuts.filter(|cut| text.is_char_boundary(*cut));
        let cut = cuts.find(|cut| is_known(&text[..*cut]) && is_known(&text[*cut..]))?;
        Some(vec![&text[..cut], &text[cut..]])
    });
    let Some(parts) = parts else { return vec![word] };
    let part = |text: &&str| Word { text: (*text).to_owned(), number: None, ..word.clone() };
    let mut parts: Vec<Word> = parts.iter().map(part).collect();
    if let Some(last) = parts.last_mut() {
        last.number = word.number;
    }
    parts
}

fn without_repeats(facts: Vec<Fact>) -> Vec<Fact> {
    let mut kept: Vec<Fact> = Vec::with_capacity(facts.len());
    for fact in facts {
        // "Substation" alone tells nothing.
        if fact.axis() == Axis::Station && fact.number.is_none() {
            continue;
        }
        let repeats = |known: &Fact| {
            known.text == fact.text
                && known.number == fact.number
                && known.readings == fact.readings
        };
        if !kept.iter().any(repeats) {
            kept.push(fact);
        }
    }
    kept
}

fn read(words: &[Word], vocabulary: Option<&Vocabulary>, hint: &Hint) -> Vec<Fact> {
    let apart = vocabulary.map(|vocabulary| voltages_apart(words, vocabulary));
    let words = apart.as_deref().unwrap_or(words);
    let (mut facts, mut i) = designation(words, vocabulary);
    while i < words.len() {
        let (mut found, used) = next(&words[i..], &facts, vocabulary);
        facts.append(&mut found);
        i += used;
    }
    resolve_letters(&mut facts, hint);
    facts
}

/// In `Pos - 110 - Bay 3` the voltage is no number of the position.
fn voltages_apart(words: &[Word], vocabulary: &Vocabulary) -> Vec<Word> {
    let mut apart = Vec::with_capacity(words.len());
    for word in words {
        let kilovolts =
            word.number.filter(|n| !word.number_is_joined && level_of_kilovolts(*n).is_some());
        let readings = lexical(&word.text, false);
        let is_soft = readings.iter().any(|r| matches!(r.axis, Axis::Quantity | Axis::Neutral));
        let is_of_model = word.number.is_some_and(|number| vocabulary.has(&word.text, number));
        if kilovolts.is_some() && is_soft && !is_of_model {
            apart.push(Word { number: None, ..word.clone() });
            apart.push(Word { text: String::new(), is_joined: false, ..word.clone() });
        } else {
            apart.push(word.clone());
        }
    }
    apart
}

/// The function aspect of IEC 81346 at the beginning: station, level, bay.
fn designation(words: &[Word], vocabulary: Option<&Vocabulary>) -> (Vec<Fact>, usize) {
    let letter = |w: &Word| w.number_is_joined && w.text.len() == 1 && w.text != "l";
    let is = |i: usize, text: &str| words.get(i).is_some_and(|w| letter(w) && w.text == text);
    let is_level =
        |i: usize| words.get(i).is_some_and(|w| letter(w) && level_of_letter(&w.text).is_some());
    let starts = is(0, "s") && words.get(1).is_some_and(letter)
        || is_level(0) && (is(1, "q") || is(1, "w")) && words[1].is_joined;
    let mut facts = Vec::new();
    if !starts {
        return (facts, 0);
    }
    for word in words.iter().take_while(|w| letter(w)) {
        let has = |axis| facts.iter().any(|f: &Fact| f.axis() == axis);
        let fact = |axis, concept: &str| Fact::new(&word.text, word.number, axis, concept);
        let known = |facts: &Vec<Fact>| facts.is_empty();
        let mut fact = match word.text.as_str() {
            "s" if known(&facts) => fact(Axis::Station, STATION),
            text => match level_of_letter(text) {
                // Unless the model has bays of that letter and no level.
                Some(level)
                    if !has(Axis::Level) && !has(Axis::Bay) && !is_bay_letter(text, vocabulary) =>
                {
                    fact(Axis::Level, level)
                }
                _ => match lexical(text, word.number.is_some()).first() {
                    Some(r) if r.axis == Axis::Bay || r.axis == Axis::Device => {
                        fact(r.axis, &r.concept)
                    }
                    _ => fact(Axis::Bay, &format!("{text} bay")),
                },
            },
        };
        fact.is_context = true;
        facts.push(fact);
    }
    let count = facts.len();
    (facts, count)
}

fn is_bay_letter(text: &str, vocabulary: Option<&Vocabulary>) -> bool {
    let used = vocabulary.and_then(|v| v.usage(text, true)).unwrap_or_default();
    !used.is_empty() && used.iter().all(|reading| reading.axis == Axis::Bay)
}

fn level_of_letter(letter: &str) -> Option<&'static str> {
    let ends =
        |(name, _): &&(&'static str, _)| name.to_lowercase().ends_with(&format!(" {letter}"));
    LEVELS.iter().find(ends).map(|(name, _)| *name)
}

fn level_of_kilovolts(kilovolts: u32) -> Option<&'static str> {
    LEVELS.iter().find(|(_, voltages)| voltages.contains(&kilovolts)).map(|(name, _)| *name)
}

fn lexical(text: &str, has_number: bool) -> Vec<Reading> {
    let with_number = has_number.then(|| PHRASES.get(format!("{text}#").as_str())).flatten();
    // With a number, Q is a bay and no reactive power.
    let found = with_number.or_else(|| PHRASES.get(text)).into_iter().flatten();
    found.map(|&(axis, concept)| Reading::new(axis, concept)).collect()
}

/// The facts of the next words, and how many words these are.
fn next(rest: &[Word], before: &[Fact], vocabulary: Option<&Vocabulary>) -> (Vec<Fact>, usize) {
    let word = &rest[0];
    if let Some(found) =
        voltage_level(rest).or_else(|| phase(rest)).or_else(|| terminal(rest, before))
    {
        return found;
    }
    for count in (2..=MAX_PHRASE_WORDS.min(rest.len())).rev() {
        let (inner, last) = (&rest[..count - 1], &rest[count - 1]);
        if inner.iter().any(|w| w.number.is_some()) {
            continue;
        }
        let text = rest[..count].iter().map(|w| w.text.as_str()).collect::<Vec<_>>().join(" ");
        if let Some(fact) = fact_of(&text, last.number, None) {
            return (vec![fact], count);
        }
    }
    let fact = fact_of(&word.text, word.number, vocabulary);
    let fact = fact.unwrap_or_else(|| Fact::new(&word.text, word.number, Axis::Word, &word.text));
    (vec![fact], 1)
}

fn fact_of(text: &str, number: Option<u32>, vocabulary: Option<&Vocabulary>) -> Option<Fact> {
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

/// `220 kV`, or a nominal voltage alone at the beginning.
fn voltage_level(rest: &[Word]) -> Option<(Vec<Fact>, usize)> {
    let word = &rest[0];
    let kilovolts = word.number.filter(|_| word.text.is_empty())?;
    let level = level_of_kilovolts(kilovolts)?;
    let named = rest.get(1).is_some_and(|w| w.text == "kv");
    // "220kV03" is no level with a number.
    let used = if named && rest[1].number.is_none() { 2 } else { 1 };
    let text = format!("{kilovolts} kV");
    (named || !word.is_joined).then(|| (vec![Fact::new(&text, None, Axis::Level, level)], used))
}

/// `L1`, `phs A`, `IA`, `UL2`, `L1-L2`.
fn phase(rest: &[Word]) -> Option<(Vec<Fact>, usize)> {
    let word = &rest[0];
    let text = word.text.as_str();
    let quantity = |number| Fact::new(text, number, Axis::Quantity, "current or voltage");
    if BETWEEN_PHASES.contains(&text) && word.number.is_none() {
        return Some((vec![quantity(None), Fact::phase(text, BETWEEN)], 1));
    }
    if let Some((_, phase)) = PHASE_QUANTITIES.iter().find(|(name, _)| *name == text)
        && word.number.is_none()
    {
        return Some((vec![quantity(None), Fact::phase(text, *phase)], 1));
    }
    let prefixes = ["phase", "phs", "ph"];
    let letter = prefixes.iter().find_map(|prefix| text.strip_prefix(prefix));
    let letter = letter.filter(|letter| text != "phv" && !letter.is_empty());
    if let Some((_, phase)) = PHASES.iter().find(|(name, _)| Some(*name) == letter)
        && word.number.is_none()
    {
        return Some((vec![Fact::phase(text, *phase)], 1));
    }
    match (text, word.number) {
        ("l", Some(number @ 1..=3)) => {
            let next = rest.get(1).filter(|w| w.text == "l");
            match next.and_then(|w| w.number) {
                Some(other @ 1..=3) if other != number => {
                    Some((vec![Fact::phase("l1-l2", BETWEEN)], 2))
                }
                _ => Some((vec![Fact::phase("l", number)], 1)),
            }
        }
        ("l", Some(12 | 23 | 31 | 13)) => Some((vec![Fact::phase("l1-l2", BETWEEN)], 1)),
        ("il" | "ul" | "vl", Some(number @ 1..=3)) => {
            Some((vec![quantity(None), Fact::phase(text, number)], 1))
        }
        ("phs" | "ph" | "phase" | "pole", None) => {
            let letter = &rest.get(1)?;
            let number = PHASES.iter().find(|(name, _)| *name == letter.text)?.1;
            letter.number.is_none().then(|| (vec![Fact::phase(&letter.text, number)], 2))
        }
        ("phs" | "ph" | "phase" | "pole", Some(number @ 1..=3)) => {
            Some((vec![Fact::phase("phase", number)], 1))
        }
        _ => None,
    }
}

/// `bushing 1U` after IEC 60076-1: winding 1, phase U.
fn terminal(rest: &[Word], before: &[Fact]) -> Option<(Vec<Fact>, usize)> {
    let [word, letter, ..] = rest else { return None };
    let winding = word.number.filter(|n| (1..=3).contains(n))?;
    let phase = PHASES.iter().find(|(name, _)| "uvwn".contains(name) && *name == letter.text)?.1;
    if !letter.is_joined || letter.number.is_some() {
        return None;
    }
    let facts = vec![
        // U alone is a voltage; 1U is a terminal.
        Fact::new(&format!("winding {winding}"), Some(winding), Axis::Winding, WINDING),
        Fact::phase(&letter.text, phase),
    ];
    if word.text.is_empty() {
        return (!before.is_empty()).then_some((facts, 2));
    }
    let mut own = fact_of(&word.text, None, None)?;
    let is_bushing = own.first().concept == BUSHING;
    if !is_bushing && word.number_is_joined {
        return None;
    }
    own.number = None;
    Some((std::iter::once(own).chain(facts).collect(), 2))
}

/// Decides of each single letter whether it is a phase or a quantity.
fn resolve_letters(facts: &mut [Fact], hint: &Hint) {
    let has_quantity = |facts: &[Fact], but: usize| {
        let is_quantity = |(i, f): (usize, &Fact)| i != but && f.axis() == Axis::Quantity;
        facts.iter().enumerate().any(is_quantity)
    };
    let mut has_phase = facts.iter().any(|f| f.axis() == Axis::Phase);
    for i in (0..facts.len()).rev() {
        let fact = &facts[i];
        let phase = PHASES.iter().find(|(name, _)| *name == fact.text);
        let Some(&(letter, phase)) = phase else { continue };
        if fact.number.is_some() || fact.axis() == Axis::Phase || fact.axis() == Axis::Winding {
            continue;
        }
        let follows_place = i > 0 && facts[i - 1].number.is_none() && {
            let concept = facts[i - 1].first().concept.as_str();
            [BAY, STATION, "busbar"].contains(&concept) || facts[i - 1].text == "section"
        };
        if has_phase || follows_place {
            if has_phase && !follows_place {
                facts[i].readings = vec![Reading::new(Axis::Quantity, "unit")];
            }
            continue;
        }
        let units =
            ALSO_QUANTITIES.iter().find(|(name, _)| *name == letter).map(|(_, units)| units);
        let may_be_unit = units.is_some_and(|units| {
            let fits = hint.unit.is_empty() || units.contains(&hint.unit.as_str());
            fits && !hint.is_state && !has_quantity(facts, i)
        });
        if may_be_unit {
            facts[i].readings = vec![Reading::new(Axis::Quantity, "phase or unit")];
        } else {
            facts[i] = Fact::phase(letter, phase);
            has_phase = true;
        }
    }
}

#[cfg(test)]
#[path = "facts_tests.rs"]
mod tests;
