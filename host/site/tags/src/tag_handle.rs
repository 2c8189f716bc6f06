//! Handles by which tags of one table are named.

use serde::{Deserialize, Serialize};

/// Names a tag within one table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct TagHandle(pub u32);
