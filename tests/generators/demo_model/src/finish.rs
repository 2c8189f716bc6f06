//! Surface finishes: the materials of the models.

use busbar_scene::{Material, Texture, TextureRef, Wrap};

use crate::plates;

/// Surface finish by paint, glaze or zinc.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Finish {
    /// Light-grey paint (near RAL 7035) of tanks, radiators and cabinets.
    GreyPaint,
    /// Darker grey paint of frames, fans and mechanism housings.
    DarkPaint,
    /// Porcelain with brown glaze.
    BrownPorcelain,
    /// Steel, hot-dip galvanised, dull grey.
    Galvanised,
    /// Bare aluminium: caps, flanges, terminals.
    Aluminium,
    /// Bare copper: studs and low-voltage terminals.
    Copper,
    /// Cast concrete of foundations.
    Concrete,
    /// Crushed stone of the yard.
    Gravel,
    /// Black rubber and plastic: seals, handles, cable.
    Rubber,
    /// Gauge glass and sight glasses.
    Glass,
    /// Silica gel that is still dry.
    SilicaGel,
    /// White enamel of dials and indicators.
    WhiteEnamel,
    /// Warning triangle on doors.
    WarningSign,
    /// Rating plate with engraving.
    RatingPlate,
}

impl Finish {
    /// Returns the material; a texture that it needs is added to `textures`.
    pub(crate) fn material(self, textures: &mut Vec<Texture>) -> Material {
        // Name, linear colour, metallic, roughness.
        let (name, [r, g, b], metallic, roughness) = match self {
            Self::GreyPaint => ("light-grey paint", [0.60, 0.62, 0.61], 0.0, 0.45),
            Self::DarkPaint => ("dark-grey paint", [0.19, 0.20, 0.21], 0.0, 0.5),
            Self::BrownPorcelain => ("brown porcelain", [0.16, 0.052, 0.025], 0.0, 0.18),
            Self::Galvanised => ("galvanised steel", [0.50, 0.52, 0.53], 0.8, 0.55),
            Self::Aluminium => ("aluminium", [0.78, 0.79, 0.80], 1.0, 0.35),
            Self::Copper => ("copper", [0.80, 0.40, 0.25], 1.0, 0.35),
            Self::Concrete => ("concrete", [0.37, 0.36, 0.34], 0.0, 0.95),
            Self::Gravel => ("gravel", [0.30, 0.295, 0.28], 0.0, 1.0),
            Self::Rubber => ("black rubber", [0.02, 0.02, 0.02], 0.0, 0.7),
            Self::Glass => ("glass", [0.10, 0.14, 0.15], 0.0, 0.08),
            Self::SilicaGel => ("silica gel", [0.75, 0.30, 0.04], 0.0, 0.5),
            Self::WhiteEnamel => ("white enamel", [0.85, 0.85, 0.83], 0.0, 0.3),
            Self::WarningSign => ("warning sign", [1.0, 1.0, 1.0], 0.0, 0.4),
            Self::RatingPlate => ("rating plate", [1.0, 1.0, 1.0], 0.6, 0.4),
        };
        let texture = match self {
            Self::WarningSign => Some(plates::warning_sign()),
            Self::RatingPlate => Some(plates::rating_plate()),
            _ => None,
        };
        let base_color_texture = texture.map(|texture| {
            textures.push(texture);
            TextureRef { texture: textures.len() as u32 - 1, wrap: [Wrap::Clamp; 2] }
        });
        Material {
            name: name.to_owned(),
            base_color: [r, g, b, 1.0],
            base_color_texture,
            metallic,
            roughness,
            ..Material::default()
        }
    }
}
