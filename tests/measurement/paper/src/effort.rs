//! Measurement effort: numbers of frames, moves and pixels.

/// Amounts measured in one run.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Flag of the short run.
    pub quick: bool,
    /// Number of frames of the camera path for each theta, size and number of samples.
    pub path_frames: usize,
    /// Numbers of samples a pixel for which frames are timed.
    pub samples: &'static [u32],
    /// Number of timed changes of theta.
    pub theta_changes: usize,
    /// Number of moves of the lossless walk.
    pub moves: usize,
    /// Number of picked pixels.
    pub pixels: usize,
    /// Number of points drawn on each surface that is compared.
    pub surface_samples: usize,
}

impl Effort {
    /// Effort of the full report.
    pub const FULL: Self = Self {
        quick: false,
        path_frames: 60,
        samples: &[1, 4],
        theta_changes: 200,
        moves: 10_000,
        pixels: 10_000,
        surface_samples: 20_000,
    };

    /// Effort of the whole report with fewer measurements.
    pub const QUICK: Self = Self {
        quick: true,
        path_frames: 10,
        samples: &[1],
        theta_changes: 30,
        moves: 500,
        pixels: 10_000,
        surface_samples: 4_000,
    };
}
