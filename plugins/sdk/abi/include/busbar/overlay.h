/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/overlay.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.overlay/2-draft`: values of tags to things drawn at equipment.
 *
 * The plugin says what to show; the host decides how it looks, and marks
 * whatever rests on a value that is not good, whatever the plugin says.
 */

#ifndef BUSBAR_OVERLAY_H
#define BUSBAR_OVERLAY_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/values.h>

// Id of the capability.
#define BUSBAR_OVERLAY_ID "busbar.overlay/2-draft"

// Flag of a verdict: it rests on a default of the plugin, which the reason names.
#define BUSBAR_VERDICT_FLAG_ASSUMED 1

// Flag of an abnormal verdict: it is surely no alarm, so that it needs attention and no action
// now. Without this flag and the next one an abnormal verdict is an alarm: it needs action now.
#define BUSBAR_VERDICT_FLAG_WARNING 2

// Flag of an abnormal verdict: it needs attention, and the inputs do not decide whether it is an
// alarm.
#define BUSBAR_VERDICT_FLAG_PERHAPS_ALARM 4

// Pattern of a state, which those see who see no colour.
enum BusbarPattern
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Pattern of a plain colour.
  BUSBAR_PATTERN_SOLID = 0,
  // Pattern of diagonal stripes.
  BUSBAR_PATTERN_STRIPED = 1,
  // Pattern of stripes that cross.
  BUSBAR_PATTERN_CROSSED = 2,
  // Pattern of regular dots.
  BUSBAR_PATTERN_DOTTED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarPattern BusbarPattern;
#else
typedef uint32_t BusbarPattern;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a primitive.
enum BusbarPrimitiveKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Line of the label at a node: caption and value.
  BUSBAR_PRIMITIVE_KIND_LINE = 1,
  // Tint: the node and all under it, drawn in the colour of the severity.
  BUSBAR_PRIMITIVE_KIND_TINT = 2,
  // State of the legend of a piece of equipment, and of all under it. A state that rests on
  // several bindings is named once for each, one after the other.
  BUSBAR_PRIMITIVE_KIND_STATE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarPrimitiveKind BusbarPrimitiveKind;
#else
typedef uint32_t BusbarPrimitiveKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a quantity.
enum BusbarQuantityKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Position of a switch. `value` is the share of its way that it has travelled from open (0) to
  // closed (1), in between while it travels; NaN where what is reported contradicts itself.
  BUSBAR_QUANTITY_KIND_POSITION = 1,
  // Power that flows. `value` is its share of the rating, positive from `equipment` to
  // `to_equipment`.
  BUSBAR_QUANTITY_KIND_FLOW = 2,
  // Level of the contour, in its unit.
  BUSBAR_QUANTITY_KIND_LEVEL = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarQuantityKind BusbarQuantityKind;
#else
typedef uint32_t BusbarQuantityKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Severity of a primitive.
enum BusbarSeverity
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Severity of the normal state; grey.
  BUSBAR_SEVERITY_NORMAL = 0,
  // Severity outside the normal band.
  BUSBAR_SEVERITY_WARNING = 1,
  // Severity that needs action now.
  BUSBAR_SEVERITY_ALARM = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarSeverity BusbarSeverity;
#else
typedef uint32_t BusbarSeverity;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Verdict of an overlay on a piece of equipment.
enum BusbarVerdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Equipment within its limits.
  BUSBAR_VERDICT_NORMAL = 1,
  // Equipment outside its limits, or in a state that needs attention.
  BUSBAR_VERDICT_ABNORMAL = 2,
  // Equipment that cannot be judged, for the reason given.
  BUSBAR_VERDICT_UNKNOWN = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarVerdict BusbarVerdict;
#else
typedef uint32_t BusbarVerdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A tag bound to a node. Array element.
typedef struct BusbarBinding {
  // Names the node in primitives.
  uint32_t node;
  // Kind of the tag's values.
  BusbarValueKind kind;
  // Reserved; must be zero.
  uint8_t reserved[3];
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

// A state that an overlay shows equipment in, as the legend has it. Array element.
typedef struct BusbarLegendEntry {
  // Display name of the state; at most 64 bytes.
  struct BusbarStr name;
  // Pattern of the state: no two entries that differ in colour alone may mean different
  // things to who sees none.
  BusbarPattern pattern;
  // Colour in sRGB, `0xRRGGBB`.
  uint32_t color;
} BusbarLegendEntry;

// The state of one bound tag in this frame. Array element.
typedef struct BusbarTagValue {
  // Kind of the last value; `BUSBAR_VALUE_KIND_NONE` if no value came yet.
  BusbarValueKind kind;
  // Quality of the value, freshness included.
  BusbarQuality quality;
  // Reason of the quality.
  BusbarReason reason;
  // Origin of the value, `BUSBAR_ORIGIN_*` or'ed; 0 for a live one. The host gives what is drawn
  // on the value, and verdicts that rest on it, this origin. A plugin with a history begins it
  // anew where the origin changes.
  uint8_t origin;
  // Reserved; must be zero.
  uint8_t reserved[4];
  // Last value of kind `BUSBAR_VALUE_KIND_F64`; 0 for others.
  double number;
  // Last value of kind `BUSBAR_VALUE_KIND_I64`, `BUSBAR_VALUE_KIND_BOOL` or
  // `BUSBAR_VALUE_KIND_DOUBLE_POINT`; 0 for others.
  int64_t integer;
  // Time since that value came, milliseconds.
  uint64_t age_millis;
  // Last value of kind `BUSBAR_VALUE_KIND_TEXT`, valid during the call; empty for others.
  struct BusbarStr text;
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
  // Kind of the primitive.
  BusbarPrimitiveKind kind;
  // Index of the binding whose value this rests on. The host hatches the
  // primitive, with the age, when that value is not good.
  uint32_t binding;
  // Node at which a line or tint is drawn; 0 for a state.
  uint32_t node;
  // Severity of a line or tint; 0 for a state.
  BusbarSeverity severity;
  // Index of the equipment described that is in a state; 0 for others.
  uint32_t equipment;
  // Index of the legend's entry of a state; 0 for others.
  uint32_t entry;
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
  // Kind of the quantity.
  BusbarQuantityKind kind;
  // Index of the binding whose value this rests on: what is not good is drawn as not known.
  uint32_t binding;
  // Index of the equipment described.
  uint32_t equipment;
  // Index of the mechanism of a position; 0 for others.
  uint32_t mechanism;
  // Index of the equipment that power flows to; 0 for others.
  uint32_t to_equipment;
  // Reserved; must be zero.
  uint32_t reserved;
  // Number of the quantity, in the unit of its kind; finite unless the kind says otherwise.
  double value;
} BusbarOverlayQuantity;

// The judgment of an overlay on one piece of equipment. Array element. Every piece that
// was described has one in every frame; the host takes a piece without one as unknown, and
// says that the plugin is at fault.
typedef struct BusbarOverlayVerdict {
  // Index of the equipment described.
  uint32_t equipment;
  // Verdict on the equipment.
  BusbarVerdict verdict;
  // Flags: `BUSBAR_VERDICT_FLAG_ASSUMED`, and one of `BUSBAR_VERDICT_FLAG_WARNING` and
  // `BUSBAR_VERDICT_FLAG_PERHAPS_ALARM` of an abnormal verdict; or 0.
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

// Function table of `busbar.overlay/2-draft`.
typedef struct BusbarOverlay {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Says which tags are bound to which nodes; called before
  // the first `draw` and after a reload. Everything is borrowed for the
  // call.
  BusbarStatus (*configure)(const struct BusbarPlugin *plugin,
                            const struct BusbarBinding *bindings,
                            size_t binding_count,
                            struct BusbarError *error);
  // `[serialized]` Works out what to draw, and judges the equipment. Called at
  // most once a frame, also while nobody has the overlay drawn, and must return
  // within a few milliseconds. Fails with
  // `BUSBAR_BUFFER_TOO_SMALL` when the buffers do not suffice.
  BusbarStatus (*draw)(const struct BusbarPlugin *plugin,
                       const struct BusbarOverlayFrame *frame,
                       struct BusbarOverlayOutput *output,
                       struct BusbarError *error);
  // `[serialized]` Says what is shown besides values; called after each
  // `configure`. Null where it is nothing.
  BusbarStatus (*describe)(const struct BusbarPlugin *plugin,
                           struct BusbarOverlayDescription *description,
                           struct BusbarError *error);
} BusbarOverlay;

#endif  /* BUSBAR_OVERLAY_H */
