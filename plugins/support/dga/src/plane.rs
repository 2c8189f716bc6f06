//! Points, segments and polygons in a plane.

/// Point by x and y.
pub(crate) type Point = [f64; 2];
/// Segment by its two ends.
pub(crate) type Segment = [Point; 2];

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// Computes the distance from a point to the nearest point of a segment; its ends differ.
pub(crate) fn distance(point: Point, [a, b]: Segment) -> f64 {
    let (along, to_point) = (minus(b, a), minus(point, a));
    let t = (dot(to_point, along) / dot(along, along)).clamp(0.0, 1.0);
    let away = [to_point[0] - t * along[0], to_point[1] - t * along[1]];
    dot(away, away).sqrt()
}

/// Computes the distance to the nearest of several segments.
pub(crate) fn nearest(point: Point, segments: impl IntoIterator<Item = Segment>) -> f64 {
    segments.into_iter().map(|segment| distance(point, segment)).fold(f64::INFINITY, f64::min)
}

/// Returns the edges of a polygon, closed.
pub(crate) fn edges(polygon: &[Point]) -> impl Iterator<Item = Segment> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(&a, &b)| [a, b])
}

/// Reports whether a polygon contains a point: a ray to the right meets an odd number of edges.
pub(crate) fn has_inside(polygon: &[Point], point: Point) -> bool {
    let crosses = |&[a, b]: &Segment| {
        let spans = (a[1] > point[1]) != (b[1] > point[1]);
        spans && point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    };
    edges(polygon).filter(crosses).count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_go_to_the_nearest_point_of_a_segment() {
        let segment = [[0.0, 0.0], [10.0, 0.0]];
        assert_eq!(distance([5.0, 3.0], segment), 3.0);
        assert_eq!(distance([13.0, 4.0], segment), 5.0);
        assert_eq!(distance([-3.0, -4.0], segment), 5.0);
    }

    #[test]
    fn a_notch_is_outside() {
        let notched = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        assert!(has_inside(&notched, [1.0, 1.0]) && has_inside(&notched, [3.0, 1.0]));
        assert!(!has_inside(&notched, [2.0, 2.0]) && !has_inside(&notched, [5.0, 1.0]));
    }
}
