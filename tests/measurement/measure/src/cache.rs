//! Average cache miss ratio (ACMR) of an order of triangles.

use std::collections::VecDeque;

/// Computes the average cache miss ratio: vertices fetched a triangle, with a first-in first-out
/// cache of `entries` entries (Hoppe, "Optimization of mesh locality for transparent vertex
/// caching", 1999). From about 0.5 to 3; 0 without triangles.
pub fn acmr(triangles: &[[u32; 3]], entries: usize) -> f64 {
    let mut cache = VecDeque::with_capacity(entries + 1);
    let mut misses = 0_u64;
    for corner in triangles.as_flattened() {
        if !cache.contains(corner) {
            misses += 1;
            cache.push_back(*corner);
            if cache.len() > entries {
                cache.pop_front();
            }
        }
    }
    misses as f64 / triangles.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_lists_have_known_ratios() {
        // A strip: three vertices, then one a triangle.
        let strip: Vec<[u32; 3]> = (0..100).map(|i| [i, i + 1, i + 2]).collect();
        assert!((acmr(&strip, 16) - 102.0 / 100.0).abs() < 1e-12);
        // Apart: every corner is a miss.
        let apart: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        assert_eq!(acmr(&apart, 16), 3.0);
        // First in is first out, used again or not: 0 leaves when 4 comes.
        assert_eq!(acmr(&[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], 4), 7.0 / 4.0);
        assert_eq!(acmr(&[], 16), 0.0);
    }
}
