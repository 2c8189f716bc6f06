//! Procedural images: the warning sign and the rating plate.

use busbar_scene::Texture;

const SIGN_PIXELS: u32 = 128;
const PLATE_WIDTH: u32 = 256;
const PLATE_HEIGHT: u32 = 192;
/// Number of samples along each axis of a pixel, for soft edges.
const SAMPLES: u32 = 4;

type Rgb = [f32; 3];

const YELLOW: Rgb = [250.0, 204.0, 20.0];
const BLACK: Rgb = [22.0, 22.0, 22.0];
const STEEL: Rgb = [196.0, 198.0, 200.0];
const ENGRAVED: Rgb = [52.0, 54.0, 58.0];

/// Draws the sign for dangerous voltage (ISO 7010 W012): a black bolt in a yellow triangle with a
/// black border.
pub(crate) fn warning_sign() -> Texture {
    draw(SIGN_PIXELS, SIGN_PIXELS, |x, y| {
        let (x, y) = (x / SIGN_PIXELS as f32, y / SIGN_PIXELS as f32);
        // Distance inside the triangle's nearest side; its apex is at the top.
        let side = |x: f32| (y - 0.06) * 0.4472 - x * 0.8944;
        let inside = side(x - 0.5).min(side(0.5 - x)).min(0.92 - y);
        let bolt: [(f32, f32); 7] = [
            (0.53, 0.34),
            (0.42, 0.60),
            (0.50, 0.59),
            (0.46, 0.84),
            (0.60, 0.53),
            (0.52, 0.54),
            (0.60, 0.34),
        ];
        if inside < 0.0 {
            STEEL
        } else if inside < 0.05 || contains(&bolt, x, y) {
            BLACK
        } else {
            YELLOW
        }
    })
}

/// Draws a rating plate: a frame, a headline, lines of engraving, a table of taps. The engraving is
/// unreadable on purpose: this transformer has no maker.
pub(crate) fn rating_plate() -> Texture {
    draw(PLATE_WIDTH, PLATE_HEIGHT, |x, y| {
        let (w, h) = (PLATE_WIDTH as f32, PLATE_HEIGHT as f32);
        let edge = x.min(w - x).min(y).min(h - y);
        let ink = (4.0..6.0).contains(&edge)
            || headline(x, y)
            || (edge > 14.0 && engraved_line(x, y))
            || tap_table(x, y)
            || corner_hole(x, y, w, h);
        if ink { ENGRAVED } else { STEEL }
    })
}

fn headline(x: f32, y: f32) -> bool {
    (70.0..186.0).contains(&x) && (16.0..28.0).contains(&y) && letters(x, y, 10.0, 7)
}

fn engraved_line(x: f32, y: f32) -> bool {
    let row = ((y - 36.0) / 10.0).floor();
    let in_row = (0.0..14.0).contains(&row) && (y - 36.0).rem_euclid(10.0) < 6.0;
    // Left column of names and values; the table has the right half.
    let end = 112.0 - (row * 37.0).rem_euclid(24.0);
    in_row && (16.0..end).contains(&x) && letters(x, y, 5.0, row as u32 + 11)
}

/// Draws strokes of letter-like width; `seed` varies them from line to line.
fn letters(x: f32, y: f32, pitch: f32, seed: u32) -> bool {
    let cell = (x / pitch).floor() as u32;
    let mixed = cell.wrapping_mul(2_654_435_761).wrapping_add(seed.wrapping_mul(40_503)) >> 7;
    let (u, v) = ((x / pitch).fract(), y.rem_euclid(pitch) / pitch);
    let blank = mixed.is_multiple_of(6) || u > 0.72;
    let stem = u < 0.26;
    let bar = v < 0.22 || (mixed & 8 != 0 && v > 0.5 && v < 0.72);
    let second = mixed & 4 != 0 && u > 0.48;
    !blank && (stem || bar || second)
}

fn tap_table(x: f32, y: f32) -> bool {
    let (u, v) = (x - 130.0, y - 40.0);
    if !(0.0..=108.0).contains(&u) || !(0.0..=133.0).contains(&v) {
        return false;
    }
    let line = u.rem_euclid(36.0) < 1.2 || v.rem_euclid(12.0) < 1.2;
    let text = (8.0..30.0).contains(&u.rem_euclid(36.0))
        && (3.5..9.5).contains(&v.rem_euclid(12.0))
        && letters(x, y, 5.0, (v / 12.0) as u32 + 3);
    line || text
}

fn corner_hole(x: f32, y: f32, w: f32, h: f32) -> bool {
    let (dx, dy) = (x.min(w - x) - 11.0, y.min(h - y) - 11.0);
    dx * dx + dy * dy < 9.0
}

/// Reports whether a polygon contains a point, by the even-odd rule.
fn contains(polygon: &[(f32, f32)], x: f32, y: f32) -> bool {
    let crosses = |(ax, ay): (f32, f32), (bx, by): (f32, f32)| {
        (ay > y) != (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax
    };
    let edges = (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]));
    edges.filter(|&(a, b)| crosses(a, b)).count() % 2 == 1
}

/// Draws `color` at each pixel's samples and averages them.
fn draw(width: u32, height: u32, color: impl Fn(f32, f32) -> Rgb) -> Texture {
    let mut rgba8 = Vec::with_capacity((width * height * 4) as usize);
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0.0; 3];
            for sample in 0..SAMPLES * SAMPLES {
                let inner = |i: u32| (i as f32 + 0.5) / SAMPLES as f32;
                let at = (x as f32 + inner(sample % SAMPLES), y as f32 + inner(sample / SAMPLES));
                let rgb = color(at.0, at.1);
                (0..3).for_each(|channel| sum[channel] += rgb[channel]);
            }
            let mean = sum.map(|s: f32| (s / (SAMPLES * SAMPLES) as f32).round() as u8);
            rgba8.extend([mean[0], mean[1], mean[2], 255]);
        }
    }
    Texture { width, height, rgba8 }
}
