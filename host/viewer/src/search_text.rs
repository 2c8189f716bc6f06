//! Texts of very many things, searched while somebody types.

use std::collections::HashMap;

use memchr::memmem;

/// What is found at most; who finds so many types on.
pub(crate) const MAX_HITS: usize = 1_000;
/// Bytes of a query that count.
const MAX_QUERY_BYTES: usize = 200;
/// Words of a query that count.
const MAX_WORDS: usize = 8;
/// Between the names of one thing, and behind its last.
const BETWEEN: char = '\t';
const END: u8 = b'\n';

/// All texts one behind the other in lower case, so that one pass over memory finds all.
#[derive(Debug, Default)]
pub(crate) struct SearchText {
    text: String,
    /// Where the text of each thing begins.
    starts: Vec<u32>,
}

/// How well a thing fits, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fit {
    Whole,
    Beginning,
    BeginningOfWord,
    Within,
}

impl SearchText {
    /// Adds the next thing with its names.
    pub(crate) fn add<'t>(&mut self, names: impl IntoIterator<Item = &'t str>) {
        self.starts.push(self.text.len() as u32);
        for name in names {
            let plain = name.chars().flat_map(char::to_lowercase);
            self.text.extend(plain.map(|c| if c.is_control() { ' ' } else { c }));
            self.text.push(BETWEEN);
        }
        self.text.push(char::from(END));
    }

    /// The numbers of things that have all words of a query in their names, those that fit
    /// its first word best before others, and whether there are more than
    /// [`MAX_HITS`].
    pub(crate) fn find(&self, query: &str) -> (Vec<u32>, bool) {
        let query: String = query.chars().take(MAX_QUERY_BYTES).collect::<String>().to_lowercase();
        let mut words = query.split_whitespace().take(MAX_WORDS);
        let Some(first) = words.next() else { return (Vec::new(), false) };
        let others: Vec<_> = words.map(memmem::Finder::new).collect();
        let bytes = self.text.as_bytes();
        let mut fits: HashMap<u32, Fit> = HashMap::new();
        let mut is_cut = false;
        for at in memmem::find_iter(bytes, first) {
            let thing = self.starts.partition_point(|start| *start as usize <= at) as u32 - 1;
            let fit = self.fit(at, first.len());
            if let Some(known) = fits.get_mut(&thing) {
                *known = (*known).min(fit);
                continue;
            }
            let own = &bytes[self.range(thing)];
            if !others.iter().all(|other| other.find(own).is_some()) {
                continue;
            }
            if fits.len() >= MAX_HITS {
                is_cut = true;
                break;
            }
            fits.insert(thing, fit);
        }
        let mut found: Vec<(Fit, u32)> =
            fits.into_iter().map(|(thing, fit)| (fit, thing)).collect();
        found.sort_unstable();
        (found.into_iter().map(|(_, thing)| thing).collect(), is_cut)
    }

    fn fit(&self, at: usize, length: usize) -> Fit {
        let before = self.text[..at].chars().next_back().unwrap_or(BETWEEN);
        let begins = before == BETWEEN || before == char::from(END);
        let ends = self.text[at + length..].starts_with(BETWEEN);
        match (begins, ends) {
            (true, true) => Fit::Whole,
            (true, false) => Fit::Beginning,
            _ if !before.is_alphanumeric() => Fit::BeginningOfWord,
            _ => Fit::Within,
        }
    }

    fn range(&self, thing: u32) -> std::ops::Range<usize> {
        let thing = thing as usize;
        let end = self.starts.get(thing + 1).map_or(self.text.len(), |end| *end as usize);
        self.starts[thing] as usize..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(things: &[&[&str]]) -> SearchText {
        let mut text = SearchText::default();
        things.iter().for_each(|names| text.add(names.iter().copied()));
        text
    }

    #[test]
    fn the_best_fit_comes_first_whatever_its_case() {
        let text = text(&[&["=Q11-QA1"], &["=Q1-QA1", "Öl Pump"], &["QA1"], &["=Q2", "qa1 spare"]]);
        assert_eq!(text.find("qa1").0, [2, 3, 0, 1]);
        assert_eq!(text.find("ÖL").0, [1]);
        assert_eq!(text.find("qa1 q11").0, [0], "all words");
        assert_eq!(text.find("  ").0, [0; 0]);
        assert_eq!(text.find("absent").0, [0; 0]);
        assert_eq!(text.find("a1\tö").0, [1], "two words of one thing");
    }

    #[test]
    fn what_is_found_is_bounded() {
        let mut text = SearchText::default();
        (0..MAX_HITS + 7).for_each(|thing| text.add([format!("=Q{thing}").as_str()]));
        let (found, is_cut) = text.find("q");
        assert_eq!((found.len(), is_cut), (MAX_HITS, true));
        assert!(!text.find("q7").1);
        assert_eq!(text.find(&"q".repeat(100_000)).0, [0; 0]);
    }
}
