//! Statistics and state of the view, its tags and plugins.

use std::collections::BTreeSet;
use std::time::Duration;

use busbar_scene::NodeIndex;
use busbar_site::OverlayVerdicts;
use busbar_tags::{EventLog, Snapshot};
use busbar_types::VerdictSeverity;

use super::Viewer;
use crate::panel_rows::TagListRows;
use crate::stats::{self, FaceplateStats, Stats, ViewHealth};

impl Viewer {
    /// Numbers about the view as its last frame showed it.
    pub fn stats(&self) -> Stats {
        let [median, p99] = self.statistics.percentiles([0.5, 0.99]);
        let rows = self.detail.model_rows(&self.scene);
        let (last_frame, recovery) = (self.drawing.last_frame(), self.renderer.recovery());
        let selection = self.interaction.selection();
        Stats {
            vertices: self.detail.surviving_vertices(&self.scene),
            triangles: last_frame.triangles,
            triangles_full: self.detail.triangles_full(),
            theta: rows.clone().map(|row| (row.name.clone(), row.theta[1])).collect(),
            theta_span: rows.map(|row| (row.name.clone(), row.theta)).collect(),
            cpu_ms: self.statistics.cpu_millis,
            hide_ms: last_frame.occlusion_millis,
            draw_calls: last_frame.draw_calls,
            draw_commands: last_frame.draw_commands,
            gpu_ms: stats::gpu_millis(last_frame),
            resolve_ms: last_frame.resolve_millis,
            resolved: self.detail.resolved(),
            waiting: self.detail.waiting_count(),
            groups_as_one: self.detail.groups_as_one(),
            index_cache_bytes: self.renderer.get().index_cache_bytes(),
            frames: self.statistics.frames(),
            fps_median: if median > 0.0 { 1e3 / median } else { 0.0 },
            frame_ms_p99: p99,
            gpu: self.renderer.get().device_name().to_owned(),
            devices_replaced: recovery.replaced,
            frames_skipped: recovery.skipped,
            load_ms: self.scene.millis.clone(),
            cached_meshes: self.scene.cached_meshes,
            plugins: self.site.plugins().map(stats::plugin).collect(),
            tags: stats::tags(&self.scene.tags, self.site.snapshot()),
            quality: self.site.snapshot().counts().into(),
            origin: self.shown_origin().names().collect(),
            pauses: self.site.pauses(),
            verdicts: self.verdicts(),
            scene_time: self.site.scene_time().map(|time| time.0 as f64 / 1e9),
            events: self.site.events().count(),
            alarms: self.alarm_rows().stats(),
            chart: self.chart_with_reader().map(|(chart, reader)| chart.stats(reader)),
            selected_alarm: self.selected_alarm(),
            picked: match selection.len() {
                1 => self.ids_of(selection).next(),
                _ => None,
            },
            selected: self.ids_of(selection).collect(),
            hovered: self.hovered(),
            faceplate: self.faceplate_stats(),
            dark: self.panels.is_dark(),
            equipment_rows: self.equipment.tree_len(),
            measured: self.interaction.measuring.as_ref().map_or_else(Vec::new, |measuring| {
                measuring.points().iter().map(|point| point.to_array()).collect()
            }),
            hidden_labels: self.ids_of(self.overlays.hidden_labels()).collect(),
            camera: self.camera_stats(),
            reloads: stats::reloads(&self.statistics.reloads),
            validation_messages: self.renderer.get().validation_messages(),
        }
    }

    /// Returns the id of the selected alarm.
    fn selected_alarm(&self) -> Option<String> {
        self.site.alarms()?.id_of(self.alarms.selected()?)
    }

    /// Returns the health numbers, which are cheaper than all statistics.
    pub fn health(&self) -> ViewHealth {
        ViewHealth {
            quality: self.site.snapshot().counts().into(),
            alarms: self.site.alarms().map_or_else(Vec::new, stats::alarms_by_state),
            plugins: self.site.plugins().map(stats::plugin).collect(),
            reloads: stats::reloads(&self.statistics.reloads),
        }
    }

    /// Returns the time of the last frame, from its beginning until its submission to the device.
    pub fn frame_time(&self) -> Duration {
        self.statistics.last_time()
    }

    /// Starts a plugin again that waits for that or is in quarantine.
    pub fn start_plugin(&self, name: &str) {
        self.site.start_plugin(name);
    }

    /// Returns the tags as the last frame showed them.
    pub fn tags(&self) -> Snapshot<'_> {
        self.site.snapshot()
    }

    /// Returns the switching events since the start, in order of arrival.
    pub fn events(&self) -> &EventLog {
        self.site.events()
    }

    /// Returns the verdicts of each overlay that judges equipment, hidden ones too.
    pub fn overlay_verdicts(&self) -> impl Iterator<Item = OverlayVerdicts<'_>> {
        self.site.overlay_verdicts()
    }

    /// The verdicts of all overlays, hidden ones too.
    pub(crate) fn verdicts(&self) -> Vec<stats::VerdictStats> {
        let mut all = Vec::new();
        for overlay in self.overlay_verdicts() {
            for (equipment, id) in overlay.equipment.iter().enumerate() {
                let of = overlay.verdict(equipment);
                all.push(stats::VerdictStats {
                    overlay: overlay.name.to_owned(),
                    equipment: id.clone(),
                    verdict: of.verdict.name(),
                    severity: of.severity.map(VerdictSeverity::name),
                    assumed: of.is_assumed,
                    reason: of.reason.into_owned(),
                    was_abnormal: of.was_abnormal,
                    origin: of.origin.names().collect(),
                });
            }
        }
        all
    }

    fn ids_of(&self, nodes: &BTreeSet<NodeIndex>) -> impl Iterator<Item = String> {
        nodes.iter().map(|node| self.scene.graph.node(*node).id())
    }

    fn camera_stats(&self) -> stats::CameraStats {
        let camera = self.navigator.camera();
        stats::CameraStats {
            // Tenths of a millimetre: single precision has no more within a scene.
            eye: self
                .scene
                .graph
                .point_to_world(camera.eye())
                .map(|metres| (metres * 1e4).round() / 1e4),
            direction: camera.forward().to_array(),
            mode: stats::mode_name(self.navigator.mode()),
            orthographic: self.navigator.is_orthographic(),
        }
    }

    fn faceplate_stats(&self) -> Option<FaceplateStats> {
        let faceplate = self.equipment.faceplate()?;
        let (snapshot, filter) = (self.tags(), self.equipment.tag_filter());
        let rows = TagListRows::new(&self.scene, snapshot, filter, std::iter::empty());
        let inputs = self.faceplate_inputs(&rows, self.overlays.states());
        Some(stats::faceplate(&faceplate.model(&inputs)))
    }
}
