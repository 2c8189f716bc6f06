//! Alarms: as typed, and as used.

use std::time::Duration;

use busbar_types::{DoublePoint, Limit, MAX_TEXT_BYTES, Priority, Text, Value, ValueKind};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::Deserialize;

use crate::alarm_sources::{AlarmSourceConfig, RawAlarmSource};
use crate::limits::*;

/// On-delay of a condition on bad quality, seconds: at the start no tag has a value yet.
const QUALITY_DELAY_SECONDS: f64 = 5.0;

/// Alarm of a tag or of an overlay's verdict, or a mirrored one.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Alarm")]
pub(crate) struct RawAlarm {
    /// Tag that it rests on; an alarm has a tag or a verdict unless it is mirrored.
    #[serde(default)]
    #[schemars(extend("examples" = ["T1.TopOil"]))]
    pub(crate) tag: Option<String>,
    /// Condition on the tag's value, of one kind.
    #[serde(default)]
    #[schemars(with = "RawCondition", extend("examples" = [{"high": 95, "deadband": 2}]))]
    pub(crate) condition: Option<RawCondition>,
    /// Verdict of an overlay that it rests on instead of a tag.
    #[serde(default)]
    #[schemars(with = "RawVerdict", extend("examples" = [{"instance": "thermography"}]))]
    pub(crate) verdict: Option<RawVerdict>,
    /// Seconds for which the condition must hold without interruption; where missing 5 for
    /// `bad_quality`, else 0. A verdict that becomes unknown does not interrupt it.
    #[serde(default)]
    #[schemars(with = "f64", range(min = 0.0, max = MAX_ALARM_DELAY_SECONDS), extend("examples" = [5]))]
    on_delay_seconds: Option<f64>,
    /// Seconds for which the condition must be over before the alarm has returned to normal.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = MAX_ALARM_DELAY_SECONDS), extend("examples" = [10]))]
    off_delay_seconds: f64,
    /// Priority, by how soon somebody must act.
    #[serde(default)]
    #[schemars(extend("examples" = ["high"]))]
    priority: Priority,
    /// Latches the alarm: once it occurred, it stays until an operator resets it.
    #[serde(default)]
    latched: bool,
    /// Message about the event, for people.
    #[schemars(length(min = 1, max = MAX_ALARM_TEXT), extend("examples" = ["Top oil hot"]))]
    message: String,
    /// Consequence of inaction, for people.
    #[serde(default)]
    #[schemars(length(max = MAX_ALARM_TEXT), extend("examples" = ["Insulation ages faster"]))]
    consequence: String,
    /// Corrective action of the operator.
    #[serde(default)]
    #[schemars(length(max = MAX_ALARM_TEXT), extend("examples" = ["Start the second fan stage"]))]
    response: String,
    /// Equipment id, as in a binding; where missing, the first equipment that the tag is bound
    /// to. That of a verdict stands in `verdict`.
    #[serde(default)]
    #[schemars(extend("examples" = ["=S12D1T1-TA1/tank"]))]
    pub(crate) equipment: Option<String>,
    /// Alarms of one group tell which of them came first.
    #[serde(default)]
    #[schemars(length(min = 1, max = MAX_NAME_BYTES), extend("examples" = ["T1 trip"]))]
    group: Option<String>,
    /// Condition that suppresses the alarm by design.
    #[serde(default)]
    #[schemars(with = "RawSuppression")]
    pub(crate) suppressed_by: Option<RawSuppression>,
    /// Takes the states from the host's alarm system; nothing is decided here.
    #[serde(default)]
    mirrored: bool,
}

/// Condition on a tag's value: one limit, or `equals`, `differs` or `bad_quality`.
#[derive(Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Condition")]
pub(crate) struct RawCondition {
    /// Far above: a number greater than this.
    #[schemars(with = "f64", extend("examples" = [105]))]
    high_high: Option<f64>,
    /// Above: a number greater than this.
    #[schemars(with = "f64", extend("examples" = [95]))]
    high: Option<f64>,
    /// Below: a number less than this.
    #[schemars(with = "f64", extend("examples" = [20]))]
    low: Option<f64>,
    /// Far below: a number less than this.
    #[schemars(with = "f64", extend("examples" = [10]))]
    low_low: Option<f64>,
    /// Deadband before a number counts as back within its limit, in the tag's unit.
    #[schemars(range(min = 0.0), extend("examples" = [2]))]
    deadband: f64,
    /// A value of the tag: true or false, a whole number, a position (`intermediate`, `off`, `on`,
    /// `bad_state`), or a text.
    #[schemars(with = "RawState")]
    equals: Option<RawState>,
    /// Any value but this one.
    #[schemars(with = "RawState")]
    differs: Option<RawState>,
    /// Bad quality of the tag, by its source or by staleness.
    #[schemars(extend("examples" = [true]))]
    bad_quality: bool,
}

/// Abnormal verdict of an overlay that raises an alarm. The alarm returns to normal once the
/// equipment is judged normal: never because the verdict became unknown, or its overlay is late,
/// hidden or gone.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Verdict")]
pub(crate) struct RawVerdict {
    /// Name of the overlay's plugin instance, one of `overlays`.
    #[schemars(extend("examples" = ["thermography"]))]
    instance: String,
    /// Equipment id that the overlay judges; where missing, each piece that it judges has an
    /// alarm of its own, whose id is this alarm's, a colon and the equipment's.
    #[serde(default)]
    #[schemars(with = "String", extend("examples" = ["=S12D1Q3-QB9"]))]
    equipment: Option<String>,
    /// Least severity of an abnormal verdict that raises the alarm.
    #[serde(default)]
    #[schemars(extend("examples" = ["alarm"]))]
    severity: VerdictSeverityConfig,
}

/// Severity of an abnormal verdict.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "VerdictSeverity")]
pub enum VerdictSeverityConfig {
    /// Attention is needed: any abnormal verdict.
    #[default]
    Warning,
    /// Action is needed now.
    Alarm,
}

/// Condition that suppresses an alarm by design.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Suppression")]
pub(crate) struct RawSuppression {
    /// Id of the tag.
    #[schemars(extend("examples" = ["Q1.Position"]))]
    tag: String,
    /// Condition on its value.
    #[schemars(extend("examples" = [{"equals": "off"}]))]
    condition: RawCondition,
}

/// A state of a tag as typed.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(crate) enum RawState {
    Bool(bool),
    Integer(i64),
    /// Position of a switch, or a text, by the type of the tag.
    Word(String),
}

/// Settings of all alarms.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "AlarmHandling")]
pub(crate) struct RawAlarmHandling {
    /// Folder of the audit log, relative to this file or absolute; where missing nothing
    /// is kept, and what operators do is forgotten when the window closes.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["alarm_log"]))]
    log_directory: Option<String>,
    /// File with the key of the log's hash chain, 16 to 4096 bytes, relative to this file or
    /// absolute; outside the log's folder, where who writes the log cannot read it. Without
    /// one, `busbar log verify` finds accidents, and no forgery.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["/etc/busbar/log.key"]))]
    log_key_file: Option<String>,
    /// File that number and chain value of the newest record are kept in, relative to this file
    /// or absolute; outside the log's folder. Without one, the loss of the newest lines is not
    /// found.
    #[schemars(length(min = 1, max = MAX_PATH_BYTES), extend("examples" = ["/var/lib/busbar/log.anchor"]))]
    log_anchor_file: Option<String>,
    /// Size at which the log begins a new file, in 10^6 bytes.
    #[schemars(range(min = 1, max = MAX_LOG_MEGABYTES), extend("examples" = [8]))]
    log_megabytes: u32,
    /// Full files of the log that are kept, the newest included; files that ended early for a
    /// fault do not count.
    #[schemars(range(min = 1, max = MAX_LOG_FILES), extend("examples" = [20]))]
    log_files: u32,
    /// The longest that an operator may shelve an alarm, in seconds.
    #[schemars(range(min = 60.0, max = MAX_SHELVING_SECONDS), extend("examples" = [28_800]))]
    #[schemars(extend("x-busbar-formerly" = ["max_shelving_minutes"]))]
    max_shelving_seconds: f64,
}

/// Condition on a tag's value that fits the tag's type.
#[derive(Clone, Debug, PartialEq)]
pub enum ConditionConfig {
    /// A number beyond a limit.
    Limit {
        /// Kind of the limit.
        limit: Limit,
        /// Limit value, in the tag's unit.
        at: f64,
        /// Deadband before the condition clears; not negative.
        deadband: f64,
    },
    /// State, count or text equal to this one.
    Equals(Value),
    /// State, count or text different from this one.
    Differs(Value),
    /// Bad quality of the tag.
    BadQuality,
}

/// A condition of a tag.
#[derive(Clone, Debug, PartialEq)]
pub struct TagConditionConfig {
    /// Id of the tag.
    pub tag: String,
    /// Condition on its value.
    pub condition: ConditionConfig,
}

/// Origin of an alarm's states.
#[derive(Clone, Debug, PartialEq)]
pub enum AlarmOriginConfig {
    /// States follow a tag.
    Tag {
        /// Condition that raises the alarm.
        trigger: TagConditionConfig,
        /// Time for which the condition must hold, seconds.
        on_delay_seconds: f64,
        /// Time for which the condition must be over, seconds.
        off_delay_seconds: f64,
        /// Condition that suppresses the alarm by design.
        suppressed_by: Option<TagConditionConfig>,
    },
    /// States follow an overlay's verdict on the alarm's equipment; without one, on each piece of
    /// equipment that the overlay judges.
    Verdict {
        /// Plugin instance of the overlay.
        overlay: String,
        /// Least severity of an abnormal verdict that raises the alarm.
        severity: VerdictSeverityConfig,
        /// Time from the first abnormal verdict on, seconds.
        on_delay_seconds: f64,
        /// Time for which the equipment must be judged normal, seconds.
        off_delay_seconds: f64,
        /// Condition that suppresses the alarm by design.
        suppressed_by: Option<TagConditionConfig>,
    },
    /// States come from the host.
    Mirrored,
}

/// Alarm of the configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct AlarmConfig {
    /// Message about the event, for people.
    pub message: String,
    /// Consequence of inaction, for people.
    pub consequence: String,
    /// Corrective action of the operator.
    pub response: String,
    /// Equipment id; whether a part of a model exists is not checked here.
    pub equipment: Option<String>,
    /// Priority of the alarm.
    pub priority: Priority,
    /// True where the alarm stays until an operator resets it.
    pub latched: bool,
    /// Alarms of one group tell which of them came first.
    pub group: Option<String>,
    /// Origin of its states.
    pub origin: AlarmOriginConfig,
    /// JSON pointer of the alarm.
    pub pointer: String,
}

/// Settings of all alarms.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlarmHandlingConfig {
    /// Folder of the audit log as written; none for no log.
    pub log_directory: Option<String>,
    /// File with the key of its hash chain, as written.
    pub log_key_file: Option<String>,
    /// File of its anchor, as written.
    pub log_anchor_file: Option<String>,
    /// Size at which the log begins a new file, in 10^6 bytes.
    pub log_megabytes: u32,
    /// Files that are kept.
    pub log_files: u32,
    /// The longest that an alarm is shelved.
    pub max_shelving: Duration,
    /// Plugins with the alarms of other systems.
    pub sources: Vec<AlarmSourceConfig>,
    /// JSON pointer; of an object that may be absent.
    pub pointer: String,
}

/// One schema for all forms: `anyOf` would blur where a fault is.
impl JsonSchema for RawState {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "State".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": ["boolean", "integer", "string"],
            "maxLength": MAX_TEXT_BYTES,
            "examples": [true, 3, "off", "MANUAL"]
        })
    }
}

impl Default for RawAlarmHandling {
    fn default() -> Self {
        Self {
            log_directory: None,
            log_key_file: None,
            log_anchor_file: None,
            log_megabytes: 8,
            log_files: 20,
            max_shelving_seconds: 28_800.0,
        }
    }
}

impl RawAlarmHandling {
    pub(crate) fn resolve(self, sources: Vec<RawAlarmSource>) -> AlarmHandlingConfig {
        AlarmHandlingConfig {
            log_directory: self.log_directory,
            log_key_file: self.log_key_file,
            log_anchor_file: self.log_anchor_file,
            log_megabytes: self.log_megabytes,
            log_files: self.log_files,
            max_shelving: Duration::from_secs_f64(self.max_shelving_seconds),
            sources: (0..).zip(sources).map(RawAlarmSource::resolve).collect(),
            pointer: "/alarm_handling".to_owned(),
        }
    }
}

impl RawAlarm {
    /// Resolves the alarm; `kind` is the type of a tag.
    pub(crate) fn resolve(
        self,
        pointer: String,
        kind: impl Fn(&str) -> Option<ValueKind>,
    ) -> AlarmConfig {
        AlarmConfig {
            origin: self.origin(kind),
            equipment: match self.verdict {
                Some(verdict) => verdict.equipment,
                None => self.equipment,
            },
            message: self.message,
            consequence: self.consequence,
            response: self.response,
            priority: self.priority,
            latched: self.latched,
            group: self.group,
            pointer,
        }
    }

    /// The rules ensure that there are tag and condition, or a verdict, unless it is mirrored.
    fn origin(&self, kind: impl Fn(&str) -> Option<ValueKind>) -> AlarmOriginConfig {
        let suppressed_by = self.suppressed_by.as_ref().map(|by| TagConditionConfig {
            tag: by.tag.clone(),
            condition: by.condition.resolve(kind(&by.tag)),
        });
        if let (false, Some(verdict)) = (self.mirrored, &self.verdict) {
            return AlarmOriginConfig::Verdict {
                overlay: verdict.instance.clone(),
                severity: verdict.severity,
                on_delay_seconds: self.on_delay_seconds.unwrap_or_default(),
                off_delay_seconds: self.off_delay_seconds,
                suppressed_by,
            };
        }
        let (false, Some(tag), Some(condition)) = (self.mirrored, &self.tag, &self.condition)
        else {
            return AlarmOriginConfig::Mirrored;
        };
        let condition = condition.resolve(kind(tag));
        let trigger = TagConditionConfig { tag: tag.clone(), condition };
        let usual = match trigger.condition {
            ConditionConfig::BadQuality => QUALITY_DELAY_SECONDS,
            _ => 0.0,
        };
        AlarmOriginConfig::Tag {
            trigger,
            on_delay_seconds: self.on_delay_seconds.unwrap_or(usual),
            off_delay_seconds: self.off_delay_seconds,
            suppressed_by,
        }
    }
}

impl RawCondition {
    /// The rules ensure that it is of one kind.
    fn resolve(&self, kind: Option<ValueKind>) -> ConditionConfig {
        let limits = [
            (Limit::HighHigh, self.high_high),
            (Limit::High, self.high),
            (Limit::Low, self.low),
            (Limit::LowLow, self.low_low),
        ];
        let limit = limits.into_iter().find_map(|(limit, at)| Some((limit, at?)));
        match (limit, &self.equals, &self.differs) {
            (Some((limit, at)), ..) => {
                ConditionConfig::Limit { limit, at, deadband: self.deadband }
            }
            (None, Some(state), _) => ConditionConfig::Equals(state.resolve(kind)),
            (None, None, Some(state)) => ConditionConfig::Differs(state.resolve(kind)),
            (None, None, None) => ConditionConfig::BadQuality,
        }
    }
}

impl RawState {
    /// The rules ensure that a word is one of the tag's type.
    fn resolve(&self, kind: Option<ValueKind>) -> Value {
        let position = |word: &str| match kind {
            Some(ValueKind::Text) => None,
            _ => DoublePoint::from_name(word),
        };
        match self {
            Self::Bool(state) => Value::Bool(*state),
            Self::Integer(state) => Value::I64(*state),
            Self::Word(word) => match position(word) {
                Some(position) => Value::DoublePoint(position),
                None => Value::Text(Text::cut(word)),
            },
        }
    }
}
