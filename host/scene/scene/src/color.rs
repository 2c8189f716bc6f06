//! Colours as bytes and as light.

/// Converts an sRGB byte to linear light (IEC 61966-2-1).
pub fn linear_from_srgb(byte: u8) -> f32 {
    let value = f32::from(byte) / 255.0;
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_conversion_is_inverted() {
        assert_eq!(linear_from_srgb(0), 0.0);
        assert_eq!(linear_from_srgb(255), 1.0);
        assert!((linear_from_srgb(188) - 0.5029).abs() < 1e-3);
    }
}
