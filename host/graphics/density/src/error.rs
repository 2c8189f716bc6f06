//! Errors of density counting.

use busbar_gpu::GpuError;
use thiserror::Error;

/// A failure to count records.
#[derive(Debug, Error)]
pub enum DensityError {
    /// Vulkan or the machine is at fault.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// More than a limit allows.
    #[error("{what}: {asked}, but at most {limit} are possible")]
    TooMany {
        /// Kind of the items that are too many.
        what: &'static str,
        /// Number of items asked for.
        asked: u64,
        /// Greatest number of items allowed.
        limit: u64,
    },
}
