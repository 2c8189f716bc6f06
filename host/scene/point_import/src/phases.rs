//! Phases and terminals, and letters that may be either a phase or a quantity.

use crate::facts::{BETWEEN, Fact, Hint, Reading, fact_of};
use crate::lexicon::{
    ALSO_QUANTITIES, Axis, BAY, BETWEEN_PHASES, BUSHING, PHASE_QUANTITIES, PHASES, STATION, WINDING,
};
use crate::tokenizer::Word;

/// `L1`, `phs A`, `IA`, `UL2`, `L1-L2`.
pub(crate) fn phase(rest: &[Word]) -> Option<(Vec<Fact>, usize)> {
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
pub(crate) fn terminal(rest: &[Word], before: &[Fact]) -> Option<(Vec<Fact>, usize)> {
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
pub(crate) fn resolve_letters(facts: &mut [Fact], hint: &Hint) {
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
