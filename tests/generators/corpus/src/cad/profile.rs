//! Profiles of lines and arcs, to be revolved or extruded.

use glam::{Vec2, Vec3};

use crate::cad::shape::{Shape, Vertex};

/// Point of a profile with its normal.
#[derive(Clone, Copy, Debug)]
struct Station {
    point: Vec2,
    normal: Vec2,
}

/// Profile of runs, each smooth in itself; matter lies on its left.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    at: Vec2,
    runs: Vec<Vec<Station>>,
}

/// Returns cosine and sine of a share of a turn; quarters are exact.
pub(crate) fn turn(step: usize, steps: usize) -> Vec2 {
    let step = step % steps;
    let eighths = [Vec2::X, Vec2::Y, Vec2::NEG_X, Vec2::NEG_Y];
    if (4 * step).is_multiple_of(steps) {
        return eighths[4 * step / steps];
    }
    let angle = std::f64::consts::TAU * step as f64 / steps as f64;
    Vec2::new(libm::cos(angle) as f32, libm::sin(angle) as f32)
}

/// Returns points on a circle.
pub(crate) fn circle(centre: Vec2, radius: f32, steps: usize) -> Vec<Vec2> {
    (0..steps).map(|step| centre + turn(step, steps) * radius).collect()
}

impl Profile {
    pub(crate) fn from(x: f32, y: f32) -> Self {
        Self { at: Vec2::new(x, y), runs: Vec::new() }
    }

    /// Adds a straight run to a point.
    pub(crate) fn line(mut self, x: f32, y: f32) -> Self {
        let to = Vec2::new(x, y);
        let along = to - self.at;
        let normal = Vec2::new(along.y, -along.x).normalize_or_zero();
        self.runs.push([self.at, to].map(|point| Station { point, normal }).to_vec());
        self.at = to;
        self
    }

    /// Adds an arc about a centre by less than a full turn: left about bulges, right about is
    /// hollow.
    pub(crate) fn arc(mut self, to: [f32; 2], centre: [f32; 2], left: bool, steps: usize) -> Self {
        let (to, centre) = (Vec2::from(to), Vec2::from(centre));
        let (out, end) = (self.at - centre, to - centre);
        let sign = if left { 1.0 } else { -1.0 };
        let sweep = f64::from(out.perp_dot(end) * sign);
        let angle = libm::atan2(sweep, f64::from(out.dot(end)));
        let angle = if angle <= 0.0 { angle + std::f64::consts::TAU } else { angle };
        let station = |step: usize| {
            let turned = angle * step as f64 / steps as f64;
            let by = Vec2::new(libm::cos(turned) as f32, libm::sin(turned) as f32 * sign);
            let offset = by.rotate(out);
            let point = match step {
                0 => self.at,
                _ if step == steps => to,
                _ => centre + offset,
            };
            Station { point, normal: offset.normalize_or_zero() * sign }
        };
        let run = (0..=steps).map(station).collect();
        self.runs.push(run);
        self.at = to;
        self
    }

    /// Builds the surface of revolution of the profile about the y axis; x is the radius.
    pub(crate) fn revolved(&self, segments: usize) -> Shape {
        let mut shape = Shape::default();
        let mut length = 0.0;
        for run in &self.runs {
            let lengths = lengths(run, &mut length);
            shape.net([segments, run.len() - 1], |segment, station| {
                let Station { point, normal } = run[station];
                let round = turn(segment, segments);
                let at = |v: Vec2| Vec3::new(round.x * v.x, v.y, round.y * v.x);
                let share = segment as f32 / segments as f32;
                let uv = Vec2::new(share * std::f32::consts::TAU * point.x, lengths[station]);
                Vertex { position: at(point), normal: at(normal).normalize_or_zero(), uv }
            });
        }
        shape
    }

    /// Builds the walls over the profile in the plane of x and z, from one height to another.
    pub(crate) fn walls(&self, from: f32, to: f32) -> Shape {
        let mut shape = Shape::default();
        let mut length = 0.0;
        for run in &self.runs {
            let lengths = lengths(run, &mut length);
            shape.net([run.len() - 1, 1], |station, top| {
                let Station { point, normal } = run[station];
                let height = if top == 0 { from } else { to };
                Vertex {
                    position: Vec3::new(point.x, height, point.y),
                    normal: Vec3::new(normal.x, 0.0, normal.y),
                    uv: Vec2::new(lengths[station], height),
                }
            });
        }
        shape
    }

    /// Returns the points of a closed profile.
    pub(crate) fn outline(&self) -> Vec<Vec2> {
        let points = |run: &Vec<Station>| -> Vec<Vec2> {
            run[..run.len() - 1].iter().map(|station| station.point).collect()
        };
        self.runs.iter().flat_map(points).collect()
    }
}

/// Returns the arc length from the profile's start to each station of a run, metres.
fn lengths(run: &[Station], length: &mut f32) -> Vec<f32> {
    let mut last = run.first().map_or(Vec2::ZERO, |station| station.point);
    let along = |station: &Station| {
        *length += station.point.distance(last);
        last = station.point;
        *length
    };
    run.iter().map(along).collect()
}
