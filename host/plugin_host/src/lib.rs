//! Plugins: discovery, ABI check, lifecycle, and one file a capability.
//!
//! Everything that comes back from a plugin is checked here, so that the rest
//! of the host only ever sees valid values.
//!
//! Invariant: no concrete plugin is named here, or anywhere in the host.

mod catalog;
mod error;
mod instance;
mod library;
mod log;
mod mesh_optimizer;
mod overlay;
mod telemetry;
mod text;

pub use catalog::{Catalog, MAX_LIBRARIES, Refused};
pub use error::{PluginError, SettingsFault};
pub use instance::Instance;
pub use library::PluginInfo;
pub use mesh_optimizer::{MeshOptimizer, Optimised};
pub use overlay::{Overlay, OverlayBinding, OverlayLine, OverlayPicture, OverlayTint, Severity};
pub use telemetry::{LinkReport, LinkState, Telemetry, TelemetryTag};
