//! Legend: the states that equipment is shown in, and that they are no permit to work.

use busbar_plugin_sdk::{LegendEntry, Pattern};

use crate::judgment::PieceState;
use crate::settings::{LevelSettings, Settings};

/// Color of dead equipment: a grey.
const DEAD: [u8; 3] = [0x4a, 0x4e, 0x54];
/// Color of earthed equipment (IEC 60445: green and yellow is the protective conductor).
const EARTHED: [u8; 3] = [0x5f, 0xa8, 0x2d];
/// Color of a portable earth: a dark green.
const PORTABLE_EARTH: [u8; 3] = [0x0a, 0x1e, 0x08];
/// Color of what is not known.
const UNKNOWN: [u8; 3] = [0x9c, 0x1f, 0x8c];
/// Color of a contradiction.
const CONTRADICTION: [u8; 3] = [0xc8, 0x48, 0xd8];
/// Color of poles that disagree.
const POLES_DISAGREE: [u8; 3] = [0x1c, 0x0a, 0x20];
/// Color of a switch in motion.
const IN_MOTION: [u8; 3] = [0xb0, 0xb4, 0xcc];
/// Color of a switch that is racked out.
const RACKED_OUT: [u8; 3] = [0x10, 0x14, 0x18];
/// Color of a position that is set by hand.
const HAND_DRESSED: [u8; 3] = [0x40, 0x70, 0xb0];

/// States besides those of the levels, in the legend's order.
const OTHERS: [(PieceState, &str, [u8; 3], Pattern); 9] = [
    (PieceState::Dead, "dead", DEAD, Pattern::Dotted),
    (PieceState::Earthed, "earthed", EARTHED, Pattern::Crossed),
    (PieceState::Unknown, "unknown", UNKNOWN, Pattern::Striped),
    (
        PieceState::Contradiction,
        "contradiction: in doubt, see the reason",
        CONTRADICTION,
        Pattern::Crossed,
    ),
    (PieceState::PolesDisagree, "poles disagree", POLES_DISAGREE, Pattern::Striped),
    (PieceState::InMotion, "in motion", IN_MOTION, Pattern::Striped),
    (PieceState::PortableEarth, "portable earth placed", PORTABLE_EARTH, Pattern::Crossed),
    (
        PieceState::RackedOut,
        "racked out (its fixed contacts may be live)",
        RACKED_OUT,
        Pattern::Dotted,
    ),
    (PieceState::HandDressed, "position set by hand", HAND_DRESSED, Pattern::Dotted),
];

/// Last line of the legend. Nothing is shown in it.
const NOTICE: &str = "these are indications, not a permit to work";

impl Settings {
    /// The legend: each level energised, the other states, and the notice.
    pub fn legend(&self) -> Vec<LegendEntry> {
        let entry = |name: String, color, pattern| LegendEntry { name, color, pattern };
        let energised = |level: &LevelSettings| {
            entry(format!("{} energised", level.name), level.color.0, Pattern::Solid)
        };
        let others = OTHERS.map(|(_, name, color, pattern)| entry(name.into(), color, pattern));
        let notice = entry(NOTICE.into(), DEAD, Pattern::Dotted);
        self.levels.iter().map(energised).chain(others).chain([notice]).collect()
    }

    /// The index of a state in the legend.
    pub(crate) fn legend_entry(&self, state: PieceState, level: usize) -> usize {
        let other = OTHERS.iter().position(|(other, ..)| *other == state);
        other.map_or(level, |other| self.levels.len() + other)
    }
}
