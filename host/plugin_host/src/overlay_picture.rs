//! What overlays draw, and the rules that hold for it whichever way it comes.

use std::collections::HashSet;

use busbar_tags::TagHandle;
use serde::{Deserialize, Serialize};

use crate::OverlayBinding;

/// Primitives that one overlay may draw in a frame, a binding.
const MAX_PRIMITIVES_A_BINDING: usize = 8;
/// Bytes of one caption or value.
pub const MAX_PART_BYTES: usize = 256;

/// How much something needs an operator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Severity {
    /// Grey.
    #[default]
    Normal,
    /// Outside the normal band.
    Warning,
    /// Needs action now.
    Alarm,
}

/// A line of the label at a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayLine {
    /// The node.
    pub node: u32,
    /// The tag whose value it shows. Its quality decides how the line looks.
    pub tag: TagHandle,
    /// Severity, for a good value.
    pub severity: Severity,
    /// Caption.
    pub caption: String,
    /// Value as text.
    pub text: String,
}

/// A node in the colour of a severity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayTint {
    /// The node.
    pub node: u32,
    /// The tag it rests on.
    pub tag: TagHandle,
    /// Severity.
    pub severity: Severity,
}

/// What one overlay draws in one frame, checked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverlayPicture {
    /// Lines in the plugin's order.
    pub lines: Vec<OverlayLine>,
    /// Tints.
    pub tints: Vec<OverlayTint>,
}

/// What a picture of an overlay with certain bindings may name.
#[derive(Clone, Debug, Default)]
pub struct PictureRules {
    tags: HashSet<TagHandle>,
    nodes: HashSet<u32>,
    max_primitives: usize,
}

/// Primitives that an overlay with so many bindings may draw in a frame.
pub(crate) fn max_primitives(bindings: usize) -> usize {
    (bindings + 1) * MAX_PRIMITIVES_A_BINDING
}

impl PictureRules {
    /// The rules for an overlay with these bindings.
    pub fn new(bindings: &[OverlayBinding]) -> Self {
        Self {
            tags: bindings.iter().map(|b| b.tag).collect(),
            nodes: bindings.iter().map(|b| b.node).collect(),
            max_primitives: max_primitives(bindings.len()),
        }
    }

    /// Whether a picture keeps to them.
    ///
    /// # Errors
    /// The rule that it breaks, in words.
    pub fn check(&self, picture: &OverlayPicture) -> Result<(), &'static str> {
        if picture.lines.len() + picture.tints.len() > self.max_primitives {
            return Err("it claims too many primitives");
        }
        let lines = picture.lines.iter().map(|line| (line.node, line.tag));
        let tints = picture.tints.iter().map(|tint| (tint.node, tint.tag));
        for (node, tag) in lines.chain(tints) {
            if !self.tags.contains(&tag) {
                return Err("a primitive names a tag that is not bound");
            }
            if !self.nodes.contains(&node) {
                return Err("a primitive names a node that nothing is bound to");
            }
        }
        let mut parts = picture.lines.iter().flat_map(|line| [&line.caption, &line.text]);
        if parts.any(|part| part.len() > MAX_PART_BYTES) {
            return Err("a caption or value is too long");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use busbar_tags::ValueKind;

    use super::*;

    fn line(tag: u32, node: u32, text: &str) -> OverlayPicture {
        let line = OverlayLine {
            node,
            tag: TagHandle(tag),
            severity: Severity::Normal,
            caption: String::new(),
            text: text.into(),
        };
        OverlayPicture { lines: vec![line], tints: Vec::new() }
    }

    #[test]
    fn a_picture_names_only_what_is_bound() {
        let rules = PictureRules::new(&[OverlayBinding {
            tag: TagHandle(3),
            node: 5,
            kind: ValueKind::F64,
            limit_low: None,
            limit_high: None,
            tag_id: String::new(),
            tag_name: String::new(),
            unit: String::new(),
            node_id: String::new(),
            role: String::new(),
        }]);
        assert_eq!(rules.check(&line(3, 5, "1.0")), Ok(()));
        assert!(rules.check(&line(4, 5, "1.0")).is_err());
        assert!(rules.check(&line(3, 4, "1.0")).is_err());
        assert!(rules.check(&line(3, 5, &"x".repeat(MAX_PART_BYTES + 1))).is_err());
        let mut many = line(3, 5, "1.0");
        many.lines = vec![many.lines[0].clone(); max_primitives(1) + 1];
        assert!(rules.check(&many).is_err());
    }
}
