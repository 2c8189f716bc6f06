/* Busbar plugin ABI 1.0, the contract between host and plugins.
 * Generated from plugins/sdk/abi/src/entry.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * This header is what every plugin needs. A capability has a header of its own beside
 * this one, such as `busbar/telemetry.h`; `busbar/values.h` has what they share.
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
 * - Tags in brackets say who calls when: [serialized] one call after the other:
 *   never two such calls at once on one instance (without an instance: on one
 *   library), though not always on the same thread; [any-thread] any thread, also
 *   several at once; [idle] before `start` or after `stop`; [active] between them.
 * - A field of an enum's type may hold a number that the enum lacks, from a host or
 *   plugin that is newer: take it as unknown.
 *
 * Entry, factory, descriptor, plugin, host table and error are frozen: a library
 * built against this header loads in every 1.x. Capabilities whose id ends in
 * `-draft` may still change; rebuild with the header of the host.
 */

#ifndef BUSBAR_PLUGIN_H
#define BUSBAR_PLUGIN_H

#include <stddef.h>
#include <stdint.h>
// Id of the factory.
#define BUSBAR_PLUGIN_FACTORY_ID "busbar.plugin-factory/1"

// Marks the one symbol that a library exports:
//   BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = { ... };
#if defined(__cplusplus)
#define BUSBAR_EXPORT extern "C" __attribute__((visibility("default")))
#else
#define BUSBAR_EXPORT __attribute__((visibility("default")))
#endif

// Major version of the ABI: host and plugin must have the same.
#define BUSBAR_ABI_MAJOR 1

// Minor version of the ABI: a host runs plugins of its own minor version and older ones.
#define BUSBAR_ABI_MINOR 0

// Bytes of text that a `BusbarError` holds.
#define BUSBAR_ERROR_CAPACITY 1024

// Level of a line in the host's log, and of a command's diagnostic.
//
enum BusbarLogLevel
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Log level of faults that a user must act on.
  BUSBAR_LOG_ERROR = 1,
  // Log level of conditions that may become a fault.
  BUSBAR_LOG_WARNING = 2,
  // Log level of ordinary events.
  BUSBAR_LOG_INFO = 3,
  // Log level of details for the plugin's author.
  BUSBAR_LOG_DEBUG = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarLogLevel BusbarLogLevel;
#else
typedef uint32_t BusbarLogLevel;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Result of a call: success, or the kind of failure.
//
enum BusbarStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Status of a call that succeeded.
  BUSBAR_OK = 0,
  // Status of a call whose arguments break a rule of this header: the caller is at fault.
  BUSBAR_INVALID_ARGUMENT = 1,
  // Status of a call whose settings or address are at fault: the user must change them.
  BUSBAR_INVALID_SETTINGS = 2,
  // Status of a call whose buffer is too small for the result.
  BUSBAR_BUFFER_TOO_SMALL = 3,
  // Status of a call that stopped because the caller asked to.
  BUSBAR_CANCELLED = 4,
  // Status of a call that failed outside the plugin: a file, a device, memory.
  BUSBAR_FAILED = 5,
  // Status of a call that met a fault of the plugin; a caught panic is one.
  BUSBAR_INTERNAL = 6,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarStatus BusbarStatus;
#else
typedef int32_t BusbarStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

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
  void (*log)(void *context, BusbarLogLevel level, struct BusbarStr message);
} BusbarHost;

// Plugin instance. The library owns it; the host ends it by `destroy`.
typedef struct BusbarPlugin {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Data of the library's own.
  void *data;
  // `[serialized & idle]` Ends the instance and frees it. No call to the
  // host may follow.
  void (*destroy)(struct BusbarPlugin *plugin);
  // `[serialized]` Returns the function table of a capability by id, valid until `destroy`, or
  // null if the plugin lacks the capability.
  const void *(*get_capability)(const struct BusbarPlugin *plugin, struct BusbarStr capability_id);
} BusbarPlugin;

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

// Entry point that a library exports. Static, for the library's whole life.
typedef struct BusbarPluginEntry {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Major version that the plugin was built with, `BUSBAR_ABI_MAJOR`.
  uint32_t abi_major;
  // Minor version that the plugin was built with, `BUSBAR_ABI_MINOR`.
  uint32_t abi_minor;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Initializes the library, before any other call. May be null.
  BusbarStatus (*init)(struct BusbarError *error);
  // `[serialized]` Called once for every `init`, after every plugin is destroyed. The library
  // stays mapped, and `init` may follow again. May be null.
  void (*deinit)(void);
  // `[serialized]` Returns a static factory by id, or null if there is none.
  // `busbar.plugin-factory/1` names a `BusbarPluginFactory`.
  const void *(*get_factory)(struct BusbarStr factory_id);
} BusbarPluginEntry;

// Factory of plugin instances.
typedef struct BusbarPluginFactory {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Number of plugins in this library, at most 64.
  uint32_t (*count)(void);
  // `[serialized]` Returns a plugin's static descriptor, or null if `index` is too large.
  const struct BusbarPluginDescriptor *(*descriptor)(uint32_t index);
  // `[serialized]` Creates an instance with settings, a JSON object that fits the descriptor's
  // schema. Returns null and fills in `error` on failure. `host` stays valid until `destroy`
  // returns.
  struct BusbarPlugin *(*create)(struct BusbarStr plugin_id,
                                 struct BusbarStr settings_json,
                                 const struct BusbarHost *host,
                                 struct BusbarError *error);
} BusbarPluginFactory;

#endif  /* BUSBAR_PLUGIN_H */
