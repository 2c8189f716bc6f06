//! Bindings of tags to nodes, as overlay plugins get them.

use busbar_tags::TagHandle;
use busbar_types::ValueKind;
use serde::{Deserialize, Serialize};

/// Bytes of one caption or value.
pub const MAX_PART_BYTES: usize = 256;

/// A tag bound to a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayBinding {
    /// Handle of the bound tag.
    pub tag: TagHandle,
    /// Names the node; the scene's node index.
    pub node: u32,
    /// Type of the tag's values.
    pub kind: ValueKind,
    /// Lower end of the normal band.
    pub limit_low: Option<f64>,
    /// Upper end of the normal band.
    pub limit_high: Option<f64>,
    /// Id of the tag.
    pub tag_id: String,
    /// Display name of the tag.
    pub tag_name: String,
    /// Unit of the tag.
    pub unit: String,
    /// Equipment id of the node.
    pub node_id: String,
    /// Role of the value for the node.
    pub role: String,
}
