//! What `--stats` writes.

use std::collections::BTreeMap;

use busbar_alarms::Priority;
use busbar_plugin_host::{LinkReport, LinkState};
use busbar_plugin_process::Plugin;
use busbar_renderer::FrameStats;
use busbar_tags::{QualityCounts, Snapshot, TagSet, TagSpec, TagState, Value};
use busbar_ui::{CameraMode, Faceplate, RecordRow, RecordSection};
use serde::Serialize;

use crate::AlarmState;
use crate::alarms::AlarmService;
use crate::reload::ReloadCounters;

/// Milliseconds a stage of loading, in no order.
pub type LoadMillis = BTreeMap<String, f64>;

/// Numbers about the view.
#[derive(Clone, Debug, Serialize)]
pub struct Stats {
    /// Surviving vertices (welded positions), summed over instances.
    pub vertices: u64,
    /// Triangles drawn.
    pub triangles: u64,
    /// Triangles at full detail.
    pub triangles_full: u64,
    /// Theta by model; the greatest where its instances differ.
    pub theta: BTreeMap<String, f64>,
    /// Least and greatest theta of its instances by model.
    pub theta_span: BTreeMap<String, [f64; 2]>,
    /// Milliseconds from the last frame's beginning until it was handed to the device, or what
    /// is near of it, where that is drawn first; without waiting for it.
    pub cpu_ms: f64,
    /// Milliseconds from when what is near was drawn until the rest was handed to the device:
    /// for what is hidden, where the processor draws.
    pub hide_ms: f64,
    /// GPU milliseconds of the last frame it finished: `frame` in all, and by stage:
    /// `upload`, `scene`, `panels`. Empty on devices without timestamps.
    pub gpu_ms: BTreeMap<&'static str, f64>,
    /// Draws of the last frame, without those of the panels.
    pub draw_calls: u32,
    /// Commands that asked for them: what is alike is one, where the device can.
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
    /// One over the median frame time of the last frames.
    pub fps_median: f64,
    /// 99th percentile of the frame time of the last frames, milliseconds.
    pub frame_ms_p99: f64,
    /// Graphics device.
    pub gpu: String,
    /// Times that the device failed and was made anew.
    pub devices_replaced: u64,
    /// Frames left out because the device was not there or had no memory.
    pub frames_skipped: u64,
    /// Milliseconds a stage of loading.
    pub load_ms: LoadMillis,
    /// Meshes whose stacks were in the cache.
    pub cached_meshes: usize,
    /// Every plugin.
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
    /// Every tag.
    pub tags: Vec<TagStats>,
    /// Tags a quality.
    pub quality: QualityStats,
    /// Origins of what is shown that is not live: of any tag's value, and of plugins that
    /// say it of all their values. Empty where all is live.
    pub origin: Vec<&'static str>,
    /// Pauses of the process or the machine, after each of which values were held for stale.
    pub pauses: u64,
    /// What was picked: equipment id, or null; also null where several are selected.
    pub picked: Option<String>,
    /// Equipment ids of what is selected.
    pub selected: Vec<String>,
    /// Equipment id of what is under the pointer, or null.
    pub hovered: Option<String>,
    /// What the faceplate shows, or null.
    pub faceplate: Option<FaceplateStats>,
    /// Whether the theme is the dark one.
    pub dark: bool,
    /// Rows of the equipment that are listed: all that is open, or what a search found.
    pub equipment_rows: usize,
    /// Points that are measured between, world space in metres.
    pub measured: Vec<[f64; 3]>,
    /// Equipment ids of labels whose equipment is behind other equipment.
    pub hidden_labels: Vec<String>,
    /// The camera.
    pub camera: CameraStats,
    /// Messages of the Vulkan validation layer.
    pub validation_messages: Vec<String>,
    /// How the configuration was reloaded.
    pub reloads: ReloadStats,
}

/// What of a view is looked at all the time.
#[derive(Clone, Debug, Serialize)]
pub struct ViewHealth {
    /// Tags by quality.
    pub quality: QualityStats,
    /// How many alarms are in each state.
    pub alarms: Vec<(AlarmState, usize)>,
    /// Plugin instances.
    pub plugins: Vec<PluginStats>,
    /// How the configuration was reloaded.
    pub reloads: ReloadStats,
}

/// How a configuration was reloaded.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReloadStats {
    /// Configurations shown in place of the one before.
    pub good: u64,
    /// Those that were refused.
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
    /// Reports whether the verdict rests on a default, which the reason names.
    pub assumed: bool,
    /// Reason; empty for none.
    pub reason: String,
    /// Reports whether the piece is unknown now and was abnormal when it was last known.
    pub was_abnormal: bool,
}

/// A faceplate.
#[derive(Clone, Debug, Serialize)]
pub struct FaceplateStats {
    /// Equipment id.
    pub id: String,
    /// What people call it; may be empty.
    pub name: String,
    /// Ids of the tags whose values it shows.
    pub tags: Vec<String>,
    /// Ids of the tags whose trends it shows, and of how many points each is drawn.
    pub trends: BTreeMap<String, usize>,
    /// Ids of its alarms that are not normal.
    pub alarms: Vec<String>,
    /// What overlays show it in.
    pub states: Vec<String>,
    /// What business and management systems have of it.
    pub records: Vec<RecordStats>,
}

/// A list of a faceplate.
#[derive(Clone, Debug, Serialize)]
pub struct RecordStats {
    /// What it is called.
    pub title: String,
    /// Where it comes from.
    pub source: String,
    /// Why it may not be as the source has it now, or null.
    pub doubt: Option<String>,
    /// Rows that are left out.
    pub left_out: u64,
    /// How many rows are open.
    pub open: usize,
    /// What is shown of each row: part, severity, `open` or `closed`, when, and its cells.
    pub rows: Vec<Vec<String>>,
}

/// A chart that stands in the scene.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ChartStats {
    /// Records there are.
    pub records: usize,
    /// Records that are known at the instant shown and that brushes mean.
    pub meant: usize,
    /// Whether those are still being counted.
    pub is_counting: bool,
    /// Equipment whose last known record they mean.
    pub brushed: Vec<String>,
    /// The state of each piece of equipment by its last known record; null where that is
    /// too old to speak for it.
    pub states: BTreeMap<String, Option<String>>,
    /// The axes shown that are before the camera, from the left to the right.
    pub axes: Vec<ChartAxisStats>,
    /// The equipment that something is said of.
    pub explained: Option<String>,
    /// What is the matter with it.
    pub verdict: Option<String>,
    /// What each method says of it.
    pub evidence: Vec<ChartEvidence>,
    /// Why records may be out of date.
    pub fault: Option<String>,
}

/// An axis as the last frame had it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ChartAxisStats {
    /// Its name.
    pub name: String,
    /// Where its lower end is on the screen, points.
    pub foot: [f32; 2],
    /// Where its upper end is.
    pub head: [f32; 2],
    /// The values there.
    pub ends: [f32; 2],
    /// Whether it is logarithmic.
    pub log: bool,
}

/// What a method says of a piece of equipment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ChartEvidence {
    /// The method.
    pub method: String,
    /// Its result.
    pub result: String,
    /// Whether that agrees with the verdict; null where it says nothing.
    pub agrees: Option<bool>,
}

/// The camera.
#[derive(Clone, Debug, Serialize)]
pub struct CameraStats {
    /// Where it stands, metres.
    pub eye: [f32; 3],
    /// Where it looks, a unit vector.
    pub direction: [f32; 3],
    /// `orbit`, `walk` or `fly`.
    pub mode: &'static str,
    /// Whether it looks without perspective.
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
        let severity = row.severity.map_or("", |severity| severity.word());
        let state = if row.is_open { "open" } else { "closed" };
        let place = row.place.as_deref().unwrap_or_default();
        let head = [place, severity, state, &row.when].map(str::to_owned);
        head.into_iter().chain(row.cells.iter().map(|(_, text)| text.clone())).collect()
    };
    RecordStats {
        title: shown.title.clone(),
        source: shown.source.clone(),
        doubt: shown.doubt.clone(),
        left_out: shown.left_out.0,
        open: shown.open,
        rows: shown.rows.iter().map(row).collect(),
    }
}

/// One plugin.
#[derive(Clone, Debug, Serialize)]
pub struct PluginStats {
    /// Name in the configuration.
    pub name: String,
    /// Plugin id.
    pub plugin: String,
    /// `in process`, `running`, `starting`, `restarting`, `quarantined` or `ended`.
    pub state: &'static str,
    /// Its process, or null.
    pub pid: Option<u32>,
    /// Memory that its process has in RAM, or null.
    pub memory_bytes: Option<u64>,
    /// Times that its process ended or was killed.
    pub deaths: u64,
    /// How it ended last, or null.
    pub last_death: Option<String>,
    /// Samples that later ones of their tags overtook because too many waited.
    pub dropped: u64,
    /// Samples that named no tag of this plugin or made no sense.
    pub rejected: u64,
    /// What went wrong last, or null.
    pub fault: Option<String>,
    /// Its link to what it reads from, or null where it reads from nothing.
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

/// One tag.
#[derive(Clone, Debug, Serialize)]
pub struct TagStats {
    /// Id.
    pub id: String,
    /// Last value, or null.
    pub value: serde_json::Value,
    /// `good`, `uncertain` or `bad`.
    pub quality: &'static str,
    /// Why it is not good, or null.
    pub reason: Option<String>,
    /// Seconds since the value came, or null.
    pub age: Option<f64>,
    /// Origins of the value; empty where it is live.
    pub origin: Vec<&'static str>,
}

/// One alarm.
#[derive(Clone, Debug, Serialize)]
pub struct AlarmStats {
    /// Id.
    pub id: String,
    /// Its state by the letter of IEC 62682.
    pub state: AlarmState,
    /// `critical`, `high`, `medium` or `low`.
    pub priority: &'static str,
    /// Whether its tag is good.
    pub certain: bool,
    /// Occurrences since the start.
    pub occurrences: u64,
    /// The plugin whose source decides on it; none where that is done here.
    pub source: Option<String>,
    /// Why nobody knows whether it holds still, where its source says so or is lost.
    pub doubt: Option<String>,
}

/// Tags a quality.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct QualityStats {
    /// Good ones.
    pub good: usize,
    /// Uncertain ones.
    pub uncertain: usize,
    /// Bad ones.
    pub bad: usize,
}

impl From<QualityCounts> for QualityStats {
    fn from(counts: QualityCounts) -> Self {
        Self { good: counts.good, uncertain: counts.uncertain, bad: counts.bad }
    }
}

/// What the GPU took, by stage.
pub(crate) fn gpu_millis(frame: &FrameStats) -> BTreeMap<&'static str, f64> {
    let whole = frame.gpu_millis.map(|millis| ("frame", millis));
    whole.into_iter().chain(frame.gpu_stages.iter()).collect()
}

/// The alarms that are not normal.
pub(crate) fn alarms(alarm_service: &AlarmService) -> Vec<AlarmStats> {
    let table = alarm_service.table();
    let of = |alarm| {
        let (spec, status) = (table.set().spec(alarm)?, table.status(alarm)?);
        Some(AlarmStats {
            id: spec.id.clone(),
            state: status.state,
            priority: spec.priority.name(),
            certain: status.is_certain,
            occurrences: status.occurrences,
            source: None,
            doubt: None,
        })
    };
    table.open().filter_map(of).chain(alarm_service.external_stats()).collect()
}

/// Id of the alarm that was chosen.
pub(crate) fn selected_alarm(alarm_service: &AlarmService) -> Option<String> {
    alarm_service.id_of(alarm_service.selected()?)
}

/// One plugin with its link and its last fault.
pub(crate) fn alarms_by_state(alarms: &AlarmService) -> Vec<(AlarmState, usize)> {
    let table = alarms.table();
    let count = |state| -> usize {
        Priority::ALL.into_iter().map(|priority| table.counts(priority).count(state)).sum()
    };
    let sourced = |state| alarms.external_stats().filter(|alarm| alarm.state == state).count();
    AlarmState::ALL.into_iter().map(|state| (state, count(state) + sourced(state))).collect()
}

pub(crate) fn reloads(reloads: &ReloadCounters) -> ReloadStats {
    let ReloadCounters { good, bad, last, ref fault } = *reloads;
    let last_ms = last.map(|last| last.as_secs_f64() * 1e3);
    ReloadStats { good, bad, last_ms, fault: fault.clone() }
}

pub(crate) fn plugin(
    plugin: &Plugin,
    link: Option<LinkReport>,
    fault: Option<&str>,
) -> PluginStats {
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

pub(crate) fn link(report: LinkReport) -> LinkStats {
    LinkStats {
        state: match report.state {
            LinkState::Idle => "idle",
            LinkState::Connecting => "connecting",
            LinkState::Up => "up",
            LinkState::Down => "down",
        },
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

/// All tags of a snapshot.
pub(crate) fn tags(tags: &TagSet, snapshot: Snapshot<'_>) -> Vec<TagStats> {
    tags.specs().iter().zip(snapshot.states()).map(|(spec, state)| tag(spec, &state)).collect()
}

fn tag(spec: &TagSpec, state: &TagState) -> TagStats {
    TagStats {
        id: spec.id.clone(),
        value: match state.value {
            None => serde_json::Value::Null,
            Some(Value::F64(value)) => value.into(),
            Some(Value::I64(value)) => value.into(),
            Some(Value::Bool(value)) => value.into(),
            Some(Value::DoublePoint(value)) => value.to_string().into(),
        },
        quality: state.quality.name(),
        reason: state.quality.reason().map(|reason| reason.to_string()),
        age: state.age.map(|age| age.as_secs_f64()),
        origin: state.origin.names().collect(),
    }
}
