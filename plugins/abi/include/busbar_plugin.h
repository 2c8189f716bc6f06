/* Busbar plugin ABI 1.0, the contract between host and plugins.
 * Generated from plugins/abi by cbindgen; the test `header` compares the two.
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

// Marks the one symbol that a library exports:
//   BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = { ... };
#if defined(__cplusplus)
#define BUSBAR_EXPORT extern "C" __attribute__((visibility("default")))
#else
#define BUSBAR_EXPORT __attribute__((visibility("default")))
#endif

// Alarms of one report.
#define BUSBAR_MAX_SOURCE_ALARMS 5000

// Bytes of an id, a name, a source or a message.
#define BUSBAR_MAX_SOURCE_ALARM_TEXT 512

// Bytes of a report.
#define BUSBAR_MAX_ALARM_REPORT (24 << 20)

// Axes of a chart.
#define BUSBAR_MAX_CHART_AXES 32

// Records of a chart.
#define BUSBAR_MAX_CHART_RECORDS 10000000

// Bytes of a description, or of an explanation.
#define BUSBAR_MAX_CHART_TEXT (16 << 20)

// Commands of one plugin at most.
#define BUSBAR_MAX_COMMANDS 16

// Bytes of a command's name at most.
#define BUSBAR_MAX_COMMAND_NAME 32

// Bytes of one `write` at most.
#define BUSBAR_MAX_CHUNK (1 << 20)

// Exit code: done.
#define BUSBAR_EXIT_DONE 0

// Exit code: the input is at fault, and nothing could be done.
#define BUSBAR_EXIT_INPUT 1

// Exit code: the arguments are at fault.
#define BUSBAR_EXIT_USAGE 2

// Major version: host and plugin must have the same.
#define BUSBAR_ABI_MAJOR 1

// Minor version: a host runs plugins of its own minor version and older ones.
#define BUSBAR_ABI_MINOR 0

// Bytes of text that a [`BusbarError`] holds.
#define BUSBAR_ERROR_CAPACITY 1024

// Log level: what a user must act on.
#define BUSBAR_LOG_ERROR 1

// Log level: what may become a fault.
#define BUSBAR_LOG_WARNING 2

// Log level: what happened.
#define BUSBAR_LOG_INFO 3

// Log level: for the plugin's author.
#define BUSBAR_LOG_DEBUG 4

// Of `flags`: `optimize` reads positions and triangles alone, so that the host need not
// give it wedges.
#define BUSBAR_OPTIMIZER_NO_WEDGES 1

// Primitive: a line of the label at a node: caption and value.
#define BUSBAR_OVERLAY_LINE 1

// Primitive: the node and all under it drawn in the colour of the severity.
#define BUSBAR_OVERLAY_TINT 2

// Primitive: a piece of equipment, and all under it, in a state of the legend. What rests
// on several bindings is named once for each, one after the other.
#define BUSBAR_OVERLAY_STATE 3

// Pattern: plain colour.
#define BUSBAR_PATTERN_SOLID 0

// Pattern: stripes.
#define BUSBAR_PATTERN_STRIPED 1

// Pattern: stripes that cross.
#define BUSBAR_PATTERN_CROSSED 2

// Pattern: dots.
#define BUSBAR_PATTERN_DOTTED 3

// Quantity: the position of a switch. `value` is the share of its way that it has travelled
// from open (0) to closed (1), in between while it travels; NaN where what is reported
// contradicts itself. `other` is the index of the mechanism.
#define BUSBAR_QUANTITY_POSITION 1

// Quantity: power that flows. `value` is its share of the rating, positive from `equipment`
// to `other`, a second piece of it.
#define BUSBAR_QUANTITY_FLOW 2

// Quantity: a level of the contour, in its unit. `other` is zero.
#define BUSBAR_QUANTITY_LEVEL 3

// Severity: normal; grey.
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

// Flag of a verdict: it rests on a default of the plugin, which the reason names.
#define BUSBAR_VERDICT_ASSUMED 1

// Lists of a plugin.
#define BUSBAR_MAX_RECORD_LISTS 16

// Columns of a list.
#define BUSBAR_MAX_RECORD_COLUMNS 32

// Rows of a list.
#define BUSBAR_MAX_RECORD_ROWS 200000

// Bytes of an equipment id, or of a cell.
#define BUSBAR_MAX_RECORD_TEXT 1024

// Bytes of all texts of all lists of a plugin, each counted with 32 more.
#define BUSBAR_MAX_RECORD_BYTES (64 << 20)

// Bytes of a description.
#define BUSBAR_MAX_RECORD_DESCRIPTION (4 << 20)

// The time of a row that has none.
#define BUSBAR_RECORD_NO_TIME INT64_MIN

// Severity of a row that is no defect, or of which that is not known.
#define BUSBAR_RECORD_NO_SEVERITY 0

// Severity of a defect: to be mended when there is occasion.
#define BUSBAR_RECORD_GENERAL 1

// Severity of a defect: to be mended soon, and watched until then.
#define BUSBAR_RECORD_SERIOUS 2

// Severity of a defect: to be mended at once.
#define BUSBAR_RECORD_CRITICAL 3

// Flag of a row: it is open, so that something is to be done still.
#define BUSBAR_RECORD_OPEN 1

// Shape: the base, always.
#define BUSBAR_SHAPE_CONSTANT 0

// Shape: a sine about the base.
#define BUSBAR_SHAPE_SINE 1

// Shape: a smooth random walk about the base.
#define BUSBAR_SHAPE_WALK 2

// Shape: levels about the base, or positions of a switch, each held for a period.
#define BUSBAR_SHAPE_STEPS 3

// Shape: one more each period, from the base to base and amplitude, then anew.
#define BUSBAR_SHAPE_COUNTER 4

// Fault: connections end, and new ones are turned away.
#define BUSBAR_FAULT_LINK_LOSS 1

// Fault: every answer takes a while, but comes in time.
#define BUSBAR_FAULT_SLOW 2

// Fault: connections stay, and nothing comes through them.
#define BUSBAR_FAULT_HALF_OPEN 4

// Fault: connections are reset, again and again.
#define BUSBAR_FAULT_RESET 8

// Fault: random bytes come instead of answers.
#define BUSBAR_FAULT_GARBAGE 16

// Fault: answers come after the client's deadline.
#define BUSBAR_FAULT_LATE 32

// Fault: the device's clock is wrong.
#define BUSBAR_FAULT_CLOCK_JUMP 64

// Bytes of the text of a [`BusbarSimulatorStatus`].
#define BUSBAR_SIMULATOR_MESSAGE_CAPACITY 512

// Event: the tag goes to a value and stays there.
#define BUSBAR_EVENT_VALUE 0

// Event: the tag moves by its own shape again.
#define BUSBAR_EVENT_RELEASE 1

// Value kind: none; the sample says something about quality only.
#define BUSBAR_VALUE_NONE 0

// Value kind: IEEE 754 double, its bits in `value`.
#define BUSBAR_VALUE_F64 1

// Value kind: two's complement 64-bit integer.
#define BUSBAR_VALUE_I64 2

// Value kind: 0 or 1.
#define BUSBAR_VALUE_BOOL 3

// Value kind: double-point, 0 intermediate, 1 off, 2 on, 3 bad state
// (IEC 60870-5-101, 7.2.6.2).
#define BUSBAR_VALUE_DOUBLE_POINT 4

// Quality: usable.
#define BUSBAR_QUALITY_GOOD 0

// Quality: doubtful.
#define BUSBAR_QUALITY_UNCERTAIN 1

// Quality: not usable.
#define BUSBAR_QUALITY_BAD 2

// Reason: none given.
#define BUSBAR_REASON_NONE 0

// Reason: the link to the device is down.
#define BUSBAR_REASON_COMMUNICATION 1

// Reason: the device says that its sensor failed.
#define BUSBAR_REASON_SENSOR 2

// Reason: outside the measuring range.
#define BUSBAR_REASON_OUT_OF_RANGE 3

// Reason: the device refused the address, or its answer does not fit.
#define BUSBAR_REASON_CONFIGURATION 4

// Reason: not connected yet.
#define BUSBAR_REASON_NOT_CONNECTED 5

// Reason: not a finite number.
#define BUSBAR_REASON_NOT_FINITE 6

// Reason: past its freshness limit. Only the host gives it.
#define BUSBAR_REASON_STALE 7

// Reason: the time that the source gave is missing where one is promised,
// unreadable, in the future or impossible.
#define BUSBAR_REASON_SOURCE_TIME 8

// Sample flag: the sample comes out of a buffer (buffered report, stored or
// historical value). Source time orders such samples; all others count in the
// order of their arrival, whatever their source time.
#define BUSBAR_SAMPLE_BUFFERED (1 << 0)

// Sample flag: settings or protocol promise a source time, and this sample's
// is missing or unreadable. A good value becomes uncertain (source time).
#define BUSBAR_SAMPLE_TIME_UNUSABLE (1 << 1)

// Origin: a person or program put the value in place of the measured one.
#define BUSBAR_ORIGIN_SUBSTITUTED (1 << 2)

// Origin: the device is under test.
#define BUSBAR_ORIGIN_TEST (1 << 3)

// Origin: a simulator made the value.
#define BUSBAR_ORIGIN_SIMULATED (1 << 4)

// Origin: the value is replayed from a recording.
#define BUSBAR_ORIGIN_RECORDED (1 << 5)

// Origin: the source says that the value is of the past.
#define BUSBAR_ORIGIN_HISTORICAL (1 << 6)

// `source_time` of a sample whose source gives no time.
#define BUSBAR_NO_TIME INT64_MIN

// State of the plugin's link: not tried yet.
#define BUSBAR_LINK_IDLE 0

// State of the plugin's link: connecting or waiting to try again.
#define BUSBAR_LINK_CONNECTING 1

// State of the plugin's link: up.
#define BUSBAR_LINK_UP 2

// State of the plugin's link: down.
#define BUSBAR_LINK_DOWN 3

// Result of a call: [`BUSBAR_OK`] or one of the codes below it.
typedef int32_t BusbarStatus;

// Why a call failed. The caller owns it and fills in `struct_size`.
typedef struct BusbarError {
  // Size of this struct as the caller knows it, bytes.
  uint32_t struct_size;
  // Bytes used of `message`, at most its size.
  uint32_t message_len;
  // The code that goes with it, for calls that return no status.
  BusbarStatus status;
  // UTF-8: fault, place and remedy in one or two sentences.
  uint8_t message[1024];
} BusbarError;

// UTF-8 text with a length in bytes, not terminated. `ptr` may be null only
// if `len` is 0.
typedef struct BusbarStr {
  // First byte.
  const uint8_t *ptr;
  // Length in bytes.
  size_t len;
} BusbarStr;

// The one exported entry. Static in the library, for its whole life.
typedef struct BusbarPluginEntry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // [`BUSBAR_ABI_MAJOR`] that the plugin was built with.
  uint32_t abi_major;
  // [`BUSBAR_ABI_MINOR`] that the plugin was built with.
  uint32_t abi_minor;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Called before anything else. May be null.
  BusbarStatus (*init)(struct BusbarError *error);
  // `[main-thread]` Called once for every `init`, after every plugin is
  // destroyed. The library stays mapped, and `init` may follow again. May be
  // null.
  void (*deinit)(void);
  // `[main-thread]` A factory by id, static, or null if there is none.
  // `busbar.plugin-factory/1` gives a [`BusbarPluginFactory`].
  const void *(*get_factory)(struct BusbarStr factory_id);
} BusbarPluginEntry;

// What a plugin is. Static.
typedef struct BusbarPluginDescriptor {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of capabilities, at most 64.
  uint32_t capability_count;
  // Unique id in reverse notation, such as `com.example.mine`: letters, digits,
  // `.`, `_` and `-`, at most 128.
  struct BusbarStr id;
  // Name for people.
  struct BusbarStr name;
  // Version of the plugin.
  struct BusbarStr version;
  // One sentence.
  struct BusbarStr description;
  // JSON Schema of the settings; empty accepts any object.
  struct BusbarStr settings_schema;
  // Ids of its capabilities, `capability_count` of them.
  const struct BusbarStr *capabilities;
} BusbarPluginDescriptor;

// One instance. Owned by the library; the host gives it back by `destroy`.
typedef struct BusbarPlugin {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // The library's own.
  void *data;
  // `[main-thread & idle]` Ends the instance and frees it. No call to the
  // host may follow.
  void (*destroy)(struct BusbarPlugin *plugin);
  // `[main-thread]` The table of a capability by id, valid until `destroy`,
  // or null if the plugin does not have it.
  const void *(*get_capability)(const struct BusbarPlugin *plugin, struct BusbarStr capability_id);
} BusbarPlugin;

// What the host offers to one plugin instance. Valid from `create` until
// `destroy` returns.
typedef struct BusbarHost {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // The host's ABI major version.
  uint32_t abi_major;
  // The host's ABI minor version.
  uint32_t abi_minor;
  // Zero.
  uint32_t reserved;
  // Passed back in every call to the host.
  void *context;
  // `[any-thread]` Writes one line to the host's log. Messages beyond the
  // host's rate limit are dropped and counted. Cannot fail.
  void (*log)(void *context, uint32_t level, struct BusbarStr message);
} BusbarHost;

// Makes plugins.
typedef struct BusbarPluginFactory {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Number of plugins in this library, at most 64.
  uint32_t (*count)(void);
  // `[main-thread]` Descriptor of one of them, static, or null if `index`
  // is too large.
  const struct BusbarPluginDescriptor *(*descriptor)(uint32_t index);
  // `[main-thread]` Makes an instance with settings (a JSON object that
  // fits the descriptor's schema). Returns null and fills `error` on
  // failure. `host` stays valid until `destroy` returns.
  struct BusbarPlugin *(*create)(struct BusbarStr plugin_id,
                                 struct BusbarStr settings_json,
                                 const struct BusbarHost *host,
                                 struct BusbarError *error);
} BusbarPluginFactory;

// A triangle mesh over welded positions, and the wedges that split them.
//
// A *wedge* is one position with one set of attributes; a position on a
// normal, texture or material seam has several. The fields from `wedge_count`
// on came later: they are there if `struct_size` reaches over them, and count
// and pointers are zero where the host has no attributes or the plugin wants
// none (`BUSBAR_OPTIMIZER_NO_WEDGES`). Either all five arrays are given or none.
typedef struct BusbarMesh {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of positions.
  uint32_t position_count;
  // Number of triangles.
  uint32_t triangle_count;
  // Zero.
  uint32_t reserved;
  // x, y, z of each position, finite, metres.
  const float *positions;
  // Three different position indices of each triangle, counter-clockwise.
  const uint32_t *triangles;
  // Number of wedges: at least one for each position, or 0.
  uint32_t wedge_count;
  // Zero.
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
  // Zero.
  uint32_t reserved;
  // Passed back in `report`.
  void *context;
  // `[the thread of the call]` Says how much is done, 0 to 1. Returns 0 if
  // the plugin must stop and return `BUSBAR_CANCELLED`. May be null.
  uint32_t (*report)(void *context, float fraction);
} BusbarProgress;

// One half-edge collapse. Array element.
typedef struct BusbarCollapse {
  // Position that goes. No later entry may name it.
  uint32_t removed;
  // Position that stands for it; must not have been removed before.
  uint32_t kept;
  // Geometric error after this collapse, metres: finite, at least 0, never
  // decreasing along the sequence.
  float error;
} BusbarCollapse;

// Time of one stage of the work. Array element.
typedef struct BusbarStage {
  // UTF-8 name, padded with zeros.
  uint8_t name[24];
  // Milliseconds.
  double millis;
} BusbarStage;

// Buffers for the result. The caller owns them; the plugin fills in the
// counts.
typedef struct BusbarCollapseOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Room in `collapses`: at least `position_count`.
  uint32_t collapse_capacity;
  // Collapses written.
  uint32_t collapse_count;
  // Room in `stages`.
  uint32_t stage_capacity;
  // Stages written.
  uint32_t stage_count;
  // Zero.
  uint32_t reserved;
  // The sequence, in order.
  struct BusbarCollapse *collapses;
  // Times of the stages, for reports.
  struct BusbarStage *stages;
} BusbarCollapseOutput;

// Table of `busbar.mesh-optimizer/1-draft`.
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

// One tag that a telemetry plugin is to serve. Array element.
typedef struct BusbarTagSpec {
  // Names the tag in samples.
  uint32_t tag;
  // `BUSBAR_VALUE_*` that the host wants.
  uint32_t kind;
  // Freshness limit: a value older than this is stale, milliseconds.
  uint64_t freshness_millis;
  // Tag id, for messages.
  struct BusbarStr id;
  // The tag's address for this plugin: JSON, as the configuration has it.
  struct BusbarStr address_json;
} BusbarTagSpec;

// One update of one tag, 24 bytes. Array element.
typedef struct BusbarSample {
  // Handle from [`BusbarTagSpec`].
  uint32_t tag;
  // `BUSBAR_VALUE_*`.
  uint8_t kind;
  // `BUSBAR_QUALITY_*`.
  uint8_t quality;
  // `BUSBAR_REASON_*`.
  uint8_t reason;
  // `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*`, or'ed; 0 for a live value.
  uint8_t flags;
  // Bits of the value, after `kind`.
  uint64_t value;
  // Time at the source, nanoseconds since 1970-01-01 UTC, or
  // [`BUSBAR_NO_TIME`].
  int64_t source_time_unix_nanos;
} BusbarSample;

// Where samples go. Valid from `start` until `stop` returns.
typedef struct BusbarSampleSink {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // Passed back in every call.
  void *context;
  // `[any-thread & active]` Takes a batch, copying it, without blocking.
  // Returns how many samples were taken. When the queue is full, the
  // oldest in it are dropped and counted.
  size_t (*publish)(void *context, const struct BusbarSample *samples, size_t count);
  // `[any-thread & active]` Tells operators how the link is:
  // `BUSBAR_LINK_*` and a sentence.
  void (*report_link)(void *context, uint32_t state, struct BusbarStr message);
  // `[any-thread & active]` Tells the time that the values published from
  // here on are of, nanoseconds since 1970-01-01 UTC, where that is not now:
  // a recording's. Overlays then calculate by that time.
  // [`BUSBAR_NO_TIME`] goes back to the wall clock. Null in older hosts.
  void (*report_scene_time)(void *context, int64_t scene_time_unix_nanos);
} BusbarSampleSink;

// Table of `busbar.telemetry/1-draft`.
typedef struct BusbarTelemetry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // `BUSBAR_ORIGIN_*`, or'ed, of all samples of this plugin; 0 where they
  // are live.
  uint32_t origin;
  // `[main-thread & idle]` Whether these tags could be served: reads
  // addresses, connects to nothing. Everything is borrowed for the call.
  // Fails like `start`. May be null.
  BusbarStatus (*check)(const struct BusbarPlugin *plugin,
                        const struct BusbarTagSpec *tags,
                        size_t tag_count,
                        struct BusbarError *error);
  // `[main-thread & idle]` Starts to serve tags on threads of the plugin's
  // own and returns at once; a device that does not answer is no failure
  // but Bad quality. The specs are valid during the call, `sink` until
  // `stop` returns. Fails with `BUSBAR_INVALID_SETTINGS` when an address is
  // wrong, naming every tag at fault that the message has room for; the
  // plugin is then idle, and no call to the sink may follow.
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
  // Tag id.
  struct BusbarStr tag_id;
  // Tag name for people.
  struct BusbarStr tag_name;
  // Unit, such as `kV`; empty for none.
  struct BusbarStr unit;
  // Equipment id of the node.
  struct BusbarStr node_id;
  // What the value means to the node, as the configuration words it.
  struct BusbarStr role;
} BusbarBinding;

// The state of one bound tag in this frame. Array element.
typedef struct BusbarTagValue {
  // `BUSBAR_VALUE_*`; `BUSBAR_VALUE_NONE` if no value came yet.
  uint8_t kind;
  // `BUSBAR_QUALITY_*`, freshness included.
  uint8_t quality;
  // `BUSBAR_REASON_*`.
  uint8_t reason;
  // Zero.
  uint8_t reserved[5];
  // Bits of the last value.
  uint64_t value;
  // Time since that value came, milliseconds.
  uint64_t age_millis;
} BusbarTagValue;

// All bound tags at one instant.
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

// One thing to draw. Array element.
typedef struct BusbarOverlayPrimitive {
  // `BUSBAR_OVERLAY_*`.
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
  // `BUSBAR_QUANTITY_*`.
  uint32_t kind;
  // Index of the binding whose value this rests on: what is not good is drawn as not known.
  uint32_t binding;
  // Index of the equipment described.
  uint32_t equipment;
  // By kind.
  uint32_t other;
  // By kind; finite unless the kind says otherwise.
  double value;
} BusbarOverlayQuantity;

// The judgment of an overlay on one piece of equipment. Array element. Every piece that
// was described has one in every frame; the host takes a piece without one as unknown, and
// says that the plugin is at fault.
typedef struct BusbarOverlayVerdict {
  // Index of the equipment described.
  uint32_t equipment;
  // `BUSBAR_VERDICT_*`.
  uint32_t verdict;
  // `BUSBAR_VERDICT_ASSUMED`, or 0.
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
  // Room in `primitives`.
  uint32_t primitive_capacity;
  // Primitives written.
  uint32_t primitive_count;
  // Room in `text`, bytes.
  uint32_t text_capacity;
  // Bytes of `text` written.
  uint32_t text_len;
  // Zero.
  uint32_t reserved;
  // What to draw.
  struct BusbarOverlayPrimitive *primitives;
  // UTF-8 that the primitives name.
  uint8_t *text;
  // Room in `quantities`. This and what follows is there where the size says so.
  uint32_t quantity_capacity;
  // Quantities written.
  uint32_t quantity_count;
  // What has a shape of the host's.
  struct BusbarOverlayQuantity *quantities;
  // Room in `verdicts`. This and what follows is there where the size says so.
  uint32_t verdict_capacity;
  // Verdicts written.
  uint32_t verdict_count;
  // Judgments on the equipment described.
  struct BusbarOverlayVerdict *verdicts;
  // Room in `basis`.
  uint32_t basis_capacity;
  // Elements of `basis` written.
  uint32_t basis_count;
  // Indices of bindings that verdicts rest on.
  uint32_t *basis;
} BusbarOverlayOutput;

// A state that an overlay shows equipment in, as the legend has it. Array element.
typedef struct BusbarLegendEntry {
  // What it says, for people; at most 64 bytes.
  struct BusbarStr name;
  // `BUSBAR_PATTERN_*`: no two entries that differ in colour alone may mean different
  // things to who sees none.
  uint32_t pattern;
  // `0xRRGGBB`, sRGB.
  uint32_t color;
} BusbarLegendEntry;

// A quantity whose course over the ground an overlay shows, worked out of levels at
// equipment. Array element.
typedef struct BusbarContour {
  // What it is called, for people; at most 64 bytes.
  struct BusbarStr name;
  // Its unit, such as `°C`; empty for none; at most 16 bytes.
  struct BusbarStr unit;
  // How far around a piece of equipment its level counts, metres; 0.1 to 1000.
  double reach_metres;
  // Normal band, lower end; NaN for none. Only what lies outside the band is coloured.
  double low;
  // Normal band, upper end; NaN for none.
  double high;
  // From one line of equal level to the next, in the unit; above 0.
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
  // Zero.
  uint32_t reserved;
  // The legend.
  const struct BusbarLegendEntry *legend;
  // Ids, by any alias, of the equipment that is judged: every piece that the settings or
  // the bindings name. `draw` gives each of them a verdict.
  const struct BusbarStr *equipment;
  // Number of mechanisms; at most 16. This and what follows is there where the size
  // says so.
  uint32_t mechanism_count;
  // Whether it is drawn only once an operator switches it on: 0 or 1.
  uint32_t starts_hidden;
  // Names of mechanisms, as models have them, that positions are given of.
  const struct BusbarStr *mechanisms;
  // The contour that levels are of; null for none.
  const struct BusbarContour *contour;
  // Number of findings; at most 256. This and what follows is there where the size
  // says so.
  uint32_t finding_count;
  // Zero.
  uint32_t reserved_2;
  // Faults of the bindings given, each as cause and remedy with `; ` between: a role
  // that no tag has, a unit that cannot be converted. `busbar check` refuses them; a
  // view shows the equipment as unknown.
  const struct BusbarStr *findings;
} BusbarOverlayDescription;

// Table of `busbar.overlay/1-draft`.
typedef struct BusbarOverlay {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
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

// One tag that is simulated. Array element.
typedef struct BusbarSimulatedTag {
  // The tag, as telemetry has it.
  struct BusbarTagSpec spec;
  // `BUSBAR_SHAPE_*`.
  uint32_t shape;
  // Zero.
  uint32_t reserved;
  // What it is about, in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double base;
  // How far it goes from that; not negative.
  double amplitude;
  // Time of a wave, a level or a count, seconds; more than 0.
  double period_seconds;
} BusbarSimulatedTag;

// Something that happens to a simulated tag. Array element.
typedef struct BusbarSimulatedEvent {
  // Handle of the tag.
  uint32_t tag;
  // `BUSBAR_EVENT_*`.
  uint32_t kind;
  // When, seconds since the scenario began; not negative.
  double at_seconds;
  // How long the way to the value takes, seconds; not negative, 0 for bool and
  // double-point.
  double over_seconds;
  // The value in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double value;
} BusbarSimulatedEvent;

// A time in which the link fails. Array element.
typedef struct BusbarLinkFault {
  // `BUSBAR_FAULT_*`, one of them.
  uint32_t fault;
  // Zero.
  uint32_t reserved;
  // When it begins, seconds since the scenario began; not negative.
  double at_seconds;
  // How long it holds, seconds; more than 0.
  double for_seconds;
} BusbarLinkFault;

// What holds for all tags of a simulation.
typedef struct BusbarSimulation {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Sum of the `BUSBAR_FAULT_*` that strike; 0 for none.
  uint32_t faults;
  // The same seed gives the same values and the same faults.
  uint64_t seed;
  // Period in which changes are looked for, milliseconds; more than 0. Of no
  // meaning to protocols whose devices only answer.
  uint64_t update_millis;
  // In each of these periods one fault strikes, milliseconds; more than
  // `fault_millis`.
  uint64_t fault_period_millis;
  // How long a fault holds at most, milliseconds; more than 0.
  uint64_t fault_millis;
  // When the scenario began, nanoseconds since 1970-01-01 UTC; a plugin that is started
  // again goes on with it.
  int64_t scenario_unix_nanos;
  // Number of events.
  uint32_t event_count;
  // Number of link faults.
  uint32_t link_fault_count;
  // What happens to tags, in the order of time.
  const struct BusbarSimulatedEvent *events;
  // What happens to the link, in the order of time.
  const struct BusbarLinkFault *link_faults;
} BusbarSimulation;

// How a simulation goes.
typedef struct BusbarSimulatorStatus {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // The `BUSBAR_FAULT_*` that holds; 0 for none.
  uint32_t fault;
  // Clients that are connected.
  uint32_t clients;
  // Used bytes of `message`.
  uint32_t message_len;
  // Connections that were taken so far.
  uint64_t connections;
  // Answers to requests, and messages without one, that were sent so far.
  uint64_t messages;
  // Where it listens, UTF-8.
  uint8_t message[BUSBAR_SIMULATOR_MESSAGE_CAPACITY];
} BusbarSimulatorStatus;

// Table of `busbar.simulator/1-draft`. Whether the plugin also serves tags by
// `busbar.telemetry/1-draft` is of no concern to it.
typedef struct BusbarSimulator {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread & idle]` Listens, serves tags on threads of the plugin's own, and
  // returns at once. Tags and simulation are valid during the call. Fails with
  // `BUSBAR_INVALID_SETTINGS` when an address is wrong or cannot hold the values of
  // its tag, naming every tag at fault that the message has room for; with
  // `BUSBAR_FAILED` when it cannot listen. The plugin is then idle.
  BusbarStatus (*start)(const struct BusbarPlugin *plugin,
                        const struct BusbarSimulatedTag *tags,
                        size_t tag_count,
                        const struct BusbarSimulation *simulation,
                        struct BusbarError *error);
  // `[main-thread & active]` Ends all connections and threads within two seconds,
  // and listens no more.
  void (*stop)(const struct BusbarPlugin *plugin);
  // `[main-thread & active]` Fills in how it goes.
  BusbarStatus (*status)(const struct BusbarPlugin *plugin,
                         struct BusbarSimulatorStatus *status,
                         struct BusbarError *error);
} BusbarSimulator;

// A command that a plugin offers. Valid until `destroy`.
typedef struct BusbarCommandInfo {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // What users type: a lower-case letter, then lower-case letters, digits and `-`.
  struct BusbarStr name;
  // One line: what it does.
  struct BusbarStr help;
} BusbarCommandInfo;

// What a command is to do.
typedef struct BusbarCommandCall {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of arguments.
  uint32_t argument_count;
  // Name of the command.
  struct BusbarStr name;
  // What users wrote for the plugin, besides files.
  const struct BusbarStr *arguments;
} BusbarCommandCall;

// Input, output and diagnostics of a command. Valid during `run`, on its thread alone.
typedef struct BusbarCommandStreams {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // Passed back in every call.
  void *context;
  // `[the thread of the call]` Puts at most `capacity` bytes of the input into `buffer`.
  // Returns how many; 0 at the end, and less than 0 if the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  int64_t (*read)(void *context, uint8_t *buffer, size_t capacity);
  // `[the thread of the call]` Takes `len` bytes of output, at most
  // [`BUSBAR_MAX_CHUNK`], copying them. Returns 0 if the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  uint32_t (*write)(void *context, const uint8_t *bytes, size_t len);
  // `[the thread of the call]` Says something of the input: `level` is a
  // `BUSBAR_LOG_*`, `line` the line of the input that it is about, 1 the first, 0 for
  // none. Messages beyond the host's limit are counted, not kept. Cannot fail.
  void (*diagnose)(void *context, uint32_t level, uint64_t line, struct BusbarStr message);
} BusbarCommandStreams;

// What a command came to. The caller owns it and fills in `struct_size`.
typedef struct BusbarCommandResult {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // `BUSBAR_EXIT_*`.
  uint32_t exit_code;
} BusbarCommandResult;

// Table of `busbar.command/1-draft`.
typedef struct BusbarCommand {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Number of commands, at most [`BUSBAR_MAX_COMMANDS`].
  uint32_t (*count)(const struct BusbarPlugin *plugin);
  // `[main-thread]` One of them, valid until `destroy`, or null if `index` is too large.
  const struct BusbarCommandInfo *(*describe)(const struct BusbarPlugin *plugin, uint32_t index);
  // `[main-thread]` Does a command: reads the input as far as it needs, writes its output
  // in order, and fills in the exit code. Everything is borrowed for the call. What is
  // wrong with the input is a diagnostic and at worst `BUSBAR_EXIT_INPUT`, no failure.
  // Fails with `BUSBAR_INVALID_ARGUMENT` for a name that it does not offer, with
  // `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
  BusbarStatus (*run)(const struct BusbarPlugin *plugin,
                      const struct BusbarCommandCall *call,
                      const struct BusbarCommandStreams *streams,
                      struct BusbarCommandResult *result,
                      struct BusbarError *error);
} BusbarCommand;

// Room for a text. The caller owns it.
typedef struct BusbarTextOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Room in `text`, bytes.
  uint32_t capacity;
  // Bytes written; where there was too little room, bytes needed.
  uint32_t len;
  // Zero.
  uint32_t reserved;
  // UTF-8.
  uint8_t *text;
} BusbarTextOutput;

// What a record is besides its values. Array element.
typedef struct BusbarChartRecord {
  // When it was taken, nanoseconds since 1970-01-01 UTC.
  int64_t time_unix_nanos;
  // Index of the equipment described.
  uint32_t equipment;
  // Index of the legend's entry.
  uint32_t state;
} BusbarChartRecord;

// Room for some of the records. The caller owns it and says what it wants.
typedef struct BusbarChartPage {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Axes that the caller was told of: values a record.
  uint32_t axis_count;
  // The first record wanted.
  uint64_t first;
  // Room in `records`; 0 asks for revision and total alone.
  uint32_t capacity;
  // Records written.
  uint32_t count;
  // Records there are.
  uint64_t total;
  // Grows with every change of description or records.
  uint64_t revision;
  // The records, those of each piece of equipment in the order of time.
  struct BusbarChartRecord *records;
  // `axis_count` values a record, in its unit; NaN where there is none.
  float *values;
} BusbarChartPage;

// Table of `busbar.chart/1-draft`.
typedef struct BusbarChart {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Writes the description as JSON. Fails with
  // `BUSBAR_BUFFER_TOO_SMALL` when it does not fit, and says in `len` what it takes.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarTextOutput *output,
                           struct BusbarError *error);
  // `[main-thread]` Writes records. Fails with `BUSBAR_INVALID_ARGUMENT` when the
  // number of axes is not that of the description.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       struct BusbarChartPage *page,
                       struct BusbarError *error);
  // `[main-thread]` Writes as JSON what the last record of a piece of equipment that is
  // not after an instant means. Fails as `describe` does.
  BusbarStatus (*explain)(const struct BusbarPlugin *plugin,
                          struct BusbarStr equipment,
                          int64_t time_unix_nanos,
                          struct BusbarTextOutput *output,
                          struct BusbarError *error);
} BusbarChart;

// What a row is besides its texts. Array element.
typedef struct BusbarRecordRow {
  // When it was reported or done, nanoseconds since 1970-01-01 UTC, or
  // `BUSBAR_RECORD_NO_TIME`.
  int64_t time_unix_nanos;
  // `BUSBAR_RECORD_*` of severities.
  uint32_t severity;
  // `BUSBAR_RECORD_OPEN`, or 0.
  uint32_t flags;
} BusbarRecordRow;

// Room for some of the rows of a list. The caller owns it and says what it wants.
typedef struct BusbarRecordPage {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Index of the list described.
  uint32_t list;
  // Columns that the caller was told of.
  uint32_t column_count;
  // Room in `rows`; 0 asks for the revision alone, of whatever list.
  uint32_t row_capacity;
  // The first row wanted.
  uint64_t first;
  // Room in `text`, bytes.
  uint32_t text_capacity;
  // Rows written: as many as there is room for.
  uint32_t row_count;
  // Rows that the list has.
  uint64_t total;
  // Grows with every change of the description or of any list.
  uint64_t revision;
  // The rows.
  struct BusbarRecordRow *rows;
  // Where texts end in `text`: `1 + column_count` a row, row by row. The first is the id
  // of the equipment, or any alias of it; then comes a cell a column.
  uint32_t *ends;
  // UTF-8.
  uint8_t *text;
} BusbarRecordPage;

// Table of `busbar.records/1-draft`.
typedef struct BusbarRecords {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Writes the description as JSON. Fails with
  // `BUSBAR_BUFFER_TOO_SMALL` when it does not fit, and says in `len` what it takes.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarTextOutput *output,
                           struct BusbarError *error);
  // `[main-thread]` Writes rows. Fails with `BUSBAR_INVALID_ARGUMENT` when there is no
  // such list, or its columns are more or fewer; with `BUSBAR_BUFFER_TOO_SMALL` when not
  // one row fits.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       struct BusbarRecordPage *page,
                       struct BusbarError *error);
} BusbarRecords;

// Table of `busbar.alarms/1-draft`.
typedef struct BusbarAlarms {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Zero.
  uint32_t reserved;
  // `[main-thread]` Writes as JSON how the alarms stand. Where their revision is still
  // the known one, or they are not known at all, the report may be without alarms; 0 is
  // never a revision. Returns at
  // once with what is known. Fails with `BUSBAR_BUFFER_TOO_SMALL` when it does not fit,
  // and says in `len` what it takes.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       uint64_t known_revision,
                       struct BusbarTextOutput *output,
                       struct BusbarError *error);
} BusbarAlarms;

// Done.
#define BUSBAR_OK 0

// The arguments break a rule of this header: the caller is at fault.
#define BUSBAR_INVALID_ARGUMENT 1

// The settings or an address are at fault: the user must change them.
#define BUSBAR_INVALID_SETTINGS 2

// A buffer of the caller is too small for the result.
#define BUSBAR_BUFFER_TOO_SMALL 3

// The caller asked to stop, and the call stopped.
#define BUSBAR_CANCELLED 4

// Something outside failed: a file, a device, memory.
#define BUSBAR_FAILED 5

// The plugin has a fault of its own; a caught panic is one.
#define BUSBAR_INTERNAL 6

#endif  /* BUSBAR_PLUGIN_H */
