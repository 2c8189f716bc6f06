//! Object numbers of the renderer: they count from 1, nodes from 0.

use busbar_scene::NodeIndex;

/// Returns the object number of a node.
pub(crate) fn object_of(node: NodeIndex) -> u32 {
    node.0 + 1
}

/// Returns the node of an object number; none for the background.
pub(crate) fn node_of(object: Option<u32>) -> Option<NodeIndex> {
    object.and_then(|object| object.checked_sub(1)).map(NodeIndex)
}
