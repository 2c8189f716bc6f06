//! Texts of reasons: one arena for a frame, in which equal reasons are stored once.

use smallvec::SmallVec;

use crate::contradiction::{Contradictions, name_of_source};
use crate::reachability::NONE;
use crate::readings::Readings;
use crate::state::Input;
use crate::topology::{Switch, Topology};

/// Bytes of all reasons of one frame; what finds no room says so.
pub const MAX_REASON_BYTES: usize = 1 << 28;

/// Text of [`Judgments`](crate::Judgments), as its place among all texts of the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Text {
    start: u32,
    end: u32,
}

impl Text {
    /// Text that is not made yet.
    const NOT_MADE: Self = Self { start: NONE, end: NONE };

    /// Reports whether nothing is told.
    pub fn is_empty(self) -> bool {
        self.start == self.end
    }

    fn range(self) -> std::ops::Range<usize> {
        self.start as usize..self.end as usize
    }
}

/// Texts of one frame, in memory that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReasonTexts {
    text: String,
    /// Condition of each switch.
    of_switches: Vec<Text>,
    /// Condition of each source.
    of_sources: Vec<Text>,
    /// Earth switches that may be closed, by switches.
    of_earths: Vec<Text>,
    /// Contradictions, in their order.
    of_contradictions: Vec<Text>,
    /// Default that each source was taken to feed by.
    of_assumptions: Vec<Text>,
    at_an_end: Text,
    too_long: Text,
    no_room: Text,
}

/// Parts of a reason: at most the own condition, a cause, and switches set by hand.
pub(crate) type Parts = SmallVec<[Text; 4]>;

impl ReasonTexts {
    /// Removes all texts and prepares for another frame.
    pub(crate) fn clear(&mut self, topology: &Topology, contradictions: usize) {
        let Self { text, of_switches, of_sources, of_earths, .. } = self;
        text.clear();
        for (texts, count) in [
            (of_switches, topology.switches.len()),
            (of_sources, topology.sources.len()),
            (of_earths, topology.switches.len()),
            (&mut self.of_contradictions, contradictions),
            (&mut self.of_assumptions, topology.sources.len()),
        ] {
            texts.clear();
            texts.resize(count, Text::NOT_MADE);
        }
        self.no_room = self.add("there are more reasons than a frame can hold");
        self.at_an_end = self.add("energised at an end");
        self.too_long =
            self.add("it rests on more tags than are checked in a frame: split the network");
    }

    /// Prepares for the next frame with other readings of some inputs, and keeps the texts.
    pub(crate) fn go_on(&mut self, switches: &[Switch], sources: &[usize], contradictions: usize) {
        self.of_contradictions.clear();
        self.of_contradictions.resize(contradictions, Text::NOT_MADE);
        for &switch in switches {
            self.of_switches[switch] = Text::NOT_MADE;
            self.of_earths[switch] = Text::NOT_MADE;
        }
        for &source in sources {
            self.of_sources[source] = Text::NOT_MADE;
        }
    }

    /// Returns the length of all texts, bytes.
    pub(crate) fn len(&self) -> usize {
        self.text.len()
    }

    /// Returns the words of a text.
    pub(crate) fn get(&self, text: Text) -> &str {
        &self.text[text.range()]
    }

    /// Stores words as a text.
    pub(crate) fn add(&mut self, words: &str) -> Text {
        self.add_parts(&[words])
    }

    fn add_parts(&mut self, words: &[&str]) -> Text {
        let start = self.text.len();
        if start + words.iter().map(|words| words.len()).sum::<usize>() > MAX_REASON_BYTES {
            return self.no_room;
        }
        words.iter().for_each(|words| self.text.push_str(words));
        Text { start: start as u32, end: self.text.len() as u32 }
    }

    /// Joins the parts of a reason. A part alone is the reason itself.
    pub(crate) fn join(&mut self, parts: &[Text]) -> Text {
        let (first, others) = match parts {
            [] => return Text::default(),
            [part] => return *part,
            [first, others @ ..] => (first, others),
        };
        let start = self.text.len();
        let length: usize = parts.iter().map(|part| part.range().len() + 2).sum();
        if start + length > MAX_REASON_BYTES {
            return self.no_room;
        }
        self.text.extend_from_within(first.range());
        for part in others {
            self.text.push_str("; ");
            self.text.extend_from_within(part.range());
        }
        Text { start: start as u32, end: self.text.len() as u32 }
    }

    /// Reports whether parts say these words already.
    pub(crate) fn says(&self, parts: &[Text], words: Text) -> bool {
        parts.iter().any(|&part| part == words || self.get(part) == self.get(words))
    }

    /// Returns the condition of a switch; empty where nothing is remarkable.
    pub(crate) fn of_switch(
        &mut self,
        topology: &Topology,
        readings: &Readings,
        switch: Switch,
    ) -> Text {
        if self.of_switches[switch] == Text::NOT_MADE {
            let words = readings.switches[switch].condition.explain(&topology.switches[switch]);
            self.of_switches[switch] =
                if words.is_empty() { Text::default() } else { self.add(&words) };
        }
        self.of_switches[switch]
    }

    /// Returns the reason why an input is not known.
    pub(crate) fn of_input(
        &mut self,
        topology: &Topology,
        readings: &Readings,
        input: Input,
    ) -> Text {
        let text = match input {
            Input::Switch(switch) => self.of_switch(topology, readings, switch),
            Input::Source(source) if self.of_sources[source] != Text::NOT_MADE => {
                self.of_sources[source]
            }
            Input::Source(source) => {
                let words = readings.explain(topology, input);
                self.of_sources[source] = self.add(&words);
                self.of_sources[source]
            }
        };
        if !text.is_empty() {
            return text;
        }
        let words = readings.explain(topology, input);
        self.add(&words)
    }

    /// Returns the reason why a node is perhaps earthed, of which `words` tell.
    pub(crate) fn of_earth(&mut self, input: Input, words: Text) -> Text {
        let known = match input {
            Input::Switch(switch) => self.of_earths[switch],
            Input::Source(_) => Text::NOT_MADE,
        };
        if known != Text::NOT_MADE {
            return known;
        }
        let prefix = self.add("perhaps earthed: ");
        if prefix == self.no_room || self.text.len() + words.range().len() > MAX_REASON_BYTES {
            return self.no_room;
        }
        self.text.extend_from_within(words.range());
        let text = Text { start: prefix.start, end: self.text.len() as u32 };
        if let Input::Switch(switch) = input {
            self.of_earths[switch] = text;
        }
        text
    }

    /// Returns the words for a contradiction, by its index.
    pub(crate) fn of_contradiction(
        &mut self,
        topology: &Topology,
        contradictions: &Contradictions,
        index: usize,
    ) -> Text {
        if self.of_contradictions[index] == Text::NOT_MADE {
            let words = contradictions.all()[index].explain(topology);
            self.of_contradictions[index] = self.add(&words);
        }
        self.of_contradictions[index]
    }

    /// Returns the words for the default that a source was taken to feed by.
    pub(crate) fn of_assumption(&mut self, topology: &Topology, source: usize) -> Text {
        if self.of_assumptions[source] == Text::NOT_MADE {
            let name = name_of_source(topology, source);
            self.of_assumptions[source] =
                self.add_parts(&["any power of ", name, " is feeding, as it has no rating"]);
        }
        self.of_assumptions[source]
    }

    /// Returns the words for a piece that is energised at one of its ends.
    pub(crate) fn at_an_end(&self) -> Text {
        self.at_an_end
    }

    /// Returns the words for what rests on too many tags.
    pub(crate) fn too_long(&self) -> Text {
        self.too_long
    }
}
