//! Camera as the choice of detail sees it: position, direction, and size of a pixel.

use busbar_geometry::Bounds;
use glam::Vec3;

/// Camera position, direction and resolution for the choice of detail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodCamera {
    /// Eye position in world space, metres.
    pub position: Vec3,
    /// Viewing direction, a unit vector.
    pub ahead: Vec3,
    /// Size of a pixel in the scene.
    pub pixel: PixelSize,
}

/// Size of a pixel in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelSize {
    /// Perspective projection: the size grows with depth.
    PerMetre {
        /// Pixel size one metre ahead of the eye, metres.
        ahead: f32,
        /// Depth per metre of distance at the picture's corners.
        corner: f32,
    },
    /// Whatever the distance, metres: without perspective.
    Metres(f32),
}

impl PixelSize {
    /// Returns a lower bound of the pixel size at a distance from the eye, both in metres.
    pub fn at_distance(self, distance: f32) -> f32 {
        match self {
            Self::PerMetre { ahead, corner } => ahead * corner * distance,
            Self::Metres(metres) => metres,
        }
    }
}

impl LodCamera {
    /// Returns a lower bound of the pixel size within a box at a distance, both in metres.
    pub fn pixel_at(&self, bounds: &Bounds, distance: f32) -> f32 {
        match self.pixel {
            PixelSize::PerMetre { ahead, corner } => {
                let half = (bounds.max - bounds.min) * 0.5;
                // Of what is everywhere it is no number, and `max` lets it go.
                let depth =
                    (bounds.center() - self.position).dot(self.ahead) - half.dot(self.ahead.abs());
                ahead * depth.max(distance * corner)
            }
            PixelSize::Metres(metres) => metres,
        }
    }
}
