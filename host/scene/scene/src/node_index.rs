//! Indices and ids of the nodes of a scene.

/// An equipment id, such as `=S12D1T1-TA1` or `=S12D1T1-TA1/bushing 1U`.
pub type EquipmentId = String;

/// Index of a node in the graph. Picking and bindings name equipment by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct NodeIndex(pub u32);

/// Index of a placement's own theta policy, in a list that the caller keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PolicyIndex(pub u32);

/// A node: a placement or a part of one, by their indices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NodeAddress {
    pub(crate) placement: u32,
    pub(crate) part: Option<u32>,
}
