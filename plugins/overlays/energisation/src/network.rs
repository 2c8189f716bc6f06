//! The network with the tags that are bound to it, and what the bindings lack.

use std::collections::{HashMap, HashSet};

use busbar_plugin_sdk::Binding;

use crate::branch_kind::EarthKind;
use crate::findings::no_nominal;
use crate::measured_unit::MeasuredUnit;
use crate::placements::NamesInNetwork;
use crate::rows::Rows;
use crate::settings::Settings;
use crate::source_reading::{ACTIVE_POWER, REACTIVE_POWER, SOURCE, SourceTag, SourceWiring};
use crate::switch_condition::Pole;
use crate::switch_reading::{
    Contact, HAND_DRESSED, PORTABLE_EARTH, POSITION, RACKED_OUT, SwitchWiring,
};
use crate::topology::{Equipment, Node, Topology};
use crate::topology_error::TopologyError;
use crate::voltage::{Phase, PhaseTag, VOLTAGE_FAULTS, VOLTAGES, VoltageMemory, VoltageWiring};

/// Roles of positions of poles, and the poles.
const POLES: [(&str, Pole); 3] =
    [("position_l1", Pole::L1), ("position_l2", Pole::L2), ("position_l3", Pole::L3)];

/// A network and its tags.
#[derive(Clone, Debug, Default)]
pub struct Network {
    /// The network, with the portable earths that are bound or placed.
    pub topology: Topology,
    /// Tags of each switch.
    pub switches: Vec<SwitchWiring>,
    /// Tags of each source.
    pub sources: Vec<SourceWiring>,
    /// Instrument transformers and their tags.
    pub voltages: Vec<VoltageWiring>,
    /// Nodes that each piece of equipment is at.
    pub nodes_of: Rows,
    /// Switches that each piece of equipment is, and portable earths at it.
    pub switches_of: Rows,
    /// Equipment at each node.
    pub pieces_at: Rows,
    /// Equipment that each switch is, or that a portable earth is placed at.
    pub pieces_of_switch: Rows,
    /// Switches that each binding tells of.
    pub switches_of_binding: Rows,
    /// Faults of the bindings, each as cause and remedy.
    pub findings: Vec<String>,
}

/// Bindings by role and equipment.
struct Roles<'a> {
    bindings: &'a [Binding],
    of: HashMap<&'a str, HashMap<&'a str, Vec<usize>>>,
}

impl<'a> Roles<'a> {
    fn new(bindings: &'a [Binding]) -> Self {
        let mut of: HashMap<&str, HashMap<&str, Vec<usize>>> = HashMap::new();
        for (index, Binding { role, node_id, .. }) in bindings.iter().enumerate() {
            of.entry(role).or_default().entry(node_id).or_default().push(index);
        }
        Self { bindings, of }
    }

    fn all(&self, role: &str, id: &str) -> &[usize] {
        self.of.get(role).and_then(|of| of.get(id)).map_or(&[], Vec::as_slice)
    }

    fn last(&self, role: &str, id: &str) -> Option<usize> {
        self.all(role, id).last().copied()
    }

    fn unit(&self, binding: usize) -> MeasuredUnit {
        MeasuredUnit::parse(&self.bindings[binding].unit)
    }
}

impl Network {
    /// Wires tags and placements to a network.
    ///
    /// # Errors
    /// A placement that names what is not there.
    pub fn new(
        settings: &Settings,
        topology: &Topology,
        bindings: &[Binding],
    ) -> Result<Self, TopologyError> {
        let mut network = Self {
            nodes_of: topology.nodes_of_equipment(),
            topology: topology.clone(),
            ..Self::default()
        };
        let roles = Roles::new(bindings);
        network.wire_switches(settings, &roles);
        network.add_portable_earths(&roles);
        let names = NamesInNetwork::new(topology);
        settings.placements.iter().try_for_each(|placement| network.place(placement, &names))?;
        network.index_switches(bindings.len());
        network.wire_sources(settings, &roles);
        network.wire_voltages(settings, &roles);
        // Without any bindings the settings are only tried.
        if bindings.is_empty() {
            network.findings.clear();
        } else {
            network.find_missing_tags();
            network.find_mismatched_kinds(bindings);
        }
        Ok(network)
    }

    fn wire_switches(&mut self, settings: &Settings, roles: &Roles<'_>) {
        let branches = settings.branches.iter().filter(|branch| branch.untelemetered);
        let earths = settings.earths.iter().filter(|earth| earth.untelemetered);
        let untelemetered: HashSet<&str> = branches
            .map(|branch| branch.equipment.as_str())
            .chain(earths.map(|earth| earth.equipment.as_str()))
            .collect();
        let portable: HashSet<&str> = settings
            .earths
            .iter()
            .filter(|earth| earth.kind == EarthKind::Portable)
            .map(|earth| earth.equipment.as_str())
            .collect();
        for id in &self.topology.switches {
            let whole = roles.all(POSITION, id);
            let mut contacts: Vec<Contact> =
                whole.iter().map(|&binding| Contact { binding, pole: Pole::Whole }).collect();
            let mut missing_pole = None;
            for (role, pole) in POLES {
                let tags = roles.all(role, id);
                contacts.extend(tags.iter().map(|&binding| Contact { binding, pole }));
                if tags.is_empty() {
                    missing_pole = missing_pole.or(Some(pole));
                }
            }
            let needs_poles = whole.is_empty() && !contacts.is_empty();
            self.switches.push(SwitchWiring {
                contacts,
                missing_pole: missing_pole.filter(|_| needs_poles),
                racked_out: roles.last(RACKED_OUT, id),
                hand_dressed: roles.last(HAND_DRESSED, id),
                portable_earth: roles.last(PORTABLE_EARTH, id),
                is_portable_earth: portable.contains(id.as_str()),
                is_untelemetered: untelemetered.contains(id.as_str()),
                ..SwitchWiring::default()
            });
        }
    }

    /// Adds an earth for each tag in the role `portable_earth` that is bound to equipment
    /// which is not itself a portable earth.
    fn add_portable_earths(&mut self, roles: &Roles<'_>) {
        let portable: HashSet<String> = self
            .topology
            .switches
            .iter()
            .zip(&self.switches)
            .filter(|(_, wiring)| wiring.is_portable_earth)
            .map(|(id, _)| id.clone())
            .collect();
        let pieces: HashMap<String, Equipment> =
            self.topology.equipment.iter().cloned().zip(0..).collect();
        for (index, binding) in roles.bindings.iter().enumerate() {
            let id = &binding.node_id;
            if binding.role != PORTABLE_EARTH || portable.contains(id) {
                continue;
            }
            let Some(&piece) = pieces.get(id) else {
                self.findings.push(format!(
                    "the tag '{}' tells of a portable earth at '{id}', which is not in the \
                     network; add it to the equipment of a node",
                    binding.tag_id
                ));
                continue;
            };
            let wiring = SwitchWiring { portable_earth: Some(index), ..SwitchWiring::default() };
            self.add_portable_earth(piece, None, wiring);
        }
    }

    /// Adds the placing of a portable earth at a piece of equipment.
    pub(crate) fn add_portable_earth(
        &mut self,
        piece: Equipment,
        node: Option<Node>,
        wiring: SwitchWiring,
    ) {
        let nodes = node.map_or_else(|| self.nodes_of.row(piece).to_vec(), |node| vec![node]);
        let is_ambiguous = !self.are_one(&nodes);
        self.topology.add_earth(&nodes, piece);
        self.switches.push(SwitchWiring { is_portable_earth: true, is_ambiguous, ..wiring });
    }

    /// Reports whether nodes are joined for good by conductors, so that an earth or a
    /// voltage at one is at all of them.
    fn are_one(&self, nodes: &[Node]) -> bool {
        let Some((&first, others)) = nodes.split_first() else { return false };
        if others.is_empty() {
            return true;
        }
        let mut reached = HashSet::from([first]);
        let mut to_visit = vec![first];
        while let Some(node) = to_visit.pop() {
            for arc in self.topology.adjacency.at(node) {
                let is_conductor = arc.switch().is_none() && !arc.stops_earth();
                if is_conductor && reached.insert(arc.to()) {
                    to_visit.push(arc.to());
                }
            }
        }
        others.iter().all(|node| reached.contains(node))
    }

    fn index_switches(&mut self, bindings: usize) {
        let tags = |wiring: &SwitchWiring| {
            let SwitchWiring { racked_out, hand_dressed, portable_earth, .. } = *wiring;
            [racked_out, hand_dressed, portable_earth].into_iter().flatten()
        };
        let pairs = self.switches.iter().enumerate().flat_map(|(switch, wiring)| {
            let contacts = wiring.contacts.iter().map(|contact| contact.binding);
            contacts.chain(tags(wiring)).map(move |binding| (binding, switch))
        });
        self.switches_of_binding = Rows::new(bindings, pairs);
        let branches = self.topology.branches.iter();
        let branches =
            branches.filter_map(|branch| branch.switch.map(|switch| (branch.equipment, switch)));
        let earths = self.topology.earths.iter().map(|earth| (earth.equipment, earth.switch));
        let pieces = self.topology.equipment.len();
        let of_pieces = branches.chain(earths);
        let of_switches = of_pieces.clone().map(|(piece, switch)| (switch, piece));
        self.pieces_of_switch = Rows::new(self.topology.switches.len(), of_switches);
        self.switches_of = Rows::new(pieces, of_pieces);
        let at_nodes = (0..pieces)
            .flat_map(|piece| self.nodes_of.row(piece).iter().map(move |&node| (node, piece)));
        self.pieces_at = Rows::new(self.topology.nodes.len(), at_nodes);
    }

    fn wire_sources(&mut self, settings: &Settings, roles: &Roles<'_>) {
        let mut unused = Vec::new();
        for (source, set) in self.topology.sources.iter().zip(&settings.sources) {
            let level = &settings.levels[self.topology.levels[source.node]];
            let mut wiring = SourceWiring {
                is_always_on: source.equipment.is_none(),
                is_untelemetered: set.untelemetered,
                rating_mva: source.rating_mva,
                nominal_kv: level.nominal_kv(),
                ..SourceWiring::default()
            };
            if let Some(id) = &source.equipment {
                let tag = |binding| SourceTag { binding, unit: roles.unit(binding) };
                wiring.says = roles.last(SOURCE, id).map(tag);
                let powers = [ACTIVE_POWER, REACTIVE_POWER];
                let powers = powers.into_iter().flat_map(|role| roles.all(role, id));
                wiring.powers = powers.map(|&binding| tag(binding)).collect();
                let has_voltage =
                    wiring.says.is_some_and(|tag| matches!(tag.unit, MeasuredUnit::Voltage(_)));
                if has_voltage && wiring.nominal_kv.is_none() {
                    unused.push(no_nominal(&level.name, id));
                }
            }
            self.sources.push(wiring);
        }
        self.findings.append(&mut unused);
    }

    fn wire_voltages(&mut self, settings: &Settings, roles: &Roles<'_>) {
        for piece in 0..self.topology.equipment.len() {
            let id = &self.topology.equipment[piece];
            let mut phases = Vec::new();
            for (role, phase) in VOLTAGES {
                for &binding in roles.all(role, id) {
                    let unit = roles.unit(binding);
                    let phase = if phase == Phase::Any { phase_of_pole(id) } else { phase };
                    phases.push(PhaseTag {
                        binding,
                        phase,
                        unit,
                        memory: VoltageMemory::default(),
                    });
                }
            }
            if phases.is_empty() {
                continue;
            }
            let Some(&node) = self.nodes_of.row(piece).first() else { continue };
            let level = &settings.levels[self.topology.levels[node]];
            if !self.are_one(self.nodes_of.row(piece)) {
                self.findings.push(format!(
                    "the voltage at '{id}' is of one of its ends, and nobody knows which; bind it \
                     to equipment at a node"
                ));
                continue;
            }
            for tag in &phases {
                let Binding { unit, tag_id, .. } = &roles.bindings[tag.binding];
                match tag.unit {
                    MeasuredUnit::Voltage(_) | MeasuredUnit::None
                        if level.nominal_kv().is_none() =>
                    {
                        self.findings.push(no_nominal(&level.name, id));
                    }
                    MeasuredUnit::Power(_) | MeasuredUnit::Current(_) | MeasuredUnit::Other => {
                        self.findings.push(format!(
                            "the tag '{tag_id}' at '{id}' is a voltage and has the unit '{unit}'; \
                             give it one of V, kV, %, p.u."
                        ));
                    }
                    _ => {}
                }
            }
            let faults = VOLTAGE_FAULTS.into_iter().flat_map(|role| roles.all(role, id));
            self.voltages.push(VoltageWiring {
                equipment: id.clone(),
                node,
                nominal_kv: level.nominal_kv(),
                phases,
                faults: faults.copied().collect(),
            });
        }
    }
}

/// The phase of single-pole equipment, by the end of its id.
fn phase_of_pole(id: &str) -> Phase {
    let ends = [("-L1", 1), ("-L2", 2), ("-L3", 3)];
    let phase = ends.into_iter().find(|(end, _)| id.ends_with(end));
    phase.map_or(Phase::Any, |(_, phase)| Phase::Earth(phase))
}
