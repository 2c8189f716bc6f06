//! Dispatch of operator commands to the parts of the view.

use busbar_alarms::AlarmHandle;
use busbar_tags::TagHandle;
use busbar_ui::{ChartCommand, Command};

use super::Viewer;
use crate::environment;
use crate::measurement_chain::MeasurementChain;
use crate::pick_queue::PickPurpose;

impl Viewer {
    /// Does what the panels ask, except for the camera, which is steered already.
    pub(super) fn apply_commands(&mut self, commands: &[Command]) {
        for command in commands {
            match command {
                Command::SetTheta { model, theta } => {
                    self.detail.set_manual_theta(*model, Some(*theta));
                }
                Command::UsePolicy { model } => self.detail.set_manual_theta(*model, None),
                Command::SetThetaScale(scale) => self.set_theta_scale(*scale),
                Command::SetWireframe(wireframe) => self.set_wireframe(*wireframe),
                Command::Focus(id) | Command::Reveal(id) => {
                    self.select(self.scene.graph.find(id));
                }
                Command::SelectAlarm(alarm) => {
                    self.alarms.select(AlarmHandle(*alarm), &self.site);
                }
                Command::ActOnAlarm { alarm, action } => {
                    let (alarm, operator) = (AlarmHandle(*alarm), &self.host.operator);
                    self.alarms.act(&mut self.site, alarm, *action, operator);
                }
                Command::ShowAlarmList(list) => self.alarms.show_list(*list, &self.site),
                Command::SetLayer { layer, shown } => {
                    self.overlays.layers.set_shown(*layer, *shown);
                }
                Command::StartPlugin(name) => self.start_plugin(name),
                Command::Chart(command) => self.apply_chart_command(command),
                Command::Pick(position) => self.pick_line_or_scene(*position),
                Command::PickRectangle(area) => self.pick_in(PickPurpose::SelectAll, *area),
                Command::Hover(position) => self.interaction.point_at(*position),
                Command::SetMeasuring(measures) => {
                    self.interaction.measuring = measures.then(MeasurementChain::default);
                }
                Command::SetSection(cut) => self.set_section(cut.and_then(environment::plane_of)),
                Command::Measure(position) => self.pick_at(PickPurpose::Measure, *position),
                Command::Escape if self.interaction.measuring.is_some() => {
                    self.interaction.measuring = None;
                }
                Command::Escape => self.select(None),
                Command::SearchEquipment(query) => {
                    self.equipment.search_equipment(query, &self.scene);
                }
                Command::ToggleBranch(entry) => self.equipment.toggle_branch(*entry),
                Command::FilterTags(query) => self.equipment.filter_tags(query, &self.scene),
                Command::ToggleTrend(tag) => self.equipment.toggle_trend(TagHandle(*tag)),
                Command::SetTrendSpan(span) => self.equipment.set_trend_span(*span),
                Command::SetDark(is_dark) => self.panels.set_dark(*is_dark),
                // The camera's.
                Command::UseCamera(_)
                | Command::StoreBookmark(_)
                | Command::GoToBookmark(_)
                | Command::SetCameraMode(_)
                | Command::SetOrthographic(_)
                | Command::UseStandardView(_)
                | Command::FitAll
                | Command::FitSelection
                | Command::Orbit(_)
                | Command::StartInertia(_)
                | Command::Pan(_)
                | Command::Zoom(_)
                | Command::Move { .. } => {}
            }
        }
    }

    /// Arranges the chart that stands in the scene; without one, nothing happens.
    pub fn apply_chart_command(&mut self, command: &ChartCommand) {
        let copied = self.overlays.chart_mut().and_then(|chart| chart.apply(command));
        if let Some(text) = copied {
            self.panels.copy_text(text);
        }
    }
}
