//! Positions of switches as their tags have them: contacts of each pole, racking, and what
//! was set by hand.

use busbar_plugin_sdk::{DoublePoint, Quality, TagValue, Value};

use smallvec::{SmallVec, smallvec};

use crate::state::Position;
use crate::switch_condition::{Pole, SwitchCondition, SwitchRole};

/// Tags and placements that tell where a switch stands, by indices of bindings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SwitchWiring {
    /// Tags of positions, each of the whole switch or of a pole.
    pub contacts: Vec<Contact>,
    /// Pole that no tag tells of, where other poles have one.
    pub missing_pole: Option<Pole>,
    /// Tag in the role `racked_out`.
    pub racked_out: Option<usize>,
    /// Tag in the role `hand_dressed`.
    pub hand_dressed: Option<usize>,
    /// Tag in the role `portable_earth`.
    pub portable_earth: Option<usize>,
    /// Placement of the settings.
    pub placed: Option<Placed>,
    /// Reports whether it is a portable earth, and no switch.
    pub is_portable_earth: bool,
    /// Reports whether the end of its equipment that it earths is not known.
    pub is_ambiguous: bool,
    /// Reports whether the settings say that no tag tells.
    pub is_untelemetered: bool,
}

/// Tag of a position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Contact {
    /// Index of the binding.
    pub binding: usize,
    /// Pole that the tag tells of.
    pub pole: Pole,
}

/// Something that the settings say an operator placed or set by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placed {
    /// Portable earth that is placed.
    PortableEarth,
    /// Switch that is racked out.
    RackedOut,
    /// Position that is set by hand.
    HandDressed(Position),
}

/// Indices of bindings that a reading rests on: few, so mostly without an allocation.
pub type BindingList = SmallVec<[u32; 2]>;

/// Reading of a switch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SwitchReading {
    /// Position that counts for the network.
    pub position: Position,
    /// Condition that is shown at the switch itself.
    pub condition: SwitchCondition,
    /// Bindings that the position rests on.
    pub basis: BindingList,
}

/// Lists the binding of a tag, where there is one.
pub(crate) fn one(binding: Option<usize>) -> BindingList {
    binding.map(|binding| binding as u32).into_iter().collect()
}

/// Reading of a tag that is true or false.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flag {
    False,
    True,
    Unknown,
}

impl SwitchWiring {
    /// Reads where the switch stands.
    pub fn read(&self, values: &[TagValue]) -> SwitchReading {
        if self.is_portable_earth {
            return self.read_portable_earth(values);
        }
        let racked_out = match (self.placed, self.racked_out) {
            (Some(Placed::RackedOut), _) => Flag::True,
            (_, Some(binding)) => flag(&values[binding]),
            (_, None) => Flag::False,
        };
        if racked_out == Flag::True {
            let basis = match self.placed {
                Some(Placed::RackedOut) => BindingList::new(),
                _ => one(self.racked_out),
            };
            let condition = SwitchCondition::RackedOut;
            return SwitchReading { position: Position::Open, condition, basis };
        }
        let mut reading = self.read_in_place(values);
        if reading.position == Position::Closed {
            reading.basis.extend(one(self.racked_out));
            if racked_out == Flag::Unknown {
                reading.position = Position::Unknown;
                reading.condition = SwitchCondition::NotGood { role: SwitchRole::RackedOut };
            }
        }
        reading
    }

    fn read_portable_earth(&self, values: &[TagValue]) -> SwitchReading {
        let basis = one(self.portable_earth);
        let of = |position, condition| SwitchReading { position, condition, basis };
        let (position, condition) = match (self.placed, self.portable_earth) {
            (Some(Placed::PortableEarth), _) => {
                let position = self.unless_ambiguous(Position::Closed);
                let condition = SwitchCondition::PortableEarthPlaced;
                return SwitchReading { position, condition, basis: BindingList::new() };
            }
            (_, None) if self.is_untelemetered => {
                (Position::Unknown, SwitchCondition::Untelemetered)
            }
            (_, None) => (Position::Unknown, SwitchCondition::NoTag),
            (_, Some(binding)) => match flag(&values[binding]) {
                Flag::False => (Position::Open, SwitchCondition::Settled),
                Flag::True => {
                    let position = self.unless_ambiguous(Position::Closed);
                    (position, SwitchCondition::PortableEarthPlaced)
                }
                Flag::Unknown => (
                    Position::Unknown,
                    SwitchCondition::NotGood { role: SwitchRole::PortableEarth },
                ),
            },
        };
        of(position, condition)
    }

    fn unless_ambiguous(&self, position: Position) -> Position {
        if self.is_ambiguous { Position::Unknown } else { position }
    }

    /// Reads a switch that is not racked out.
    fn read_in_place(&self, values: &[TagValue]) -> SwitchReading {
        let condition = SwitchCondition::HandDressed;
        if let Some(Placed::HandDressed(position)) = self.placed {
            return SwitchReading { position, condition, basis: BindingList::new() };
        }
        let Some(binding) = self.hand_dressed else { return self.read_contacts(values, false) };
        let tag = &values[binding];
        let is_good = tag.quality == Quality::Good;
        match &tag.value {
            // The position itself, set by hand.
            Some(Value::DoublePoint(DoublePoint::Off)) if is_good => {
                SwitchReading { position: Position::Open, condition, basis: one(Some(binding)) }
            }
            Some(Value::DoublePoint(DoublePoint::On)) if is_good => {
                SwitchReading { position: Position::Closed, condition, basis: one(Some(binding)) }
            }
            Some(Value::DoublePoint(_)) if is_good => {
                let mut reading = self.read_contacts(values, false);
                reading.basis.push(binding as u32);
                reading
            }
            // A flag at the position that the tag in the role `position` has.
            Some(Value::Bool(true)) if is_good => {
                let mut reading = self.read_contacts(values, true);
                reading.basis.push(binding as u32);
                if reading.position != Position::Unknown {
                    reading.condition = condition;
                }
                reading
            }
            Some(Value::Bool(_)) => self.read_contacts(values, false),
            // Another position may have been set by hand.
            _ => SwitchReading {
                position: Position::Unknown,
                condition: SwitchCondition::NotGood { role: SwitchRole::HandDressed },
                basis: one(Some(binding)),
            },
        }
    }

    /// Reads the contacts of all poles. What was set by hand is taken though a device says
    /// that it is substituted, which is of uncertain quality.
    fn read_contacts(&self, values: &[TagValue], is_hand_dressed: bool) -> SwitchReading {
        let read = |contact: &Contact| {
            let tag = &values[contact.binding];
            match (tag.quality, &tag.value) {
                (Quality::Uncertain(_), Some(value)) if is_hand_dressed => position_of(value),
                (Quality::Good, Some(value)) => position_of(value),
                _ => Err(SwitchCondition::NotGood { role: SwitchRole::Position }),
            }
        };
        let readings: SmallVec<[_; 4]> =
            self.contacts.iter().map(|contact| (contact, read(contact))).collect();
        let find = |position| {
            let mut readings = readings.iter();
            readings.find(|(_, reading)| *reading == Ok(position)).map(|(contact, _)| *contact)
        };
        let (open, closed) = (find(Position::Open), find(Position::Closed));
        let unknown =
            |condition, basis| SwitchReading { position: Position::Unknown, condition, basis };
        if let Some((open, closed)) = open.zip(closed) {
            let condition = SwitchCondition::PolesDisagree { open: open.pole, closed: closed.pole };
            return unknown(condition, smallvec![open.binding as u32, closed.binding as u32]);
        }
        let is_sure = |contact: &&Contact| {
            !is_hand_dressed || values[contact.binding].quality == Quality::Good
        };
        let basis: BindingList =
            self.contacts.iter().filter(is_sure).map(|contact| contact.binding as u32).collect();
        let faults = || readings.iter().filter_map(|(_, reading)| reading.err());
        let worst = faults().find(|fault| *fault != SwitchCondition::InMotion);
        if let Some(fault) = worst.or_else(|| faults().next()) {
            return unknown(fault, basis);
        }
        if let Some(pole) = self.missing_pole {
            return unknown(SwitchCondition::NoTagAtPole(pole), basis);
        }
        let position = match (open, closed) {
            (Some(_), _) => Position::Open,
            (_, Some(_)) => Position::Closed,
            (None, None) if self.is_untelemetered => {
                return unknown(SwitchCondition::Untelemetered, basis);
            }
            (None, None) => return unknown(SwitchCondition::NoTag, basis),
        };
        SwitchReading { position, condition: SwitchCondition::Settled, basis }
    }
}

/// Role of a tag that is a switch's position.
pub(crate) const POSITION: &str = "position";
/// Role of a tag that tells whether a switch is withdrawn from its contacts.
pub(crate) const RACKED_OUT: &str = "racked_out";
/// Role of a tag that tells whether a position is set by hand, or of one that is it.
pub(crate) const HAND_DRESSED: &str = "hand_dressed";
/// Role of a tag that tells whether a portable earth is placed.
pub(crate) const PORTABLE_EARTH: &str = "portable_earth";

/// The position that a value is.
fn position_of(value: &Value) -> Result<Position, SwitchCondition> {
    match value {
        Value::DoublePoint(DoublePoint::Off) | Value::Bool(false) => Ok(Position::Open),
        Value::DoublePoint(DoublePoint::On) | Value::Bool(true) => Ok(Position::Closed),
        Value::DoublePoint(DoublePoint::Intermediate) => Err(SwitchCondition::InMotion),
        Value::DoublePoint(DoublePoint::BadState) => Err(SwitchCondition::BadState),
        Value::F64(_) | Value::I64(_) | Value::Text(_) => Err(SwitchCondition::NoPosition),
    }
}

fn flag(tag: &TagValue) -> Flag {
    match tag.value.as_ref().filter(|_| tag.quality == Quality::Good).map(position_of) {
        Some(Ok(Position::Closed)) => Flag::True,
        Some(Ok(Position::Open)) => Flag::False,
        _ => Flag::Unknown,
    }
}
