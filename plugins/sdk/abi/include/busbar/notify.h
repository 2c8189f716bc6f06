/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/notify.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.notify/1-draft`: changes of alarms for plugins that tell people who are not in
 * the room.
 *
 * The host hands over changes with growing numbers, again and again until the plugin has taken
 * them; `plugins/sdk/sdk/src/notify.rs` has the fields of the JSON.
 */

#ifndef BUSBAR_NOTIFY_H
#define BUSBAR_NOTIFY_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_NOTIFY_ID "busbar.notify/1-draft"

// Changes of one batch, at most.
#define BUSBAR_MAX_NOTIFY_CHANGES 256

// Alarms of one list of standing alarms, at most.
#define BUSBAR_MAX_NOTIFY_STANDING 2000

// Bytes of the sentence in a report, at most.
#define BUSBAR_MAX_NOTIFY_MESSAGE 1024

// Bytes of a report, at most.
#define BUSBAR_MAX_NOTIFY_REPORT (64 << 10)

// Function table of `busbar.notify/1-draft`.
typedef struct BusbarNotify {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Takes a batch of changes as JSON, writes a report as JSON, and returns
  // without waiting for any receiver. Changes that were taken before may come again and count
  // once. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the report does not fit, with the bytes
  // needed in `len`; the batch comes again then.
  BusbarStatus (*notify)(const struct BusbarPlugin *plugin,
                         struct BusbarStr batch,
                         struct BusbarTextOutput *output,
                         struct BusbarError *error);
} BusbarNotify;

#endif  /* BUSBAR_NOTIFY_H */
