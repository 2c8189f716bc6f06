//! Mark of a picture that is not live: no colour, and stripes over all of it.

use busbar_protocol::pictures::PIXEL_BYTES;

/// Columns from stripe to stripe, and of a stripe.
const PERIOD: usize = 24;
const STRIPE: usize = 4;
/// Shades of a stripe: dark over light pixels, light over dark ones.
const DARK: u8 = 0x30;
const LIGHT: u8 = 0xc0;

/// Takes the colour from a picture and lays stripes over it, so that nobody takes it for
/// live, in greyscale neither.
pub(crate) fn mark_dead(pixels: &mut [u8], width: usize) {
    for (y, row) in pixels.chunks_exact_mut(width * PIXEL_BYTES).enumerate() {
        for (x, pixel) in row.chunks_exact_mut(PIXEL_BYTES).enumerate() {
            let [blue, green, red] = [pixel[0], pixel[1], pixel[2]].map(u32::from);
            // Luma of ITU-R BT.709, in 256ths.
            let grey = ((19 * blue + 183 * green + 54 * red) >> 8) as u8;
            let is_stripe = (x + y) % PERIOD < STRIPE;
            let shade = match (is_stripe, grey > 0x78) {
                (false, _) => grey,
                (true, true) => DARK,
                (true, false) => LIGHT,
            };
            pixel[..3].fill(shade);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_are_seen_on_any_ground_and_no_colour_is_left() {
        for ground in [[0, 0, 0], [255, 255, 255], [128, 128, 128], [0, 0, 255], [120, 120, 120]] {
            let mut pixels: Vec<u8> =
                std::iter::repeat_n([ground[0], ground[1], ground[2], 255], 64 * 64)
                    .flatten()
                    .collect();
            mark_dead(&mut pixels, 64);
            let shades: Vec<u8> = pixels.chunks(4).map(|pixel| pixel[0]).collect();
            assert!(pixels.chunks(4).all(|p| p[0] == p[1] && p[1] == p[2] && p[3] == 255));
            let (least, most) = (shades.iter().min().unwrap(), shades.iter().max().unwrap());
            assert!(most - least >= 70, "{ground:?}: {least} to {most}");
        }
    }
}
