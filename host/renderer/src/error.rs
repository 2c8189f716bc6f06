//! Why something could not be drawn.

use busbar_gpu::{GpuError, RecoveryAction};
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
        /// Where the reference stands.
        place: String,
        /// What it refers to.
        what: &'static str,
        /// The index it gives.
        index: u32,
        /// How many there are.
        count: usize,
    },
    /// A texture's bytes do not fill its size.
    #[error("texture {index} is {width}x{height} but holds {bytes} bytes: decode it to RGBA first")]
    BadTexture {
        /// Index in the upload.
        index: u32,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Bytes it holds.
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
        /// What there is too much of.
        what: &'static str,
        /// How much was asked for.
        asked: u64,
        /// The limit.
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
        /// The pixel.
        pixel: [u32; 2],
        /// The picture's size.
        size: [u32; 2],
    },
    /// Nothing was drawn yet.
    #[error("there is no picture yet: draw a frame first")]
    NoPicture,
}

impl RenderError {
    /// What may help against it.
    pub fn recovery_action(&self) -> RecoveryAction {
        match self {
            Self::Gpu(error) => error.recovery_action(),
            _ => RecoveryAction::None,
        }
    }
}
