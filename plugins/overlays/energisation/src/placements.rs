//! Placements of the settings: portable earths, racked-out switches, positions set by hand.

use std::collections::HashMap;

use crate::network::Network;
use crate::settings::{HandDressedPosition, PlacementKind, PlacementSettings};
use crate::state::Position;
use crate::switch_reading::{Placed, SwitchWiring};
use crate::topology::{Equipment, Node, Switch, Topology};
use crate::topology_error::TopologyError;

/// Indices of what a placement may name.
pub(crate) struct NamesInNetwork<'a> {
    nodes: HashMap<&'a str, Node>,
    equipment: HashMap<&'a str, Equipment>,
    switches: HashMap<&'a str, Switch>,
}

impl<'a> NamesInNetwork<'a> {
    pub(crate) fn new(topology: &'a Topology) -> Self {
        let index = |names: &'a [String]| -> HashMap<&'a str, usize> {
            names.iter().enumerate().map(|(index, name)| (name.as_str(), index)).collect()
        };
        Self {
            nodes: index(&topology.nodes),
            equipment: index(&topology.equipment),
            switches: index(&topology.switches),
        }
    }
}

impl Network {
    /// Applies a placement of the settings.
    pub(crate) fn place(
        &mut self,
        placement: &PlacementSettings,
        names: &NamesInNetwork<'_>,
    ) -> Result<(), TopologyError> {
        let id = &placement.equipment;
        let fault = |fault: &str| TopologyError::Placement {
            equipment: id.clone(),
            fault: fault.to_owned(),
        };
        let piece = names.equipment.get(id.as_str()).copied();
        let piece =
            piece.ok_or_else(|| fault("names equipment that is not in the network: mend it"))?;
        let find_node = |name: &String| {
            let node = names.nodes.get(name.as_str()).copied();
            node.ok_or_else(|| fault("names a node that is not there: mend it"))
        };
        let node = placement.node.as_ref().map(find_node).transpose()?;
        let placed = match (placement.kind, placement.position) {
            (PlacementKind::PortableEarth, None) => Placed::PortableEarth,
            (PlacementKind::RackedOut, None) => Placed::RackedOut,
            (PlacementKind::HandDressed, Some(position)) => Placed::HandDressed(match position {
                HandDressedPosition::Open => Position::Open,
                HandDressedPosition::Closed => Position::Closed,
            }),
            (PlacementKind::HandDressed, None) => {
                return Err(fault("is a position set by hand: give 'position'"));
            }
            (_, Some(_)) => {
                return Err(fault("has a 'position' that nothing needs: remove it"));
            }
        };
        let is_portable = placed == Placed::PortableEarth;
        let switch = names.switches.get(id.as_str()).copied();
        let switch =
            switch.filter(|&switch| self.switches[switch].is_portable_earth == is_portable);
        match (placed, switch) {
            (Placed::PortableEarth, None) => {
                let placed = Some(Placed::PortableEarth);
                self.add_portable_earth(
                    piece,
                    node,
                    SwitchWiring { placed, ..SwitchWiring::default() },
                );
            }
            (_, Some(switch)) => self.switches[switch].placed = Some(placed),
            (_, None) => return Err(fault("is of a switch, and the equipment is none: mend it")),
        }
        Ok(())
    }
}
