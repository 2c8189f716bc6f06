//! Gases that laboratories report.

/// Gas dissolved in oil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Gas {
    /// Hydrogen, the gas H2.
    H2,
    /// Methane, the gas CH4.
    Ch4,
    /// Ethane, the gas C2H6.
    C2h6,
    /// Ethylene, the gas C2H4.
    C2h4,
    /// Acetylene, the gas C2H2.
    C2h2,
    /// Carbon monoxide, the gas CO.
    Co,
    /// Carbon dioxide, the gas CO2.
    Co2,
    /// Oxygen, the gas O2.
    O2,
    /// Nitrogen, the gas N2.
    N2,
}

impl Gas {
    /// All gases, in the order of the tables of IEEE C57.104.
    pub const ALL: [Self; 9] = [
        Self::H2,
        Self::Ch4,
        Self::C2h6,
        Self::C2h4,
        Self::C2h2,
        Self::Co,
        Self::Co2,
        Self::O2,
        Self::N2,
    ];

    /// Five gases that most methods rest on.
    pub const FIVE: [Self; 5] = [Self::H2, Self::Ch4, Self::C2h6, Self::C2h4, Self::C2h2];

    /// Returns the gas's chemical formula.
    pub const fn formula(self) -> &'static str {
        match self {
            Self::H2 => "H2",
            Self::Ch4 => "CH4",
            Self::C2h6 => "C2H6",
            Self::C2h4 => "C2H4",
            Self::C2h2 => "C2H2",
            Self::Co => "CO",
            Self::Co2 => "CO2",
            Self::O2 => "O2",
            Self::N2 => "N2",
        }
    }
}
