/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/alarms.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.alarms/1-draft`: alarms of another system, which decides on them; the host
 * shows them.
 *
 * The plugin says which alarms are of interest now, how each stands, and whether what it
 * says is current; `plugins/sdk/sdk/src/alarms.rs` has the fields of the JSON.
 */

#ifndef BUSBAR_ALARMS_H
#define BUSBAR_ALARMS_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_ALARMS_ID "busbar.alarms/1-draft"

// Alarms of one report, at most.
#define BUSBAR_MAX_SOURCE_ALARMS 5000

// Bytes of an id, a name, a source or a message, at most.
#define BUSBAR_MAX_SOURCE_ALARM_TEXT 512

// Bytes of a report, at most.
#define BUSBAR_MAX_ALARM_REPORT (24 << 20)

// Function table of `busbar.alarms/1-draft`.
typedef struct BusbarAlarms {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Writes the state of the alarms as JSON, and returns at once. The report may
  // be without alarms where their revision is still `known_revision`, or where they are not
  // known at all. 0 is never a revision. Fails with `BUSBAR_BUFFER_TOO_SMALL` when the text does
  // not fit, with the bytes needed in `len`.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin,
                       uint64_t known_revision,
                       struct BusbarTextOutput *output,
                       struct BusbarError *error);
} BusbarAlarms;

#endif  /* BUSBAR_ALARMS_H */
