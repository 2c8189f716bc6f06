//! Level of detail: chooses what is drawn for each mesh instance, and in how much detail.
//!
//! [`ThetaPolicy`] maps distance or pixel size to a detail. [`Proxies`] are the simplified meshes
//! that stand for distant groups and for repeated meshes. [`LodCursors`] chooses and tracks the
//! collapse cursor of each instance.
//!
//! Invariant: nothing here knows a graphics device, a configuration or a tag.
#![doc = include_str!("../DESIGN.md")]

mod cursors;
mod instance_groups;
mod lod_camera;
mod proxies;
mod screen_error;
mod theta_policy;

pub use cursors::{DrawItem, LodCursors, LodRequest, MeshCursor, ModelDetail, Morph, MorphBudget};
pub use instance_groups::{Group, find_groups, first_group_after};
pub use lod_camera::{LodCamera, PixelSize};
pub use proxies::{HlodGroup, MeshProxies, MeshProxy, Proxies, ProxyModel, SourceModel};
pub use screen_error::ScreenError;
pub use theta_policy::{
    Detail, DistanceLevel, DistanceTable, InstancePolicies, ThetaPolicy, ViewMetrics,
    distance_to_bounds,
};
