//! Statistics of the view, as `--stats` writes them.

use std::collections::BTreeMap;

use busbar_plugin_host::LinkReport;
use busbar_renderer::FrameStats;
use busbar_scene_loader::LoadMillis;
use busbar_scene_overlays::ChartStats;
use busbar_site::{AlarmService, PluginHealth};
use busbar_tags::{QualityCounts, Snapshot, TagSet, TagSpec, TagState};
use busbar_types::{Priority, Value};
use busbar_ui::{CameraMode, Faceplate, RecordRow, RecordSection};
use serde::Serialize;

use crate::AlarmState;
use crate::reload::ReloadCounters;

/// Numbers about the view.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// Surviving vertices (welded positions), summed over instances.
    pub vertices: u64,
    /// Number of triangles drawn.
    pub triangles: u64,
    /// Triangles at full detail.
    pub triangles_full: u64,
    /// Theta by model; the greatest where its instances differ.
    pub theta: BTreeMap<String, f64>,
    /// Least and greatest theta of its instances by model.
    pub theta_span: BTreeMap<String, [f64; 2]>,
    /// Milliseconds from the last frame's beginning until its submission. With two-pass
    /// occlusion it ends at the submission of the first pass.
    pub cpu_ms: f64,
    /// Milliseconds from the first pass of two-pass occlusion until the submission of the second,
    /// on software rasterizers.
    pub hide_ms: f64,
    /// GPU milliseconds of the last frame it finished: `frame` in all, and by stage:
    /// `upload`, `scene`, `panels`. Empty on devices without timestamps.
    pub gpu_ms: BTreeMap<&'static str, f64>,
    /// Draws of the last frame, without those of the panels.
    pub draw_calls: u32,
    /// Number of draw commands; identical draws share one where the device supports it.
    pub draw_commands: u32,
    /// CPU milliseconds that the last frame spent on meshes at new cursors.
    pub resolve_ms: f64,
    /// Meshes that came onto the device at new cursors so far.
    pub resolved: u64,
    /// Instances that wait for their mesh at another cursor.
    pub waiting: usize,
    /// Groups far away that the last frame drew as one mesh.
    pub groups_as_one: usize,
    /// Bytes of index buffers on the device.
    pub index_cache_bytes: u64,
    /// Frames drawn so far.
    pub frames: u64,
    /// Frame rate, from the median time of the last frames.
    pub fps_median: f64,
    /// 99th percentile of the frame time of the last frames, milliseconds.
    pub frame_ms_p99: f64,
    /// Name of the graphics device.
    pub gpu: String,
    /// Times that the device failed and was made anew.
    pub devices_replaced: u64,
    /// Frames left out because the device was not there or had no memory.
    pub frames_skipped: u64,
    /// Milliseconds a stage of loading.
    pub load_ms: LoadMillis,
    /// Meshes whose stacks were in the cache.
    pub cached_meshes: usize,
    /// Statistics of every plugin instance.
    pub plugins: Vec<PluginStats>,
    /// Verdicts of the overlays on the equipment that they describe, hidden overlays
    /// included.
    pub verdicts: Vec<VerdictStats>,
    /// Time that the overlays calculate by, seconds since 1970-01-01 UTC, where that is not
    /// the wall clock's: a recording's.
    pub scene_time: Option<f64>,
    /// Changes of single points and double-points since the start.
    pub events: u64,
    /// The alarms that are not normal.
    pub alarms: Vec<AlarmStats>,
    /// Id of the alarm that was chosen.
    pub selected_alarm: Option<String>,
    /// The chart that stands in the scene.
    pub chart: Option<ChartStats>,
    /// State of every tag.
    pub tags: Vec<TagStats>,
    /// Number of tags by quality.
    pub quality: QualityStats,
    /// Origins other than live of tag values, and of plugins that declare them for all their
    /// values. Empty while all is live.
    pub origin: Vec<&'static str>,
    /// Pauses of the process or the machine, after each of which values were held for stale.
    pub pauses: u64,
    /// Equipment id of the selection; null unless exactly one piece is selected.
    pub picked: Option<String>,
    /// Equipment ids of the selection.
    pub selected: Vec<String>,
    /// Equipment id under the pointer, or null.
    pub hovered: Option<String>,
    /// Content of the faceplate; null while it is closed.
    pub faceplate: Option<FaceplateStats>,
    /// True while the dark theme is active.
    pub dark: bool,
    /// Rows of the equipment that are listed: all that is open, or what a search found.
    pub equipment_rows: usize,
    /// Points that are measured between, world space in metres.
    pub measured: Vec<[f64; 3]>,
    /// Equipment ids of labels whose equipment is behind other equipment.
    pub hidden_labels: Vec<String>,
    /// Position and mode of the camera.
    pub camera: CameraStats,
    /// Messages of the Vulkan validation layer.
    pub validation_messages: Vec<String>,
    /// Counters of configuration reloads.
    pub reloads: ReloadStats,
}

/// Health of a view for continuous monitoring.
#[derive(Clone, Debug, Serialize)]
pub struct ViewHealth {
    /// Number of tags by quality.
    pub quality: QualityStats,
    /// Number of alarms in each state.
    pub alarms: Vec<(AlarmState, usize)>,
    /// Statistics of the plugin instances.
    pub plugins: Vec<PluginStats>,
    /// Counters of configuration reloads.
    pub reloads: ReloadStats,
}

/// Statistics of configuration reloads.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReloadStats {
    /// Configurations shown in place of the one before.
    pub good: u64,
    /// Configurations that were refused.
    pub bad: u64,
    /// Milliseconds from the settling of the file to the frame that showed the last good one.
    pub last_ms: Option<f64>,
    /// The faults of the file as it is, if it has any.
    pub fault: Option<String>,
}

/// Verdict of an overlay on a piece of equipment.
#[derive(Clone, Debug, Serialize)]
pub struct VerdictStats {
    /// Name of the overlay's plugin instance.
    pub overlay: String,
    /// Equipment id, as the overlay describes it.
    pub equipment: String,
    /// The verdict: `normal`, `abnormal` or `unknown`.
    pub verdict: &'static str,
    /// Severity of an abnormal verdict: `warning`, `alarm`, or `perhaps_alarm` where the inputs
    /// do not decide; null of any other.
    pub severity: Option<&'static str>,
    /// Reports whether the verdict rests on a default, which the reason names.
    pub assumed: bool,
    /// Reason; empty for none.
    pub reason: String,
    /// Reports whether the piece is unknown now and was abnormal when it was last known.
    pub was_abnormal: bool,
    /// Origins of the values that it rests on, such as `simulated`; empty for live ones.
    pub origin: Vec<&'static str>,
}

/// Content of a faceplate.
#[derive(Clone, Debug, Serialize)]
pub struct FaceplateStats {
    /// Equipment id of the faceplate.
    pub id: String,
    /// Descriptive name; may be empty.
    pub name: String,
    /// Ids of the tags whose values it shows.
    pub tags: Vec<String>,
    /// Ids of the tags whose trends it shows, and of how many points each is drawn.
    pub trends: BTreeMap<String, usize>,
    /// Ids of its alarms that are not normal.
    pub alarms: Vec<String>,
    /// Names of the states that overlays show.
    pub states: Vec<String>,
    /// Records of business and asset management systems.
    pub records: Vec<RecordStats>,
}

/// A list of a faceplate.
#[derive(Clone, Debug, Serialize)]
pub struct RecordStats {
    /// Title of the list.
    pub title: String,
    /// Name of the source system.
    pub source: String,
    /// Reason why the list may be outdated, or null.
    #[serde(rename = "doubt")]
    pub uncertainty: Option<String>,
    /// Rows that are left out.
    pub left_out: u64,
    /// Number of open rows.
    pub open: usize,
    /// Displayed texts of each row: part, severity, `open` or `closed`, date, and the cells.
    pub rows: Vec<Vec<String>>,
}

/// Statistics of the camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraStats {
    /// Position of the eye, metres.
    pub eye: [f64; 3],
    /// Viewing direction, a unit vector.
    pub direction: [f32; 3],
    /// `orbit`, `walk` or `fly`.
    pub mode: &'static str,
    /// True for orthographic projection.
    pub orthographic: bool,
}

pub(crate) fn mode_name(mode: CameraMode) -> &'static str {
    match mode {
        CameraMode::Orbit => "orbit",
        CameraMode::Walk => "walk",
        CameraMode::Fly => "fly",
    }
}

pub(crate) fn faceplate(shown: &Faceplate) -> FaceplateStats {
    let id_of =
        |tag: u32| shown.values.iter().find(|value| value.tag == tag).map(|v| v.row.id.clone());
    FaceplateStats {
        id: shown.id.clone(),
        name: shown.name.clone(),
        tags: shown.values.iter().map(|value| value.row.id.clone()).collect(),
        trends: shown
            .trends
            .iter()
            .filter_map(|trend| Some((id_of(trend.tag)?, trend.points.len())))
            .collect(),
        alarms: shown.alarms.iter().map(|alarm| alarm.id.clone()).collect(),
        states: shown.states.iter().map(|state| state.state.name.clone()).collect(),
        records: shown.records.iter().map(records).collect(),
    }
}

fn records(shown: &RecordSection) -> RecordStats {
    let row = |row: &RecordRow| {
        let severity = row.severity.map_or("", |severity| severity.name());
        let state = if row.is_open { "open" } else { "closed" };
        let place = row.place.as_deref().unwrap_or_default();
        let head = [place, severity, state, &row.when].map(str::to_owned);
        head.into_iter().chain(row.cells.iter().map(|(_, text)| text.clone())).collect()
    };
    RecordStats {
        title: shown.title.clone(),
        source: shown.source.clone(),
        uncertainty: shown.uncertainty.clone(),
        left_out: shown.left_out.0,
        open: shown.open,
        rows: shown.rows.iter().map(row).collect(),
    }
}

/// Statistics of a plugin instance.
#[derive(Clone, Debug, Serialize)]
pub struct PluginStats {
    /// Name in the configuration.
    pub name: String,
    /// Id of the plugin.
    pub plugin: String,
    /// `in process`, `running`, `starting`, `restarting`, `quarantined` or `ended`.
    pub state: &'static str,
    /// Process id, or null in process.
    pub pid: Option<u32>,
    /// Memory that its process has in RAM, or null.
    pub memory_bytes: Option<u64>,
    /// Times that its process ended or was killed.
    pub deaths: u64,
    /// Reason of the last death, or null.
    pub last_death: Option<String>,
    /// Samples that later ones of their tags overtook because too many waited.
    pub dropped: u64,
    /// Samples that named no tag of this plugin or made no sense.
    pub rejected: u64,
    /// Last fault, or null.
    pub fault: Option<String>,
    /// Link to the data source, or null without one.
    pub link: Option<LinkStats>,
}

/// Link of a telemetry plugin.
#[derive(Clone, Debug, Serialize)]
pub struct LinkStats {
    /// `idle`, `connecting`, `up` or `down`.
    pub state: &'static str,
    /// Sentence of the plugin for operators.
    pub message: String,
    /// Seconds since the last sample, or null before the first.
    pub silent_seconds: Option<f64>,
    /// Origins that all its samples have; empty where they are live.
    pub origin: Vec<&'static str>,
    /// Steady difference of the source's clock from this machine's, seconds, positive where
    /// the source is ahead; null where there is none.
    pub clock_skew_seconds: Option<f64>,
    /// Steps back of the source's clock.
    pub clock_steps: u64,
    /// Samples whose time was in the future.
    pub future_times: u64,
    /// Samples whose promised time was missing or unreadable.
    pub unusable_times: u64,
    /// `source time` or `reception`: from where the age of values is counted.
    pub freshness_by: String,
    /// Sentences about the source's clock, with remedies.
    pub clock_remarks: Vec<String>,
}

/// State of a tag.
#[derive(Clone, Debug, Serialize)]
pub struct TagStats {
    /// Id of the tag.
    pub id: String,
    /// Last value, or null.
    pub value: serde_json::Value,
    /// `good`, `uncertain` or `bad`.
    pub quality: &'static str,
    /// Reason of the quality, or null if good.
    pub reason: Option<String>,
    /// Seconds since the value came, or null.
    pub age: Option<f64>,
    /// Origins of the value; empty where it is live.
    pub origin: Vec<&'static str>,
}

/// State of an alarm.
#[derive(Clone, Debug, Serialize)]
pub struct AlarmStats {
    /// Id of the alarm.
    pub id: String,
    /// State by the letter of IEC 62682.
    pub state: AlarmState,
    /// `critical`, `high`, `medium` or `low`.
    pub priority: &'static str,
    /// True while the alarm's tag is good, or its verdict known.
    pub certain: bool,
    /// Occurrences since the start.
    pub occurrences: u64,
    /// Origins of the value or verdict on which the alarm rests, and of its tag now; empty where
    /// all are live.
    pub origin: Vec<&'static str>,
    /// The plugin whose source decides on it; none where that is done here.
    pub source: Option<String>,
    /// Plugin instance of the overlay whose verdict it follows.
    pub overlay: Option<String>,
    /// True where that verdict rests on a default, which the reason names.
    pub assumed: bool,
    /// Reason of the verdict by which the alarm came or went last.
    pub reason: Option<String>,
    /// Reason why the alarm's state is uncertain: its source reports so or is lost, or its verdict
    /// is unknown.
    #[serde(rename = "doubt")]
    pub uncertainty: Option<String>,
}

/// Number of tags by quality.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct QualityStats {
    /// Tags of good quality.
    pub good: usize,
    /// Tags of uncertain quality.
    pub uncertain: usize,
    /// Tags of bad quality.
    pub bad: usize,
}

impl From<QualityCounts> for QualityStats {
    fn from(counts: QualityCounts) -> Self {
        Self { good: counts.good, uncertain: counts.uncertain, bad: counts.bad }
    }
}

/// Returns the GPU time of the frame and its stages, milliseconds.
pub(crate) fn gpu_millis(frame: &FrameStats) -> BTreeMap<&'static str, f64> {
    let whole = frame.gpu_millis.map(|millis| ("frame", millis));
    whole.into_iter().chain(frame.gpu_stages.iter()).collect()
}

/// Counts the alarms in each state.
pub(crate) fn alarms_by_state(alarms: &AlarmService) -> Vec<(AlarmState, usize)> {
    let table = alarms.table();
    let count = |state| -> usize {
        Priority::ALL.into_iter().map(|priority| table.counts(priority).count(state)).sum()
    };
    let external = |state| {
        let states = alarms.sources().iter().map(|(_, alarm)| alarm.alarm.standing().state());
        states.filter(|of_alarm| *of_alarm == state).count()
    };
    AlarmState::ALL.into_iter().map(|state| (state, count(state) + external(state))).collect()
}

pub(crate) fn reloads(reloads: &ReloadCounters) -> ReloadStats {
    let ReloadCounters { good, bad, last, ref fault } = *reloads;
    let last_ms = last.map(|last| last.as_secs_f64() * 1e3);
    ReloadStats { good, bad, last_ms, fault: fault.clone() }
}

pub(crate) fn plugin(health: PluginHealth<'_>) -> PluginStats {
    let PluginHealth { plugin, link, fault } = health;
    let status = plugin.status();
    let lost = link.as_ref().map_or((0, 0), |link| (link.dropped, link.rejected));
    PluginStats {
        name: plugin.name().to_owned(),
        plugin: plugin.info().id.clone(),
        state: status.state.name(),
        pid: status.pid,
        memory_bytes: status.memory_bytes,
        deaths: status.deaths,
        last_death: status.last_death,
        dropped: lost.0,
        rejected: lost.1,
        fault: fault.map(str::to_owned),
        link: link.map(self::link),
    }
}

fn link(report: LinkReport) -> LinkStats {
    LinkStats {
        state: report.state.name(),
        silent_seconds: report.silent_for.map(|silence| silence.as_secs_f64()),
        origin: report.origin.names().collect(),
        clock_skew_seconds: report.clock.skew_nanos.map(|nanos| nanos as f64 / 1e9),
        clock_steps: report.clock.steps,
        future_times: report.clock.future_times,
        unusable_times: report.clock.unusable_times,
        freshness_by: report.clock.basis.to_string(),
        clock_remarks: report.clock.remarks(),
        message: report.message,
    }
}

/// Returns the state of all tags in a snapshot.
pub(crate) fn tags(tags: &TagSet, snapshot: Snapshot<'_>) -> Vec<TagStats> {
    tags.specs().iter().zip(snapshot.states()).map(|(spec, state)| tag(spec, &state)).collect()
}

fn tag(spec: &TagSpec, state: &TagState) -> TagStats {
    TagStats {
        id: spec.id.clone(),
        value: match &state.value {
            None => serde_json::Value::Null,
            Some(Value::F64(value)) => (*value).into(),
            Some(Value::I64(value)) => (*value).into(),
            Some(Value::Bool(value)) => (*value).into(),
            Some(Value::DoublePoint(value)) => value.to_string().into(),
            Some(Value::Text(value)) => value.as_str().into(),
        },
        quality: state.quality.name(),
        reason: state.quality.reason().map(|reason| reason.to_string()),
        age: state.age.map(|age| age.as_secs_f64()),
        origin: state.origin.names().collect(),
    }
}
