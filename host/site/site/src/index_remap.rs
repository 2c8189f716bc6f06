//! Index remap: maps the tag and equipment numbers held by running plugins to those after a
//! reload.

use std::sync::Arc;

use busbar_overlay_picture::OverlayPicture;
use busbar_tags::{HandleRemap, TagHandle};

use crate::equipment::EquipmentNumber;

/// No tag has this number.
const NO_TAG: TagHandle = TagHandle(u32::MAX);

/// Map from the tag and equipment numbers before a reload to those after it.
#[derive(Clone, Debug, Default)]
pub struct IndexRemap {
    tags: HandleRemap,
    equipment: HandleRemap,
}

impl IndexRemap {
    /// Creates a map from the maps of tags and of equipment numbers.
    pub fn new(tags: HandleRemap, equipment: HandleRemap) -> Self {
        Self { tags, equipment }
    }

    /// Returns the map of the tags.
    pub fn tags(&self) -> &HandleRemap {
        &self.tags
    }

    /// Returns the composition: this map, then the next.
    pub fn then(&self, next: &Self) -> Self {
        Self { tags: self.tags.then(&next.tags), equipment: self.equipment.then(&next.equipment) }
    }

    /// Returns the present number of a piece of equipment; none if it is gone.
    pub fn equipment(&self, EquipmentNumber(old): EquipmentNumber) -> Option<EquipmentNumber> {
        self.equipment.index(old).map(EquipmentNumber)
    }

    /// Maps a picture to the present numbers; entries of removed tags or equipment are dropped.
    pub(crate) fn picture(&self, picture: &Arc<OverlayPicture>) -> Arc<OverlayPicture> {
        if self.tags.is_identity() && self.equipment.is_identity() {
            return Arc::clone(picture);
        }
        let mut now = OverlayPicture::clone(picture);
        let remap = |node: &mut u32, tag: &mut TagHandle| {
            let found = self.equipment.index(*node).zip(self.tags.tag(*tag));
            found.map(|found| (*node, *tag) = found).is_some()
        };
        now.lines.retain_mut(|line| remap(&mut line.node, &mut line.tag));
        now.tints.retain_mut(|tint| remap(&mut tint.node, &mut tint.tag));
        let remap = |tag: &mut TagHandle| {
            let found = self.tags.tag(*tag);
            found.map(|found| *tag = found).is_some()
        };
        now.states.retain_mut(|state| remap(&mut state.tag));
        now.quantities.retain_mut(|quantity| remap(&mut quantity.tag));
        // A verdict that rests on a tag that is gone is taken back.
        now.verdicts.map_tags(|tag| self.tags.tag(tag).unwrap_or(NO_TAG));
        Arc::new(now)
    }
}
