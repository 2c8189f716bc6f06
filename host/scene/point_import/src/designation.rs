//! Designations of IEC 81346: station, voltage level, bay.

use crate::facts::{Fact, Vocabulary, lexical};
use crate::lexicon::{Axis, LEVELS, STATION};
use crate::tokenizer::Word;

/// Separates voltages from numbers: in `Pos - 110 - Bay 3` the voltage is no number of the
/// position.
pub(crate) fn voltages_apart(words: &[Word], vocabulary: &Vocabulary) -> Vec<Word> {
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
pub(crate) fn designation(words: &[Word], vocabulary: Option<&Vocabulary>) -> (Vec<Fact>, usize) {
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

/// `220 kV`, or a nominal voltage alone at the beginning.
pub(crate) fn voltage_level(rest: &[Word]) -> Option<(Vec<Fact>, usize)> {
    let word = &rest[0];
    let kilovolts = word.number.filter(|_| word.text.is_empty())?;
    let level = level_of_kilovolts(kilovolts)?;
    let named = rest.get(1).is_some_and(|w| w.text == "kv");
    // "220kV03" is no level with a number.
    let used = if named && rest[1].number.is_none() { 2 } else { 1 };
    let text = format!("{kilovolts} kV");
    (named || !word.is_joined).then(|| (vec![Fact::new(&text, None, Axis::Level, level)], used))
}
