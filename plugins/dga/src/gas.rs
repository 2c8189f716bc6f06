//! Gases that laboratories report.

/// A gas dissolved in oil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Gas {
    /// Hydrogen.
    H2,
    /// Methane.
    Ch4,
    /// Ethane.
    C2h6,
    /// Ethylene.
    C2h4,
    /// Acetylene.
    C2h2,
    /// Carbon monoxide.
    Co,
    /// Carbon dioxide.
    Co2,
    /// Oxygen.
    O2,
    /// Nitrogen.
    N2,
}

impl Gas {
    /// All of them, in the order of the tables of IEEE C57.104.
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

    /// The five that most methods rest on.
    pub const FIVE: [Self; 5] = [Self::H2, Self::Ch4, Self::C2h6, Self::C2h4, Self::C2h2];

    /// Its formula.
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
