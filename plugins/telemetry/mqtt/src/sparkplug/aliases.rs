//! Alias table of one device, from its birth certificate (Sparkplug 3.0, 6.4.3).
//!
//! Aliases are to be unique within an edge node. Devices that number their aliases on their own
//! work all the same, because each message names its device.

use std::collections::HashMap;

/// Metrics of one device by alias.
#[derive(Debug, Default)]
pub(super) struct AliasTable {
    by_alias: HashMap<u64, Alias>,
}

/// Metric behind an alias.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alias {
    /// A metric that tags name.
    Named(usize),
    /// A metric that no tag names.
    Unnamed,
    /// Ambiguous alias of at least two metrics.
    Ambiguous,
}

impl AliasTable {
    pub(super) fn len(&self) -> usize {
        self.by_alias.len()
    }

    pub(super) fn clear(&mut self) {
        self.by_alias.clear();
    }

    pub(super) fn get(&self, alias: u64) -> Option<Alias> {
        self.by_alias.get(&alias).copied()
    }

    /// Learns an alias of a metric that tags name, or of another; hands on the named metrics
    /// that are ambiguous by it.
    pub(super) fn learn(&mut self, alias: u64, named: Option<usize>) -> [Option<usize>; 2] {
        let metric = named.map_or(Alias::Unnamed, Alias::Named);
        let known = self.by_alias.entry(alias).or_insert(metric);
        match (*known, metric) {
            (Alias::Ambiguous, _) => [named, None],
            (before, after) if before == after => [None, None],
            (Alias::Named(before), _) => {
                *known = Alias::Ambiguous;
                [Some(before), named]
            }
            _ => {
                *known = Alias::Ambiguous;
                [named, None]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alias_of_two_metrics_is_none_of_either() {
        let mut table = AliasTable::default();
        assert_eq!(table.learn(1, Some(7)), [None, None]);
        assert_eq!(table.learn(1, Some(7)), [None, None], "told twice");
        assert_eq!(table.get(1), Some(Alias::Named(7)));
        assert_eq!(table.learn(1, Some(8)), [Some(7), Some(8)]);
        assert_eq!(table.learn(1, Some(9)), [Some(9), None]);
        assert_eq!(table.get(1), Some(Alias::Ambiguous));
        assert_eq!(table.learn(2, None), [None, None]);
        assert_eq!(table.learn(2, Some(5)), [Some(5), None]);
        assert_eq!(table.learn(3, Some(6)), [None, None]);
        assert_eq!(table.learn(3, None), [Some(6), None]);
        assert_eq!((table.get(2), table.get(3)), (Some(Alias::Ambiguous), Some(Alias::Ambiguous)));
        assert_eq!(table.get(4), None);
    }
}
