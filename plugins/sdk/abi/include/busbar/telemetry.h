/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/telemetry.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.telemetry/2-draft`: samples from devices into the tag table.
 *
 * Adapters are read-only: nothing here lets Busbar command equipment.
 */

#ifndef BUSBAR_TELEMETRY_H
#define BUSBAR_TELEMETRY_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_TELEMETRY_ID "busbar.telemetry/2-draft"

// Sample flag of a buffered sample: a buffered report, a stored or a historical value. Source time
// orders such samples; all others count in the order of their arrival, whatever their source time.
#define BUSBAR_SAMPLE_BUFFERED (1 << 0)

// Sample flag of a promised source time that is missing or unreadable. A good value becomes
// uncertain (source time).
#define BUSBAR_SAMPLE_TIME_UNUSABLE (1 << 1)

// Source timestamp of a sample whose source gives none.
#define BUSBAR_NO_TIME INT64_MIN

// State of the link to the device.
enum BusbarLinkState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Link state of a plugin that has not tried to connect yet.
  BUSBAR_LINK_STATE_IDLE = 0,
  // Link state of a plugin that connects or waits to try again.
  BUSBAR_LINK_STATE_CONNECTING = 1,
  // Link state of a connected plugin.
  BUSBAR_LINK_STATE_UP = 2,
  // Link state of a plugin whose link is down.
  BUSBAR_LINK_STATE_DOWN = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarLinkState BusbarLinkState;
#else
typedef uint32_t BusbarLinkState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Update of one tag. Array element.
typedef struct BusbarSample {
  // Handle of the tag, from `BusbarTagSpec`.
  uint32_t tag;
  // Kind of the value.
  BusbarValueKind kind;
  // Quality of the value.
  BusbarQuality quality;
  // Reason of the quality.
  BusbarReason reason;
  // Flags, `BUSBAR_SAMPLE_*` and `BUSBAR_ORIGIN_*` or'ed; 0 for a live value.
  uint8_t flags;
  // Value of kind `BUSBAR_VALUE_KIND_F64`; of no meaning for others.
  double number;
  // Value of kind `BUSBAR_VALUE_KIND_I64`, `BUSBAR_VALUE_KIND_BOOL` or
  // `BUSBAR_VALUE_KIND_DOUBLE_POINT`; of no meaning for others.
  int64_t integer;
  // Source timestamp, nanoseconds since 1970-01-01 UTC, or `BUSBAR_NO_TIME`.
  int64_t source_time_unix_nanos;
  // Value of kind `BUSBAR_VALUE_KIND_TEXT`, valid during the call; of no meaning for others. Text
  // that is too long or no UTF-8 is taken as far as it is, and is uncertain.
  struct BusbarStr text;
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
  // `[any-thread & active]` Reports the state of the link to operators, with a sentence.
  void (*report_link)(void *context, BusbarLinkState state, struct BusbarStr message);
  // `[any-thread & active]` Sets the scene time of the values published from now on, nanoseconds
  // since 1970-01-01 UTC. For recordings, whose time is not now; overlays then calculate by that
  // time. `BUSBAR_NO_TIME` returns to the wall clock. Null in older hosts.
  void (*report_scene_time)(void *context, int64_t scene_time_unix_nanos);
} BusbarSampleSink;

// Tag that a telemetry plugin is to serve. Array element.
typedef struct BusbarTagSpec {
  // Handle that names the tag in samples.
  uint32_t tag;
  // Kind of value that the host expects.
  BusbarValueKind kind;
  // Reserved; must be zero.
  uint8_t reserved[3];
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

// Function table of `busbar.telemetry/2-draft`.
typedef struct BusbarTelemetry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Origin of all samples of this plugin, `BUSBAR_ORIGIN_*` or'ed; 0 where they are live.
  uint32_t origin;
  // `[serialized & idle]` Checks whether these tags could be served: reads addresses, connects
  // to nothing. All arguments are borrowed for the call. Fails like `start`. May be null.
  BusbarStatus (*check)(const struct BusbarPlugin *plugin,
                        const struct BusbarTagSpec *tags,
                        size_t tag_count,
                        struct BusbarError *error);
  // `[serialized & idle]` Starts to serve tags on threads of the plugin's own and returns at
  // once. A device that does not answer is no failure but Bad quality. The specs are valid
  // during the call, `sink` until `stop` returns. Fails with `BUSBAR_INVALID_SETTINGS` when an
  // address is wrong. The message names every tag at fault that it has room for. The plugin is
  // then idle, and no call to the sink may follow.
  BusbarStatus (*start)(const struct BusbarPlugin *plugin,
                        const struct BusbarTagSpec *tags,
                        size_t tag_count,
                        const struct BusbarSampleSink *sink,
                        struct BusbarError *error);
  // `[serialized & active]` Ends all threads within two seconds. No call
  // to the sink may follow.
  void (*stop)(const struct BusbarPlugin *plugin);
} BusbarTelemetry;

#endif  /* BUSBAR_TELEMETRY_H */
