/* Busbar plugin ABI 1.0, the contract between host and plugins.
 * Generated from plugins/sdk/abi by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * A library exports one symbol, `busbar_plugin_entry`. From it the host gets a
 * factory, from the factory plugins, from a plugin its capabilities: tables of
 * functions, found by id. What holds everywhere:
 *
 * - Every table and every struct passed alone starts with `struct_size`, its size
 *   in bytes, so that fields can be added at the end. Array elements (marked so)
 *   have a frozen layout instead.
 * - Text is UTF-8 with a length, without a terminating zero.
 * - What a caller passes is valid during the call only, unless said otherwise:
 *   copy what you keep. No call hands over memory; results go into buffers of
 *   the caller.
 * - A function that can fail returns BUSBAR_OK or a code, and then writes the
 *   reason into the caller's BusbarError, unless that is null or too small.
 * - A pointer that is null or misaligned where an object is wanted, a struct_size
 *   that is too small, or an unknown id is refused with BUSBAR_INVALID_ARGUMENT
 *   (null where a pointer is returned), and nothing is touched; `destroy` and
 *   `stop` then do nothing. So are calls out of order, such as a second `start`.
 * - No exception may leave a function; never exit, abort or change signal handlers.
 * - Tags in brackets say who calls when: [main-thread] never two such calls at
 *   once on one instance (without an instance: on one library), though not always
 *   on the same thread; [any-thread] any thread, also several at once; [idle]
 *   before `start` or after `stop`; [active] between them.
 *
 * Entry, factory, descriptor, plugin, host table and error are frozen: a library
 * built against this header loads in every 1.x. Capabilities whose id ends in
 * `-draft` may still change; rebuild with the header of the host.
 */

#ifndef BUSBAR_PLUGIN_H
#define BUSBAR_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

// Ids of the factory and of the capabilities.
#define BUSBAR_PLUGIN_FACTORY_ID "busbar.plugin-factory/1"
#define BUSBAR_MESH_OPTIMIZER_ID "busbar.mesh-optimizer/1-draft"
#define BUSBAR_TELEMETRY_ID "busbar.telemetry/1-draft"
#define BUSBAR_OVERLAY_ID "busbar.overlay/1-draft"
#define BUSBAR_SIMULATOR_ID "busbar.simulator/1-draft"
#define BUSBAR_COMMAND_ID "busbar.command/1-draft"
#define BUSBAR_CHART_ID "busbar.chart/1-draft"
#define BUSBAR_RECORDS_ID "busbar.records/1-draft"
#define BUSBAR_ALARMS_ID "busbar.alarms/1-draft"
#define BUSBAR_NOTIFY_ID "busbar.notify/1-draft"

// Marks the one symbol that a library exports:
//   BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = { ... };
#if defined(__cplusplus)
#define BUSBAR_EXPORT extern "C" __attribute__((visibility("default")))
#else
#define BUSBAR_EXPORT __attribute__((visibility("default")))
#endif

// Alarms of one report, at most.
#define BUSBAR_MAX_SOURCE_ALARMS 5000

// Bytes of an id, a name, a source or a message, at most.
#define BUSBAR_MAX_SOURCE_ALARM_TEXT 512

// Bytes of a report, at most.
#define BUSBAR_MAX_ALARM_REPORT (24 << 20)

// Axes of a chart, at most.
#define BUSBAR_MAX_CHART_AXES 32

// Records of a chart, at most.
#define BUSBAR_MAX_CHART_RECORDS 10000000

// Bytes of a description, or of an explanation, at most.
#define BUSBAR_MAX_CHART_TEXT (16 << 20)

// Commands of one plugin, at most.
#define BUSBAR_MAX_COMMANDS 16

// Bytes of a command's name, at most.
#define BUSBAR_MAX_COMMAND_NAME 32

// Bytes of one `write`, at most.
#define BUSBAR_MAX_CHUNK (1 << 20)

// Exit code of a command that is done.
#define BUSBAR_EXIT_DONE 0

// Exit code of a command whose input is at fault; nothing could be done.
#define BUSBAR_EXIT_INPUT 1

// Exit code of a command whose arguments are at fault.
#define BUSBAR_EXIT_USAGE 2

// Major version of the ABI: host and plugin must have the same.
#define BUSBAR_ABI_MAJOR 1

// Minor version of the ABI: a host runs plugins of its own minor version and older ones.
#define BUSBAR_ABI_MINOR 0

// Bytes of text that a [`BusbarError`] holds.
#define BUSBAR_ERROR_CAPACITY 1024

// Log level of faults that a user must act on.
#define BUSBAR_LOG_ERROR 1

// Log level of conditions that may become a fault.
#define BUSBAR_LOG_WARNING 2

// Log level of ordinary events.
#define BUSBAR_LOG_INFO 3

// Log level of details for the plugin's author.
#define BUSBAR_LOG_DEBUG 4

// Flag of a sequence whose proportion of simplified vertices, theta, is that of its mesh. Without
// it a host shares one theta among all meshes of a model by error.
#define BUSBAR_COLLAPSES_THETA_BY_MESH 1

// Flag of a plugin whose `optimize` reads positions and triangles alone, so that the host need not
// pass wedges.
#define BUSBAR_OPTIMIZER_NO_WEDGES 1

// Changes of one batch, at most.
#define BUSBAR_MAX_NOTIFY_CHANGES 256

// Alarms of one list of standing alarms, at most.
#define BUSBAR_MAX_NOTIFY_STANDING 2000

// Bytes of the sentence in a report, at most.
#define BUSBAR_MAX_NOTIFY_MESSAGE 1024

// Bytes of a report, at most.
#define BUSBAR_MAX_NOTIFY_REPORT (64 << 10)

// Primitive: a line of the label at a node: caption and value.
#define BUSBAR_OVERLAY_LINE 1

// Primitive: the node and all under it drawn in the colour of the severity.
#define BUSBAR_OVERLAY_TINT 2

// Primitive: a piece of equipment, and all under it, in a state of the legend. What rests
// on several bindings is named once for each, one after the other.
#define BUSBAR_OVERLAY_STATE 3

// Quantity: the position of a switch. `value` is the share of its way that it has travelled
// from open (0) to closed (1), in between while it travels; NaN where what is reported
// contradicts itself. `other` is the index of the mechanism.
#define BUSBAR_QUANTITY_POSITION 1

// Quantity: power that flows. `value` is its share of the rating, positive from `equipment`
// to `other`, a second piece of it.
#define BUSBAR_QUANTITY_FLOW 2

// Quantity: a level of the contour, in its unit. `other` is zero.
#define BUSBAR_QUANTITY_LEVEL 3

// Flag of a verdict: it rests on a default of the plugin, which the reason names.
#define BUSBAR_VERDICT_ASSUMED 1

// Flag of an abnormal verdict: it is surely no alarm, so that it needs attention and no action
// now. Without this flag and the next one an abnormal verdict is an alarm: it needs action now.
#define BUSBAR_VERDICT_WARNING 2

// Flag of an abnormal verdict: it needs attention, and the inputs do not decide whether it is an
// alarm.
#define BUSBAR_VERDICT_PERHAPS_ALARM 4

// Lists of a plugin, at most.
#define BUSBAR_MAX_RECORD_LISTS 16

// Columns of a list, at most.
#define BUSBAR_MAX_RECORD_COLUMNS 32

// Rows of a list, at most.
#define BUSBAR_MAX_RECORD_ROWS 200000

// Bytes of an equipment id, or of a cell, at most.
#define BUSBAR_MAX_RECORD_TEXT 1024

// Bytes of all texts of all lists of a plugin, each counted with 32 more, at most.
#define BUSBAR_MAX_RECORD_BYTES (64 << 20)

// Bytes of a description, at most.
#define BUSBAR_MAX_RECORD_DESCRIPTION (4 << 20)

// Time of a row that has none.
#define BUSBAR_RECORD_NO_TIME INT64_MIN

// Flag of an open row: something is still to be done.
#define BUSBAR_RECORD_OPEN 1

// Capacity of the text of a [`BusbarSimulatorStatus`], bytes.
#define BUSBAR_SIMULATOR_MESSAGE_CAPACITY 512

// Event kind: the tag moves to a value and stays there.
#define BUSBAR_EVENT_VALUE 0

// Event kind: the tag follows its own shape again.
#define BUSBAR_EVENT_RELEASE 1

// Sample flag of a buffered sample: a buffered report, a stored or a historical value. Source time
// orders such samples; all others count in the order of their arrival, whatever their source time.
#define BUSBAR_SAMPLE_BUFFERED (1 << 0)

// Sample flag of a promised source time that is missing or unreadable. A good value becomes
// uncertain (source time).
#define BUSBAR_SAMPLE_TIME_UNUSABLE (1 << 1)

// Source timestamp of a sample whose source gives none.
#define BUSBAR_NO_TIME INT64_MIN

// Link state of a plugin that has not tried to connect yet.
#define BUSBAR_LINK_IDLE 0

// Link state of a plugin that connects or waits to try again.
#define BUSBAR_LINK_CONNECTING 1

// Link state of a connected plugin.
#define BUSBAR_LINK_UP 2

// Link state of a plugin whose link is down.
#define BUSBAR_LINK_DOWN 3

// Value kind of a sample without a value: it sets the quality only.
#define BUSBAR_VALUE_NONE 0

// Value kind of an IEEE 754 double, its bits in `value`.
#define BUSBAR_VALUE_F64 1

// Value kind of a two's complement 64-bit integer.
#define BUSBAR_VALUE_I64 2

// Value kind of a single point, 0 or 1.
#define BUSBAR_VALUE_BOOL 3

// Value kind of a double point: 0 intermediate, 1 off, 2 on, 3 bad state (IEC 60870-5-101,
// 7.2.6.2).
#define BUSBAR_VALUE_DOUBLE_POINT 4

// Quality of a usable value.
#define BUSBAR_QUALITY_GOOD 0

// Quality of a doubtful value.
#define BUSBAR_QUALITY_UNCERTAIN 1

// Quality of an unusable value.
#define BUSBAR_QUALITY_BAD 2

// Reason of a quality that names none.
#define BUSBAR_REASON_NONE 0

// Reason of a link to the device that is down.
#define BUSBAR_REASON_COMMUNICATION 1

// Reason of a device that reports a failed sensor.
#define BUSBAR_REASON_SENSOR 2

// Reason of a value outside the measuring range.
#define BUSBAR_REASON_OUT_OF_RANGE 3

// Reason of a device that refused the address, or whose answer does not fit.
#define BUSBAR_REASON_CONFIGURATION 4

// Reason of a device that is not connected yet.
#define BUSBAR_REASON_NOT_CONNECTED 5

// Reason of a value that is not a finite number.
#define BUSBAR_REASON_NOT_FINITE 6

// Reason of a value past its freshness limit. The host alone sets it.
#define BUSBAR_REASON_STALE 7

// Reason of a source timestamp that is missing where one is promised, unreadable, in the future or
// impossible.
#define BUSBAR_REASON_SOURCE_TIME 8

// Origin of a value that a person or program substituted for the measured one.
#define BUSBAR_ORIGIN_SUBSTITUTED (1 << 2)

// Origin of a value from a device under test.
#define BUSBAR_ORIGIN_TEST (1 << 3)

// Origin of a value that a simulator made.
#define BUSBAR_ORIGIN_SIMULATED (1 << 4)

// Origin of a value that is replayed from a recording.
#define BUSBAR_ORIGIN_RECORDED (1 << 5)

// Origin of a value that its source calls historical.
#define BUSBAR_ORIGIN_HISTORICAL (1 << 6)

// Pattern of a plain colour.
#define BUSBAR_PATTERN_SOLID 0

// Pattern of diagonal stripes.
#define BUSBAR_PATTERN_STRIPED 1

// Pattern: stripes that cross.
#define BUSBAR_PATTERN_CROSSED 2

// Pattern of regular dots.
#define BUSBAR_PATTERN_DOTTED 3

// Severity of the normal state; grey.
#define BUSBAR_SEVERITY_NORMAL 0

// Severity: outside the normal band.
#define BUSBAR_SEVERITY_WARNING 1

// Severity: needs action now.
#define BUSBAR_SEVERITY_ALARM 2

// Verdict: within its limits.
#define BUSBAR_VERDICT_NORMAL 1

// Verdict: outside its limits, or in a state that needs attention.
#define BUSBAR_VERDICT_ABNORMAL 2

// Verdict: not to be judged, for the reason given.
#define BUSBAR_VERDICT_UNKNOWN 3

// Severity of a row that is no defect, or of which that is not known.
#define BUSBAR_RECORD_NO_SEVERITY 0

// Severity of a defect to be mended when there is occasion.
#define BUSBAR_RECORD_GENERAL 1

// Severity of a defect to be mended soon, and watched until then.
#define BUSBAR_RECORD_SERIOUS 2

// Severity of a defect to be mended at once.
#define BUSBAR_RECORD_CRITICAL 3

// Shape of a constant at the base.
#define BUSBAR_SHAPE_CONSTANT 0

// Shape of a sine about the base.
#define BUSBAR_SHAPE_SINE 1

// Shape of a smooth random walk about the base.
#define BUSBAR_SHAPE_WALK 2

// Shape of levels about the base, or positions of a switch, each held for a period.
#define BUSBAR_SHAPE_STEPS 3

// Shape of a counter: one more each period, from the base to base and amplitude, then anew.
#define BUSBAR_SHAPE_COUNTER 4

// Fault of a lost link: connections end, and new ones are refused.
#define BUSBAR_FAULT_LINK_LOSS 1

// Fault of a slow device: every answer is delayed, but within the deadline.
#define BUSBAR_FAULT_SLOW 2

// Fault of half-open connections, through which no bytes come.
#define BUSBAR_FAULT_HALF_OPEN 4

// Fault of connections that are reset, again and again.
#define BUSBAR_FAULT_RESET 8

// Fault of random bytes instead of answers.
#define BUSBAR_FAULT_GARBAGE 16

// Fault of answers after the client's deadline.
#define BUSBAR_FAULT_LATE 32

// Fault of a wrong device clock.
#define BUSBAR_FAULT_CLOCK_JUMP 64

// Result of a call: [`BUSBAR_OK`] or one of the codes below it.
typedef int32_t BusbarStatus;

// Error of a call. The caller owns it and fills in `struct_size`.
typedef struct BusbarError {
  // Size of this struct as the caller knows it, bytes.
  uint32_t struct_size;
  // Bytes used of `message`, at most its capacity.
  uint32_t message_len;
  // Status of the error, for calls that return no status.
  BusbarStatus status;
  // Message in UTF-8: fault, place and remedy in one or two sentences.
  uint8_t message[1024];
} BusbarError;

// UTF-8 text with a length in bytes, not terminated. `ptr` may be null only
// if `len` is 0.
typedef struct BusbarStr {
  // First byte of the text.
  const uint8_t *ptr;
  // Length of the text, bytes.
  size_t len;
} BusbarStr;

// Entry point that a library exports. Static, for the library's whole life.
typedef struct BusbarPluginEntry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Major version that the plugin was built with, [`BUSBAR_ABI_MAJOR`].
  uint32_t abi_major;
  // Minor version that the plugin was built with, [`BUSBAR_ABI_MINOR`].
  uint32_t abi_minor;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Initializes the library, before any other call. May be null.
  BusbarStatus (*init)(struct BusbarError *error);
  // `[main-thread]` Called once for every `init`, after every plugin is destroyed. The library
  // stays mapped, and `init` may follow again. May be null.
  void (*deinit)(void);
  // `[main-thread]` Returns a static factory by id, or null if there is none.
  // `busbar.plugin-factory/1` names a [`BusbarPluginFactory`].
  const void *(*get_factory)(struct BusbarStr factory_id);
} BusbarPluginEntry;

// Identity and capabilities of a plugin. Static.
typedef struct BusbarPluginDescriptor {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of capabilities, at most 64.
  uint32_t capability_count;
  // Unique id in reverse notation, such as `com.example.mine`: letters, digits,
  // `.`, `_` and `-`, at most 128.
  struct BusbarStr id;
  // Display name of the plugin.
  struct BusbarStr name;
  // Version of the plugin.
  struct BusbarStr version;
  // Description of the plugin in one sentence.
  struct BusbarStr description;
  // JSON Schema of the settings; empty accepts any object.
  struct BusbarStr settings_schema;
  // Ids of the plugin's capabilities, `capability_count` of them.
  const struct BusbarStr *capabilities;
} BusbarPluginDescriptor;

// Plugin instance. The library owns it; the host ends it by `destroy`.
typedef struct BusbarPlugin {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Data of the library's own.
  void *data;
  // `[main-thread & idle]` Ends the instance and frees it. No call to the
  // host may follow.
  void (*destroy)(struct BusbarPlugin *plugin);
  // `[main-thread]` Returns the function table of a capability by id, valid until `destroy`, or
  // null if the plugin lacks the capability.
  const void *(*get_capability)(const struct BusbarPlugin *plugin, struct BusbarStr capability_id);
} BusbarPlugin;

// Services of the host for one plugin instance. Valid from `create` until `destroy` returns.
typedef struct BusbarHost {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Major version of the host's ABI.
  uint32_t abi_major;
  // Minor version of the host's ABI.
  uint32_t abi_minor;
  // Reserved; must be zero.
  uint32_t reserved;
  // Context that is passed back in every call to the host.
  void *context;
  // `[any-thread]` Writes one line to the host's log. Messages beyond the
  // host's rate limit are dropped and counted. Cannot fail.
  void (*log)(void *context, uint32_t level, struct BusbarStr message);
} BusbarHost;

// Factory of plugin instances.
typedef struct BusbarPluginFactory {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Number of plugins in this library, at most 64.
  uint32_t (*count)(void);
  // `[main-thread]` Returns a plugin's static descriptor, or null if `index` is too large.
  const struct BusbarPluginDescriptor *(*descriptor)(uint32_t index);
  // `[main-thread]` Creates an instance with settings, a JSON object that fits the descriptor's
  // schema. Returns null and fills in `error` on failure. `host` stays valid until `destroy`
  // returns.
  struct BusbarPlugin *(*create)(struct BusbarStr plugin_id,
                                 struct BusbarStr settings_json,
                                 const struct BusbarHost *host,
                                 struct BusbarError *error);
} BusbarPluginFactory;

// Triangle mesh over welded positions, and the wedges that split them.
//
// A *wedge* is one position with one set of attributes; a position on a
// normal, texture or material seam has several. The fields from `wedge_count`
// on came later: they are there if `struct_size` reaches over them, and count
// and pointers are zero where the host has no attributes or the plugin wants
// none (`BUSBAR_OPTIMIZER_NO_WEDGES`). Either all five arrays are given or none.
typedef struct BusbarMesh {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of positions in `positions`.
  uint32_t position_count;
  // Number of triangles in `triangles`.
  uint32_t triangle_count;
  // Reserved; must be zero.
  uint32_t reserved;
  // Coordinates x, y, z of each position, finite, metres.
  const float *positions;
  // Three different position indices of each triangle, counter-clockwise.
  const uint32_t *triangles;
  // Number of wedges: at least one for each position, or 0.
  uint32_t wedge_count;
  // Reserved; must be zero.
  uint32_t wedge_reserved;
  // Three wedge indices of each triangle, each standing on the position
  // that `triangles` names there.
  const uint32_t *corners;
  // The position of each wedge. Wedges of one position follow one another.
  // A wedge of a removed position becomes, of the first 64 wedges of the
  // kept one, that of the same section, then of the least sum of
  // 1 - cosine of the normals and distance of the coordinates, then the
  // first.
  const uint32_t *wedge_positions;
  // x, y, z of the normal of each wedge, finite, not always of length 1.
  const float *wedge_normals;
  // u, v of each wedge, finite; zero where there are none.
  const float *wedge_uvs;
  // A number for the material of each wedge.
  const uint32_t *wedge_sections;
} BusbarMesh;

// Progress and cancellation of a long call.
typedef struct BusbarProgress {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Passed back in `report`.
  void *context;
  // `[the thread of the call]` Says how much is done, 0 to 1. Returns 0 if
  // the plugin must stop and return `BUSBAR_CANCELLED`. May be null.
  uint32_t (*report)(void *context, float fraction);
} BusbarProgress;

// Half-edge collapse. Array element.
typedef struct BusbarCollapse {
  // Index of the position that is removed. No later entry may name it.
  uint32_t removed;
  // Index of the position that replaces it; must not have been removed before.
  uint32_t kept;
  // Geometric error after this collapse, metres: finite, at least 0, never
  // decreasing along the sequence.
  float error;
} BusbarCollapse;

// Time of one stage of the work. Array element.
typedef struct BusbarStage {
  // UTF-8 name, padded with zeros.
  uint8_t name[24];
  // Duration of the stage, milliseconds.
  double millis;
} BusbarStage;

// Buffers for the result. The caller owns them; the plugin fills in the
// counts.
typedef struct BusbarCollapseOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Room in `collapses`: at least `position_count`.
  uint32_t collapse_capacity;
  // Number of collapses written.
  uint32_t collapse_count;
  // Capacity of `stages`, in elements.
  uint32_t stage_capacity;
  // Number of stages written.
  uint32_t stage_count;
  // `BUSBAR_COLLAPSES_...`, written by the plugin, or 0. Bits that a host does not know are
  // ignored.
  uint32_t flags;
  // The sequence, in order.
  struct BusbarCollapse *collapses;
  // Times of the stages, for reports.
  struct BusbarStage *stages;
} BusbarCollapseOutput;

// Function table of `busbar.mesh-optimizer/1-draft`.
typedef struct BusbarMeshOptimizer {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // `BUSBAR_OPTIMIZER_...`, or 0. Bits that a host does not know are ignored.
  uint32_t flags;
  // `[any-thread]` Orders the half-edge collapses of a mesh, the least
  // important first. The same mesh and settings give the same sequence,
  // bit for bit, on every machine. Borrows everything for the call.
  // Fails with `BUSBAR_INVALID_ARGUMENT`, `BUSBAR_BUFFER_TOO_SMALL`,
  // `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
  BusbarStatus (*optimize)(const struct BusbarPlugin *plugin,
                           const struct BusbarMesh *mesh,
                           const struct BusbarProgress *progress,
                           struct BusbarCollapseOutput *output,
                           struct BusbarError *error);
} BusbarMeshOptimizer;

// Tag that a telemetry plugin is to serve. Array element.
typedef struct BusbarTagSpec {
  // Handle that names the tag in samples.
  uint32_t tag;
  // Kind of value that the host expects, one of `BUSBAR_VALUE_*`.
  uint32_t kind;
  // Freshness limit, milliseconds: an older value is stale.
  uint64_t freshness_millis;
  // Id of the tag, for messages.
  struct BusbarStr id;
  // Address of the tag for this plugin: JSON, as the configuration has it.
  struct BusbarStr address_json;
  // Unit that samples must have, such as `kV`; empty where the tag has none, or where the host
  // scales samples to it. A plugin whose source names another unit converts or refuses.
  struct BusbarStr unit;
} BusbarTagSpec;

// Update of one tag, 24 bytes. Array element.
typedef struct BusbarSample {
  // Handle of the tag, from [`BusbarTagSpec`].
  uint32_t tag;
  // Kind of the value, one of `BUSBAR_VALUE_*`.
  uint8_t kind;
  // Quality, one of `BUSBAR_QUALITY_*`.
  uint8_t quality;
  // Reason of the quality, one of `BUSBAR_REASON_*`.
  uint8_t reason;
  // Flags, `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*` or'ed; 0 for a live value.
  uint8_t flags;
  // Bits of the value, by its `kind`.
  uint64_t value;
  // Source timestamp, nanoseconds since 1970-01-01 UTC, or [`BUSBAR_NO_TIME`].
  int64_t source_time_unix_nanos;
} BusbarSample;

// Sink for samples and link reports. Valid from `start` until `stop` returns.
typedef struct BusbarSampleSink {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Context that is passed back in every call.
  void *context;
  // `[any-thread & active]` Takes a batch, copying it, without blocking.
  // Returns how many samples were taken. When the queue is full, the
  // oldest in it are dropped and counted.
  size_t (*publish)(void *context, const struct BusbarSample *samples, size_t count);
  // `[any-thread & active]` Reports the state of the link to operators: `BUSBAR_LINK_*` and a
  // sentence.
  void (*report_link)(void *context, uint32_t state, struct BusbarStr message);
  // `[any-thread & active]` Sets the scene time of the values published from now on, nanoseconds
  // since 1970-01-01 UTC. For recordings, whose time is not now; overlays then calculate by that
  // time. [`BUSBAR_NO_TIME`] returns to the wall clock. Null in older hosts.
  void (*report_scene_time)(void *context, int64_t scene_time_unix_nanos);
} BusbarSampleSink;

// Function table of `busbar.telemetry/1-draft`.
typedef struct BusbarTelemetry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Origin of all samples of this plugin, `BUSBAR_ORIGIN_*` or'ed; 0 where they are live.
  uint32_t origin;
  // `[main-thread & idle]` Checks whether these tags could be served: reads addresses, connects
  // to nothing. All arguments are borrowed for the call. Fails like `start`. May be null.
  BusbarStatus (*check)(const struct BusbarPlugin *plugin,
                        const struct BusbarTagSpec *tags,
                        size_t tag_count,
                        struct BusbarError *error);
  // `[main-thread & idle]` Starts to serve tags on threads of the plugin's own and returns at
  // once. A device that does not answer is no failure but Bad quality. The specs are valid
  // during the call, `sink` until `stop` returns. Fails with `BUSBAR_INVALID_SETTINGS` when an
  // address is wrong. The message names every tag at fault that it has room for. The plugin is
  // then idle, and no call to the sink may follow.
  BusbarStatus (*start)(const struct BusbarPlugin *plugin,
                        const struct BusbarTagSpec *tags,
                        size_t tag_count,
                        const struct BusbarSampleSink *sink,
                        struct BusbarError *error);
  // `[main-thread & active]` Ends all threads within two seconds. No call
  // to the sink may follow.
  void (*stop)(const struct BusbarPlugin *plugin);
} BusbarTelemetry;

// A tag bound to a node. Array element.
typedef struct BusbarBinding {
  // Names the node in primitives.
  uint32_t node;
  // `BUSBAR_VALUE_*` of the tag.
  uint32_t kind;
  // Normal band, lower end; NaN for none.
  double limit_low;
  // Normal band, upper end; NaN for none.
  double limit_high;
  // Id of the tag.
  struct BusbarStr tag_id;
  // Tag name for people.
  struct BusbarStr tag_name;
  // Unit, such as `kV`; empty for none.
  struct BusbarStr unit;
  // Equipment id of the node.
  struct BusbarStr node_id;
  // Role of the value for the node, as the configuration words it.
  struct BusbarStr role;
} BusbarBinding;

// The state of one bound tag in this frame. Array element.
typedef struct BusbarTagValue {
  // `BUSBAR_VALUE_*`; `BUSBAR_VALUE_NONE` if no value came yet.
  uint8_t kind;
  // Quality, one of `BUSBAR_QUALITY_*`, freshness included.
  uint8_t quality;
  // Reason of the quality, one of `BUSBAR_REASON_*`.
  uint8_t reason;
  // Origin of the value, `BUSBAR_ORIGIN_*` or'ed; 0 for a live one. The host gives what is drawn
  // on the value, and verdicts that rest on it, this origin. A plugin with a history begins it
  // anew where the origin changes.
  uint8_t origin;
  // Reserved; must be zero.
  uint8_t reserved[4];
  // Bits of the last value.
  uint64_t value;
  // Time since that value came, milliseconds.
  uint64_t age_millis;
} BusbarTagValue;

// Frame with all bound tags at one instant.
typedef struct BusbarOverlayFrame {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of values: that of the bindings.
  uint32_t value_count;
  // Scene clock, nanoseconds since 1970-01-01 UTC: the time that the values
  // are of. It is the wall clock's for live values and the recording's for
  // replayed ones. It may stand still, run fast, or be set back.
  int64_t time_unix_nanos;
  // `values[i]` belongs to the `i`-th binding of `configure`.
  const struct BusbarTagValue *values;
} BusbarOverlayFrame;

// Primitive to draw. Array element.
typedef struct BusbarOverlayPrimitive {
  // Kind of the primitive, one of `BUSBAR_OVERLAY_*`.
  uint32_t kind;
  // Index of the binding whose value this rests on. The host hatches the
  // primitive, with the age, when that value is not good.
  uint32_t binding;
  // Node at which it is drawn; of a state, the index of the equipment described.
  uint32_t node;
  // `BUSBAR_SEVERITY_*`; of a state, the index of the legend's entry.
  uint32_t severity;
  // Caption: offset into the text buffer, bytes.
  uint32_t caption_offset;
  // Caption: length, at most 256 bytes.
  uint32_t caption_len;
  // Value text: offset into the text buffer, bytes.
  uint32_t text_offset;
  // Value text: length, at most 256 bytes.
  uint32_t text_len;
} BusbarOverlayPrimitive;

// A number at equipment that the host gives a shape. Array element.
typedef struct BusbarOverlayQuantity {
  // Kind of the quantity, one of `BUSBAR_QUANTITY_*`.
  uint32_t kind;
  // Index of the binding whose value this rests on: what is not good is drawn as not known.
  uint32_t binding;
  // Index of the equipment described.
  uint32_t equipment;
  // Second index, by the kind.
  uint32_t other;
  // Value by the kind; finite unless the kind says otherwise.
  double value;
} BusbarOverlayQuantity;

// The judgment of an overlay on one piece of equipment. Array element. Every piece that
// was described has one in every frame; the host takes a piece without one as unknown, and
// says that the plugin is at fault.
typedef struct BusbarOverlayVerdict {
  // Index of the equipment described.
  uint32_t equipment;
  // Verdict, one of `BUSBAR_VERDICT_*`.
  uint32_t verdict;
  // Flags: `BUSBAR_VERDICT_ASSUMED`, and one of `BUSBAR_VERDICT_WARNING` and
  // `BUSBAR_VERDICT_PERHAPS_ALARM` of an abnormal verdict; or 0.
  uint32_t flags;
  // Reason, for people: offset into the text buffer, bytes.
  uint32_t reason_offset;
  // Reason: length, at most 256 bytes; more than 0 for what is unknown or assumed.
  uint32_t reason_len;
  // Bindings that it rests on: offset into `basis`. The host takes the verdict back in the
  // very frame in which the value of any of them is not good.
  uint32_t basis_offset;
  // Bindings that it rests on: number. Verdicts may share a range.
  uint32_t basis_count;
} BusbarOverlayVerdict;

// Buffers for what to draw. The caller owns them; the plugin fills in the
// counts.
typedef struct BusbarOverlayOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Capacity of `primitives`, in elements.
  uint32_t primitive_capacity;
  // Number of primitives written.
  uint32_t primitive_count;
  // Room in `text`, bytes.
  uint32_t text_capacity;
  // Bytes of `text` written.
  uint32_t text_len;
  // Reserved; must be zero.
  uint32_t reserved;
  // Primitives to draw, in order.
  struct BusbarOverlayPrimitive *primitives;
  // UTF-8 that the primitives name.
  uint8_t *text;
  // Room in `quantities`. This and what follows is there where the size says so.
  uint32_t quantity_capacity;
  // Number of quantities written.
  uint32_t quantity_count;
  // Quantities that the host draws by shapes of its own.
  struct BusbarOverlayQuantity *quantities;
  // Room in `verdicts`. This and what follows is there where the size says so.
  uint32_t verdict_capacity;
  // Number of verdicts written.
  uint32_t verdict_count;
  // Judgments on the equipment described.
  struct BusbarOverlayVerdict *verdicts;
  // Capacity of `basis`, in elements.
  uint32_t basis_capacity;
  // Elements of `basis` written.
  uint32_t basis_count;
  // Indices of bindings that verdicts rest on.
  uint32_t *basis;
} BusbarOverlayOutput;

// A state that an overlay shows equipment in, as the legend has it. Array element.
typedef struct BusbarLegendEntry {
  // Display name of the state; at most 64 bytes.
  struct BusbarStr name;
  // `BUSBAR_PATTERN_*`: no two entries that differ in colour alone may mean different
  // things to who sees none.
  uint32_t pattern;
  // Colour in sRGB, `0xRRGGBB`.
  uint32_t color;
} BusbarLegendEntry;

// A quantity whose course over the ground an overlay shows, worked out of levels at
// equipment. Array element.
typedef struct BusbarContour {
  // Display name of the quantity; at most 64 bytes.
  struct BusbarStr name;
  // Unit such as `°C`; empty for none; at most 16 bytes.
  struct BusbarStr unit;
  // Radius around a piece of equipment within which its level counts, metres; 0.1 to 1000.
  double reach_metres;
  // Normal band, lower end; NaN for none. Only what lies outside the band is coloured.
  double low;
  // Normal band, upper end; NaN for none.
  double high;
  // Distance from one line of equal level to the next, in the unit; above 0.
  double step;
} BusbarContour;

// Contents of an overlay besides values. The caller sets the size; the plugin fills in
// the rest, all of which stays as it is until the next `configure`, or until the plugin is
// destroyed.
typedef struct BusbarOverlayDescription {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of legend entries; at most 64.
  uint32_t legend_count;
  // Number of equipment ids; at most 100,000.
  uint32_t equipment_count;
  // Reserved; must be zero.
  uint32_t reserved;
  // Legend entries of the overlay.
  const struct BusbarLegendEntry *legend;
  // Ids, by any alias, of the equipment that is judged: every piece that the settings or
  // the bindings name. `draw` gives each of them a verdict.
  const struct BusbarStr *equipment;
  // Number of mechanisms; at most 16. This and what follows is there where the size
  // says so.
  uint32_t mechanism_count;
  // Flag, 0 or 1: the overlay is drawn only once an operator switches it on.
  uint32_t starts_hidden;
  // Names of mechanisms, as models have them, that positions are given of.
  const struct BusbarStr *mechanisms;
  // The contour that levels are of; null for none.
  const struct BusbarContour *contour;
  // Number of findings; at most 256. This and what follows is there where the size
  // says so.
  uint32_t finding_count;
  // Reserved; must be zero.
  uint32_t reserved_2;
  // Faults of the bindings given, each as cause and remedy with `; ` between: a role
  // that no tag has, a unit that cannot be converted. `busbar check` refuses them; a
  // view shows the equipment as unknown.
  const struct BusbarStr *findings;
} BusbarOverlayDescription;

// Function table of `busbar.overlay/1-draft`.
typedef struct BusbarOverlay {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Says which tags are bound to which nodes; called before
  // the first `draw` and after a reload. Everything is borrowed for the
  // call.
  BusbarStatus (*configure)(const struct BusbarPlugin *plugin,
                            const struct BusbarBinding *bindings,
                            size_t binding_count,
                            struct BusbarError *error);
  // `[main-thread]` Works out what to draw, and judges the equipment. Called at
  // most once a frame, also while nobody has the overlay drawn, and must return
  // within a few milliseconds. Fails with
  // `BUSBAR_BUFFER_TOO_SMALL` when the buffers do not suffice.
  BusbarStatus (*draw)(const struct BusbarPlugin *plugin,
                       const struct BusbarOverlayFrame *frame,
                       struct BusbarOverlayOutput *output,
                       struct BusbarError *error);
  // `[main-thread]` Says what is shown besides values; called after each
  // `configure`. Null where it is nothing.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarOverlayDescription *description,
                           struct BusbarError *error);
} BusbarOverlay;

// Simulated tag. Array element.
typedef struct BusbarSimulatedTag {
  // Specification of the tag, as for telemetry.
  struct BusbarTagSpec spec;
  // Shape of the signal, one of `BUSBAR_SHAPE_*`.
  uint32_t shape;
  // Reserved; must be zero.
  uint32_t reserved;
  // Base value of the signal, in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double base;
  // Amplitude about the base, in the tag's unit; not negative.
  double amplitude;
  // Period of a wave, a level or a count, seconds; more than 0.
  double period_seconds;
} BusbarSimulatedTag;

// Scenario event of a simulated tag. Array element.
typedef struct BusbarSimulatedEvent {
  // Handle of the tag.
  uint32_t tag;
  // Kind of the event, one of `BUSBAR_EVENT_*`.
  uint32_t kind;
  // Time of the event, seconds since the scenario began; not negative.
  double at_seconds;
  // Duration of the ramp to the value, seconds; not negative, 0 for bool and double-point.
  double over_seconds;
  // Target value in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double value;
} BusbarSimulatedEvent;

// Interval in which the link has a fault. Array element.
typedef struct BusbarLinkFault {
  // Kind of the fault, one of `BUSBAR_FAULT_*`.
  uint32_t fault;
  // Reserved; must be zero.
  uint32_t reserved;
  // Begin of the fault, seconds since the scenario began; not negative.
  double at_seconds;
  // Duration of the fault, seconds; more than 0.
  double for_seconds;
} BusbarLinkFault;

// Parameters of a simulation, for all its tags.
typedef struct BusbarSimulation {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Kinds of random faults, a sum of `BUSBAR_FAULT_*`; 0 for none.
  uint32_t faults;
  // Seed of the random numbers: the same seed gives the same values and the same faults.
  uint64_t seed;
  // Period in which changes are looked for, milliseconds; more than 0. Of no
  // meaning to protocols whose devices only answer.
  uint64_t update_millis;
  // Period in which one fault occurs, milliseconds; more than `fault_millis`.
  uint64_t fault_period_millis;
  // Longest duration of a random fault, milliseconds; more than 0.
  uint64_t fault_millis;
  // Start of the scenario, nanoseconds since 1970-01-01 UTC; a plugin that is restarted
  // continues it.
  int64_t scenario_unix_nanos;
  // Number of events in `events`.
  uint32_t event_count;
  // Number of link faults.
  uint32_t link_fault_count;
  // Scenario events of tags, in the order of time.
  const struct BusbarSimulatedEvent *events;
  // Scenario faults of the link, in the order of time.
  const struct BusbarLinkFault *link_faults;
} BusbarSimulation;

// Status of a simulation.
typedef struct BusbarSimulatorStatus {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Present fault, one of `BUSBAR_FAULT_*`; 0 for none.
  uint32_t fault;
  // Number of clients that are connected.
  uint32_t clients;
  // Used bytes of `message`.
  uint32_t message_len;
  // Number of connections accepted so far.
  uint64_t connections;
  // Number of messages sent so far: answers to requests, and unsolicited ones.
  uint64_t messages;
  // Address that the simulator listens at, UTF-8.
  uint8_t message[BUSBAR_SIMULATOR_MESSAGE_CAPACITY];
} BusbarSimulatorStatus;

// Function table of `busbar.simulator/1-draft`. It is independent of `busbar.telemetry/1-draft`,
// which the plugin may also have.
typedef struct BusbarSimulator {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread & idle]` Listens, serves tags on threads of the plugin's own, and returns at
  // once. Tags and simulation are valid during the call. Fails with `BUSBAR_INVALID_SETTINGS`
  // when an address is wrong or cannot hold the values of its tag. The message names every tag
  // at fault that it has room for. Fails with `BUSBAR_FAILED` when the plugin cannot listen. The
  // plugin is then idle.
  BusbarStatus (*start)(const struct BusbarPlugin *plugin,
                        const struct BusbarSimulatedTag *tags,
                        size_t tag_count,
                        const struct BusbarSimulation *simulation,
                        struct BusbarError *error);
  // `[main-thread & active]` Ends all connections and threads within two seconds,
  // and listens no more.
  void (*stop)(const struct BusbarPlugin *plugin);
  // `[main-thread & active]` Fills in the status of the simulation.
  BusbarStatus (*status)(const struct BusbarPlugin *plugin,
                         struct BusbarSimulatorStatus *status,
                         struct BusbarError *error);
} BusbarSimulator;

// Command that a plugin offers. Valid until `destroy`.
typedef struct BusbarCommandInfo {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Name that users type: a lower-case letter, then lower-case letters, digits and `-`.
  struct BusbarStr name;
  // Help text of one line.
  struct BusbarStr help;
} BusbarCommandInfo;

// Call of a command, with its arguments.
typedef struct BusbarCommandCall {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of arguments in `arguments`.
  uint32_t argument_count;
  // Name of the command.
  struct BusbarStr name;
  // Arguments that users wrote for the plugin, besides files.
  const struct BusbarStr *arguments;
} BusbarCommandCall;

// Input, output and diagnostics of a command. Valid during `run`, on its thread alone.
typedef struct BusbarCommandStreams {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Context that is passed back in every call.
  void *context;
  // `[the thread of the call]` Reads at most `capacity` bytes of the input into `buffer`.
  // Returns their number, 0 at the end of the input. Below 0, the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  int64_t (*read)(void *context, uint8_t *buffer, size_t capacity);
  // `[the thread of the call]` Takes `len` bytes of output, at most
  // [`BUSBAR_MAX_CHUNK`], copying them. Returns 0 if the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  uint32_t (*write)(void *context, const uint8_t *bytes, size_t len);
  // `[the thread of the call]` Reports a diagnostic on the input. `level` is a `BUSBAR_LOG_*`,
  // `line` a line of the input, 1 the first, 0 for none. Messages beyond the host's limit are
  // counted, not kept. Cannot fail.
  void (*diagnose)(void *context, uint32_t level, uint64_t line, struct BusbarStr message);
} BusbarCommandStreams;

// Result of a command. The caller owns it and fills in `struct_size`.
typedef struct BusbarCommandResult {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Exit code, one of `BUSBAR_EXIT_*`.
  uint32_t exit_code;
} BusbarCommandResult;

// Function table of `busbar.command/1-draft`.
typedef struct BusbarCommand {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Number of commands, at most [`BUSBAR_MAX_COMMANDS`].
  uint32_t (*count)(const struct BusbarPlugin *plugin);
  // `[main-thread]` Returns a command's description, valid until `destroy`, or null if `index`
  // is too large.
  const struct BusbarCommandInfo *(*describe)(const struct BusbarPlugin *plugin, uint32_t index);
  // `[main-thread]` Runs a command: reads the input as far as it needs, writes its output in
  // order, and fills in the exit code. All arguments are borrowed for the call. A fault of the
  // input is a diagnostic and at worst `BUSBAR_EXIT_INPUT`, no failure. Fails with
  // `BUSBAR_INVALID_ARGUMENT` for a name that the plugin does not offer, with
  // `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
  BusbarStatus (*run)(const struct BusbarPlugin *plugin,
                      const struct BusbarCommandCall *call,
                      const struct BusbarCommandStreams *streams,
                      struct BusbarCommandResult *result,
                      struct BusbarError *error);
} BusbarCommand;

// Buffer for a text. The caller owns it.
typedef struct BusbarTextOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Capacity of `text`, bytes.
  uint32_t capacity;
  // Bytes written; where the capacity was too small, bytes needed.
  uint32_t len;
  // Reserved; must be zero.
  uint32_t reserved;
  // Text in UTF-8, not terminated.
  uint8_t *text;
} BusbarTextOutput;

// Time, equipment and state of a record. Array element.
typedef struct BusbarChartRecord {
  // Time at which the record was taken, nanoseconds since 1970-01-01 UTC.
  int64_t time_unix_nanos;
  // Index of the equipment described.
  uint32_t equipment;
  // Index of the legend's entry.
  uint32_t state;
} BusbarChartRecord;

// Buffers for a part of the records. The caller owns them and fills in the request.
typedef struct BusbarChartPage {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of axes in the description that the caller has: values a record.
  uint32_t axis_count;
  // Index of the first record requested.
  uint64_t first;
  // Capacity of `records`; 0 requests revision and total alone.
  uint32_t capacity;
  // Number of records written.
  uint32_t count;
  // Number of records in all.
  uint64_t total;
  // Revision of the chart, which grows with every change of description or records.
  uint64_t revision;
  // The records, those of each piece of equipment in the order of time.
  struct BusbarChartRecord *records;
  // Values of the records, `axis_count` a record, each in the unit of its axis; NaN where there
  // is none.
  float *values;
} BusbarChartPage;

// Function table of `busbar.chart/1-draft`.
typedef struct BusbarChart {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Writes the description as JSON. Fails with `BUSBAR_BUFFER_TOO_SMALL` when
  // the text does not fit, with the bytes needed in `len`.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarTextOutput *output,
                           struct BusbarError *error);
  // `[main-thread]` Writes records. Fails with `BUSBAR_INVALID_ARGUMENT` when the
  // number of axes is not that of the description.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       struct BusbarChartPage *page,
                       struct BusbarError *error);
  // `[main-thread]` Writes an explanation as JSON: of a piece of equipment's last record that is
  // not after an instant. Fails as `describe` does.
  BusbarStatus (*explain)(const struct BusbarPlugin *plugin,
                          struct BusbarStr equipment,
                          int64_t time_unix_nanos,
                          struct BusbarTextOutput *output,
                          struct BusbarError *error);
} BusbarChart;

// Time, severity and flags of a row. Array element.
typedef struct BusbarRecordRow {
  // Time at which the row was reported or done, nanoseconds since 1970-01-01 UTC, or
  // `BUSBAR_RECORD_NO_TIME`.
  int64_t time_unix_nanos;
  // Severity of the row, one of `BUSBAR_RECORD_NO_SEVERITY` to `BUSBAR_RECORD_CRITICAL`.
  uint32_t severity;
  // Flags of the row: `BUSBAR_RECORD_OPEN`, or 0.
  uint32_t flags;
} BusbarRecordRow;

// Buffers for a part of a list's rows. The caller owns them and fills in the request.
typedef struct BusbarRecordPage {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Index of the list described.
  uint32_t list;
  // Number of columns in the description that the caller has.
  uint32_t column_count;
  // Capacity of `rows`; 0 requests the revision alone, of whatever list.
  uint32_t row_capacity;
  // Index of the first row requested.
  uint64_t first;
  // Capacity of `text`, bytes.
  uint32_t text_capacity;
  // Number of rows written: as many as there is room for.
  uint32_t row_count;
  // Number of rows that the list has.
  uint64_t total;
  // Revision of the lists, which grows with every change of the description or of any list.
  uint64_t revision;
  // Rows of the list, in its order.
  struct BusbarRecordRow *rows;
  // End offsets of texts in `text`: `1 + column_count` a row, row by row. The first text is the
  // equipment's id or an alias of it; a cell a column follows.
  uint32_t *ends;
  // Texts of the rows in UTF-8, one after the other.
  uint8_t *text;
} BusbarRecordPage;

// Function table of `busbar.records/1-draft`.
typedef struct BusbarRecords {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Writes the description as JSON. Fails with `BUSBAR_BUFFER_TOO_SMALL` when
  // the text does not fit, with the bytes needed in `len`.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarTextOutput *output,
                           struct BusbarError *error);
  // `[main-thread]` Writes rows. Fails with `BUSBAR_INVALID_ARGUMENT` when there is no such
  // list, or its number of columns is another. Fails with `BUSBAR_BUFFER_TOO_SMALL` when not one
  // row fits.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       struct BusbarRecordPage *page,
                       struct BusbarError *error);
} BusbarRecords;

// Function table of `busbar.alarms/1-draft`.
typedef struct BusbarAlarms {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Writes the state of the alarms as JSON, and returns at once. The report may
  // be without alarms where their revision is still `known_revision`, or where they are not
  // known at all. 0 is never a revision. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the text does
  // not fit, with the bytes needed in `len`.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       uint64_t known_revision,
                       struct BusbarTextOutput *output,
                       struct BusbarError *error);
} BusbarAlarms;

// Function table of `busbar.notify/1-draft`.
typedef struct BusbarNotify {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[main-thread]` Takes a batch of changes as JSON, writes a report as JSON, and returns
  // without waiting for any receiver. Changes that were taken before may come again and count
  // once. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the report does not fit, with the bytes
  // needed in `len`; the batch comes again then.
  BusbarStatus (*notify)(const struct BusbarPlugin *plugin,
                         struct BusbarStr batch,
                         struct BusbarTextOutput *output,
                         struct BusbarError *error);
} BusbarNotify;

// Status of a call that succeeded.
#define BUSBAR_OK 0

// Status of a call whose arguments break a rule of this header: the caller is at fault.
#define BUSBAR_INVALID_ARGUMENT 1

// Status of a call whose settings or address are at fault: the user must change them.
#define BUSBAR_INVALID_SETTINGS 2

// Status of a call whose buffer is too small for the result.
#define BUSBAR_BUFFER_TOO_SMALL 3

// Status of a call that stopped because the caller asked to.
#define BUSBAR_CANCELLED 4

// Status of a call that failed outside the plugin: a file, a device, memory.
#define BUSBAR_FAILED 5

// Status of a call that met a fault of the plugin; a caught panic is one.
#define BUSBAR_INTERNAL 6

#endif  /* BUSBAR_PLUGIN_H */
