//! Incremental text search over the names of many items.

use std::collections::HashMap;

use memchr::memmem;

/// Largest number of search results.
pub(crate) const MAX_HITS: usize = 1_000;
/// Bytes of a query that count.
const MAX_QUERY_BYTES: usize = 200;
/// Largest number of query words that count.
const MAX_WORDS: usize = 8;
/// Separators between an item's names, and between items.
const NAME_SEPARATOR: char = '\t';
const ITEM_SEPARATOR: u8 = b'\n';

/// Lower-case text of all items in one buffer, searched in one pass over memory.
#[derive(Debug, Default)]
pub(crate) struct SearchIndex {
    text: String,
    /// Start of each item's text, bytes.
    starts: Vec<u32>,
}

/// Rank of a match, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum MatchRank {
    Whole,
    Beginning,
    BeginningOfWord,
    Within,
}

impl SearchIndex {
    /// Adds the next thing with its names.
    pub(crate) fn add<'t>(&mut self, names: impl IntoIterator<Item = &'t str>) {
        self.starts.push(self.text.len() as u32);
        for name in names {
            let plain = name.chars().flat_map(char::to_lowercase);
            self.text.extend(plain.map(|c| if c.is_control() { ' ' } else { c }));
            self.text.push(NAME_SEPARATOR);
        }
        self.text.push(char::from(ITEM_SEPARATOR));
    }

    /// Finds the items that contain all words of a query, best matches of the first word first. The
    /// flag reports more than [`MAX_HITS`] results.
    pub(crate) fn find(&self, query: &str) -> (Vec<u32>, bool) {
        let query: String = query.chars().take(MAX_QUERY_BYTES).collect::<String>().to_lowercase();
        let mut words = query.split_whitespace().take(MAX_WORDS);
        let Some(first) = words.next() else { return (Vec::new(), false) };
        let others: Vec<_> = words.map(memmem::Finder::new).collect();
        let bytes = self.text.as_bytes();
        let mut ranks: HashMap<u32, MatchRank> = HashMap::new();
        let mut is_truncated = false;
        for at in memmem::find_iter(bytes, first) {
            let item = self.starts.partition_point(|start| *start as usize <= at) as u32 - 1;
            let rank = self.rank(at, first.len());
            if let Some(known) = ranks.get_mut(&item) {
                *known = (*known).min(rank);
                continue;
            }
            let own = &bytes[self.range(item)];
            if !others.iter().all(|other| other.find(own).is_some()) {
                continue;
            }
            if ranks.len() >= MAX_HITS {
                is_truncated = true;
                break;
            }
            ranks.insert(item, rank);
        }
        let mut found: Vec<(MatchRank, u32)> =
            ranks.into_iter().map(|(item, rank)| (rank, item)).collect();
        found.sort_unstable();
        (found.into_iter().map(|(_, item)| item).collect(), is_truncated)
    }

    fn rank(&self, at: usize, length: usize) -> MatchRank {
        let before = self.text[..at].chars().next_back().unwrap_or(NAME_SEPARATOR);
        let begins = before == NAME_SEPARATOR || before == char::from(ITEM_SEPARATOR);
        let ends = self.text[at + length..].starts_with(NAME_SEPARATOR);
        match (begins, ends) {
            (true, true) => MatchRank::Whole,
            (true, false) => MatchRank::Beginning,
            _ if !before.is_alphanumeric() => MatchRank::BeginningOfWord,
            _ => MatchRank::Within,
        }
    }

    fn range(&self, item: u32) -> std::ops::Range<usize> {
        let item = item as usize;
        let end = self.starts.get(item + 1).map_or(self.text.len(), |end| *end as usize);
        self.starts[item] as usize..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(items: &[&[&str]]) -> SearchIndex {
        let mut text = SearchIndex::default();
        items.iter().for_each(|names| text.add(names.iter().copied()));
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
    fn the_number_of_matches_is_bounded() {
        let mut text = SearchIndex::default();
        (0..MAX_HITS + 7).for_each(|item| text.add([format!("=Q{item}").as_str()]));
        let (found, is_truncated) = text.find("q");
        assert_eq!((found.len(), is_truncated), (MAX_HITS, true));
        assert!(!text.find("q7").1);
        assert_eq!(text.find(&"q".repeat(100_000)).0, [0; 0]);
    }
}
