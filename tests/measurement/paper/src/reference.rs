//! Reference values printed in the paper.

/// Row of the paper's Table I, with the quotients that follow from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrintedRow {
    /// Proportion of simplified vertices.
    pub theta: f64,
    /// Number of vertices V.
    pub vertices: u64,
    /// Number of triangles T.
    pub triangles: u64,
    /// Frame rate, frames per second.
    pub fps: f64,
}

/// Table I: a Quadro 1000M, resolution not given.
pub const TABLE_I: [PrintedRow; 3] = [
    PrintedRow { theta: 0.0, vertices: 536_141, triangles: 1_057_086, fps: 3.9 },
    PrintedRow { theta: 0.7, vertices: 160_841, triangles: 316_452, fps: 15.5 },
    PrintedRow { theta: 0.85, vertices: 80_421, triangles: 148_352, fps: 18.0 },
];

impl PrintedRow {
    /// Returns the row of a theta, if the paper has one.
    pub fn at(theta: f64) -> Option<Self> {
        TABLE_I.into_iter().find(|row| row.theta == theta)
    }

    /// Returns 2V - T, from which shells and holes are counted.
    pub fn two_v_minus_t(&self) -> i64 {
        2 * self.vertices as i64 - self.triangles as i64
    }

    /// Returns the frame rate divided by that at theta 0.
    pub fn fps_ratio(&self) -> f64 {
        self.fps / TABLE_I[0].fps
    }

    /// Returns triangles at theta 0 divided by those of this row: the gain of fewer triangles
    /// alone.
    pub fn triangle_ratio(&self) -> f64 {
        TABLE_I[0].triangles as f64 / self.triangles as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotients_are_those_that_the_notes_name() {
        let [full, middle, low] = TABLE_I;
        assert_eq!(full.two_v_minus_t(), 4 * 3799);
        assert_eq!(middle.two_v_minus_t(), 5230);
        assert_eq!(low.two_v_minus_t(), 12_490);
        assert_eq!(format!("{:.2} {:.2}", middle.fps_ratio(), low.fps_ratio()), "3.97 4.62");
        let triangles = [middle, low].map(|row| format!("{:.2}", row.triangle_ratio()));
        assert_eq!(triangles, ["3.34", "7.13"]);
    }
}
