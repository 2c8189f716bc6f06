//! World transforms of placements: composition down the scene hierarchy.

use serde_json::Value;

use crate::{MAX_COORDINATE_METRES, MAX_SCALE, MIN_SCALE};

type Vector = [f64; 3];

/// The transform from a placement to the world.
#[derive(Clone, Copy)]
pub(crate) struct WorldTransform {
    /// Images of the axes x, y and z.
    axes: [Vector; 3],
    /// Image of the origin.
    origin: Vector,
}

/// Reasons why a world transform cannot be used. Numbers are as they would be stored.
pub(crate) enum TransformFault {
    /// Too much or too little, by the length of an axis.
    Scale(f32),
    /// Too far, by a coordinate of the axis named.
    Coordinate(char, f32),
}

impl WorldTransform {
    /// World transform of the scene's root.
    pub(crate) const ROOT: Self =
        Self { axes: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], origin: [0.0; 3] };

    /// Composes a child's transform with this one. `None` if the child's transform alone is
    /// invalid, which other rules report.
    pub(crate) fn place(&self, transform: &Value) -> Option<Self> {
        let local = Self::read(transform)?;
        let moved = self.rotate_and_scale(local.origin);
        Some(Self {
            axes: local.axes.map(|axis| self.rotate_and_scale(axis)),
            origin: std::array::from_fn(|i| self.origin[i] + moved[i]),
        })
    }

    /// Returns the limit that the transform breaks.
    pub(crate) fn fault(&self) -> Option<TransformFault> {
        // Rounded to what will be stored: turning adds errors of its own.
        let scales = self.axes.map(|axis| axis.iter().map(|c| c * c).sum::<f64>().sqrt() as f32);
        let scale = scales.into_iter().find(|scale| !(MIN_SCALE..=MAX_SCALE).contains(scale));
        let coordinates = ['x', 'y', 'z'].into_iter().zip(self.origin.map(|c| c as f32));
        let far = |(_, coordinate): &(char, f32)| coordinate.abs() > MAX_COORDINATE_METRES;
        let coordinate = || coordinates.into_iter().find(far);
        scale
            .map(TransformFault::Scale)
            .or_else(|| coordinate().map(|(axis, at)| TransformFault::Coordinate(axis, at)))
    }

    /// Scale, then rotation about x, y and z in turn, then translation.
    fn read(transform: &Value) -> Option<Self> {
        let origin = numbers(&transform["translation"], 0.0)?;
        let degrees = numbers(&transform["rotation_degrees"], 0.0)?;
        let scale = match transform["scale"].as_f64() {
            Some(factor) => [factor; 3],
            None => numbers(&transform["scale"], 1.0)?,
        };
        let usable = |factor: f64| (MIN_SCALE..=MAX_SCALE).contains(&(factor.abs() as f32));
        let near = |metres: f64| metres.abs() as f32 <= MAX_COORDINATE_METRES;
        let is_sound = scale.into_iter().all(usable) && origin.into_iter().all(near);
        let axis = |i: usize| rotate(Self::ROOT.axes[i].map(|c| c * scale[i]), degrees);
        is_sound.then(|| Self { axes: std::array::from_fn(axis), origin })
    }

    /// A direction here as one in the world.
    fn rotate_and_scale(&self, direction: Vector) -> Vector {
        std::array::from_fn(|i| (0..3).map(|axis| self.axes[axis][i] * direction[axis]).sum())
    }
}

impl TransformFault {
    /// Returns cause and remedy for people.
    pub(crate) fn texts(&self) -> (String, String) {
        match self {
            Self::Scale(scale) => (
                format!("with what it hangs under, the node is scaled by {scale:e} in all"),
                format!("keep the product of all factors from {MIN_SCALE:e} to {MAX_SCALE:e}"),
            ),
            Self::Coordinate(axis, at) => (
                format!("with what it hangs under, the node stands at {at:e} m on the {axis} axis"),
                format!("keep it within {MAX_COORDINATE_METRES:e} m of the origin on each axis"),
            ),
        }
    }
}

/// About x, y and z in turn.
fn rotate(mut vector: Vector, degrees: Vector) -> Vector {
    for (axis, angle) in degrees.into_iter().enumerate() {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        (vector[i], vector[j]) =
            (cosine * vector[i] - sine * vector[j], sine * vector[i] + cosine * vector[j]);
    }
    vector
}

/// Three numbers; `default` where there is nothing.
fn numbers(value: &Value, default: f64) -> Option<Vector> {
    let Value::Array(elements) = value else {
        return value.is_null().then_some([default; 3]);
    };
    let numbers: Option<Vec<f64>> = elements.iter().take(4).map(Value::as_f64).collect();
    numbers?.try_into().ok()
}
