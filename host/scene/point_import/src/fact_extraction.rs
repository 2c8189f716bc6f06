//! Words to facts, in the order in which a name is read.

use crate::designation::{designation, voltage_level, voltages_apart};
use crate::facts::{Fact, GLUED, Hint, PHRASES, Reading, Vocabulary, fact_of};
use crate::lexicon::{Axis, NOISE};
use crate::phases::{phase, resolve_letters, terminal};
use crate::tokenizer::{Word, as_plain, words};

/// Words of the longest phrase in the lexicon.
const MAX_PHRASE_WORDS: usize = 3;
/// The shortest word that is looked for within another one, in bytes.
const MIN_GLUED_BYTES: usize = 3;

/// Extracts facts from a node's name.
pub(crate) fn facts_of_node(name: &str) -> Vec<Fact> {
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

/// Extracts facts from a tag's id or description, by the model's own use of words.
pub(crate) fn facts_of_tag(text: &str, vocabulary: &Vocabulary, hint: &Hint) -> Vec<Fact> {
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

#[cfg(test)]
#[path = "fact_extraction_tests.rs"]
mod tests;
