//! Interface of the view to a host program.

use busbar_alarms::AlarmFlags;
use busbar_chart::Action;
use busbar_protocol::message::{CameraPose, TagUpdate};
use busbar_tags::{SourceTime, TagHandle};
use busbar_ui::{AlarmAction, ChartCommand};

use super::host_intake::ArrivalTimes;
use super::sample_intake::SampleUpdates;
use super::*;

/// Picks that a host program has yet to hear; of more the oldest goes.
const MAX_HOST_PICKS: usize = 256;

impl Viewer {
    /// Marks the view as embedded in a host program.
    pub(crate) fn set_host(&mut self) {
        self.has_host = true;
        if let Some(alarms) = &mut self.alarms {
            alarms.set_host();
        }
    }

    /// Sets the size of a view without a window, pixels.
    pub(crate) fn resize_offscreen(&mut self, size: [u32; 2]) {
        self.renderer.resize(size);
        let points = size.map(|pixels| pixels as f32 / self.scene.config.view.scale);
        self.screen = Rect::from_min_size(Pos2::ZERO, points.into());
    }

    /// Waits until the device has drawn the last frame; reports success. The next frame reports a
    /// lost device.
    pub(crate) fn finish_frame(&mut self) -> bool {
        self.renderer.finish().is_ok()
    }

    /// Selects and frames a piece of equipment, by its id or an alias; whether there is one.
    pub(crate) fn focus(&mut self, id: &str) -> bool {
        let Some(node) = self.scene.equipment.find(&self.scene.graph, id) else { return false };
        self.select([node]);
        self.host_camera_commands.push(Command::Focus(self.scene.graph.node(node).id()));
        true
    }

    /// Returns the pose of the camera.
    pub(crate) fn pose(&self) -> CameraPose {
        let camera = self.navigator.camera();
        CameraPose {
            eye: camera.eye().to_array(),
            target: camera.target().to_array(),
            is_orthographic: self.navigator.is_orthographic(),
        }
    }

    /// Puts the camera somewhere at once.
    pub(crate) fn set_pose(&mut self, pose: &CameraPose) {
        let camera = self.navigator.camera().moved_to(pose.eye.into(), pose.target.into());
        self.navigator.jump_to(camera.with_projection(pose.is_orthographic));
    }

    /// Draws an overlay or leaves it out, by its plugin instance; whether there is one.
    pub fn set_layer_shown(&mut self, name: &str, shown: bool) -> bool {
        let mut overlays = self.overlays.iter_mut();
        let found = overlays.find(|overlay| overlay.overlay.name() == name);
        found.map(|overlay| overlay.is_shown = shown).is_some()
    }

    /// Sets the instant that the chart shows.
    pub(crate) fn set_playhead(&mut self, unix_nanos: Option<i64>) {
        self.apply_chart_command(&ChartCommand::Apply(Action::SetPlayhead(unix_nanos)));
    }

    /// Sets a tag that is the host program's.
    ///
    /// # Errors
    /// A text: the tag does not exist or is not set by the host.
    pub(crate) fn set_tag(&mut self, update: &TagUpdate) -> Result<(), String> {
        let specs = self.scene.tags.specs();
        let found = specs.binary_search_by(|spec| spec.id.as_str().cmp(&update.tag));
        let by_host = self.scene.config.tags.get(&update.tag).map(|tag| tag.is_host_written());
        let (Ok(index), Some(by_host)) = (found, by_host) else {
            return Err(format!("there is no tag '{}'", update.tag));
        };
        if !by_host {
            return Err(format!(
                "tag '{}' comes from elsewhere; say \"set_by_host\": true in the configuration \
                 instead of its source",
                update.tag
            ));
        }
        let boot = busbar_protocol::pictures::now();
        let at = ArrivalTimes { now: Moment::now(), wall: wall_clock(), boot };
        let Self { tags, events, history, alarms, host_intake, .. } = self;
        let mut updates = SampleUpdates { tags, events, history, alarms: alarms.as_mut() };
        host_intake.take(TagHandle(index as u32), update, at, &mut updates);
        Ok(())
    }

    /// Notes what an operator picked.
    pub(super) fn note_host_pick(&mut self, node: Option<NodeIndex>) {
        if self.host_picks.len() == MAX_HOST_PICKS {
            self.host_picks.pop_front();
        }
        self.host_picks.push_back(node);
    }

    /// Takes the ids of the equipment picked since the last call.
    pub(crate) fn take_host_picks(&mut self) -> Vec<Option<String>> {
        let id = |node: NodeIndex| self.scene.graph.node(node).id();
        self.host_picks.drain(..).map(|node| node.map(id)).collect()
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
        let alarms = self.alarms.as_mut().ok_or_else(|| format!("there is no alarm '{id}'"))?;
        alarms.act_as(id, action, operator)
    }

    /// Alarms, if any is configured.
    pub(crate) fn alarm_service(&mut self) -> Option<&mut AlarmService> {
        self.alarms.as_mut()
    }

    /// Restores the alarm states of a previous viewer process.
    pub(crate) fn restore_alarms(&mut self, standings: &[(String, AlarmFlags, SourceTime)]) {
        if let Some(alarms) = &mut self.alarms {
            alarms.restore(standings);
        }
    }

    /// Returns the name and the state text of each plugin instance.
    pub(crate) fn plugin_states(&self) -> Vec<(String, String)> {
        let state = |(plugin, link, fault): (&Plugin, Option<LinkReport>, Option<&str>)| {
            let row = panel_rows::plugin(plugin, link, fault);
            let process = plugin.status().state.name();
            let words = [process, row.message.as_str()].join(": ");
            (row.name, words.trim_end_matches(": ").to_owned())
        };
        self.plugin_instances().map(state).collect()
    }

    /// Returns the name of the graphics device.
    pub(crate) fn device_name(&self) -> &str {
        self.renderer.device_name()
    }

    /// Id of a tag.
    pub(crate) fn tag_id(&self, tag: TagHandle) -> Option<&str> {
        self.scene.tags.spec(tag).map(|spec| spec.id.as_str())
    }
}
