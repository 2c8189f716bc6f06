//! Results of the report, as figures.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::frames::FrameTimes;
use crate::image_difference::ImageDifference;
use crate::lossless::LosslessWalk;
use crate::machine::Machine;
use crate::picks::PickChanges;
use crate::run::LARGE;
use crate::study::Study;
use crate::theta_change::ThetaChange;
use crate::topology::TopologyCounts;

/// Figures of one run.
#[derive(Clone, Debug, Serialize)]
pub struct Results {
    /// Machine that the run was measured on.
    pub machine: Machine,
    /// Flag of the short run.
    pub quick: bool,
    /// Levels of the paper's scene, one a theta.
    pub levels: Vec<SceneLevel>,
    /// Frame times, a set for each size and number of samples.
    pub frames: Vec<FrameTimes>,
    /// Durations of the stages of loading.
    pub stages: Stages,
    /// Costs of a change of theta.
    pub theta_change: ThetaChange,
    /// Study of collapse orders on the power transformer.
    pub study: Study,
    /// Results of the lossless proof.
    pub lossless: LosslessWalk,
    /// Changes of picks by theta.
    pub picks: PickChanges,
}

/// Level of the paper's scene at one theta.
#[derive(Clone, Debug, Serialize)]
pub struct SceneLevel {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Counts of the simplified mesh.
    pub counts: TopologyCounts,
    /// Difference of the overview from that at theta 0.
    pub difference: ImageDifference,
    /// File of the overview, beside the report.
    pub picture: String,
}

/// Milliseconds of each stage of loading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stages {
    /// Stages of the first load, by the viewer's names.
    pub first: BTreeMap<String, f64>,
    /// Seconds of each stage of the second load.
    pub second: BTreeMap<String, f64>,
    /// Milliseconds of welding alone, which is part of `import`.
    pub weld: f64,
}

/// Greatest share of the optimisation's time that a load from the cache may take.
pub const MAX_CACHED_SHARE: f64 = 0.1;

impl Stages {
    /// Returns the time for stacks in the second load as a share of that in the first; `None`
    /// unless the first made them and the second found them.
    pub fn cached_share(&self) -> Option<f64> {
        let made = |load: &BTreeMap<String, f64>| {
            Some(load.get("optimize")? + load.get("stacks").copied().unwrap_or(0.0))
        };
        let found = made(&self.second).is_none().then(|| self.second.get("cache"))??;
        Some(found / made(&self.first)?)
    }
}

impl Results {
    /// Returns the scene's figures at a theta.
    pub fn level(&self, theta: f64) -> Option<&SceneLevel> {
        self.levels.iter().find(|level| level.theta == theta)
    }

    /// Returns triangles at theta 0 divided by those at theta, in the measured scene.
    pub fn triangle_ratio(&self, theta: f64) -> Option<f64> {
        let triangles = |theta| Some(self.level(theta)?.counts.triangles as f64);
        Some(triangles(0.0)? / triangles(theta)?)
    }

    /// Returns the median change of theta as a share of the median frame at theta 0, for the
    /// pictures' size and for the smaller one, at 1 sample a pixel.
    pub fn shares_of_frame(&self) -> Option<[f64; 2]> {
        let change = &self.theta_change;
        let large = self.frames_of(LARGE, 1)?.at(0.0)?.frame.p50_ms;
        Some([large, change.full_frame.p50_ms].map(|frame| change.change.p50_ms / frame))
    }

    /// Returns the frame times for a size and number of samples.
    pub fn frames_of(&self, size: [u32; 2], samples: u32) -> Option<&FrameTimes> {
        self.frames.iter().find(|f| f.size == size && f.samples == samples)
    }
}
