/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/records.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.records/1-draft`: lists of rows about equipment, from business and asset
 * management systems.
 *
 * The plugin gives lists, their columns and rows; the host joins rows to equipment by its
 * ids and aliases. What seldom changes is JSON, as settings are; `plugins/sdk/sdk/src/records.rs`
 * has its fields. A revision tells whether anything changed, so that what did not costs
 * nothing.
 */

#ifndef BUSBAR_RECORDS_H
#define BUSBAR_RECORDS_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_RECORDS_ID "busbar.records/1-draft"

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

// Severity of the defect that a row reports.
enum BusbarDefectSeverity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Severity of a row that is no defect, or of which that is not known.
  BUSBAR_DEFECT_SEVERITY_NONE = 0,
  // Severity of a defect to be mended when there is occasion.
  BUSBAR_DEFECT_SEVERITY_GENERAL = 1,
  // Severity of a defect to be mended soon, and watched until then.
  BUSBAR_DEFECT_SEVERITY_SERIOUS = 2,
  // Severity of a defect to be mended at once.
  BUSBAR_DEFECT_SEVERITY_CRITICAL = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarDefectSeverity BusbarDefectSeverity;
#else
typedef uint32_t BusbarDefectSeverity;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Time, severity and flags of a row. Array element.
typedef struct BusbarRecordRow {
  // Time at which the row was reported or done, nanoseconds since 1970-01-01 UTC, or
  // `BUSBAR_RECORD_NO_TIME`.
  int64_t time_unix_nanos;
  // Severity of the defect, if the row reports one.
  BusbarDefectSeverity severity;
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
  // `[serialized]` Writes the description as JSON. Fails with `BUSBAR_BUFFER_TOO_SMALL` when
  // the text does not fit, with the bytes needed in `len`.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin, struct BusbarTextOutput *output, struct BusbarError *error);
  // `[serialized]` Writes rows. Fails with `BUSBAR_INVALID_ARGUMENT` when there is no such
  // list, or its number of columns is another. Fails with `BUSBAR_BUFFER_TOO_SMALL` when not one
  // row fits.
  BusbarStatus (*read)(const struct BusbarPlugin *plugin, struct BusbarRecordPage *page, struct BusbarError *error);
} BusbarRecords;

#endif  /* BUSBAR_RECORDS_H */
