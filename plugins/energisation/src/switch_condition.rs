//! Conditions of switches besides their positions, and words for them.

use crate::switch_reading::POSITION;

/// Condition of a switch, besides its position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchCondition {
    /// Reported, and at one of its ends.
    Settled,
    /// Travelling between its end positions.
    InMotion,
    /// Poles, or tags of one switch, in different positions: one that is open, one closed.
    PolesDisagree {
        /// Name of an open pole.
        open: &'static str,
        /// Name of a closed pole.
        closed: &'static str,
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
        role: &'static str,
    },
    /// A number, which is no position.
    NoPosition,
    /// No tag tells its position.
    NoTag,
    /// No tag tells of one pole.
    NoTagAtPole(&'static str),
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
                let name = |pole: &str| match pole {
                    "" => "as a whole".to_owned(),
                    pole => format!("at {}", pole.to_uppercase()),
                };
                format!("poles of {id} disagree: open {}, closed {}", name(open), name(closed))
            }
            Self::RackedOut => format!("{id} is racked out"),
            Self::HandDressed => format!("the position of {id} is set by hand"),
            Self::PortableEarthPlaced => format!("a portable earth is placed at {id}"),
            Self::BadState => format!("the contacts of {id} contradict each other"),
            Self::NotGood { role: POSITION } => format!("{id} has no good position"),
            Self::NotGood { role } => format!("the tag in the role '{role}' of {id} is not good"),
            Self::NoPosition => {
                format!("the tag of {id} is a number: a position is a double_point or a bool")
            }
            Self::NoTag => format!("{id} has no tag for its position"),
            Self::NoTagAtPole(pole) => format!("{id} has no tag in the role 'position_{pole}'"),
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
