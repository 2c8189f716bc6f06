//! Conditions of switches besides their positions, and words for them.

use crate::switch_reading::{HAND_DRESSED, PORTABLE_EARTH, POSITION, RACKED_OUT};

/// Pole that a tag of a position tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pole {
    /// All poles of the switch together.
    Whole,
    /// Pole of the first phase.
    L1,
    /// Pole of the second phase.
    L2,
    /// Pole of the third phase.
    L3,
}

impl Pole {
    /// Returns the end that a role has by the pole; empty for the whole switch.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "",
            Self::L1 => "l1",
            Self::L2 => "l2",
            Self::L3 => "l3",
        }
    }
}

/// Role of a tag that tells of a switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchRole {
    /// Position of the switch, or of a pole.
    Position,
    /// Flag of a switch that is withdrawn from its contacts.
    RackedOut,
    /// Position that is set by hand, or the flag of one.
    HandDressed,
    /// Flag of a portable earth that is placed.
    PortableEarth,
}

impl SwitchRole {
    /// Returns the name of the role in the bindings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => POSITION,
            Self::RackedOut => RACKED_OUT,
            Self::HandDressed => HAND_DRESSED,
            Self::PortableEarth => PORTABLE_EARTH,
        }
    }
}

/// Condition of a switch, besides its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchCondition {
    /// Reported, and at one of its ends.
    Settled,
    /// Travelling between its end positions.
    InMotion,
    /// Poles, or tags of one switch, in different positions: one that is open, one closed.
    PolesDisagree {
        /// Pole that is open.
        open: Pole,
        /// Pole that is closed.
        closed: Pole,
    },
    /// Withdrawn from its contacts.
    RackedOut,
    /// Position set by hand.
    HandDressed,
    /// Portable earth that is placed.
    PortableEarthPlaced,
    /// Contacts that contradict each other.
    BadState,
    /// Tag of no good quality.
    NotGood {
        /// The role of the tag.
        role: SwitchRole,
    },
    /// A number or a text, which is no position.
    NoPosition,
    /// No tag tells its position.
    NoTag,
    /// No tag tells of one pole.
    NoTagAtPole(Pole),
    /// No tag tells, as the settings say.
    Untelemetered,
}

impl SwitchCondition {
    /// Tells people of it, with the name of the switch; empty where there is nothing to
    /// tell.
    pub fn explain(self, id: &str) -> String {
        match self {
            Self::Settled => String::new(),
            Self::InMotion => format!("{id} is in motion"),
            Self::PolesDisagree { open, closed } if open == closed => {
                format!("{id} is open by one tag and closed by another")
            }
            Self::PolesDisagree { open, closed } => {
                let name = |pole: Pole| match pole {
                    Pole::Whole => "as a whole".to_owned(),
                    pole => format!("at {}", pole.name().to_uppercase()),
                };
                format!("poles of {id} disagree: open {}, closed {}", name(open), name(closed))
            }
            Self::RackedOut => format!("{id} is racked out"),
            Self::HandDressed => format!("the position of {id} is set by hand"),
            Self::PortableEarthPlaced => format!("a portable earth is placed at {id}"),
            Self::BadState => format!("the contacts of {id} contradict each other"),
            Self::NotGood { role: SwitchRole::Position } => format!("{id} has no good position"),
            Self::NotGood { role } => {
                format!("the tag in the role '{}' of {id} is not good", role.name())
            }
            Self::NoPosition => {
                format!("the tag of {id} is no state: a position is a double_point or a bool")
            }
            Self::NoTag => format!("{id} has no tag for its position"),
            Self::NoTagAtPole(pole) => {
                format!("{id} has no tag in the role 'position_{}'", pole.name())
            }
            Self::Untelemetered => format!("no tag tells the position of {id}, by the settings"),
        }
    }

    /// Reports whether the position is unknown by it.
    pub fn is_fault(self) -> bool {
        !matches!(
            self,
            Self::Settled | Self::RackedOut | Self::HandDressed | Self::PortableEarthPlaced
        )
    }
}
