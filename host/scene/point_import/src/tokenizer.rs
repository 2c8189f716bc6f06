//! Tokenizer: splits names into words with numbers. `S12D1Q03_QB9-phsA` is S 12, D 1, Q 3, QB 9,
//! phs, A.

/// Limit of a name, bytes; the rest is cut off.
const MAX_NAME_BYTES: usize = 400;
/// The most words taken from one name.
const MAX_WORDS: usize = 40;
/// Digits that a number has at most; longer ones are words.
const MAX_DIGITS: usize = 6;
/// Units that a change of case does not split.
const WHOLE: [&str; 7] = ["kV", "kA", "mA", "kW", "pC", "mV", "PhV"];
/// Single letters whose number may be separated: `Q 3`.
const NUMBERED_LETTERS: [&str; 4] = ["q", "t", "l", "w"];
/// Gases of oil analysis (IEC 60599), which look like words with numbers.
const GASES: [&str; 8] = ["h2", "ch4", "c2h2", "c2h4", "c2h6", "co2", "h2o", "co"];

/// A word of a name. One of text and number may be missing.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Word {
    /// Text in small letters; empty for a number alone.
    pub(crate) text: String,
    /// The number behind it, without leading zeros.
    pub(crate) number: Option<u32>,
    /// True where text and number are adjacent.
    pub(crate) number_is_joined: bool,
    /// True where the word is adjacent to the one before.
    pub(crate) is_joined: bool,
    /// True for a chemical formula of a gas.
    pub(crate) is_gas: bool,
}

/// A run of letters or of digits.
#[derive(Debug)]
struct Run<'t> {
    text: &'t str,
    is_digits: bool,
    /// True where a separator precedes it.
    starts: bool,
}

/// The words of a name, in order.
pub(crate) fn words(name: &str) -> Vec<Word> {
    let mut end = name.len().min(MAX_NAME_BYTES);
    while !name.is_char_boundary(end) {
        end -= 1;
    }
    let mut words: Vec<Word> = Vec::new();
    for piece in name[..end].split(|c: char| !c.is_alphanumeric()) {
        if piece.is_empty() {
            continue;
        }
        if is_gas(piece) {
            words.push(Word {
                text: piece.to_lowercase(),
                number: None,
                number_is_joined: false,
                is_joined: false,
                is_gas: true,
            });
            continue;
        }
        for run in runs(piece) {
            add(&run, &mut words);
        }
    }
    words.truncate(MAX_WORDS);
    words
}

fn is_gas(piece: &str) -> bool {
    GASES.contains(&piece.to_lowercase().as_str())
}

/// A gas as the word with a number that it could be as well: `H2` is H 2.
pub(crate) fn as_plain(word: &Word) -> Vec<Word> {
    let mut words = Vec::new();
    runs(&word.text).iter().for_each(|run| add(run, &mut words));
    words
}

fn add(run: &Run<'_>, words: &mut Vec<Word>) {
    let number = run.is_digits.then(|| run.text.parse().ok()).flatten();
    match (number, words.last_mut()) {
        // A number belongs to the word before it, unless that has one.
        (Some(number), Some(last)) if takes_number(last, run) => {
            last.number = Some(number);
            last.number_is_joined = !run.starts;
        }
        (number, _) => words.push(Word {
            text: if number.is_some() { String::new() } else { run.text.to_lowercase() },
            number,
            number_is_joined: false,
            is_joined: !run.starts,
            is_gas: false,
        }),
    }
}

fn takes_number(word: &Word, run: &Run<'_>) -> bool {
    let may_be_apart = word.text.len() > 1 || NUMBERED_LETTERS.contains(&word.text.as_str());
    word.number.is_none() && !word.is_gas && (!run.starts || may_be_apart)
}

fn runs(piece: &str) -> Vec<Run<'_>> {
    let chars: Vec<(usize, char)> = piece.char_indices().collect();
    let mut runs = Vec::new();
    let mut start = 0;
    for i in 1..=chars.len() {
        if i < chars.len() && !parts(&chars, i, start, piece) {
            continue;
        }
        let end = chars.get(i).map_or(piece.len(), |c| c.0);
        let text = &piece[chars[start].0..end];
        let is_digits = text.len() <= MAX_DIGITS && text.bytes().all(|b| b.is_ascii_digit());
        runs.push(Run { text, is_digits, starts: start == 0 });
        start = i;
    }
    runs
}

/// Reports whether a new run begins at character `i`; the last one began at `start`.
fn parts(chars: &[(usize, char)], i: usize, start: usize, piece: &str) -> bool {
    let (before, here) = (chars[i - 1].1, chars[i].1);
    if before.is_ascii_digit() != here.is_ascii_digit() {
        return true;
    }
    if before.is_lowercase() && here.is_uppercase() {
        return !WHOLE.iter().any(|unit| piece[chars[start].0..].starts_with(unit));
    }
    // The last capital of several begins a word: "HVBushing".
    let next_is_small = chars.get(i + 1).is_some_and(|c| c.1.is_lowercase());
    before.is_uppercase()
        && here.is_uppercase()
        && next_is_small
        && i > start
        && chars.get(i + 2).is_some_and(|c| c.1.is_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(name: &str, expected: &str) {
        let show = |word: &Word| match word.number {
            Some(number) => format!("{}{number}", word.text),
            None => word.text.clone(),
        };
        let found: Vec<_> = words(name).iter().map(show).collect();
        assert_eq!(found.join(" "), expected, "{name}");
    }

    #[test]
    fn names_are_cut_where_people_see_a_word_end() {
        check("=S12D1Q03-QB9-L1", "s12 d1 q3 qb9 l1");
        check("Bay 03.CB_1/phsA", "bay3 cb1 phs a");
        check("TopOilTemp", "top oil temp");
        check("220kV Bay-007", "220 kv bay7");
        check("HVBushing1U", "hv bushing1 u");
        check("XSWI9.Pos.stVal", "xswi9 pos st val");
        check("T1.C2H2", "t1 c2h2");
        check("", "");
        check("/ - °", "");
    }

    #[test]
    fn long_names_are_bounded() {
        assert_eq!(words(&"a_".repeat(1_000_000)).len(), MAX_WORDS);
        assert!(words(&"ü".repeat(1_000_000)).len() == 1);
        check("x1234567890", "x 1234567890");
    }
}
