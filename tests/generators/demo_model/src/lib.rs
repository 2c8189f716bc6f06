//! Makes the demo models: a power transformer, a breaker pole and a
//! disconnector pole, as a station of 220/110/35 kV has them.
//!
//! Everything is in metres, y up, origin on the ground at the centre. Shapes
//! are closed solids with outward normals ([`shapes`]); solids with finishes
//! make a [`Part`]; parts placed by name make a model ([`Assembly`]). The same
//! call gives the same bytes on every machine: angles go through `libm`, not
//! through the platform's own functions.

mod assembly;
mod breaker;
mod disconnector;
mod finish;
mod fittings;
mod insulator;
mod part;
mod plates;
pub mod shapes;
mod solid;
mod structure;
mod transformer;
mod yard;

pub use assembly::{Assembly, MeshId, NodeId, at};
pub use breaker::breaker_pole;
pub use disconnector::disconnector_pole;
pub use finish::Finish;
pub use insulator::{Sheds, insulator_profile};
pub use part::Part;
pub use solid::{PlanarUv, Solid};
pub use transformer::power_transformer;
pub use yard::yard;
