//! Errors of uploading, drawing, picking and reading back.

use busbar_density::DensityError;
use busbar_gpu::{GpuError, RecoveryAction};
use busbar_panel_painter::PanelError;
use thiserror::Error;

/// A failure to upload, draw, pick or read back.
#[derive(Debug, Error)]
pub enum RenderError {
    /// Vulkan or the machine is at fault.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Samples a pixel that the device does not offer.
    #[error("{0} samples a pixel are not possible: use 1 or 4")]
    BadSamples(u32),
    /// A model refers to something that it does not hold.
    #[error("{place} names {what} {index}, but the model has {count}")]
    BadReference {
        /// Place of the faulty reference.
        place: String,
        /// Kind of the item referred to.
        what: &'static str,
        /// The index it gives.
        index: u32,
        /// Number of items there are.
        count: usize,
    },
    /// A texture's bytes do not fill its size.
    #[error("texture {index} is {width}x{height} but holds {bytes} bytes: decode it to RGBA first")]
    BadTexture {
        /// Index in the upload.
        index: u32,
        /// Width of the texture in pixels.
        width: u32,
        /// Height of the texture in pixels.
        height: u32,
        /// Number of bytes it holds.
        bytes: usize,
    },
    /// A handle whose model was removed or never uploaded here.
    #[error("model {0} is not uploaded, or was removed: upload it before drawing it")]
    UnknownModel(u32),
    /// egui's panels contradict themselves.
    #[error("the panels cannot be painted: {0}; please report this")]
    BadPanels(String),
    /// More than a limit allows.
    #[error("{what}: {asked}, but at most {limit} are possible; show less, or raise theta")]
    TooMany {
        /// Kind of the items that are too many.
        what: &'static str,
        /// Number of items asked for.
        asked: u64,
        /// Greatest number of items allowed.
        limit: u64,
    },
    /// The threads that resolve meshes cannot be started.
    #[error("no threads to resolve meshes with: {0}; raise the limit of processes")]
    NoThreads(String),
    /// A frame without the tints of features that it shows.
    #[error("object {object} has no highlight, only {count} have: give one for every object")]
    NoHighlight {
        /// The last object of an instance's features; 0 is none.
        object: u32,
        /// Highlights of the frame.
        count: usize,
    },
    /// A pixel outside the picture.
    #[error("pixel {pixel:?} lies outside the picture of {size:?} pixels")]
    OutsidePicture {
        /// Pixel asked for: column and row.
        pixel: [u32; 2],
        /// Size of the picture in pixels.
        size: [u32; 2],
    },
    /// Nothing was drawn yet.
    #[error("there is no picture yet: draw a frame first")]
    NoPicture,
}

impl RenderError {
    /// Returns the action that may help against this error.
    pub fn recovery_action(&self) -> RecoveryAction {
        match self {
            Self::Gpu(error) => error.recovery_action(),
            _ => RecoveryAction::None,
        }
    }
}

impl From<DensityError> for RenderError {
    fn from(error: DensityError) -> Self {
        match error {
            DensityError::Gpu(error) => Self::Gpu(error),
            DensityError::TooMany { what, asked, limit } => Self::TooMany { what, asked, limit },
        }
    }
}

impl From<PanelError> for RenderError {
    fn from(error: PanelError) -> Self {
        match error {
            PanelError::Gpu(error) => Self::Gpu(error),
            PanelError::BadPanels(fault) => Self::BadPanels(fault),
            PanelError::TooManyVertices { asked, limit } => {
                Self::TooMany { what: "vertices of panels", asked, limit }
            }
        }
    }
}
