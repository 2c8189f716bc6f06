//! Equipment numbers of a site as nodes of a scene: both count the same things in the same order.

use busbar_scene::NodeIndex;
use busbar_site::EquipmentNumber;

/// Returns the equipment number of a node.
pub fn number_of(NodeIndex(index): NodeIndex) -> EquipmentNumber {
    EquipmentNumber(index)
}

/// Returns the node of an equipment number.
pub fn node_of(EquipmentNumber(index): EquipmentNumber) -> NodeIndex {
    NodeIndex(index)
}
