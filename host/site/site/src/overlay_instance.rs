//! Running overlay plugins: their last pictures, verdicts and faults, across reloads.

use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_overlay_picture::{OverlayDescription, OverlayPicture, Verdicts};
use busbar_plugin_host::SceneClock;
use busbar_plugin_process::RunningOverlay;
use busbar_tags::{Snapshot, TagHandle};

use crate::index_remap::IndexRemap;
use crate::verdicts::VerdictBoard;

/// Longest wait of a live site for its isolated overlays: mostly enough for the picture of this
/// step, and too little to be seen.
pub(crate) const LIVE_TIMEOUT: Duration = Duration::from_millis(4);
/// Longest wait of a site that settles for its isolated overlays.
pub(crate) const SETTLING_TIMEOUT: Duration = Duration::from_millis(250);

/// Tag of what an overlay that is late or gone drew, lines of labels aside. No tag has this
/// number, so that nothing of it counts as known; what values are worth is not said by it.
pub const LATE_DISPLAY: TagHandle = TagHandle(u32::MAX - 1);

/// Running overlay with its last picture and its last fault.
pub struct OverlayInstance {
    overlay: RunningOverlay,
    /// Reason why the overlay is late; none while it draws.
    fault: Option<String>,
    /// Description that the overlay gives of its output.
    description: Arc<OverlayDescription>,
    /// Verdicts on the equipment described.
    verdicts: VerdictBoard,
    /// Ids of the equipment that the verdicts are on.
    verdict_equipment: Vec<String>,
    /// Last picture, in the present numbers.
    last: Arc<OverlayPicture>,
    /// Copy of the last picture without values; none while the overlay is not late.
    late: Option<Arc<OverlayPicture>>,
    /// Map from the plugin's numbers to the present ones.
    remap: IndexRemap,
    /// Last picture of the plugin, before and after the remap.
    remapped: [Arc<OverlayPicture>; 2],
}

impl OverlayInstance {
    /// Wraps an overlay that was just configured.
    pub(crate) fn new(overlay: RunningOverlay) -> Self {
        Self {
            overlay,
            fault: None,
            description: Arc::default(),
            verdicts: VerdictBoard::default(),
            verdict_equipment: Vec::new(),
            last: Arc::default(),
            late: None,
            remap: IndexRemap::default(),
            remapped: Default::default(),
        }
    }

    /// Returns the name of the plugin instance.
    pub fn name(&self) -> &str {
        self.overlay.name()
    }

    /// Returns the reason why the overlay is late; none while it draws.
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Returns the description that the overlay gives of its output.
    pub fn description(&self) -> &Arc<OverlayDescription> {
        &self.description
    }

    /// Returns the verdicts on the equipment of the description.
    pub fn verdicts(&self) -> &VerdictBoard {
        &self.verdicts
    }

    /// Reports whether the overlay did not draw in the last step.
    pub fn is_late(&self) -> bool {
        self.late.is_some()
    }

    /// Returns the last picture. All that a late one shows is marked as not known.
    pub fn picture(&self) -> &Arc<OverlayPicture> {
        self.late.as_ref().unwrap_or(&self.last)
    }

    /// Inherits past abnormal verdicts from the overlay before a change of settings.
    pub(crate) fn inherit(&mut self, before: Self) {
        (self.verdicts, self.verdict_equipment) = (before.verdicts, before.verdict_equipment);
    }

    /// Adapts to other tag and equipment numbers after a reload.
    pub(crate) fn remap_numbers(&mut self, remap: &IndexRemap) {
        self.remap = self.remap.then(remap);
        self.last = remap.picture(&self.last);
        self.late = None;
        self.remapped = Default::default();
    }

    /// Draws at the values of a step, and waits at most `timeout` for an isolated overlay. A failed
    /// overlay keeps its last picture as late; its fault is logged once.
    pub(crate) fn draw(&mut self, snapshot: Snapshot<'_>, clock: SceneClock, timeout: Duration) {
        self.take_description();
        let Self { overlay, remap, .. } = self;
        match overlay.draw(|tag| snapshot.state(remap.tags().tag(tag)?), clock, timeout) {
            Ok(picture) => {
                let picture = self.remap_picture(picture);
                self.verdicts.update(&picture, snapshot);
                self.verdicts.log_missing(self.overlay.name(), &self.verdict_equipment);
                self.last = picture;
                self.late = None;
                self.fault = None;
            }
            Err(error) => {
                let fault = error.to_string();
                if self.fault.as_ref() != Some(&fault) {
                    tracing::error!(plugin = self.overlay.name(), "{fault}");
                }
                self.fault = Some(fault);
                self.verdicts.mark_unknown();
                // Removing the picture would suggest a healthy plant; marking it bad would blame
                // the plant.
                let last = &self.last;
                self.late.get_or_insert_with(|| Arc::new(without_values(last)));
            }
        }
    }

    /// Maps a plugin's picture to the present numbers.
    fn remap_picture(&mut self, picture: Arc<OverlayPicture>) -> Arc<OverlayPicture> {
        if !Arc::ptr_eq(&self.remapped[0], &picture) {
            let now = self.remap.picture(&picture);
            self.remapped = [picture, now];
        }
        Arc::clone(&self.remapped[1])
    }

    /// Takes the overlay's description; an isolated one describes itself anew after it was started
    /// again.
    fn take_description(&mut self) {
        let description = self.overlay.description();
        if Arc::ptr_eq(&description, &self.description) {
            return;
        }
        if description != self.description {
            self.verdicts.describe(&self.verdict_equipment, &description.equipment);
            self.verdict_equipment.clone_from(&description.equipment);
            for finding in &description.findings {
                tracing::warn!(overlay = self.overlay.name(), "{finding}");
            }
        }
        self.description = description;
    }
}

/// Draws with every overlay, those included that no view shows: their calculations have a history,
/// and their verdicts count. All share the timeout.
pub(crate) fn draw_all(
    overlays: &mut [OverlayInstance],
    snapshot: Snapshot<'_>,
    clock: SceneClock,
    timeout: Duration,
) {
    let start = Instant::now();
    for overlay in overlays {
        overlay.draw(snapshot, clock, timeout.saturating_sub(start.elapsed()));
    }
}

/// Returns a copy of a picture, none of which rests on a value.
fn without_values(picture: &OverlayPicture) -> OverlayPicture {
    let mut late = picture.clone();
    // Lines keep their tags: what is late may rest on a value that is bad besides.
    let OverlayPicture { lines: _, tints, states, quantities, verdicts } = &mut late;
    *verdicts = Verdicts::default();
    tints.iter_mut().for_each(|tint| tint.tag = LATE_DISPLAY);
    states.iter_mut().for_each(|state| state.tag = LATE_DISPLAY);
    quantities.iter_mut().for_each(|quantity| quantity.tag = LATE_DISPLAY);
    late
}
