//! Viewer: one view of one scene and its site, stepped frame by frame.

mod commands;
mod construction;
mod frame_steps;
mod host_interface;
mod panel_models;
mod picking;
mod reload;
mod report;
mod settings;

pub use busbar_site::ChangedAlarm;
use frame_steps::DrawOutcome;
pub use host_interface::CameraPose;

use std::time::{Duration, Instant};

use busbar_plugin_host::wall_clock;
use busbar_site::Site;
use busbar_ui::Panels;
use egui::RawInput;

use crate::ViewError;
use crate::alarms::AlarmPresentation;
use crate::detail_control::DetailControl;
use crate::equipment_panels::EquipmentPanels;
use crate::frame_statistics::{FrameStageMillis, FrameStatistics};
use crate::host_program::HostProgram;
use crate::interaction::Interaction;
use crate::scene_drawing::SceneDrawing;
use crate::site_definition::SceneDirectory;
use crate::view_renderer::ViewRenderer;
use crate::view_target::ViewTarget;
use busbar_camera::Navigator;
use busbar_scene_loader::LoadedScene;
use busbar_scene_overlays::SceneOverlays;

/// A scene on a device, with its plugins running.
pub struct Viewer {
    // The site first: its plugins stop before what they feed is gone.
    site: Site,
    scene: LoadedScene,
    alarms: AlarmPresentation,
    overlays: SceneOverlays,
    navigator: Navigator,
    interaction: Interaction,
    equipment: EquipmentPanels,
    detail: DetailControl,
    renderer: ViewRenderer,
    drawing: SceneDrawing,
    target: ViewTarget,
    panels: Panels,
    host: HostProgram,
    statistics: FrameStatistics,
    /// False while nobody sees the picture: nothing is drawn then.
    is_seen: bool,
    /// True once the picture would be another than the last one drawn, while nobody sees it.
    has_unseen_changes: bool,
}

/// Output of a frame for the platform.
pub struct FrameOutput {
    /// Cursor shape, clipboard, links; none where they are as before.
    pub platform: Option<egui::PlatformOutput>,
    /// Longest delay until the panels must run again.
    pub repaint_after: Duration,
    /// True if a picture was drawn; false where it would have been that of the frame before, and
    /// while nobody sees it.
    pub is_drawn: bool,
    /// True if the last picture drawn agrees with the values of this frame.
    pub is_current: bool,
    /// Reason why the window shows an older picture; no value in it is live then.
    pub trouble: Option<String>,
}

impl Viewer {
    /// Steps the view: takes samples, runs overlays and panels, and draws where the picture would
    /// be another than the last one. A view that settles draws each frame.
    ///
    /// # Errors
    /// Errors of the graphics device.
    pub fn frame(&mut self, input: RawInput) -> Result<FrameOutput, ViewError> {
        let started = Instant::now();
        let seconds = input.time.unwrap_or_default();
        self.target.update(&input, self.panels.context().zoom_factor());
        self.navigator.advance(seconds);
        let stepped = self.site.step(&SceneDirectory::new(&self.scene));
        self.equipment.look_up_records(self.site.records(), wall_clock());
        let mut stages = FrameStageMillis::from(stepped);
        if self.has_unseen_changes && input.events.is_empty() {
            return self.step_unseen(seconds);
        }
        let shown = self.assemble_overlays(seconds, &mut stages);
        let Some((mut panels, labelled)) = self.run_panels(input, &shown, &mut stages) else {
            self.has_unseen_changes = true;
            return self.step_unseen(seconds);
        };
        self.update_graphics(&shown, &mut stages);
        self.statistics.stages = stages;
        self.update_detail(seconds);
        self.choose_resolution(seconds);
        let outcome = self.draw(&mut panels, started)?;
        let is_drawn = matches!(outcome, DrawOutcome::Drawn(_));
        let is_current = is_drawn || matches!(outcome, DrawOutcome::Unchanged);
        match outcome {
            DrawOutcome::NoDevice => return Ok(self.skipped_frame(panels)),
            DrawOutcome::Unchanged => self.note_unchanged(),
            DrawOutcome::Unseen => self.has_unseen_changes = true,
            DrawOutcome::Drawn(drawn) => self.note_drawn(*drawn),
        }
        self.note_shown(shown, labelled);
        self.step_picks()?;
        if is_drawn {
            self.statistics.record_frame(started, self.drawing.last_frame());
            self.release_loading_memory();
        }
        Ok(FrameOutput { is_drawn, is_current, ..self.frame_output(panels) })
    }
}
