//! Findings of bindings: tags that are missing, and units that say nothing.

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

/// Words for a voltage without a nominal one to compare with.
pub(crate) fn no_nominal(level: &str, id: &str) -> String {
    format!(
        "the voltage at '{id}' cannot be judged, as no nominal voltage is known of the level \
         '{level}'; set 'nominal_kv' there"
    )
}
