//! What overlays draw, and the rules that hold for it whichever way it comes.

use std::collections::HashSet;

use busbar_tags::TagHandle;
use serde::{Deserialize, Serialize};

use crate::OverlayBinding;

const MAX_BINDINGS_A_STATE: usize = busbar_plugin_abi::BUSBAR_MAX_BINDINGS_A_STATE as usize;
/// Primitives that one overlay may draw in a frame, a binding.
const MAX_PRIMITIVES_A_BINDING: usize = 8;
/// Bytes of one caption or value.
pub const MAX_PART_BYTES: usize = 256;

/// Entries that a legend may have.
pub(crate) const MAX_LEGEND_ENTRIES: usize = 64;
/// Pieces of equipment that one overlay may show states at.
pub(crate) const MAX_OVERLAY_EQUIPMENT: usize = 100_000;
/// Bytes of an entry's name.
pub(crate) const MAX_LEGEND_NAME: usize = 64;

/// What a state looks like besides its colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Pattern {
    /// Plain.
    Solid,
    /// Stripes.
    Striped,
    /// Stripes that cross.
    Crossed,
    /// Dots.
    Dotted,
}

/// A state that an overlay shows equipment in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LegendEntry {
    /// What it says, for people.
    pub name: String,
    /// sRGB.
    pub color: [u8; 3],
    /// Besides.
    pub pattern: Pattern,
}

/// What an overlay shows besides values.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverlayDescription {
    /// Its states.
    pub legend: Vec<LegendEntry>,
    /// Ids of the equipment that it shows states at.
    pub equipment: Vec<String>,
}

impl OverlayDescription {
    /// Whether it keeps within limits.
    ///
    /// # Errors
    /// The limit that it exceeds, in words.
    pub fn check(&self) -> Result<(), &'static str> {
        if self.legend.len() > MAX_LEGEND_ENTRIES {
            return Err("its legend has more than 64 entries");
        }
        if self.legend.iter().any(|entry| entry.name.len() > MAX_LEGEND_NAME) {
            return Err("a name in its legend is longer than 64 bytes");
        }
        if self.equipment.len() > MAX_OVERLAY_EQUIPMENT {
            return Err("it shows states at more than 100,000 pieces of equipment");
        }
        if self.equipment.iter().any(|id| id.len() > MAX_PART_BYTES) {
            return Err("an equipment id is longer than 256 bytes");
        }
        Ok(())
    }
}

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

/// A piece of equipment in a state, by the indices in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverlayState {
    /// The equipment.
    pub equipment: u32,
    /// The legend's entry.
    pub entry: u32,
    /// A tag that it rests on; one that rests on several is named for each, in a row.
    pub tag: TagHandle,
}

/// What one overlay draws in one frame, checked.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverlayPicture {
    /// Lines in the plugin's order.
    pub lines: Vec<OverlayLine>,
    /// Tints.
    pub tints: Vec<OverlayTint>,
    /// States.
    pub states: Vec<OverlayState>,
}

/// What a picture of an overlay with certain bindings and description may name.
#[derive(Clone, Debug, Default)]
pub struct PictureRules {
    tags: HashSet<TagHandle>,
    nodes: HashSet<u32>,
    legend: usize,
    equipment: usize,
    max_primitives: usize,
}

/// Primitives that an overlay may draw in a frame.
pub(crate) fn max_primitives(bindings: usize, description: &OverlayDescription) -> usize {
    let states = description.equipment.len() * bindings.clamp(1, MAX_BINDINGS_A_STATE);
    (bindings + 1) * MAX_PRIMITIVES_A_BINDING + states
}

impl PictureRules {
    /// The rules for an overlay with these bindings, that describes itself so.
    pub fn new(bindings: &[OverlayBinding], description: &OverlayDescription) -> Self {
        Self {
            tags: bindings.iter().map(|b| b.tag).collect(),
            nodes: bindings.iter().map(|b| b.node).collect(),
            legend: description.legend.len(),
            equipment: description.equipment.len(),
            max_primitives: max_primitives(bindings.len(), description),
        }
    }

    /// Whether a picture keeps to them.
    ///
    /// # Errors
    /// The rule that it breaks, in words.
    pub fn check(&self, picture: &OverlayPicture) -> Result<(), &'static str> {
        let OverlayPicture { lines, tints, states } = picture;
        if lines.len() + tints.len() + states.len() > self.max_primitives {
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
        for state in states {
            if !self.tags.contains(&state.tag) {
                return Err("a state rests on a tag that is not bound");
            }
            let (equipment, entry) = (state.equipment as usize, state.entry as usize);
            if equipment >= self.equipment || entry >= self.legend {
                return Err("a state names equipment or a legend entry that was not described");
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
        OverlayPicture { lines: vec![line], ..OverlayPicture::default() }
    }

    #[test]
    fn a_picture_names_only_what_is_bound() {
        let description = OverlayDescription {
            legend: vec![LegendEntry {
                name: "dead".into(),
                color: [0; 3],
                pattern: Pattern::Solid,
            }],
            equipment: vec!["=Q1".into(), "=Q2".into()],
        };
        let bindings = [OverlayBinding {
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
        }];
        let rules = PictureRules::new(&bindings, &description);
        assert_eq!(rules.check(&line(3, 5, "1.0")), Ok(()));
        assert!(rules.check(&line(4, 5, "1.0")).is_err());
        assert!(rules.check(&line(3, 4, "1.0")).is_err());
        assert!(rules.check(&line(3, 5, &"x".repeat(MAX_PART_BYTES + 1))).is_err());
        let mut many = line(3, 5, "1.0");
        many.lines = vec![many.lines[0].clone(); max_primitives(1, &description) + 1];
        assert!(rules.check(&many).is_err());
        let state = |equipment, entry, tag| OverlayPicture {
            states: vec![OverlayState { equipment, entry, tag: TagHandle(tag) }],
            ..OverlayPicture::default()
        };
        assert_eq!(rules.check(&state(1, 0, 3)), Ok(()));
        for wrong in [state(2, 0, 3), state(1, 1, 3), state(1, 0, 4)] {
            assert!(rules.check(&wrong).is_err());
        }
    }
}
