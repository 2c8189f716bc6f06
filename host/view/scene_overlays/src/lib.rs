//! Overlays of the scene: what the overlays, alarms and chart of a site put on equipment and over it.
//!
//! [`SceneOverlays`] assembles an [`OverlayFrame`] from the site once a frame. From it follow colours
//! ([`Highlights`]), outlines, lines and faces in the world, and the content over the scene as a
//! camera sees it.
//!
//! Invariant: a value that is not good is drawn as not known, whoever reports it.
#![doc = include_str!("../DESIGN.md")]

mod alarm_markers;
mod chart;
mod chart_stats;
mod contour;
mod equipment_nodes;
mod flow_arrows;
mod highlight;
pub mod highlight_styles;
mod labels;
mod moving_parts;
mod outlines;
mod overlay_geometry;
mod overlay_layers;
mod scene_overlays;
mod switch_symbols;

pub use chart::SceneChart;
pub use chart_stats::{ChartAxisStats, ChartEvidence, ChartStats};
pub use equipment_nodes::{node_of, number_of};
pub use highlight::Highlights;
pub use labels::{LinesByNode, OverlayCamera, mark, top_of};
pub use moving_parts::MovingParts;
pub use overlay_layers::{
    NodeState, OverlayFrame, OverlayLayer, OverlayLayers, StateBasis, UnknownVerdict,
};
pub use scene_overlays::{OverSceneContent, SceneOverlays, chart_of};
