//! View model of the panels.

use busbar_config::MAX_THETA_SCALE;
use busbar_plugin_host::wall_clock;
use busbar_site::ChartReader;
use busbar_tags::Moment;
use busbar_types::Origin;
use busbar_ui::{Navigation, StatusBarModel, ViewModel};

use super::Viewer;
use crate::alarms::AlarmListRows;
use crate::measurement_chain::MeasurementChain;
use crate::panel_rows::{self, TagListRows};
use crate::{clock, environment, faceplate};
use busbar_scene_overlays::NodeState;
use busbar_scene_overlays::SceneChart;

impl Viewer {
    /// Returns the view model of the panels for a frame with these rows and states.
    pub(super) fn view_model(&self, rows: &TagListRows<'_>, states: &[NodeState]) -> ViewModel {
        let counts = self.site.snapshot().counts();
        let inputs = self.faceplate_inputs(rows, states);
        let (drawing, last_frame) = (&self.drawing, self.drawing.last_frame());
        let is_live = !self.target.settles;
        ViewModel {
            models: self.detail.model_rows(&self.scene).cloned().collect(),
            plugins: self.site.plugins().map(panel_rows::plugin).collect(),
            layers: self.overlays.layers.rows(&self.site),
            cameras: self.scene.config.cameras.keys().cloned().collect(),
            section: drawing.section.as_ref().and_then(environment::cut_of),
            extent: self
                .scene
                .graph
                .bounds()
                .map_or([[0.0; 3]; 2], |bounds| [bounds.min.to_array(), bounds.max.to_array()]),
            bookmarks: self.navigator.bookmarks(&self.scene.config.cameras),
            navigation: Navigation {
                mode: self.navigator.mode(),
                orthographic: self.navigator.is_orthographic(),
                speed: self.navigator.speed(),
            },
            alarms: inputs.alarms.model(is_live),
            chart: self.chart_with_reader().map(|(chart, reader)| chart.model(reader)),
            frame_times: self.statistics.displayed().clone(),
            wireframe: drawing.wireframe,
            theta_scale: self.detail.scale(),
            max_theta_scale: MAX_THETA_SCALE,
            status: StatusBarModel {
                // A picture that nobody watches does not depend on when it was drawn.
                clock: is_live.then(|| clock::time_of_day(inputs.wall_clock)),
                keeps_clock: self.target.in_window && !self.host.is_attached,
                triangles: last_frame.triangles,
                triangles_full: self.detail.triangles_full(),
                device: self.renderer.get().device_name().to_owned(),
                good: counts.good,
                uncertain: counts.uncertain,
                bad: counts.bad,
                fault: self.statistics.reloads.fault.clone(),
            },
            selected: self.interaction.selected_text(&self.scene.graph),
            faceplate: self.equipment.faceplate().map(|faceplate| faceplate.model(&inputs)),
            measuring: self.interaction.measuring.as_ref().map(MeasurementChain::text),
            origin: self.shown_origin(),
        }
    }

    /// Returns the alarms as rows.
    pub(super) fn alarm_rows(&self) -> AlarmListRows<'_> {
        AlarmListRows {
            alarm_service: self.site.alarms(),
            presentation: &self.alarms,
            scene: &self.scene,
            snapshot: self.site.snapshot(),
        }
    }

    /// Returns the inputs of the faceplate for a frame with these rows and states.
    pub(super) fn faceplate_inputs<'a>(
        &'a self,
        rows: &'a TagListRows<'a>,
        states: &'a [NodeState],
    ) -> faceplate::FaceplateInputs<'a> {
        let (scene, snapshot) = (&self.scene, self.site.snapshot());
        faceplate::FaceplateInputs {
            scene,
            snapshot,
            rows,
            alarms: self.alarm_rows(),
            site: &self.site,
            layers: &self.overlays.layers,
            states,
            chart: self.overlays.chart(),
            span: self.equipment.trend_span(),
            now: Moment::now(),
            wall_clock: wall_clock(),
        }
    }

    /// Returns the origins of all displayed values. Origins that plugins declare count even without
    /// good values; a chart of the past counts as historical.
    pub(super) fn shown_origin(&self) -> Origin {
        let shows_past = self.overlays.chart().is_some_and(SceneChart::shows_past);
        let of_chart = if shows_past { Origin::HISTORICAL } else { Origin::LIVE };
        self.site.origin() | of_chart
    }

    /// Returns the chart with the reader of its records.
    pub(super) fn chart_with_reader(&self) -> Option<(&SceneChart, &ChartReader)> {
        self.overlays.chart().zip(self.site.chart())
    }
}
