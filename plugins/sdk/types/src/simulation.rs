//! Simulated devices: their faults, and the signals of their tags.

use crate::code::codes;

/// A way in which a link fails, as `busbar simulate --fault` names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema), schemars(rename = "LinkFaultKind"))]
pub enum FaultKind {
    /// Connections end, and new ones are turned away.
    LinkLoss,
    /// Every answer takes a while, but comes in time.
    Slow,
    /// Connections stay, and nothing comes through them.
    HalfOpen,
    /// Connections are reset, again and again.
    Reset,
    /// Random bytes come instead of answers.
    Garbage,
    /// Answers come after the client's deadline.
    Late,
    /// The device's clock is wrong.
    ClockJump,
}

/// Form of a movement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema), schemars(rename = "SimulatedShape"))]
#[repr(u8)]
pub enum SignalShape {
    /// Constant value of the base.
    Constant = 0,
    /// A sine about the base.
    Sine = 1,
    /// A smooth random walk about the base.
    Walk = 2,
    /// Random levels, or positions of a switch, each held for a period.
    Steps = 3,
    /// One more each period.
    Counter = 4,
}

codes!(SignalShape { Constant, Sine, Walk, Steps, Counter });

impl FaultKind {
    /// All kinds of faults.
    pub const ALL: [Self; 7] = [
        Self::LinkLoss,
        Self::Slow,
        Self::HalfOpen,
        Self::Reset,
        Self::Garbage,
        Self::Late,
        Self::ClockJump,
    ];

    /// Returns the name for people, such as `link-loss`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LinkLoss => "link-loss",
            Self::Slow => "slow",
            Self::HalfOpen => "half-open",
            Self::Reset => "reset",
            Self::Garbage => "garbage",
            Self::Late => "late",
            Self::ClockJump => "clock-jump",
        }
    }

    /// Returns the bit of the kind in a sum of the C ABI.
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}
