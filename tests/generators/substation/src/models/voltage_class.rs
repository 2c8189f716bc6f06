//! Dimensions of the equipment of each voltage level.

/// Dimensions of one voltage level's equipment, metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Class {
    /// Highest voltage of the equipment, kV; part of model names.
    pub(crate) highest_kilovolts: u32,
    /// Height of terminals above ground.
    pub(crate) terminal: f32,
    /// Height of the busbar's axis above ground.
    pub(crate) bus: f32,
    /// Height of the line gantry's beam.
    pub(crate) gantry: f32,
    /// Height of an insulator column.
    pub(crate) column: f32,
    /// Number of sheds of a column.
    pub(crate) sheds: usize,
    /// Number of discs of a string.
    pub(crate) discs: usize,
    /// Distance between phases, metres.
    pub(crate) phase: f32,
    /// Distance between bays, metres.
    pub(crate) pitch: f32,
}

/// Dimensions of 220 kV equipment.
pub(crate) const CLASS_252: Class = Class {
    highest_kilovolts: 252,
    terminal: 5.5,
    bus: 9.0,
    gantry: 14.5,
    column: 2.35,
    sheds: 20,
    discs: 16,
    phase: 4.0,
    pitch: 14.0,
};

/// Dimensions of 110 kV equipment.
pub(crate) const CLASS_126: Class = Class {
    highest_kilovolts: 126,
    terminal: 4.1,
    bus: 6.3,
    gantry: 10.5,
    column: 1.3,
    sheds: 9,
    discs: 9,
    phase: 2.2,
    pitch: 28.0 / 3.0,
};

impl Class {
    /// Returns the name of this class's model of a kind.
    pub(crate) fn named(&self, kind: &str) -> String {
        format!("{kind}_{}", self.highest_kilovolts)
    }

    /// Returns the scale of parts without voltage, relative to 252 kV.
    pub(super) fn scale(&self) -> f32 {
        self.column / CLASS_252.column
    }
}
