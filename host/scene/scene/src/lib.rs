//! The scene: models as imported, and the graph that places them.
//!
//! Invariant: nothing here knows where a value comes from or how it is drawn.
#![doc = include_str!("../DESIGN.md")]

mod color;
mod features;
mod graph;
mod instances;
mod model;
mod motion;
mod node_index;
mod nodes;
mod parts;
mod poses;
mod scale;

pub use color::linear_from_srgb;
pub use graph::{MAX_NODES, ModelParts, Placement, SceneError, SceneGraph, SceneNode, Transform};
pub use instances::MeshInstance;
pub use model::{AlphaMode, Material, Model, ModelIndex, ModelNode, Texture, TextureRef, Wrap};
pub use motion::Motion;
pub use node_index::{EquipmentId, NodeIndex, PolicyIndex};
pub use scale::max_scale_factor;
