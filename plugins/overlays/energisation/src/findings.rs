//! Findings of bindings: tags that are missing, kinds of values that are of no use, and units
//! that say nothing.

use std::collections::BTreeMap;

use busbar_plugin_sdk::{Binding, ValueKind};

use crate::network::Network;
use crate::source_reading::{ACTIVE_POWER, REACTIVE_POWER, SOURCE, SourceWiring};
use crate::switch_reading::{PORTABLE_EARTH, POSITION};

impl Network {
    /// Lists switches and sources without a tag, which are unknown for good.
    pub(crate) fn find_missing_tags(&mut self) {
        for (id, wiring) in self.topology.switches.iter().zip(&self.switches) {
            let is_told = wiring.is_untelemetered || wiring.placed.is_some();
            let remedy = "or set 'untelemetered' there";
            if is_told {
                continue;
            }
            if wiring.is_portable_earth && wiring.portable_earth.is_none() {
                self.findings.push(format!(
                    "the portable earth '{id}' has no tag in the role '{PORTABLE_EARTH}'; bind \
                     one, {remedy}"
                ));
            } else if !wiring.is_portable_earth && wiring.contacts.is_empty() {
                self.findings.push(format!(
                    "the switch '{id}' has no tag in the role '{POSITION}'; bind one, {remedy}"
                ));
            } else if let Some(pole) = wiring.missing_pole {
                self.findings.push(format!(
                    "the switch '{id}' has no tag in the role '{POSITION}_{}'; bind one to \
                     each pole",
                    pole.name()
                ));
            }
        }
        for (source, wiring) in self.topology.sources.iter().zip(&self.sources) {
            let SourceWiring { says, powers, is_untelemetered, .. } = wiring;
            if let Some(id) = &source.equipment
                && says.is_none()
                && powers.is_empty()
                && !is_untelemetered
            {
                self.findings.push(format!(
                    "the source '{id}' has no tag in the role '{SOURCE}', '{ACTIVE_POWER}' or \
                     '{REACTIVE_POWER}'; bind one, or set 'untelemetered' there"
                ));
            }
        }
    }
}

/// Kinds of values that are of use in a role.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RoleKinds {
    State,
    Number,
    StateOrNumber,
}

impl RoleKinds {
    /// Reports whether values of a kind are of use.
    fn includes(self, kind: ValueKind) -> bool {
        match self {
            Self::State => kind.is_state(),
            Self::Number => kind.is_quantity(),
            Self::StateOrNumber => kind.is_state() || kind.is_quantity(),
        }
    }

    /// Returns words for what another tag is not, and the names of the kinds.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::State => ["no state", "double_point or bool"],
            Self::Number => ["no number", "f64 or i64"],
            Self::StateOrNumber => ["no state or number", "bool, double_point, f64 or i64"],
        }
    }
}

impl Network {
    /// Lists tags that are wired and whose kind of value is of no use in their role.
    pub(crate) fn find_mismatched_kinds(&mut self, bindings: &[Binding]) {
        let states = self.switches.iter().flat_map(|wiring| {
            let contacts = wiring.contacts.iter().map(|contact| contact.binding);
            let flags = [wiring.racked_out, wiring.hand_dressed, wiring.portable_earth];
            contacts.chain(flags.into_iter().flatten())
        });
        let faults = self.voltages.iter().flat_map(|wiring| wiring.faults.iter().copied());
        let phases = self.voltages.iter().flat_map(|wiring| &wiring.phases);
        let powers = self.sources.iter().flat_map(|wiring| &wiring.powers);
        let numbers = powers.map(|tag| tag.binding).chain(phases.map(|tag| tag.binding));
        let sources = self.sources.iter().filter_map(|wiring| Some(wiring.says?.binding));
        let kinds = (states.chain(faults).map(|binding| (binding, RoleKinds::State)))
            .chain(numbers.map(|binding| (binding, RoleKinds::Number)))
            .chain(sources.map(|binding| (binding, RoleKinds::StateOrNumber)));
        // A tag is told once, in the order of the bindings.
        let kinds: BTreeMap<usize, RoleKinds> = kinds.collect();
        let is_mismatched =
            |(binding, kinds): &(usize, RoleKinds)| !kinds.includes(bindings[*binding].kind);
        let findings = kinds.into_iter().filter(is_mismatched).map(|(binding, kinds)| {
            let Binding { tag_id, role, node_id, .. } = &bindings[binding];
            let [is_not, names] = kinds.words();
            format!(
                "the tag '{tag_id}' in the role '{role}' at '{node_id}' is {is_not}; bind one of \
                 the type {names}"
            )
        });
        self.findings.extend(findings);
    }
}

/// Words for a voltage without a nominal one to compare with.
pub(crate) fn no_nominal(level: &str, id: &str) -> String {
    format!(
        "the voltage at '{id}' cannot be judged, as no nominal voltage is known of the level \
         '{level}'; set 'nominal_kv' there"
    )
}
