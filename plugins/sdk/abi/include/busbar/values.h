/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/values.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Shared parts of several capabilities: kinds of values, quality, reason and origin of values, and
 * buffers for texts.
 */

#ifndef BUSBAR_VALUES_H
#define BUSBAR_VALUES_H

#include <stddef.h>
#include <stdint.h>

// Bytes of a text value, at most. A longer one is cut, and is uncertain.
#define BUSBAR_MAX_TEXT_VALUE 255

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

// Quality of a value.
enum BusbarQuality
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Quality of a usable value.
  BUSBAR_QUALITY_GOOD = 0,
  // Quality of a doubtful value.
  BUSBAR_QUALITY_UNCERTAIN = 1,
  // Quality of an unusable value.
  BUSBAR_QUALITY_BAD = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarQuality BusbarQuality;
#else
typedef uint8_t BusbarQuality;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Reason of a quality.
enum BusbarReason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Reason of a quality that names none.
  BUSBAR_REASON_NONE = 0,
  // Reason of a link to the device that is down.
  BUSBAR_REASON_COMMUNICATION = 1,
  // Reason of a device that reports a failed sensor.
  BUSBAR_REASON_SENSOR = 2,
  // Reason of a value outside the measuring range.
  BUSBAR_REASON_OUT_OF_RANGE = 3,
  // Reason of a device that refused the address, or whose answer does not fit.
  BUSBAR_REASON_CONFIGURATION = 4,
  // Reason of a device that is not connected yet.
  BUSBAR_REASON_NOT_CONNECTED = 5,
  // Reason of a value that is not a finite number.
  BUSBAR_REASON_NOT_FINITE = 6,
  // Reason of a value past its freshness limit. The host alone sets it.
  BUSBAR_REASON_STALE = 7,
  // Reason of a source timestamp that is missing where one is promised, unreadable, in the
  // future or impossible.
  BUSBAR_REASON_SOURCE_TIME = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarReason BusbarReason;
#else
typedef uint8_t BusbarReason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a value, and the field that holds it.
enum BusbarValueKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint8_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No value: a sample of this kind sets the quality only.
  BUSBAR_VALUE_KIND_NONE = 0,
  // IEEE 754 double, in `number`.
  BUSBAR_VALUE_KIND_F64 = 1,
  // Integer of 64 bits, in `integer`.
  BUSBAR_VALUE_KIND_I64 = 2,
  // Single point, 0 or 1 in `integer`.
  BUSBAR_VALUE_KIND_BOOL = 3,
  // Double point, in `integer`: 0 intermediate, 1 off, 2 on, 3 bad state (IEC 60870-5-101,
  // 7.2.6.2).
  BUSBAR_VALUE_KIND_DOUBLE_POINT = 4,
  // Text of at most `BUSBAR_MAX_TEXT_VALUE` bytes, in `text`.
  BUSBAR_VALUE_KIND_TEXT = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarValueKind BusbarValueKind;
#else
typedef uint8_t BusbarValueKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

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

#endif  /* BUSBAR_VALUES_H */
