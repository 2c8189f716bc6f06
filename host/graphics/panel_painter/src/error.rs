//! Errors of painting panels.

use busbar_gpu::GpuError;
use thiserror::Error;

/// A failure to paint panels.
#[derive(Debug, Error)]
pub enum PanelError {
    /// Vulkan or the machine is at fault.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// egui's panels contradict themselves.
    #[error("the panels cannot be painted: {0}; please report this")]
    BadPanels(String),
    /// More vertices than a limit allows.
    #[error("vertices of panels: {asked}, but at most {limit} are possible")]
    TooManyVertices {
        /// Number of vertices asked for.
        asked: u64,
        /// Greatest number of vertices allowed.
        limit: u64,
    },
}
