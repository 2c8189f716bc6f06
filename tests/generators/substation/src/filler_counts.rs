//! Filler geometry for the paper's exact counts: the number of trench covers, and the fineness of
//! the earth wires.
//!
//! With V vertices and T triangles, 2V - T is 4 for a closed shell without a hole, 0 for a ring. So
//! covers (closed boxes) bring 2V - T to the paper's value, and points along the earth wires, which
//! leave it as it is, then bring T there.

use demo_model::Finish;

use crate::StationError;
use crate::body::Body;
use crate::catalogue::Counts;
use crate::layout::earth_spans;
use crate::models::{Wire, trench_metres, wire};

/// Number of vertices of the paper's scene (its Table I, theta = 0).
pub const PAPER_VERTICES: usize = 536_141;
/// Number of triangles of the paper's scene.
pub const PAPER_TRIANGLES: usize = 1_057_086;

/// Range of a trench cover's length, metres.
const COVER_METRES: std::ops::RangeInclusive<f32> = 0.3..=1.2;
/// Range of the rings of an earth wire's span.
const SPAN_RINGS: std::ops::RangeInclusive<i64> = 4..=120;
const BOX_TRIANGLES: i64 = 12;
const SIDES: [i64; 2] = [6, 5];

/// Filler geometry that makes up the paper's counts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FillerCounts {
    /// Number of trench covers.
    pub(crate) covers: usize,
    /// Rings and sides of each earth-wire span.
    pub(crate) spans: Vec<[usize; 2]>,
}

/// Solves for covers and rings; `rest` is the station without them.
pub(crate) fn solve(rest: Counts) -> Result<FillerCounts, StationError> {
    let spans = earth_spans().len() as i64;
    let two_v_less_t = |v: usize, t: usize| 2 * v as i64 - t as i64;
    let wanted = two_v_less_t(PAPER_VERTICES, PAPER_TRIANGLES);
    let open = wanted - two_v_less_t(rest.vertices, rest.triangles) - 4 * spans;
    let covers = open / 4;
    let metres = trench_metres() / covers.max(1) as f32;
    if open % 4 != 0 || covers < 1 || !COVER_METRES.contains(&metres) {
        return Err(StationError::DoesNotClose {
            what: "2V - T left for trench covers",
            range: format!("a multiple of 4 that gives covers of {COVER_METRES:?} m"),
            found: open,
        });
    }
    let left = PAPER_TRIANGLES as i64 - rest.triangles as i64 - BOX_TRIANGLES * covers;
    let rings = share_rings(left, spans)?;
    Ok(FillerCounts { covers: covers as usize, spans: rings })
}

/// Shares `left` triangles over the spans. A wire of R rings of N points,
/// capped, has 2 R N triangles; the last span is of a lighter wire with five
/// points around, which makes every even number reachable.
fn share_rings(left: i64, spans: i64) -> Result<Vec<[usize; 2]>, StationError> {
    let refused = || StationError::DoesNotClose {
        what: "triangles left for earth wires",
        range: format!("even, with {SPAN_RINGS:?} rings to each of {spans} spans"),
        found: left,
    };
    let [common, light] = SIDES;
    let even = left.div_euclid(spans.max(1)) / (2 * common);
    let light_rings = (0..common)
        .map(|i| even + i)
        .find(|rings| left % 2 == 0 && (left / 2 - light * rings) % common == 0)
        .ok_or_else(refused)?;
    let total = (left / 2 - light * light_rings) / common;
    let others = spans - 1;
    let mut shares: Vec<[usize; 2]> = Vec::new();
    for i in 0..others {
        let rings = total / others + i64::from(i < total % others);
        if !SPAN_RINGS.contains(&rings) {
            return Err(refused());
        }
        shares.push([rings as usize, common as usize]);
    }
    if !SPAN_RINGS.contains(&light_rings) {
        return Err(refused());
    }
    shares.push([light_rings as usize, light as usize]);
    Ok(shares)
}

/// Builds the earth wires with these rings and sides.
pub(crate) fn earth_wires(spans: &[[usize; 2]]) -> Body {
    let mut body = Body::new();
    for (i, (ends, &[rings, sides])) in earth_spans().into_iter().zip(spans).enumerate() {
        // Wires that meet in a peak are clamped a hand's breadth apart.
        let aside = glam::Vec3::Z * (0.02 * (i % 3) as f32);
        body.add(
            Finish::Galvanised,
            wire(&Wire {
                clamps: ends.map(|end| end + aside).to_vec(),
                sag_ratio: 0.02,
                radius: 0.012,
                segments: rings - 1,
                sides,
            }),
        );
    }
    body
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_even_remainder_is_shared_exactly() {
        for left in (9_000..9_100).step_by(2) {
            let spans = share_rings(left, 28).unwrap();
            let sum: usize = spans.iter().map(|[rings, sides]| 2 * rings * sides).sum();
            assert_eq!((spans.len(), sum as i64), (28, left));
        }
    }

    #[test]
    fn odd_and_excessive_remainders_are_refused() {
        for left in [9_001, 100, -50, 900_000] {
            assert!(share_rings(left, 28).is_err(), "{left}");
        }
    }

    #[test]
    fn the_wires_have_the_counts_of_the_formula() {
        let spans = vec![[12, 6]; earth_spans().len()];
        let body = earth_wires(&spans);
        let triangles: usize = body.part.solids().map(|s| s.triangles.len()).sum();
        assert_eq!(triangles, spans.len() * 2 * 12 * 6);
        assert_eq!(body.positions, spans.len() * (12 * 6 + 2));
    }
}
