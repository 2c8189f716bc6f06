//! The 220/110/35 kV substation of the paper: an air-insulated station with
//! two double-bus yards and two transformers.
//!
//! [`Station::generate`] makes the models and where each stands. It is written
//! in two forms of the same triangles: as a configuration that places a few
//! dozen models ([`Station::configuration`]; with all points live,
//! [`Station::live_configuration`]), and flattened into one mesh with
//! the paper's counts ([`Station::flatten`]). [`points`] is the point list,
//! [`scenarios`] is what may happen to it, [`StationRecords`] what business and management
//! systems have of it.
//!
//! World space is metres, y up, origin on the ground between the transformers;
//! 220 kV lines leave towards -z, 110 kV lines towards +z.

mod body;
mod catalogue;
mod configuration;
mod error;
mod filler_counts;
mod flatten;
mod layout;
mod live;
mod models;
mod network;
mod points;
mod records;
mod scenarios;
mod seeded_random;
mod station;

pub use catalogue::{Catalogue, Counts, Entry};
pub use error::StationError;
pub use filler_counts::{PAPER_TRIANGLES, PAPER_VERTICES};
pub use flatten::{FlatStation, Run};
pub use layout::Placement;
pub use network::{Network, NetworkSwitch, network};
pub use points::{Gateway, NormalValue, Point, PointKind, csv, points};
pub use records::{AssetRow, StationRecords, WorkRow};
pub use scenarios::{Scenario, scenarios};
pub use station::Station;
