//! View model of the panels, and statistics of the view.

use super::*;
use crate::clock;
use crate::stats::ViewHealth;
use crate::verdicts::OverlayVerdicts;

/// Selected pieces of equipment that are named; of more their number.
const MAX_NAMES: usize = 3;

impl Viewer {
    /// Numbers about the view as its last frame showed it.
    pub fn stats(&self) -> Stats {
        let mut millis: Vec<f64> = self.frame_millis.iter().copied().collect();
        millis.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = (share * millis.len().saturating_sub(1) as f64).round() as usize;
            millis.get(rank).copied().unwrap_or(0.0)
        };
        let median = at(0.5);
        let rows = self.model_rows();
        Stats {
            vertices: self.surviving_vertices(),
            triangles: self.last_frame.triangles,
            triangles_full: self.triangles_full,
            theta: rows.clone().map(|row| (row.name.clone(), row.theta[1])).collect(),
            theta_span: rows.map(|row| (row.name.clone(), row.theta)).collect(),
            cpu_ms: self.cpu_millis,
            hide_ms: self.last_frame.occlusion_millis,
            draw_calls: self.last_frame.draw_calls,
            draw_commands: self.last_frame.draw_commands,
            gpu_ms: stats::gpu_millis(&self.last_frame),
            resolve_ms: self.last_frame.resolve_millis,
            resolved: self.resolved,
            waiting: self.lod_cursors.waiting_count(),
            groups_as_one: self.groups_as_one(),
            index_cache_bytes: self.renderer.index_cache_bytes(),
            frames: self.frames,
            fps_median: if median > 0.0 { 1e3 / median } else { 0.0 },
            frame_ms_p99: at(0.99),
            gpu: self.renderer.device_name().to_owned(),
            devices_replaced: self.recovery.replaced,
            frames_skipped: self.recovery.skipped,
            load_ms: self.scene.millis.clone(),
            cached_meshes: self.scene.cached_meshes,
            plugins: self
                .plugin_instances()
                .map(|(plugin, link, fault)| stats::plugin(plugin, link, fault))
                .collect(),
            tags: stats::tags(&self.scene.tags, self.tags.snapshot()),
            quality: self.tags.snapshot().counts().into(),
            origin: self.shown_origin().names().collect(),
            pauses: self.pauses.count(),
            verdicts: self.verdicts(),
            scene_time: self
                .telemetry
                .iter()
                .filter_map(TelemetryInstance::scene_time)
                .max()
                .map(|time| time.0 as f64 / 1e9),
            events: self.events.count(),
            alarms: self.alarm_rows(self.tags.snapshot()).stats(),
            chart: self.chart.as_ref().map(SceneChart::stats),
            selected_alarm: self.alarms.as_ref().and_then(stats::selected_alarm),
            picked: match self.selection.len() {
                1 => self.ids_of(&self.selection).next(),
                _ => None,
            },
            selected: self.ids_of(&self.selection).collect(),
            hovered: self.hovered.map(|node| self.scene.graph.node(node).id()),
            faceplate: self.faceplate.as_ref().map(|faceplate| {
                let lines = panel_rows::TagListRows::new(
                    &self.scene,
                    self.tags(),
                    &self.tag_filter,
                    std::iter::empty(),
                );
                stats::faceplate(&faceplate.model(&self.faceplate_inputs(
                    self.tags(),
                    &lines,
                    &self.states,
                )))
            }),
            dark: self.panels.is_dark(),
            equipment_rows: self.equipment_tree.len(),
            measured: self.measuring.as_ref().map_or_else(Vec::new, |measuring| {
                measuring.points().iter().map(|point| point.to_array()).collect()
            }),
            hidden_labels: self.ids_of(&self.hidden_labels).collect(),
            camera: self.camera_stats(),
            reloads: stats::reloads(&self.reloads),
            validation_messages: self.renderer.validation_messages(),
        }
    }

    /// Returns the origins of all displayed values. Origins that plugins declare count even without
    /// good values; a chart of the past counts as historical.
    pub(super) fn shown_origin(&self) -> Origin {
        let links = self.telemetry.iter().map(|telemetry| telemetry.link().origin);
        let is_simulated = self.scene.config.plugins.values().any(|plugin| plugin.simulated);
        let declared = if is_simulated { Origin::SIMULATED } else { Origin::LIVE };
        let shows_past = self.chart.as_ref().is_some_and(SceneChart::shows_past);
        let of_chart = if shows_past { Origin::HISTORICAL } else { Origin::LIVE };
        let known = self.origins.shown() | declared | of_chart;
        links.fold(known, Origin::union)
    }

    /// Returns the health numbers, which are cheaper than all statistics.
    pub fn health(&self) -> ViewHealth {
        ViewHealth {
            quality: self.tags.snapshot().counts().into(),
            alarms: self.alarms.as_ref().map_or_else(Vec::new, stats::alarms_by_state),
            plugins: self
                .plugin_instances()
                .map(|(plugin, link, fault)| stats::plugin(plugin, link, fault))
                .collect(),
            reloads: stats::reloads(&self.reloads),
        }
    }

    /// Returns the time of the last frame, from its beginning until its submission to the device.
    pub fn frame_time(&self) -> Duration {
        Duration::from_secs_f64(self.last_frame_millis() / 1e3)
    }

    pub(super) fn view_model<'a>(
        &'a self,
        snapshot: Snapshot<'a>,
        rows: &'a panel_rows::TagListRows<'a>,
        states: &'a [NodeState],
    ) -> ViewModel {
        let counts = snapshot.counts();
        let inputs = self.faceplate_inputs(snapshot, rows, states);
        ViewModel {
            models: self.model_rows().cloned().collect(),
            plugins: self
                .plugin_instances()
                .map(|(plugin, link, fault)| panel_rows::plugin(plugin, link, fault))
                .collect(),
            layers: self.overlays.iter().map(panel_rows::layer).collect(),
            cameras: self.scene.config.cameras.keys().cloned().collect(),
            section: self.section.as_ref().and_then(environment::cut_of),
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
            alarms: inputs.alarms.model(!self.settles),
            chart: self.chart.as_ref().map(SceneChart::model),
            wireframe: self.wireframe,
            theta_scale: self.lod_cursors.scale(),
            max_theta_scale: MAX_THETA_SCALE,
            status: StatusBarModel {
                // A picture that nobody watches does not depend on when it was drawn.
                clock: (!self.settles).then(|| clock::time_of_day(inputs.wall_clock)),
                keeps_clock: self.in_window && !self.has_host,
                triangles: self.last_frame.triangles,
                triangles_full: self.triangles_full,
                frame_millis: self.last_frame_millis(),
                gpu_millis: stats::gpu_millis(&self.last_frame).into_iter().collect(),
                device: self.renderer.device_name().to_owned(),
                good: counts.good,
                uncertain: counts.uncertain,
                bad: counts.bad,
                fault: self.reloads.fault.clone(),
            },
            selected: self.selected_text(),
            faceplate: self.faceplate.as_ref().map(|faceplate| faceplate.model(&inputs)),
            measuring: self.measuring.as_ref().map(MeasurementChain::text),
            origin: self.shown_origin(),
        }
    }

    fn alarm_rows<'a>(&'a self, snapshot: Snapshot<'a>) -> AlarmListRows<'a> {
        AlarmListRows { alarm_service: self.alarms.as_ref(), scene: &self.scene, snapshot }
    }

    fn faceplate_inputs<'a>(
        &'a self,
        snapshot: Snapshot<'a>,
        rows: &'a panel_rows::TagListRows<'a>,
        states: &'a [NodeState],
    ) -> faceplate::FaceplateInputs<'a> {
        let scene = &self.scene;
        faceplate::FaceplateInputs {
            scene,
            snapshot,
            rows,
            alarms: self.alarm_rows(snapshot),
            overlays: &self.overlays,
            states,
            chart: self.chart.as_ref(),
            history: &self.history,
            origins: &self.origins,
            span: self.trend_span,
            now: Moment::now(),
            wall_clock: wall_clock(),
        }
    }

    /// Returns the panel rows of the configured models.
    fn model_rows(&self) -> impl Iterator<Item = &ModelRow> + Clone {
        self.models.iter().take(self.scene.model_count()).map(|model| &model.row)
    }

    /// Plugins with their links, and what went wrong with them last.
    pub(super) fn plugin_instances(
        &self,
    ) -> impl Iterator<Item = (&Plugin, Option<LinkReport>, Option<&str>)> {
        self.scene.instances.iter().map(|(name, plugin)| {
            let link = self.telemetry.iter().find(|t| t.name() == name);
            let overlay = self.overlays.iter().find(|o| o.overlay.name() == name);
            let fault = overlay.and_then(|overlay| overlay.fault.as_deref());
            (plugin, link.map(TelemetryInstance::link), fault)
        })
    }

    /// The overlays that judge equipment, hidden ones too.
    pub fn overlay_verdicts(&self) -> impl Iterator<Item = OverlayVerdicts<'_>> {
        let (scene, snapshot) = (&self.scene, self.tags.snapshot());
        self.overlays.iter().map(move |shown| OverlayVerdicts {
            name: shown.overlay.name(),
            equipment: &shown.description.equipment,
            verdicts: &shown.verdicts,
            scene,
            snapshot,
        })
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
                    assumed: of.is_assumed,
                    reason: of.reason.into_owned(),
                    was_abnormal: of.was_abnormal,
                });
            }
        }
        all
    }

    fn ids_of(&self, nodes: &BTreeSet<NodeIndex>) -> impl Iterator<Item = String> {
        nodes.iter().map(|node| self.scene.graph.node(*node).id())
    }

    fn selected_text(&self) -> Option<String> {
        let names: Vec<String> = self.ids_of(&self.selection).take(MAX_NAMES).collect();
        let more = if self.selection.len() > names.len() { ", \u{2026}" } else { "" };
        match self.selection.len() {
            0 => None,
            1 => names.into_iter().next(),
            count => Some(format!("{count} selected: {}{more}", names.join(", "))),
        }
    }

    fn camera_stats(&self) -> stats::CameraStats {
        let camera = self.navigator.camera();
        stats::CameraStats {
            eye: camera.eye().to_array(),
            direction: camera.forward().to_array(),
            mode: stats::mode_name(self.navigator.mode()),
            orthographic: self.navigator.is_orthographic(),
        }
    }

    fn surviving_vertices(&self) -> u64 {
        let mut vertices = 0;
        self.lod_cursors.for_each_drawn(|_, place, _| {
            let stacks = &self.scene.models[place.model].stacks[place.mesh];
            vertices += u64::from(stacks.surviving(place.cursor));
        });
        vertices
    }

    fn groups_as_one(&self) -> usize {
        let mut count = 0;
        self.lod_cursors.for_each_drawn(|drawn, _, _| {
            count += usize::from(matches!(drawn, DrawItem::Group(_)));
        });
        count
    }

    fn last_frame_millis(&self) -> f64 {
        self.frame_millis.back().copied().unwrap_or(0.0)
    }
}
