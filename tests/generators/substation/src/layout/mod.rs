//! Layout of the station: the two yards, the transformers between them, the site around.

mod bay;
mod site;
mod wires;
mod yard;

use glam::{Mat4, Vec3};

pub(crate) use site::{add_site_wires, earth_spans, place_site};
pub(crate) use wires::{BayKind, add_wires};
pub(crate) use yard::{YARDS, Yard, place_yard};

use crate::body::turned;

/// Placement of a piece of equipment: its model and position.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Designation of the bay (IEC 81346), such as `=S12D1Q3`.
    pub bay: String,
    /// Designation of the device in the bay, such as `QB9`.
    pub device: String,
    /// Phase 1 to 3; `None` for equipment without phases.
    pub phase: Option<u8>,
    /// Name of the model.
    pub model: String,
    /// Position of the model's origin, metres.
    pub translation: Vec3,
    /// Rotation about the y axis, degrees.
    pub yaw_degrees: f32,
}

impl Placement {
    /// Returns the device's id, such as `=S12D1Q3-QB9`.
    pub fn device_id(&self) -> String {
        format!("{}-{}", self.bay, self.device)
    }

    /// Returns the equipment id, such as `=S12D1Q3-QB9-L1`.
    pub fn id(&self) -> String {
        match self.phase {
            Some(phase) => format!("{}-L{phase}", self.device_id()),
            None => self.device_id(),
        }
    }

    /// Returns the transform from the model's space to the world.
    pub fn world_from_model(&self) -> Mat4 {
        Mat4::from_translation(self.translation) * turned(Vec3::Y, self.yaw_degrees)
    }
}
