//! Quality levels of a picture.

/// Quality of a picture, and thereby its cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Per-vertex lighting by one sun and a hemisphere: for remote desktops and software
    /// rasterizers.
    Low,
    /// Materials as they reflect light, ground and fog.
    #[default]
    Medium,
    /// Shadows of the sun and ambient occlusion besides.
    High,
}

impl Quality {
    /// Samples a pixel that go with it.
    pub fn samples(self) -> u32 {
        if self == Self::Low { 1 } else { 4 }
    }
}
