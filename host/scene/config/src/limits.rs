//! Limits of a configuration.

/// The longest text, in bytes.
pub const MAX_CONFIG_BYTES: usize = 256 * 1024 * 1024;
/// The deepest nesting of JSON arrays and objects; a scene node takes two.
pub const MAX_NESTING_DEPTH: usize = 100;
/// The most diagnostics one text gives.
pub const MAX_DIAGNOSTICS: usize = 200;
/// The largest cache, in 10^6 bytes.
pub const MAX_CACHE_MEGABYTES: u32 = 1_000_000;
/// The most directories that plugins are looked for in.
pub const MAX_PLUGIN_DIRECTORIES: usize = 16;
/// The most plugin instances.
pub const MAX_PLUGINS: usize = 64;
/// The least address space that a plugin's process can do with, in 10^6 bytes.
pub const MIN_MEMORY_MEGABYTES: u32 = 256;
/// The most that can be allowed, in 10^6 bytes.
pub const MAX_MEMORY_MEGABYTES: u32 = 1_000_000;
/// The longest delay before a plugin is started again, in milliseconds.
pub const MAX_RESTART_SECONDS: f64 = 3_600.0;
/// The most deaths before quarantine.
pub const MAX_DEATHS: u32 = 60;
/// The longest window in which deaths count, in seconds.
pub const MAX_WINDOW_SECONDS: f64 = 86_400.0;
/// The longest deadline of a plugin's call, in milliseconds.
pub const MAX_DEADLINE_SECONDS: f64 = 3_600.0;
/// Limit of the models.
pub const MAX_MODELS: usize = 10_000;
/// The most scene nodes, instances included.
pub const MAX_NODES: usize = 1_000_000;
/// Limit of the templates.
pub const MAX_TEMPLATES: usize = 1_000;
/// The most templates that are placed within one another.
pub const MAX_TEMPLATE_DEPTH: usize = 16;
/// Limit of the tags.
pub const MAX_TAGS: usize = 1_000_000;
/// The longest expression of a derived tag, in bytes.
pub const MAX_EXPRESSION_BYTES: usize = 1_000;
/// Limit of the alarms.
pub const MAX_ALARMS: usize = 100_000;
/// The longest delay of an alarm, in seconds.
pub const MAX_ALARM_DELAY_SECONDS: f64 = 86_400.0;
/// The longest text of an alarm, in characters.
pub const MAX_ALARM_TEXT: usize = 500;
/// The longest that alarms may be shelved, in minutes: a week.
pub const MAX_SHELVING_SECONDS: f64 = 604_800.0;
/// The largest file of the alarm log, in 10^6 bytes.
pub const MAX_LOG_MEGABYTES: u32 = 32;
/// The longest silence of a source of alarms before they are stale, in seconds.
pub const MAX_STALE_AFTER_SECONDS: u32 = 3_600;
/// The most rules that find the equipment of a source of alarms.
pub const MAX_SOURCE_RULES: usize = 10_000;
/// The greatest severity that a source gives an alarm.
pub const MAX_SOURCE_SEVERITY: u16 = 1_000;
/// The most files of the alarm log.
pub const MAX_LOG_FILES: u32 = 1_000;
/// The largest file of a view's log, in 10^6 bytes.
pub const MAX_VIEW_LOG_MEGABYTES: u32 = 10_000;
/// The most files of a view's log.
pub const MAX_VIEW_LOG_FILES: u32 = 1_000;
/// The longest network address, in bytes.
pub const MAX_ADDRESS_BYTES: usize = 64;
/// The most pieces of equipment that have names of their own.
pub const MAX_EQUIPMENT: usize = 1_000_000;
/// The most aliases of one piece of equipment.
pub const MAX_ALIASES: usize = 32;
/// The least factor on the size of panels and labels.
pub const MIN_PANEL_SCALE: f32 = 0.5;
/// Largest scale of panels.
pub const MAX_PANEL_SCALE: f32 = 4.0;
/// The most bindings of tags to nodes.
pub const MAX_BINDINGS: usize = 1_000_000;
/// Limit of the cameras.
pub const MAX_CAMERAS: usize = 1_000;
/// The smallest height of an orthographic view, metres.
pub const MIN_VIEW_METRES: f32 = 0.1;
/// The longest way from one camera to another, seconds.
pub const MAX_TRANSITION_SECONDS: f64 = 10.0;

/// Seconds that a change of detail may take.
pub const MAX_MORPH_SECONDS: f64 = 5.0;
/// The most levels of a theta that follows distance.
pub const MAX_THETA_LEVELS: usize = 16;
/// The greatest share of a distance by which detail returns later than it went.
pub const MAX_THETA_HYSTERESIS: f64 = 0.5;
/// The least error on the screen that detail may follow, in pixels.
pub const MIN_ERROR_PIXELS: f64 = 0.05;
/// Largest screen-space error, pixels.
pub const MAX_ERROR_PIXELS: f64 = 100.0;
/// The longest that a frame may be meant to take, in milliseconds.
pub const MAX_FRAME_SECONDS: f64 = 1.0;
/// The most that all thetas together are multiplied by.
pub const MAX_THETA_SCALE: f64 = 2.0;
/// The shortest period in which a simulated value moves, in seconds.
pub const MIN_SIMULATED_PERIOD_SECONDS: f64 = 0.01;
/// The longest: a year.
pub const MAX_SIMULATED_PERIOD_SECONDS: f64 = 31_536_000.0;
/// The longest name or equipment id, in bytes.
pub const MAX_NAME_BYTES: usize = 200;
/// The longest path, in bytes.
pub const MAX_PATH_BYTES: usize = 4_096;
/// Largest distance of a coordinate from the origin, metres.
pub const MAX_COORDINATE_METRES: f32 = 1.0e7;
/// The least magnitude of a scale factor.
pub const MIN_SCALE: f32 = 1.0e-6;
/// The greatest magnitude of a scale factor.
pub const MAX_SCALE: f32 = 1.0e6;
/// Parts of one model that move.
pub const MAX_MOVING_PARTS: usize = 64;
/// Largest rotation of a part, degrees.
pub const MAX_TURN_DEGREES: f32 = 360.0;
/// Events of a scenario.
pub const MAX_SCENARIO_EVENTS: usize = 100_000;
/// Longest duration of a scenario, seconds: a week.
pub const MAX_SCENARIO_SECONDS: f64 = 604_800.0;
/// Roles that one overlay names.
pub const MAX_OVERLAY_ROLES: usize = 100;
