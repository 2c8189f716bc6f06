//! Kinds of branches, by what passes them: load current, and the earth of a working earth.

/// Kind of a branch. Feeding passes every kind; an earth passes conductors and closed
/// switches alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BranchKind {
    /// Power transformer with separate windings.
    #[serde(alias = "power_transformer", alias = "two_winding_transformer")]
    Transformer,
    /// Transformer whose windings have a part in common.
    #[serde(alias = "autotransformer")]
    AutoTransformer,
    /// Transformer for the station's own supply: a way of back-feed.
    #[serde(alias = "station_transformer", alias = "station_service_transformer")]
    AuxiliaryTransformer,
    /// Earthing transformer, zig-zag ones too.
    #[serde(alias = "grounding_transformer", alias = "zig_zag", alias = "zigzag")]
    EarthingTransformer,
    /// Voltage transformer between primary and secondary side: a way of back-feed.
    #[serde(alias = "voltage_transformer", alias = "potential_transformer")]
    InstrumentTransformer,
    /// Reactor, in series or shunt.
    #[serde(alias = "series_reactor", alias = "shunt_reactor")]
    Reactor,
    /// Arc-suppression (Petersen) coil of a star point.
    #[serde(alias = "petersen_coil", alias = "coil")]
    ArcSuppressionCoil,
    /// Resistor, such as that of a star point.
    Resistor,
    /// Capacitor, in series or shunt.
    #[serde(alias = "series_capacitor", alias = "shunt_capacitor")]
    Capacitor,
    /// Overhead line between two nodes.
    Line,
    /// Cable between two nodes.
    Cable,
    /// Busbar, or a section of one.
    #[serde(alias = "busbar_section")]
    Busbar,
    /// Joint, clamp, bushing, wall bushing or other conductor.
    #[serde(alias = "joint", alias = "bushing")]
    Conductor,
    /// Primary side of a current transformer: a conductor.
    CurrentTransformer,
    /// Switch of any make.
    #[serde(alias = "load_switch", alias = "switch_disconnector", alias = "contactor")]
    Switch,
    /// Circuit breaker with a position.
    #[serde(alias = "circuit_breaker")]
    Breaker,
    /// Disconnector with a position.
    #[serde(alias = "isolator")]
    Disconnector,
    /// Fuse; it has a position only where `switch` says so.
    Fuse,
}

impl BranchKind {
    /// Reports whether no earth passes: it has windings, or is no conductor.
    pub fn stops_earth(self) -> bool {
        match self {
            Self::Transformer
            | Self::AutoTransformer
            | Self::AuxiliaryTransformer
            | Self::EarthingTransformer
            | Self::InstrumentTransformer
            | Self::Reactor
            | Self::ArcSuppressionCoil
            | Self::Resistor
            | Self::Capacitor => true,
            Self::Line
            | Self::Cable
            | Self::Busbar
            | Self::Conductor
            | Self::CurrentTransformer
            | Self::Switch
            | Self::Breaker
            | Self::Disconnector
            | Self::Fuse => false,
        }
    }

    /// Reports whether the kind has a position without `switch` saying so.
    pub fn is_switch(self) -> bool {
        matches!(self, Self::Switch | Self::Breaker | Self::Disconnector)
    }
}

/// Kind of an earth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EarthKind {
    /// Earth switch: its position comes from a tag in the role `position`.
    #[default]
    #[serde(alias = "earth_switch", alias = "working_earth")]
    Switch,
    /// Portable earth: a tag in the role `portable_earth` tells whether it is placed.
    #[serde(alias = "portable_earth")]
    Portable,
    /// Earthing of a star point (solid, by a resistor, a coil or a zig-zag transformer):
    /// shown, and no working earth.
    #[serde(
        alias = "neutral",
        alias = "solid",
        alias = "resistor",
        alias = "coil",
        alias = "zig_zag",
        alias = "zigzag"
    )]
    StarPoint,
}
