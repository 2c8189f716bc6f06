//! Distances between points that the operator clicks on.

use busbar_ui::{MeasuredPoint, Measurement};
use glam::DVec3;

use busbar_camera::Projection;

/// Points of a chain; the oldest goes.
const MAX_MEASURED_POINTS: usize = 64;

/// A chain of points of surfaces, world space in metres.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeasurementChain {
    points: Vec<DVec3>,
}

impl MeasurementChain {
    pub(crate) fn add(&mut self, point: DVec3) {
        if self.points.len() == MAX_MEASURED_POINTS {
            self.points.remove(0);
        }
        self.points.push(point);
    }

    pub(crate) fn points(&self) -> &[DVec3] {
        &self.points
    }

    /// Projects the chain to the screen.
    pub(crate) fn projected(&self, projection: Projection) -> Measurement {
        let point = |&world: &DVec3| MeasuredPoint {
            at: projection.to_screen(world.as_vec3()),
            world: world.to_array(),
        };
        Measurement { points: self.points.iter().map(point).collect() }
    }

    /// Returns the measured length and the next step as text.
    pub(crate) fn text(&self) -> String {
        let pieces = self.points.windows(2).map(|pair| pair[0].distance(pair[1]));
        match self.points.len() {
            0 => "Measuring: click on a surface".to_owned(),
            1 => "Measuring: click on another surface".to_owned(),
            2 => format!("Distance {:.3} m; Esc ends measuring", pieces.sum::<f64>()),
            count => format!(
                "Distances of {count} points: {:.3} m in all; Esc ends measuring",
                pieces.sum::<f64>()
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;

    #[test]
    fn a_chain_adds_up_and_has_a_limit() {
        let mut measuring = MeasurementChain::default();
        measuring.add(DVec3::ZERO);
        measuring.add(dvec3(3.0, 4.0, 0.0));
        assert_eq!(measuring.text(), "Distance 5.000 m; Esc ends measuring");
        measuring.add(dvec3(3.0, 4.0, 1.5));
        assert!(measuring.text().contains("3 points: 6.500 m"), "{}", measuring.text());
        for x in 0..2 * MAX_MEASURED_POINTS {
            measuring.add(DVec3::X * x as f64);
        }
        assert_eq!(measuring.points().len(), MAX_MEASURED_POINTS);
    }
}
