//! Positions of switches to flags on the screen.

use busbar_scene::SceneGraph;
use busbar_tags::Snapshot;
use busbar_types::Origin;
use busbar_ui::{Age, SwitchState, SwitchSymbol};

use crate::labels::OverlayCamera;
use crate::moving_parts::MovingParts;
use crate::overlay_layers::SwitchPosition;

/// Flags of the switches before the camera: of those without a part that moves, and of all
/// that are neither open nor closed, or whose position is not live.
pub(crate) fn switch_symbols(
    positions: &[SwitchPosition],
    moving: &MovingParts,
    snapshot: Snapshot<'_>,
    graph: &SceneGraph,
    camera: OverlayCamera,
) -> Vec<SwitchSymbol> {
    let symbol = |position: &SwitchPosition| {
        let told = snapshot.state(position.tag);
        let is_good = told.as_ref().is_some_and(|told| told.quality.is_good());
        let state = state_of(position.travelled, is_good);
        let is_seen_by_part = matches!(state, SwitchState::Open | SwitchState::Closed);
        let origin = told.as_ref().map_or(Origin::LIVE, |told| told.origin);
        if is_seen_by_part && moving.has(position) && origin.is_live() {
            return None;
        }
        let place = graph.node(position.node).bounds()?.center();
        Some(SwitchSymbol {
            anchor: camera.projection.to_screen(place)?,
            distance: camera.eye.distance(place),
            state,
            age: told.and_then(|told| told.age).filter(|_| !is_good).map(Age::from),
            origin,
        })
    };
    positions.iter().filter_map(symbol).collect()
}

/// Returns the symbol's state; a value that is not good is unknown, whatever was reported last.
fn state_of(travelled: Option<f64>, is_good: bool) -> SwitchState {
    match travelled {
        _ if !is_good => SwitchState::Unknown,
        None => SwitchState::Invalid,
        Some(0.0) => SwitchState::Open,
        Some(1.0) => SwitchState::Closed,
        Some(_) => SwitchState::Travelling,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bad_position_is_neither_open_nor_closed() {
        for travelled in [None, Some(0.0), Some(0.3), Some(1.0)] {
            assert_eq!(state_of(travelled, false), SwitchState::Unknown, "{travelled:?}");
        }
        assert_eq!(state_of(None, true), SwitchState::Invalid);
        assert_eq!(state_of(Some(0.0), true), SwitchState::Open);
        assert_eq!(state_of(Some(0.3), true), SwitchState::Travelling);
        assert_eq!(state_of(Some(1.0), true), SwitchState::Closed);
    }
}
