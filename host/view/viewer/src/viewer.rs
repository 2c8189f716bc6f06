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
}

/// Output of a frame for the platform.
pub struct FrameOutput {
    /// Cursor shape, clipboard, links.
    pub platform: egui::PlatformOutput,
    /// Longest delay until the panels must run again.
    pub repaint_after: Duration,
    /// Reason why the window shows an older picture; no value in it is live then.
    pub trouble: Option<String>,
}

impl Viewer {
    /// Steps the view: takes samples, runs overlays and panels, draws.
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
        let shown = self.assemble_overlays(seconds, &mut stages);
        let (mut panels, labelled) = self.run_panels(input, &shown, &mut stages);
        self.update_graphics(&shown, &mut stages);
        self.statistics.stages = stages;
        self.update_detail(seconds);
        let Some(drawn) = self.draw(&mut panels, started)? else {
            return Ok(self.skipped_frame(panels.egui));
        };
        self.note_drawn(drawn, panels.primitives, (shown, labelled));
        self.step_picks()?;
        self.statistics.record_frame(started);
        self.release_loading_memory();
        Ok(self.frame_output(panels.egui))
    }
}
