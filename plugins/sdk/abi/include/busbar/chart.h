/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/chart.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.chart/1-draft`: records for parallel coordinates, and explanations of one
 * piece of equipment's records.
 *
 * The plugin gives axes, records and the states that equipment is in by its latest record;
 * the host lays out, draws, brushes and marks. What seldom changes is JSON, as settings
 * are; `plugins/sdk/sdk/src/chart.rs` has its fields.
 */

#ifndef BUSBAR_CHART_H
#define BUSBAR_CHART_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_CHART_ID "busbar.chart/1-draft"

// Axes of a chart, at most.
#define BUSBAR_MAX_CHART_AXES 32

// Records of a chart, at most.
#define BUSBAR_MAX_CHART_RECORDS 10000000

// Bytes of a description, or of an explanation, at most.
#define BUSBAR_MAX_CHART_TEXT (16 << 20)

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
  // `[serialized]` Writes the description as JSON. Fails with `BUSBAR_BUFFER_TOO_SMALL` when
  // the text does not fit, with the bytes needed in `len`.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin, struct BusbarTextOutput *output, struct BusbarError *error);
  // `[serialized]` Writes records. Fails with `BUSBAR_INVALID_ARGUMENT` when the
  // number of axes is not that of the description.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin, struct BusbarChartPage *page, struct BusbarError *error);
  // `[serialized]` Writes an explanation as JSON: of a piece of equipment's last record that is
  // not after an instant. Fails as `describe` does.
  BusbarStatus (*explain)(const struct BusbarPlugin *plugin,
                          struct BusbarStr equipment,
                          int64_t time_unix_nanos,
                          struct BusbarTextOutput *output,
                          struct BusbarError *error);
} BusbarChart;

#endif  /* BUSBAR_CHART_H */
