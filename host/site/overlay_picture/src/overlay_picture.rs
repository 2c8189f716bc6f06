//! Overlay pictures, with the rules for pictures of both in-process and isolated plugins.

use std::collections::HashSet;

use busbar_tags::TagHandle;
use busbar_types::{Pattern, Severity};
use serde::{Deserialize, Serialize};

use crate::overlay_binding::MAX_PART_BYTES;
use crate::overlay_quantity::MAX_MECHANISMS;
use crate::{Contour, OverlayBinding, OverlayQuantity, Quantity, Verdicts};

/// Bindings under the states of one frame, for each piece of equipment described, where
/// that is more than [`MIN_STATE_PRIMITIVES`].
const MAX_BINDINGS_A_STATE: usize = 64;
/// Bindings under the states of one frame that every overlay may name.
const MIN_STATE_PRIMITIVES: usize = 1 << 20;
/// Bindings under the states of one frame that any overlay may name. At 9 bytes each they take
/// 58 MB, within the 64 MiB of a message from a plugin's process.
const MAX_STATE_PRIMITIVES: usize = 6_400_000;
/// Primitives that one overlay may draw in a frame, a binding.
const MAX_PRIMITIVES_A_BINDING: usize = 8;

/// Entries that a legend may have.
pub const MAX_LEGEND_ENTRIES: usize = 64;
/// Pieces of equipment that one overlay may show states at. Their ids, each of at most
/// [`MAX_PART_BYTES`] and its length, take 52 MB, within the 64 MiB of a message from a plugin's
/// process.
pub const MAX_OVERLAY_EQUIPMENT: usize = 200_000;
/// Findings about the bindings that one overlay may have.
pub const MAX_FINDINGS: usize = 256;
/// Bytes of a finding.
const MAX_FINDING_BYTES: usize = 1024;
/// Bytes of an entry's name.
const MAX_LEGEND_NAME: usize = 64;

/// A state that an overlay shows equipment in.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LegendEntry {
    /// Name of the state for people.
    pub name: String,
    /// Fill colour in sRGB.
    pub color: [u8; 3],
    /// Fill pattern besides the colour.
    pub pattern: Pattern,
}

/// Content that an overlay shows besides values.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverlayDescription {
    /// Legend of its states.
    pub legend: Vec<LegendEntry>,
    /// Ids of the equipment that it judges, and shows states and quantities at.
    pub equipment: Vec<String>,
    /// Mechanisms, as models name them, that it gives positions of.
    pub mechanisms: Vec<String>,
    /// Quantity that its contour levels show.
    pub contour: Option<Contour>,
    /// True where the overlay is hidden until an operator switches it on.
    pub starts_hidden: bool,
    /// Faults of the bindings, as cause and remedy with `; ` between.
    pub findings: Vec<String>,
}

impl OverlayDescription {
    /// Validates the description against the limits.
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
            return Err("it shows states at more than 200,000 pieces of equipment");
        }
        if self.equipment.iter().any(|id| id.len() > MAX_PART_BYTES) {
            return Err("an equipment id is longer than 256 bytes");
        }
        if self.mechanisms.len() > MAX_MECHANISMS {
            return Err("it gives positions of more than 16 mechanisms");
        }
        if self.mechanisms.iter().any(|name| name.len() > MAX_LEGEND_NAME) {
            return Err("the name of a mechanism is longer than 64 bytes");
        }
        if self.findings.len() > MAX_FINDINGS {
            return Err("it has more than 256 findings");
        }
        if self.findings.iter().any(|finding| finding.len() > MAX_FINDING_BYTES) {
            return Err("a finding is longer than 1024 bytes");
        }
        self.contour.as_ref().map_or(Ok(()), Contour::check)
    }
}

/// A line of the label at a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayLine {
    /// Index of the node.
    pub node: u32,
    /// The tag whose value it shows. Its quality decides how the line looks.
    pub tag: TagHandle,
    /// Severity, for a good value.
    pub severity: Severity,
    /// Caption of the line.
    pub caption: String,
    /// Value as a text.
    pub text: String,
}

/// A node in the colour of a severity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OverlayTint {
    /// Index of the node.
    pub node: u32,
    /// The tag it rests on.
    pub tag: TagHandle,
    /// Severity that chooses the tint.
    pub severity: Severity,
}

/// A piece of equipment in a state, by the indices in the description.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OverlayState {
    /// Index of the equipment.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub entry: u32,
    /// A tag that it rests on; one that rests on several is named for each, in a row.
    pub tag: TagHandle,
}

/// Checked picture of one overlay in one frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OverlayPicture {
    /// Lines in the plugin's order.
    pub lines: Vec<OverlayLine>,
    /// Tints of scene nodes.
    pub tints: Vec<OverlayTint>,
    /// States of the equipment.
    pub states: Vec<OverlayState>,
    /// Positions, flows and levels.
    pub quantities: Vec<OverlayQuantity>,
    /// Judgments on the equipment described.
    pub verdicts: Verdicts,
}

/// Limits of a picture, from the overlay's bindings and description.
#[derive(Clone, Debug, Default)]
pub struct PictureRules {
    tags: HashSet<TagHandle>,
    nodes: HashSet<u32>,
    legend: usize,
    equipment: usize,
    mechanisms: usize,
    has_contour: bool,
    max_primitives: usize,
    max_quantities: usize,
}

/// Returns the number of primitives that an overlay may draw in a frame.
pub fn max_primitives(bindings: usize, description: &OverlayDescription) -> usize {
    let equipment = description.equipment.len();
    let most = (equipment.saturating_mul(MAX_BINDINGS_A_STATE))
        .clamp(MIN_STATE_PRIMITIVES, MAX_STATE_PRIMITIVES);
    let states = equipment.saturating_mul(bindings.max(1)).min(most);
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
            mechanisms: description.mechanisms.len(),
            has_contour: description.contour.is_some(),
            max_quantities: max_quantities(bindings.len(), description),
            max_primitives: max_primitives(bindings.len(), description),
        }
    }

    /// Validates a picture against these rules.
    ///
    /// # Errors
    /// The rule that it breaks, in words.
    pub fn check(&self, picture: &OverlayPicture) -> Result<(), &'static str> {
        let OverlayPicture { lines, tints, states, quantities, verdicts } = picture;
        verdicts.check(self.equipment, |tag| self.tags.contains(&tag))?;
        if quantities.len() > self.max_quantities {
            return Err("it claims too many quantities");
        }
        quantities.iter().try_for_each(|quantity| self.check_quantity(quantity))?;
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

impl PictureRules {
    fn check_quantity(&self, quantity: &OverlayQuantity) -> Result<(), &'static str> {
        if !self.tags.contains(&quantity.tag) {
            return Err("a quantity rests on a tag that is not bound");
        }
        let is_described = |equipment: u32| (equipment as usize) < self.equipment;
        if !is_described(quantity.equipment) {
            return Err("a quantity names equipment that was not described");
        }
        match quantity.what {
            Quantity::Position { mechanism, .. } if mechanism as usize >= self.mechanisms => {
                Err("a position names a mechanism that was not described")
            }
            Quantity::Position { travelled: Some(share), .. } if !(0.0..=1.0).contains(&share) => {
                Err("a position is not a share of a way, 0 to 1")
            }
            Quantity::Flow { to, .. } if !is_described(to) => {
                Err("a flow goes to equipment that was not described")
            }
            Quantity::Level(_) if !self.has_contour => Err("a level is of no contour described"),
            Quantity::Flow { share: value, .. } | Quantity::Level(value) if !value.is_finite() => {
                Err("a flow or level is not finite")
            }
            _ => Ok(()),
        }
    }
}

/// Returns the number of quantities that an overlay may draw in a frame.
pub fn max_quantities(bindings: usize, description: &OverlayDescription) -> usize {
    bindings + description.equipment.len() * description.mechanisms.len().max(1)
}

#[cfg(test)]
mod tests {
    use busbar_types::ValueKind;

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

    /// A region of 181,600 pieces is described; the greatest description and the states of a
    /// frame are less than a message of a plugin's process.
    #[test]
    fn regions_fit_and_limits_bound_the_memory() {
        let of = |count: usize, id: &str| OverlayDescription {
            equipment: vec![id.into(); count],
            ..OverlayDescription::default()
        };
        let longest = "x".repeat(MAX_PART_BYTES);
        assert_eq!(of(181_600, "=R1").check(), Ok(()));
        let greatest = of(MAX_OVERLAY_EQUIPMENT, &longest);
        assert_eq!(greatest.check(), Ok(()));
        assert!(of(MAX_OVERLAY_EQUIPMENT + 1, "=R1").check().is_err());
        const MESSAGE_BYTES: usize = 64 << 20;
        const LENGTH_BYTES: usize = 2;
        let ids: usize = greatest.equipment.iter().map(|id| id.len() + LENGTH_BYTES).sum();
        assert!(ids < MESSAGE_BYTES, "{ids}");
        for bindings in [0, 1, 1 << 20, usize::MAX >> 8] {
            let other = (bindings + 1) * MAX_PRIMITIVES_A_BINDING;
            let states = max_primitives(bindings, &greatest) - other;
            assert!(states >= MAX_OVERLAY_EQUIPMENT && 9 * states < MESSAGE_BYTES, "{states}");
        }
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
            mechanisms: vec!["blade".into()],
            ..OverlayDescription::default()
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
        let quantity = |equipment, tag, what| OverlayPicture {
            quantities: vec![OverlayQuantity { equipment, tag: TagHandle(tag), what }],
            ..OverlayPicture::default()
        };
        let position = |mechanism, travelled| Quantity::Position { mechanism, travelled };
        let flow = |to, share| Quantity::Flow { to, share };
        for right in [position(0, None), position(0, Some(0.5)), flow(1, -1.2)] {
            assert_eq!(rules.check(&quantity(0, 3, right)), Ok(()), "{right:?}");
            assert!(rules.check(&quantity(2, 3, right)).is_err(), "{right:?}");
            assert!(rules.check(&quantity(0, 4, right)).is_err(), "{right:?}");
        }
        let no_share = position(0, Some(f64::NAN));
        let wrong = [position(1, None), position(0, Some(1.1)), no_share, flow(2, 0.1)];
        for wrong in wrong.into_iter().chain([flow(1, f64::INFINITY), Quantity::Level(1.0)]) {
            assert!(rules.check(&quantity(0, 3, wrong)).is_err(), "{wrong:?}");
        }
    }
}
