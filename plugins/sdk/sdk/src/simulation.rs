//! Signals and faults of simulated devices: pure functions without clock or socket.
//!
//! A [`Signal`] is the value of a tag at any instant. It follows from the seed, the
//! tag's id and its [`Behavior`] alone, so that whoever knows these can work out what
//! a viewer must show:
//!
//! ```
//! use std::time::{Duration, SystemTime};
//! use busbar_plugin_sdk::ValueKind;
//! use busbar_plugin_sdk::simulation::{Behavior, SignalShape, Signal};
//!
//! let behavior = Behavior::new(SignalShape::Sine, 60.0, 5.0, Duration::from_secs(600))?;
//! let oil = Signal::new(1, "T1.TopOil", ValueKind::F64, behavior)?;
//! let now = SystemTime::now();
//! assert_eq!(oil.at(now), Signal::new(1, "T1.TopOil", ValueKind::F64, behavior)?.at(now));
//! # Ok::<(), busbar_plugin_sdk::Error>(())
//! ```
//!
//! A [`FaultPlan`] says which [`FaultKind`] holds at a time since the start; a server
//! applies what makes sense for its protocol.

mod fault;
mod scenario;
mod signal;

pub use busbar_types::{FaultKind, SignalShape};
pub(crate) use fault::fault_kinds;
pub use fault::{ActiveFault, FaultPlan, LinkFault};
pub use scenario::{Scenario, ScenarioEvent};
pub use signal::{Behavior, Signal};

/// Mixes a number into an evenly spread one (SplitMix64: G. L. Steele, D. Lea and C. H. Flood,
/// "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014).
fn mix(number: u64) -> u64 {
    let mut z = number.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Returns a number of the random sequence that a key names.
fn draw(key: u64, index: u64) -> u64 {
    mix(key ^ mix(index))
}

/// Maps a number to 0 up to less than 1, by its upper bits.
fn unit(number: u64) -> f64 {
    (number >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_those_of_the_published_generator() {
        // The first three of SplitMix64 from state 1234567.
        let step = 0x9E37_79B9_7F4A_7C15_u64;
        let states = [1_234_567, 1_234_567_u64.wrapping_add(step)];
        let found = [states[0], states[1], states[1].wrapping_add(step)].map(mix);
        let known =
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(found, known);
    }

    #[test]
    fn units_fill_their_interval() {
        assert_eq!(unit(0), 0.0);
        assert!(unit(u64::MAX) < 1.0);
        let mean = (0..10_000).map(|i| unit(draw(7, i))).sum::<f64>() / 10_000.0;
        assert!((0.48..0.52).contains(&mean), "{mean}");
    }
}
