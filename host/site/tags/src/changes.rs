//! Set of the tags that changed between two frames.

use crate::TagHandle;

const BITS: usize = u64::BITS as usize;

/// Tags that changed, each once a turn.
#[derive(Debug)]
pub(crate) struct Changes {
    /// Tags that changed in the last complete turn.
    last: Vec<TagHandle>,
    /// Tags that changed in the current turn, with a bit for each tag among them.
    current: Vec<TagHandle>,
    is_current: Vec<u64>,
}

impl Changes {
    /// Creates an empty set for so many tags.
    pub(crate) fn new(tags: usize) -> Self {
        let is_current = vec![0; tags.div_ceil(BITS)];
        Self { last: Vec::new(), current: Vec::new(), is_current }
    }

    /// Records the change of a tag.
    #[inline(always)]
    pub(crate) fn record(&mut self, tag: TagHandle) {
        let word = &mut self.is_current[tag.0 as usize / BITS];
        let bit = 1 << (tag.0 as usize % BITS);
        if *word & bit == 0 {
            *word |= bit;
            self.current.push(tag);
        }
    }

    /// Ends the current turn and begins another.
    pub(crate) fn finish_turn(&mut self) {
        if self.current.len() < self.is_current.len() {
            for tag in &self.current {
                self.is_current[tag.0 as usize / BITS] = 0;
            }
        } else {
            self.is_current.fill(0);
        }
        std::mem::swap(&mut self.last, &mut self.current);
        self.current.clear();
    }

    /// Handles for which there is room.
    #[cfg(test)]
    pub(crate) fn capacity(&self) -> usize {
        self.last.capacity() + self.current.capacity()
    }

    /// Returns the tags that changed in the last complete turn.
    pub(crate) fn last(&self) -> &[TagHandle] {
        &self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_noted_once_a_turn_whether_few_change_or_all() {
        const TAGS: u32 = 200;
        let mut changes = Changes::new(TAGS as usize);
        for turn in [vec![3, 130, 3], (0..TAGS).chain(0..TAGS).collect(), vec![], vec![130, 199]] {
            turn.iter().for_each(|&tag| changes.record(TagHandle(tag)));
            changes.finish_turn();
            let mut once = turn;
            once.sort_unstable();
            once.dedup();
            assert!(changes.last().iter().map(|tag| tag.0).eq(once));
        }
    }
}
