//! Measurement of the machine at hand, for a choice of panel PCs: `busbar benchmark`.
//!
//! A scene is measured as an operator sees it, in a live view without a window: at rest, drawn
//! anew, with a moving camera and with every tag changing; then changes of detail, the time to the
//! first picture and the memory of the process. [`write_scene`] makes scenes of three sizes;
//! [`measure`] takes any configuration. Each scene is measured in a process of its own, because
//! start and memory are a process's.
//!
//! Invariant: nothing here prints or parses arguments.

mod equipment_model;
mod generated_scene;
mod measurement;
mod scene_results;
mod table;

pub use generated_scene::{GenerateError, ScenePlugins, SceneSize, write_scene};
pub use measurement::{BenchmarkError, MeasureOptions, measure, shows_tags};
pub use scene_results::{Distribution, SceneResults};
pub use table::format_table;
