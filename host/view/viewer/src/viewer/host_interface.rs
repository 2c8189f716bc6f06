//! Interface of the view to a host program.

use std::collections::HashMap;

use busbar_alarms::{AlarmFlags, AlarmHandle};
use busbar_chart::Action;
use busbar_renderer::WindowFrames;
use busbar_scene::NodeIndex;
use busbar_site::{ChangedAlarm, HostTagValue, PluginHealth};
use busbar_tags::{SourceTime, TagHandle};
use busbar_types::{AlarmAction, AlarmState, Origin};
use busbar_ui::{ChartCommand, Command};

use super::Viewer;
use crate::{ViewError, panel_rows};

/// Pose of the camera, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Position of the eye, metres.
    pub eye: [f64; 3],
    /// Point that the camera looks at and turns around, metres.
    pub target: [f64; 3],
    /// True for an orthographic projection.
    pub is_orthographic: bool,
}

impl Viewer {
    /// Marks the view as embedded in a host program.
    pub fn attach_host_program(&mut self) {
        self.host.is_attached = true;
        self.site.attach_host_program();
    }

    /// Sets the size of a view without a window, pixels.
    pub fn resize_offscreen(&mut self, size: [u32; 2]) {
        self.renderer.get_mut().resize(size);
        self.target.resize(size, self.scene.config.view.scale);
    }

    /// Sets whether anybody can see the picture. Nothing is drawn otherwise; telemetry, alarms and
    /// logs go on. With the first frame that is seen again, the picture is of then.
    pub fn set_seen(&mut self, is_seen: bool) {
        self.is_seen = is_seen;
        self.has_unseen_changes &= !is_seen;
    }

    /// Reports whether the device has drawn the last frame; does not wait.
    pub fn has_finished_frame(&self) -> bool {
        self.renderer.get().has_finished()
    }

    /// Forgets all that is kept from frame to frame to save work: the next frame lays out the panels
    /// and draws all of its picture.
    pub fn forget_picture(&mut self) {
        self.panels.forget_pass();
        self.renderer.get_mut().forget_picture();
    }

    /// Notes that the window lost its picture, for instance because it was uncovered: the next frame
    /// is drawn in any case.
    pub fn invalidate_shown(&mut self) {
        self.renderer.get_mut().invalidate_shown();
    }

    /// Defers showing frames in the window where the processor draws: each is shown by
    /// [`Viewer::present_deferred`], and at the latest with the next frame that is drawn.
    pub fn defer_presentation(&mut self) {
        self.renderer.get_mut().defer_presentation();
    }

    /// Shows the last frame if that was deferred. The next frame reports what is wrong if it cannot be
    /// shown.
    pub fn present_deferred(&mut self) {
        if let Err(error) = self.renderer.get_mut().present_deferred() {
            tracing::debug!(%error, "a frame is not shown");
        }
    }

    /// Returns the numbers of the window's frames: the last one drawn, and the last one shown.
    pub fn window_frames(&self) -> WindowFrames {
        self.renderer.get().window_frames()
    }

    /// Waits until the device has drawn the last frame; reports success. The next frame reports a
    /// lost device.
    pub fn finish_frame(&mut self) -> bool {
        self.renderer.get_mut().finish().is_ok()
    }

    /// Selects and frames a piece of equipment, by its id or an alias; whether there is one.
    pub fn focus(&mut self, id: &str) -> bool {
        let Some(node) = self.scene.equipment.find(&self.scene.graph, id) else { return false };
        self.select([node]);
        self.host.camera_commands.push(Command::Focus(self.scene.graph.node(node).id()));
        true
    }

    /// Returns the pose of the camera.
    pub fn camera_pose(&self) -> CameraPose {
        let camera = self.navigator.camera();
        CameraPose {
            eye: self.scene.graph.point_to_world(camera.eye()),
            target: self.scene.graph.point_to_world(camera.target()),
            is_orthographic: self.navigator.is_orthographic(),
        }
    }

    /// Puts the camera somewhere at once.
    pub fn set_camera_pose(&mut self, pose: &CameraPose) {
        let graph = &self.scene.graph;
        let [eye, target] = [pose.eye, pose.target].map(|point| graph.point_from_world(point));
        let camera = self.navigator.camera().moved_to(eye, target);
        self.navigator.jump_to(camera.with_projection(pose.is_orthographic));
    }

    /// Draws an overlay or leaves it out, by its plugin instance; whether there is one.
    pub fn set_layer_shown(&mut self, name: &str, shown: bool) -> bool {
        self.overlays.layers.set_shown_by_name(name, shown)
    }

    /// Sets the instant that the chart shows.
    pub fn set_playhead(&mut self, unix_nanos: Option<i64>) {
        self.apply_chart_command(&ChartCommand::Apply(Action::SetPlayhead(unix_nanos)));
    }

    /// Sets a tag that is the host program's.
    ///
    /// # Errors
    /// A text: the tag does not exist or is not set by the host.
    pub fn set_tag(&mut self, id: &str, value: HostTagValue) -> Result<(), String> {
        self.site.set_tag(id, value)
    }

    /// Takes the ids of the equipment picked since the last call.
    pub fn take_host_picks(&mut self) -> Vec<Option<String>> {
        let id = |node: NodeIndex| self.scene.graph.node(node).id();
        self.host.take_picks().into_iter().map(|node| node.map(id)).collect()
    }

    /// Sets the operator for later alarm actions, as the audit log names them.
    pub fn set_operator(&mut self, name: &str) {
        name.clone_into(&mut self.host.operator);
    }

    /// Sets a mirrored alarm to the state that the host's alarm system has it in, by the
    /// letter of IEC 62682: `A` to `I`. `until` is the end of its time on the shelf.
    ///
    /// # Errors
    /// An alarm that does not exist or is not mirrored.
    pub fn mirror_alarm(
        &mut self,
        id: &str,
        state: AlarmState,
        until: Option<SourceTime>,
        operator: Option<&str>,
    ) -> Result<(), ViewError> {
        self.site.mirror_alarm(id, state, until, operator).map_err(ViewError::Alarm)
    }

    /// Does what the host program's operator does to an alarm.
    ///
    /// # Errors
    /// A text with the reason.
    pub fn act_on_alarm(
        &mut self,
        id: &str,
        action: AlarmAction,
        operator: &str,
    ) -> Result<(), String> {
        let operator = if operator.is_empty() { &self.host.operator } else { operator };
        self.site.act_on_alarm_by_id(id, action, operator)
    }

    /// Returns the alarms that differ from `known` in standing or origin, and updates `known`.
    pub fn alarms_changed_since(
        &self,
        known: &mut HashMap<AlarmHandle, (AlarmFlags, Origin)>,
    ) -> Vec<ChangedAlarm> {
        let changed = self.site.alarms().map(|alarms| alarms.changed_since(known));
        changed.unwrap_or_default()
    }

    /// Takes the operator's requests on external alarms since the last call, by alarm id.
    pub fn take_alarm_requests(&mut self) -> Vec<(String, AlarmAction)> {
        self.site.take_alarm_requests()
    }

    /// Restores the alarm states of a previous viewer process.
    pub fn restore_alarms(&mut self, standings: &[(String, AlarmFlags, SourceTime)]) {
        self.site.restore_alarms(standings);
    }

    /// Returns the name and the state text of each plugin instance.
    pub fn plugin_states(&self) -> Vec<(String, String)> {
        let state = |health: PluginHealth<'_>| {
            let process = health.plugin.status().state.name();
            let row = panel_rows::plugin(health);
            let words = [process, row.message.as_str()].join(": ");
            (row.name, words.trim_end_matches(": ").to_owned())
        };
        self.site.plugins().map(state).collect()
    }

    /// Returns the name of the graphics device.
    pub fn device_name(&self) -> &str {
        self.renderer.get().device_name()
    }

    /// Id of a tag.
    pub fn tag_id(&self, tag: TagHandle) -> Option<&str> {
        self.scene.tags.spec(tag).map(|spec| spec.id.as_str())
    }
}
