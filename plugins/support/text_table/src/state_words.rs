//! Words of a source for states; `1`, `1.0` and `true` are one state.

use std::collections::BTreeMap;

use crate::number::scale;
use crate::{NumberFormat, shorten};

/// States by the words of a source.
#[derive(Clone, Debug, PartialEq)]
pub struct StateWords<S> {
    exact: BTreeMap<String, S>,
    canonical: BTreeMap<String, S>,
}

impl<S> Default for StateWords<S> {
    fn default() -> Self {
        Self { exact: BTreeMap::new(), canonical: BTreeMap::new() }
    }
}

impl<S: Clone + PartialEq> StateWords<S> {
    /// Makes the words of a source into a table.
    ///
    /// # Errors
    /// Two words of one state that settings make two states, such as `1` and `true`.
    pub fn new(exact: BTreeMap<String, S>) -> Result<Self, String> {
        let mut canonical: BTreeMap<String, S> = BTreeMap::new();
        for (word, state) in &exact {
            let name = canonical_word(word);
            if canonical.get(&name).is_some_and(|other| other != state) {
                let twin =
                    exact.keys().find(|other| *other != word && canonical_word(other) == name);
                return Err(format!(
                    "states: '{}' and '{}' are one state, and have two values: remove one",
                    shorten(twin.map_or("", String::as_str)),
                    shorten(word)
                ));
            }
            canonical.insert(name, state.clone());
        }
        Ok(Self { exact, canonical })
    }

    /// Reports a table without words.
    pub fn is_empty(&self) -> bool {
        self.exact.is_empty()
    }

    /// Finds the state of a word, a number or a boolean as text.
    pub fn get(&self, text: &str) -> Option<S> {
        let text = text.trim();
        self.exact.get(text).or_else(|| self.canonical.get(&canonical_word(text))).cloned()
    }

    /// Lists the words for a message.
    pub fn list(&self) -> String {
        const MAX_LISTED: usize = 8;
        let mut listed: Vec<String> =
            self.exact.keys().take(MAX_LISTED).map(|word| format!("'{}'", shorten(word))).collect();
        if self.exact.len() > MAX_LISTED {
            listed.push(format!("and {} more", self.exact.len() - MAX_LISTED));
        }
        listed.join(", ")
    }
}

/// A whole number without its fraction of zeros, booleans as numbers, other words as they are.
fn canonical_word(word: &str) -> String {
    let word = word.trim();
    if word.eq_ignore_ascii_case("true") {
        return "1".into();
    }
    if word.eq_ignore_ascii_case("false") {
        return "0".into();
    }
    let plain = NumberFormat::default().normalize(word).ok();
    match plain.and_then(|plain| scale(&plain, 0)) {
        Some((number, true)) => number.to_string(),
        _ => word.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(all: &[(&str, u8)]) -> Result<StateWords<u8>, String> {
        StateWords::new(all.iter().map(|(word, state)| ((*word).to_owned(), *state)).collect())
    }

    #[test]
    fn one_as_number_text_and_boolean_is_one_state() {
        for key in ["1", "1.0", "true", "TRUE"] {
            let words = words(&[(key, 7), ("0", 3)]).unwrap();
            for text in ["1", "1.0", "1.000", " true ", "True", "+1"] {
                assert_eq!(words.get(text), Some(7), "{key} {text}");
            }
            for text in ["0", "0.0", "false"] {
                assert_eq!(words.get(text), Some(3), "{key} {text}");
            }
            for text in ["2", "1.5", "yes", ""] {
                assert_eq!(words.get(text), None, "{key} {text}");
            }
        }
    }

    #[test]
    fn two_values_of_one_state_are_refused() {
        let fault = words(&[("1", 1), ("true", 2)]).unwrap_err();
        assert!(fault.contains("'1' and 'true' are one state"), "{fault}");
        assert!(words(&[("1", 1), ("true", 1), ("1.0", 1)]).is_ok());
        assert_eq!(words(&[("OPEN", 1)]).unwrap().get("open"), None);
        assert_eq!(words(&[("OPEN", 1)]).unwrap().list(), "'OPEN'");
    }
}
