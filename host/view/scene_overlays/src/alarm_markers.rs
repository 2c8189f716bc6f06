//! Markers of alarms at equipment, for the screen.

use std::collections::BTreeSet;

use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::{AlarmService, EquipmentAlarms};
use busbar_ui::AlarmMarker;

use crate::equipment_nodes::node_of;
use crate::labels::{OverlayCamera, top_of};

/// Marks at the equipment in alarm that is before the camera.
pub(crate) fn alarm_markers(
    alarm_service: &AlarmService,
    graph: &SceneGraph,
    camera: OverlayCamera,
) -> Vec<AlarmMarker> {
    let of_place = |(equipment, place): &(_, EquipmentAlarms)| {
        Some(AlarmMarker {
            anchor: camera.projection.to_screen(top_of(graph.node(node_of(*equipment))))?,
            priority: place.priority,
            is_unacknowledged: place.is_unacknowledged,
            is_uncertain: place.is_uncertain,
            count: place.count,
            origin: place.origin,
        })
    };
    alarm_service.listing().equipment().iter().filter_map(of_place).collect()
}

/// The equipment that beacons stand at.
pub(crate) fn nodes_in_alarm(alarm_service: &AlarmService) -> BTreeSet<NodeIndex> {
    alarm_service.listing().equipment().iter().map(|(number, _)| node_of(*number)).collect()
}
