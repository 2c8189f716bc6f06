//! Plugin instances: as typed, and as used.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Value;

use crate::durations::whole_millis;
use crate::limits::*;
use crate::report::Report;
use crate::{join_pointer, suggestions};

/// Isolation of plugins from the viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Isolation {
    /// Each plugin in a supervised process of its own.
    #[default]
    Process,
    /// Plugins in the viewer's own process: a crash takes the viewer along.
    None,
}

/// Time from which the age of a source's values is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FreshnessBasis {
    /// Time at the source where it gives one, else reception.
    #[default]
    SourceTime,
    /// Reception, for a source whose clock is known to be wrong.
    Reception,
}

/// An instance of a plugin.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Plugin")]
pub(crate) struct RawPlugin {
    /// Id of the plugin.
    #[schemars(length(min = 1, max = MAX_NAME_BYTES))]
    #[schemars(extend("examples" = ["example.optimizer"]))]
    pub(crate) plugin: String,
    /// Settings, handed to the plugin as they are.
    #[serde(default)]
    #[schemars(extend("examples" = [{}]))]
    pub(crate) settings: serde_json::Map<String, Value>,
    /// Isolation of the instance, instead of the configuration's general one.
    #[serde(default)]
    #[schemars(with = "Isolation", extend("examples" = ["process"]))]
    isolation: Option<Isolation>,
    /// The most memory (address space) that its process may have, in 10^6 bytes.
    #[serde(default = "default_memory_megabytes")]
    #[schemars(range(min = MIN_MEMORY_MEGABYTES, max = MAX_MEMORY_MEGABYTES))]
    #[schemars(extend("examples" = [4000]))]
    memory_megabytes: u32,
    /// Allows the instance's process to use the network; where missing, a plugin that is the
    /// source of a tag or of alarms, or tells people of alarms, may.
    #[serde(default)]
    #[schemars(extend("examples" = [false]))]
    network: Option<bool>,
    /// SHA-256 of its library: no other is loaded for it.
    #[serde(default)]
    #[schemars(regex(pattern = "^[0-9a-fA-F]{64}$"))]
    #[schemars(extend("examples" = ["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"]))]
    sha256: Option<String>,
    /// Roles of the bindings that an overlay gets; all where there are none. Each additional
    /// binding costs time in every frame.
    #[serde(default)]
    #[schemars(length(max = MAX_OVERLAY_ROLES), inner(length(min = 1, max = MAX_NAME_BYTES)))]
    #[schemars(extend("examples" = [["position"]]))]
    roles: Vec<String>,
    /// Marks all its values as simulated: what it connects to is a simulator.
    #[serde(default)]
    #[schemars(extend("examples" = [true]))]
    simulated: bool,
    /// Time from which the age of its values is counted.
    #[serde(default)]
    #[schemars(extend("examples" = ["reception"]))]
    freshness_by: FreshnessBasis,
}

/// Restart policy of plugins whose process crashed.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Supervision")]
pub(crate) struct RawSupervision {
    /// Delay before the first restart in seconds; it doubles with each
    /// death, and chance shortens it. 0 starts again at once.
    #[schemars(range(min = 0.0, max = MAX_RESTART_SECONDS), extend("examples" = [0.2]))]
    #[schemars(extend("x-busbar-formerly" = ["restart_millis"]))]
    restart_seconds: f64,
    /// The longest delay in seconds.
    #[schemars(range(min = 0.0, max = MAX_RESTART_SECONDS), extend("examples" = [30]))]
    #[schemars(extend("x-busbar-formerly" = ["max_restart_millis"]))]
    max_restart_seconds: f64,
    /// Crashes within the window that put a plugin in quarantine, until an operator starts it; 0
    /// for never.
    #[schemars(range(min = 0, max = MAX_DEATHS), extend("examples" = [3]))]
    max_deaths: u32,
    /// The window in seconds.
    #[schemars(range(min = 1.0, max = MAX_WINDOW_SECONDS), extend("examples" = [600]))]
    window_seconds: f64,
    /// The longest that a plugin takes to be created, to check, to start or to take
    /// bindings, in seconds. One that takes longer is killed.
    #[schemars(range(min = 0.001, max = MAX_DEADLINE_SECONDS), extend("examples" = [10]))]
    #[schemars(extend("x-busbar-formerly" = ["call_millis"]))]
    call_seconds: f64,
    /// The longest that an optimizer is silent about its progress, in seconds.
    #[schemars(range(min = 0.001, max = MAX_DEADLINE_SECONDS), extend("examples" = [120]))]
    #[schemars(extend("x-busbar-formerly" = ["optimize_millis"]))]
    optimize_seconds: f64,
}

/// Key that must have signed every plugin library.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Signature")]
pub(crate) struct RawSignature {
    /// The site's Ed25519 public key in hexadecimal, as `busbar plugin sign`
    /// prints it. Each library needs a `.sig` file beside it.
    #[schemars(regex(pattern = "^[0-9a-fA-F]{64}$"))]
    #[schemars(extend("examples" = ["d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a"]))]
    pub(crate) public_key: String,
}

/// An instance of a plugin.
#[derive(Clone, Debug, PartialEq)]
pub struct PluginConfig {
    /// The plugin's id, such as `example.optimizer`.
    pub plugin: String,
    /// Settings, an object that only the plugin understands.
    pub settings: Value,
    /// Isolation of the instance.
    pub isolation: Isolation,
    /// The most address space of its process, in 10^6 bytes.
    pub memory_megabytes: u32,
    /// Permission to use the network; none where the text does not say.
    pub network: Option<bool>,
    /// SHA-256 of its library in hexadecimal.
    pub sha256: Option<String>,
    /// The roles of the bindings that an overlay gets; all where there are none.
    pub roles: Vec<String>,
    /// True where all its values are simulated.
    pub simulated: bool,
    /// Time from which the age of its values is counted.
    pub freshness_by: FreshnessBasis,
    /// JSON pointer; the settings are at its `/settings`.
    pub pointer: String,
}

/// Restart policy of plugins whose process crashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SupervisionConfig {
    /// Delay before the first restart.
    pub restart_millis: u64,
    /// Upper bound of the delay.
    pub max_restart_millis: u64,
    /// Deaths within the window that put a plugin in quarantine; 0 for never.
    pub max_deaths: u32,
    /// Window over which crashes are counted.
    pub window_seconds: u64,
    /// The longest that a call takes which is no picture and no optimising.
    pub call_millis: u64,
    /// The longest that an optimiser is silent about its progress.
    pub optimize_millis: u64,
}

/// Key that must have signed every plugin library.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignatureConfig {
    /// 64 hexadecimal digits, which need not be a key.
    pub public_key: String,
    /// JSON pointer; the key is at its `/public_key`.
    pub pointer: String,
}

impl RawPlugin {
    pub(crate) fn resolve(self, isolation: Isolation, pointer: String) -> PluginConfig {
        PluginConfig {
            plugin: self.plugin,
            settings: Value::Object(self.settings),
            isolation: self.isolation.unwrap_or(isolation),
            memory_megabytes: self.memory_megabytes,
            network: self.network,
            sha256: self.sha256,
            roles: self.roles,
            simulated: self.simulated,
            freshness_by: self.freshness_by,
            pointer,
        }
    }
}

/// Reports roles of overlays that no binding has.
pub(crate) fn check_roles(document: &Value, report: &mut Report<'_>) {
    let bindings = document["bindings"].as_array().into_iter().flatten();
    let bound: BTreeSet<&str> = bindings.filter_map(|of| of["role"].as_str()).collect();
    for (name, plugin) in document["plugins"].as_object().into_iter().flatten() {
        let roles = plugin["roles"].as_array().into_iter().flatten();
        for (index, role) in roles.enumerate() {
            let Some(role) = role.as_str().filter(|role| !bound.contains(role)) else { continue };
            let pointer = join_pointer(&join_pointer("/plugins", name), "roles");
            let remedy = suggestions::remedy(role, bound.iter().copied(), || {
                "name a role of a binding, or remove it".to_owned()
            });
            let cause = format!("no binding has the role '{}'", suggestions::shown(role));
            report.error(&join_pointer(&pointer, index), cause, remedy);
        }
    }
}

impl RawSupervision {
    pub(crate) fn resolve(self) -> SupervisionConfig {
        SupervisionConfig {
            restart_millis: whole_millis(self.restart_seconds),
            max_restart_millis: whole_millis(self.max_restart_seconds),
            max_deaths: self.max_deaths,
            window_seconds: self.window_seconds.round() as u64,
            call_millis: whole_millis(self.call_seconds),
            optimize_millis: whole_millis(self.optimize_seconds),
        }
    }
}

impl Default for RawSupervision {
    fn default() -> Self {
        Self {
            restart_seconds: 0.2,
            max_restart_seconds: 30.0,
            max_deaths: 3,
            window_seconds: 600.0,
            call_seconds: 10.0,
            optimize_seconds: 120.0,
        }
    }
}

fn default_memory_megabytes() -> u32 {
    4000
}
