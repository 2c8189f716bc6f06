//! Positions, states and commands of a bay.

use super::point_list::{NormalValue, PointContext, PointKind, PointListBuilder};
use crate::network;

/// States by reference and name; the list repeats with the next logical node.
const STATES: [(&str, &str); 15] = [
    ("PTRC.Tr", "trip"),
    ("PTRC.Str", "protection picked up"),
    ("PDIF.Op", "differential protection operated"),
    ("PDIS.Op", "distance protection operated"),
    ("PTOC.Op", "overcurrent protection operated"),
    ("RREC.Op", "reclosing"),
    ("RBRF.OpEx", "breaker failure"),
    ("RVTF.Alm", "voltage transformer fault"),
    ("LPHD.PhyHealth", "device fault"),
    ("LGOS.St", "GOOSE link lost"),
    ("SIMG.InsAlm", "SF6 low"),
    ("SIMG.InsBlk", "SF6 lock-out"),
    ("SOPM.MotOv", "spring motor overrun"),
    ("GAPC.DcAlm", "control supply lost"),
    ("LLN0.Loc", "local control"),
];
const COMMANDS: [(&str, &str); 3] =
    [("CSWI.Pos.Oper", "operate"), ("GGIO.SPCSO.Oper", "reset"), ("RREC.Auto.Oper", "reclosing")];

/// Switch: equipment, name, true if closed. Breakers have the name [`BREAKER`].
pub(super) type Switch = (String, &'static str, bool);

/// Returns the switches of a bay of the network.
pub(super) fn switches(bay: &str) -> Vec<Switch> {
    let prefix = format!("{bay}-");
    let own = network::network().switches.into_iter();
    own.filter(|switch| switch.equipment.starts_with(&prefix))
        .map(|switch| {
            let is_breaker = switch.equipment.ends_with("-QA1");
            let name = if is_breaker { BREAKER } else { "disconnector" };
            (switch.equipment, name, switch.closed)
        })
        .collect()
}

/// Suffix of the disconnector that has an earthing blade.
pub(crate) const EARTHED: &str = "-QB9";
/// Name of the breakers' position.
pub(super) const BREAKER: &str = "breaker";
/// Code of an open switch (IEC 61850-7-3, 7.4.4); that of a closed one follows.
const OPEN: f64 = 1.0;
const CLOSED: f64 = 2.0;

/// Adds positions of switches, and of `earths` earth switches, which are open.
pub(super) fn add_doubles(
    bay: &str,
    switches: &[Switch],
    earths: usize,
    list: &mut PointListBuilder,
) {
    let (mut breakers, mut disconnectors) = (0, 0);
    for (equipment, name, closed) in switches {
        let (class, count) = match *name {
            BREAKER => ("XCBR.Pos", &mut breakers),
            _ => ("XSWI.Pos", &mut disconnectors),
        };
        *count += 1;
        let place =
            PointContext { bay, equipment: equipment.clone(), node: *count, role: "position" };
        let usual = NormalValue::Constant(if *closed { CLOSED } else { OPEN });
        list.add(PointKind::Double, (class, name, "", 0.0, 3.0, 1000), place, usual);
    }
    for node in disconnectors + 1..=disconnectors + earths {
        // The first is the line's, at its disconnector.
        let line = switches.iter().find(|(equipment, ..)| equipment.ends_with(EARTHED));
        let line = line.filter(|_| node == disconnectors + 1);
        let Some((equipment, ..)) = line.or(switches.first()) else { continue };
        let place = PointContext { bay, equipment: equipment.clone(), node, role: "earth_switch" };
        let quantity = ("XSWI.Pos", "earth switch", "", 0.0, 3.0, 1000);
        list.add(PointKind::Double, quantity, place, NormalValue::Constant(OPEN));
    }
}

/// Adds states, all in their normal condition, and commands.
pub(super) fn add_states(
    bay: &str,
    equipment: &str,
    states: usize,
    commands: usize,
    list: &mut PointListBuilder,
) {
    let kinds = [
        (PointKind::Single, &STATES[..], states, "state"),
        (PointKind::Control, &COMMANDS[..], commands, "command"),
    ];
    for (kind, names, count, role) in kinds {
        for i in 0..count {
            let (reference, name) = names[i % names.len()];
            let node = i / names.len() + 1;
            let place = PointContext { bay, equipment: equipment.to_owned(), node, role };
            list.add(
                kind,
                (reference, name, "", 0.0, 1.0, 1000),
                place,
                NormalValue::Constant(0.0),
            );
        }
    }
}
