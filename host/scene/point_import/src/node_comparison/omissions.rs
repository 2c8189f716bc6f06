//! Ambiguity by omission: parts of a node's name that the tag leaves out.

use super::{Comparison, IMPLIED, NOT_THE_PART, NUMBERLESS, SYNONYM};
use crate::facts::Fact;
use crate::lexicon::{self, Axis};

impl Comparison<'_> {
    /// Top oil is in a transformer, without anybody saying it.
    pub(super) fn cover_implied(&mut self) {
        let implied: Vec<_> =
            self.query.quantities.iter().flat_map(|q| lexicon::implied_by(q)).collect();
        for index in 0..self.node.facts.len() {
            let own = &self.node.facts[index];
            if self.covered[index] > 0.0 {
                continue;
            }
            let concept = own.first().concept.as_str();
            // T1 is the transformer bay and its transformer.
            let is_named_above = (0..index).any(|above| {
                self.covered[above] > 0.0 && self.node.facts[above].first() == own.first()
            });
            if own.is_context {
                if is_named_above && !self.model.needs_number(own.first()) {
                    self.covered[index] = SYNONYM;
                }
                continue;
            }
            let is_implied = implied.iter().any(|known| **known == concept);
            if !is_named_above && !is_implied {
                continue;
            }
            self.covered[index] = IMPLIED;
            if own.number.is_some() && self.model.needs_number(own.first()) {
                self.object(format!("there are several, and the tag does not say {}", own.shown()));
            }
        }
        let mut parts = implied.iter().filter(|known| self.model.has_concept(Axis::Part, known));
        if parts.any(|part| !self.has(part)) {
            self.confirmed *= NOT_THE_PART;
        }
    }

    pub(super) fn check_omissions(&mut self) {
        let mut lacks_context = false;
        let identifies = |own: &Fact| matches!(own.axis(), Axis::Device | Axis::Part | Axis::Word);
        let own = self.node.facts.iter().zip(&self.covered);
        let mut own = own.filter(|(own, _)| !own.is_context && identifies(own)).peekable();
        if let Some((first, _)) = own.peek().copied()
            && own.all(|(_, covered)| *covered == 0.0)
        {
            self.object(format!("the tag does not say {}", first.shown()));
        }
        for index in 0..self.node.facts.len() {
            let own = &self.node.facts[index];
            let is_left_out = self.covered[index] == 0.0;
            lacks_context |= own.is_context && self.covered[index] <= NUMBERLESS;
            if !is_left_out {
                continue;
            }
            let names =
                matches!(own.axis(), Axis::Device | Axis::Part | Axis::Phase | Axis::Winding);
            let is_numbered = own.axis() == Axis::Word && own.number.is_some();
            if !own.is_context && (names || is_numbered) {
                self.object(format!("the tag does not say {}", own.shown()));
            }
            if own.axis() == Axis::Word && self.query.has_common_words {
                self.object(format!("the node says '{}', the tags another name", own.text));
            }
        }
        if lacks_context && self.against.is_none() && self.is_elsewhere_too() {
            self.object("the tag does not say which of several places".into());
        }
    }

    /// Reports whether the tag's facts about the place hold for another place as well.
    fn is_elsewhere_too(&self) -> bool {
        let own = self.node.facts.iter().enumerate();
        let said = own.filter(|(i, fact)| fact.is_context && self.covered[*i] > 0.0);
        let tags = self.query.required.iter().chain(&self.query.optional);
        let said: Vec<&Fact> = said
            .filter_map(|(_, own)| tags.clone().find(|tag| tag.readings.contains(own.first())))
            .collect();
        let holds = |container: &Vec<Fact>| {
            said.iter().all(|tag| {
                let mut same = container.iter().filter(|own| tag.readings.contains(own.first()));
                same.any(|own| {
                    own.number == tag.number || own.number.is_none() || tag.number.is_none()
                })
            })
        };
        let own = &self.model.containers[self.node.container as usize];
        let covered = |fact: &Fact| {
            let known = |(i, own): (usize, &Fact)| own == fact && self.covered[i] > NUMBERLESS;
            self.node.facts.iter().enumerate().any(known)
        };
        // A place within this one is no other place, nor is the one around it, if the
        // tag says all that tells this one from it.
        let is_another = |other: &Vec<Fact>| {
            let within = own.iter().all(|fact| other.contains(fact));
            let around = other.iter().all(|fact| own.contains(fact))
                && own.iter().all(|fact| other.contains(fact) || covered(fact));
            !within && !around
        };
        let mut others = self.model.containers.iter().filter(|other| !other.is_empty());
        others.any(|other| holds(other) && is_another(other))
    }

    pub(super) fn check_kind(&mut self) {
        let mut innermost = self.node.facts.iter().rev();
        let Some(device) = innermost.find(|own| own.axis() == Axis::Device) else { return };
        let device = device.first().concept.as_str();
        let known = [
            lexicon::BREAKER,
            lexicon::DISCONNECTOR,
            lexicon::EARTHING_SWITCH,
            lexicon::TRANSFORMER,
            lexicon::ARRESTER,
            "current transformer",
            "voltage transformer",
            "busbar",
            "capacitor",
        ];
        let is_tap = self.has("tap changer") || self.query.quantities.contains("tap");
        for quantity in &self.query.quantities {
            let may = !known.contains(&device)
                || lexicon::fits(quantity, device)
                || quantity == lexicon::POSITION && is_tap;
            if !may {
                self.object(format!("{quantity} is nothing that a {device} has"));
                return;
            }
        }
    }
}
