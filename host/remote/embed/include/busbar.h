/* libbusbar: a live 3D view of power equipment in your program.
 * Generated from host/remote/embed by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * The viewer is a process of its own, which the library starts, watches and starts again.
 * Whatever happens to it, your process goes on, and no call waits for it. In short:
 *
 *   BusbarViewOptions options = {0};
 *   options.struct_size = sizeof options;
 *   options.config = "station.json";
 *   options.width = 1280, options.height = 720;
 *   BusbarView *view;
 *   if (busbar_view_open(&options, &view) != BUSBAR_STATUS_OK) ...
 *   // whenever busbar_view_descriptor(view) is readable:
 *   while (busbar_view_next_event(view, &event) == 1) ...
 *   // on BUSBAR_VIEW_EVENT_KIND_FRAME:
 *   busbar_view_frame(view, &frame);   // draw frame.pixels
 *
 * What holds everywhere:
 * - Text is UTF-8 and ends with a zero byte; an id or a path has at most 4096 bytes.
 *   What you pass is read during the call and not kept.
 * - A view is null, which is BUSBAR_STATUS_INVALID, or open and not yet closed. A struct whose
 *   first field is its size says there how much of it the caller knows.
 * - Any thread may call, unless a function says otherwise; calls take microseconds, a
 *   busbar_view_frame that marks a picture some milliseconds.
 * - No callback runs on a thread that is not yours unless you ask for that.
 * - Numbers below 0 are a BusbarStatus. Nothing was done then.
 * - Nothing old passes for live. A picture is as old as the values in it, not as its arrival.
 *   Past silent_millis (500, or two frame times where frames take long, at most 900) the library
 *   itself marks it, whatever the viewer does: it hatches pictures in memory, and covers an X11
 *   window with a hatched child of its own, which says since when, until the picture has been
 *   live for 400 ms. One that a signal stopped is marked within 300 ms. What is left: a process
 *   that is itself stopped marks nothing, and where all CPUs are busy the mark waits for one as
 *   all else does (a second at most was seen).
 */

#ifndef BUSBAR_H
#define BUSBAR_H

#include <stddef.h>
#include <stdint.h>

#if defined(_WIN32)
#define BUSBAR_API __declspec(dllimport)
#elif defined(__GNUC__)
#define BUSBAR_API __attribute__((visibility("default")))
#else
#define BUSBAR_API
#endif

// Version of this interface; a library of another version must not be used.
#define BUSBAR_VIEW_ABI 5

// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
#define BUSBAR_VIEW_FLAG_PANELS 1

// Source timestamp that is not known.
#define BUSBAR_VIEW_NO_TIME INT64_MIN

// Origin of a value that a person or program substituted for the measured one.
#define BUSBAR_VIEW_ORIGIN_SUBSTITUTED 1

// Origin of a value from a device under test.
#define BUSBAR_VIEW_ORIGIN_TEST 2

// Origin of a value that a simulator made.
#define BUSBAR_VIEW_ORIGIN_SIMULATED 4

// Origin of a value that is replayed from a recording.
#define BUSBAR_VIEW_ORIGIN_RECORDED 8

// Origin of a value that its source calls historical.
#define BUSBAR_VIEW_ORIGIN_HISTORICAL 16

// Status of a call. After a failure, which is below 0, nothing was done.
enum BusbarStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Success of the call.
  BUSBAR_STATUS_OK = 0,
  // Argument that is null, too small, too large, not UTF-8, or not finite.
  BUSBAR_STATUS_INVALID = -1,
  // Command queue without room: try again later.
  BUSBAR_STATUS_FULL = -2,
  // System without a descriptor, memory or a thread left.
  BUSBAR_STATUS_SYSTEM = -3,
  // Internal fault of the library; the view does nothing any more. Close it.
  BUSBAR_STATUS_FAULT = -4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarStatus BusbarStatus;
#else
typedef int32_t BusbarStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of an event, and the fields that it fills. All other fields are 0, and texts empty.
enum BusbarViewEventKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // First picture. `text`: the graphics device.
  BUSBAR_VIEW_EVENT_KIND_READY = 1,
  // New picture, or a new liveness of the last one, for busbar_view_frame. Merged: one waits at
  // most.
  BUSBAR_VIEW_EVENT_KIND_FRAME = 2,
  // Pick. `id`: the equipment, empty for nothing.
  BUSBAR_VIEW_EVENT_KIND_PICKED = 3,
  // Pointer over the equipment `id`, or over nothing. Merged.
  BUSBAR_VIEW_EVENT_KIND_HOVERED = 4,
  // Camera at `eye` that looks at `target`. Merged.
  BUSBAR_VIEW_EVENT_KIND_CAMERA = 5,
  // Alarm `id` in `alarm_state` since `unix_nanos`. `origins` names the sources, besides the live
  // process, of the value or verdict by which it came or went last. `text`: reason of an
  // overlay's verdict, with what is assumed; empty of an alarm on a tag. Each change is
  // delivered while there is room, and the last one of each alarm always.
  BUSBAR_VIEW_EVENT_KIND_ALARM = 6,
  // Operator's request `alarm_action` for the alarm `id`, which your program decides on.
  // `shelve_seconds`: shelving time.
  BUSBAR_VIEW_EVENT_KIND_ACTION_REQUESTED = 7,
  // Tag `id` whose quality is `quality`, for the reason `text`. `origins` names the sources of
  // its value besides the live process: mark a value that has any. Merged by tag.
  BUSBAR_VIEW_EVENT_KIND_QUALITY = 8,
  // Plugin instance `id`, whose state is `text`. Merged by instance.
  BUSBAR_VIEW_EVENT_KIND_PLUGIN = 9,
  // Failed command or another fault; `text` names it and a remedy.
  BUSBAR_VIEW_EVENT_KIND_ERROR = 10,
  // Picture that is not live, for the reason `text`. `liveness`: dead where the viewer is silent
  // or gone, late where it is too slow. The library has covered the picture in a window with
  // hatching, and hatches it in memory: state beside it that it is not live.
  BUSBAR_VIEW_EVENT_KIND_LOST = 11,
  // Picture that is live again, `text` says how. A new viewer has the last good configuration,
  // camera, alarms and tags.
  BUSBAR_VIEW_EVENT_KIND_RECOVERED = 12,
  // Configuration `id`, shown from now on.
  BUSBAR_VIEW_EVENT_KIND_RELOADED = 13,
  // Verdict `verdict` of the plugin instance `overlay` on the equipment `id`, for the reason
  // `text`. `is_assumed` is 1 where it rests on a default, which the reason names; `origins` are
  // those of the values that it rests on. Merged by overlay and equipment.
  BUSBAR_VIEW_EVENT_KIND_VERDICT = 14,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewEventKind BusbarViewEventKind;
#else
typedef uint32_t BusbarViewEventKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Liveness of a picture.
enum BusbarViewLiveness
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Picture whose values were read at most `silent_millis` ago. Where frames take long, the
  // limit is two frame times, at most 900 ms.
  BUSBAR_VIEW_LIVENESS_LIVE = 0,
  // Picture whose viewer is silent or gone: no value in it may be relied on. The library has
  // removed its colour and hatched it.
  BUSBAR_VIEW_LIVENESS_DEAD = 1,
  // Picture whose viewer makes progress too slowly: its values were read more than
  // `silent_millis` ago. The library has removed its colour and hatched it, like a dead one.
  BUSBAR_VIEW_LIVENESS_LATE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewLiveness BusbarViewLiveness;
#else
typedef uint32_t BusbarViewLiveness;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// State of an alarm by IEC 62682. Numbers are the letters of its states in ASCII.
enum BusbarViewAlarmState
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No state: the event is about something else.
  BUSBAR_VIEW_ALARM_STATE_NONE = 0,
  // State A: within limits, acknowledged.
  BUSBAR_VIEW_ALARM_STATE_NORMAL = 65,
  // State B: outside limits, not acknowledged.
  BUSBAR_VIEW_ALARM_STATE_UNACKNOWLEDGED = 66,
  // State C: outside limits, acknowledged.
  BUSBAR_VIEW_ALARM_STATE_ACKNOWLEDGED = 67,
  // State D: back within limits, not acknowledged.
  BUSBAR_VIEW_ALARM_STATE_RETURNED_UNACKNOWLEDGED = 68,
  // State E: back within limits, latched, not acknowledged.
  BUSBAR_VIEW_ALARM_STATE_LATCHED_UNACKNOWLEDGED = 69,
  // State F: back within limits, latched, acknowledged.
  BUSBAR_VIEW_ALARM_STATE_LATCHED_ACKNOWLEDGED = 70,
  // State G: shelved by an operator.
  BUSBAR_VIEW_ALARM_STATE_SHELVED = 71,
  // State H: suppressed by design.
  BUSBAR_VIEW_ALARM_STATE_SUPPRESSED_BY_DESIGN = 72,
  // State I: out of service.
  BUSBAR_VIEW_ALARM_STATE_OUT_OF_SERVICE = 73,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewAlarmState BusbarViewAlarmState;
#else
typedef uint32_t BusbarViewAlarmState;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Action of an operator on an alarm.
enum BusbarViewAlarmAction
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No action: the event is about something else.
  BUSBAR_VIEW_ALARM_ACTION_NONE = 0,
  // Acknowledgement of the alarm.
  BUSBAR_VIEW_ALARM_ACTION_ACKNOWLEDGE = 1,
  // Shelving of the alarm for some time.
  BUSBAR_VIEW_ALARM_ACTION_SHELVE = 2,
  // End of the shelving.
  BUSBAR_VIEW_ALARM_ACTION_UNSHELVE = 3,
  // Reset of a latched alarm.
  BUSBAR_VIEW_ALARM_ACTION_RESET = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewAlarmAction BusbarViewAlarmAction;
#else
typedef uint32_t BusbarViewAlarmAction;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Quality of a value.
enum BusbarViewQuality
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Value that can be used.
  BUSBAR_VIEW_QUALITY_GOOD = 0,
  // Value that is in doubt.
  BUSBAR_VIEW_QUALITY_UNCERTAIN = 1,
  // Value that cannot be used.
  BUSBAR_VIEW_QUALITY_BAD = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewQuality BusbarViewQuality;
#else
typedef uint32_t BusbarViewQuality;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Verdict of an overlay on equipment.
enum BusbarViewVerdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Equipment within its limits.
  BUSBAR_VIEW_VERDICT_NORMAL = 0,
  // Equipment outside its limits, or in a state that needs attention.
  BUSBAR_VIEW_VERDICT_ABNORMAL = 1,
  // Equipment that cannot be judged.
  BUSBAR_VIEW_VERDICT_UNKNOWN = 2,
  // Equipment that cannot be judged, and was abnormal at the last judgment.
  BUSBAR_VIEW_VERDICT_UNKNOWN_AFTER_ABNORMAL = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewVerdict BusbarViewVerdict;
#else
typedef uint32_t BusbarViewVerdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a value, and the field that holds it.
enum BusbarViewValueKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Measurement, which is in `number`.
  BUSBAR_VIEW_VALUE_KIND_F64 = 0,
  // Counter or code, in `integer`.
  BUSBAR_VIEW_VALUE_KIND_I64 = 1,
  // Single point: `integer` is 0 or 1.
  BUSBAR_VIEW_VALUE_KIND_BOOL = 2,
  // Switch position in `integer`: 0 travelling, 1 open, 2 closed, 3 invalid (IEC 60870-5-101,
  // 7.2.6.2).
  BUSBAR_VIEW_VALUE_KIND_DOUBLE_POINT = 3,
  // No value: the update sets the quality alone.
  BUSBAR_VIEW_VALUE_KIND_NONE = 4,
  // Text of at most 255 bytes, which is in `text`. A longer one, or one that is no UTF-8, is
  // shown as far as it goes, and is uncertain.
  BUSBAR_VIEW_VALUE_KIND_TEXT = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewValueKind BusbarViewValueKind;
#else
typedef uint32_t BusbarViewValueKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Input of a pointer over a picture.
enum BusbarViewPointer
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Movement of the pointer to x, y.
  BUSBAR_VIEW_POINTER_MOVED = 1,
  // Press of a button at x, y.
  BUSBAR_VIEW_POINTER_PRESSED = 2,
  // Release of a button at x, y.
  BUSBAR_VIEW_POINTER_RELEASED = 3,
  // Turn of the wheel by `steps`, positive away from the user.
  BUSBAR_VIEW_POINTER_SCROLLED = 4,
  // Pointer leaves the picture.
  BUSBAR_VIEW_POINTER_LEFT = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewPointer BusbarViewPointer;
#else
typedef uint32_t BusbarViewPointer;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Window system of the window that a view draws into.
enum BusbarViewWindowSystem
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // No window: pictures are in memory.
  BUSBAR_VIEW_WINDOW_SYSTEM_NONE = 0,
  // X11: `window` is the XID of the window.
  BUSBAR_VIEW_WINDOW_SYSTEM_X11 = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarViewWindowSystem BusbarViewWindowSystem;
#else
typedef uint32_t BusbarViewWindowSystem;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// View of a viewer process.
typedef struct BusbarView BusbarView;

// Content and limits of a view. Set all to 0 first, then `struct_size`, `config` and the size.
typedef struct BusbarViewOptions {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Flags of the view: BUSBAR_VIEW_FLAG_PANELS or 0.
  uint32_t flags;
  // Width of the picture, pixels: 1 to 8192.
  uint32_t width;
  // Height of the picture, pixels: 1 to 8192; width times height at most 16,777,216.
  uint32_t height;
  // Window system of `window`.
  BusbarViewWindowSystem window_system;
  // Age of the picture's values from which it is not live and hatched, milliseconds; 0 for 500.
  // Where frames take longer, the limit is two frame times, at most 900 ms. A window is covered
  // at most 50 ms later, on a machine with a CPU to spare.
  uint32_t silent_millis;
  // Time without a heartbeat and without progress of its process after which the viewer is ended
  // and started again, milliseconds; 0 for 1000. At least silent_millis. A viewer that makes
  // progress is slow and not hung: it is ended after 30 s without a frame. One that sleeps is
  // ended after 5 s, one that a signal stopped after 10 s. All limits are at least hung_millis;
  // those of 30 s and 5 s are at least eight of its longest recent frame times.
  uint32_t hung_millis;
  // Longest delay before a viewer that keeps ending is started again, milliseconds; 0 for 5000.
  uint32_t max_restart_millis;
  // Window to draw into, as its system names windows; 0 without a system.
  uint64_t window;
  // Path of the configuration, UTF-8.
  const char *config;
  // Path of the program `busbar`; null looks for it in PATH.
  const char *program;
  // Operator who acts on alarms, for the audit log; null for nobody.
  const char *operator_name;
} BusbarViewOptions;

// Event of a view. Texts end with a zero byte and are never null. They stay valid until the next
// event of the view is taken, or until the callback returns.
typedef struct BusbarViewEvent {
  // Size of this struct, bytes; set it before the call.
  uint32_t struct_size;
  // Kind of the event.
  BusbarViewEventKind kind;
  // Events dropped for want of room since the last one; events of alarms are never dropped.
  uint32_t dropped;
  // Liveness of the picture.
  BusbarViewLiveness liveness;
  // State of the alarm.
  BusbarViewAlarmState alarm_state;
  // Action that the operator asks for.
  BusbarViewAlarmAction alarm_action;
  // Shelving time that the operator asks for, seconds.
  uint32_t shelve_seconds;
  // Quality of the tag's value.
  BusbarViewQuality quality;
  // Origins, a sum of BUSBAR_VIEW_ORIGIN_SUBSTITUTED and so on; 0 for a live value.
  uint32_t origins;
  // Verdict on the equipment.
  BusbarViewVerdict verdict;
  // Number 1 where the verdict rests on a default.
  uint32_t is_assumed;
  // Reserved field, always 0.
  uint32_t reserved;
  // Time since which the alarm is in its state, nanoseconds since 1970-01-01 UTC.
  int64_t unix_nanos;
  // Position of the camera, world space in metres.
  double eye[3];
  // Point that the camera looks at, world space in metres.
  double target[3];
  // Identifier of the equipment, alarm, tag, plugin instance or configuration.
  const char *id;
  // Plugin instance that gives the verdict.
  const char *overlay;
  // Text for people, by the kind of the event.
  const char *text;
} BusbarViewEvent;

// Callback for events. It must not close the view, and not unwind.
typedef void (*BusbarViewCallback)(void *context, const struct BusbarViewEvent *event);

// Picture of a view. Its pixels are blue, green, red and 255, rows from the top.
typedef struct BusbarViewFrame {
  // Size of this struct, bytes; set it before the call.
  uint32_t struct_size;
  // Liveness of the picture.
  BusbarViewLiveness liveness;
  // Width of the picture, pixels; 0 where there is no picture yet.
  uint32_t width;
  // Height of the picture, pixels.
  uint32_t height;
  // Bytes from one row to the next.
  uint32_t stride;
  // Left column of the damaged area, which may differ from the picture of the call before.
  uint32_t damage_x;
  // Top row of the damaged area.
  uint32_t damage_y;
  // Width of the damaged area, pixels; 0 where nothing differs.
  uint32_t damage_width;
  // Height of the damaged area, pixels.
  uint32_t damage_height;
  // Age of the values that the picture shows, milliseconds since they were read.
  uint32_t age_millis;
  // Sequence number of the picture in its viewer, from 1.
  uint64_t sequence;
  // First pixel; null where there is no picture yet. The pixels stay unchanged until the next
  // call of busbar_view_frame or busbar_view_close.
  const uint8_t *pixels;
} BusbarViewFrame;

// Value of a tag that the configuration marks with "set_by_host". Its age counts from the call, or
// from its source time if that is earlier. Past the tag's freshness it is stale.
typedef struct BusbarViewTag {
  // Id of the tag, UTF-8.
  const char *id;
  // Kind of the value.
  BusbarViewValueKind kind;
  // Quality of the value.
  BusbarViewQuality quality;
  // Source timestamp, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
  int64_t source_unix_nanos;
  // Value of kind BUSBAR_VIEW_VALUE_KIND_F64.
  double number;
  // Value of the kinds I64, BOOL and DOUBLE_POINT.
  int64_t integer;
  // Value of kind BUSBAR_VIEW_VALUE_KIND_TEXT, UTF-8; of no meaning for others.
  const char *text;
} BusbarViewTag;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the version of this library's interface: BUSBAR_VIEW_ABI where library and header fit.
BUSBAR_API uint32_t busbar_view_abi(void);

// Returns the text of a status for people, which is never null and never freed. A number that is
// no status has one too.
BUSBAR_API const char *busbar_status_text(BusbarStatus status);

// Opens a view and starts its viewer, a process of its own. `*view` is yours: close it; after a
// failure it is null. A fault of the configuration arrives as BUSBAR_VIEW_EVENT_KIND_ERROR; the
// viewer is then started again with growing delays. The library has one thread a view, two for one
// in a window, and must not be unloaded.
BUSBAR_API
BusbarStatus busbar_view_open(const struct BusbarViewOptions *options,
                              struct BusbarView **view);

// Closes a view; its viewer ends by itself soon after. No callback runs after this; one that runs
// on another thread is waited for. A null view is no fault. No other call on the view may be under
// way or come later, and the call may not come from its own callback.
BUSBAR_API void busbar_view_close(struct BusbarView *view);

// Returns a descriptor that is readable while events wait, for your event loop. The view owns it:
// do not read, write or close it. A number below 0 is a status.
BUSBAR_API int32_t busbar_view_descriptor(const struct BusbarView *view);

// Takes the next event: 1 where there is one, 0 where none waits, below 0 a status. Set
// `event->struct_size` first. Its texts stay valid until the next call. One thread at a time.
BUSBAR_API
int32_t busbar_view_next_event(const struct BusbarView *view,
                               struct BusbarViewEvent *event);

// Sets the callback for events; null for none. With `on_own_thread` 0 the callback runs within
// busbar_view_dispatch alone. Otherwise the view's own thread calls it at once. It must not take
// long there: the viewer is not supervised meanwhile. `context` must be valid until another
// callback is set or the view is closed. Not to be called from a callback on the view's own
// thread.
BUSBAR_API
BusbarStatus busbar_view_set_callback(const struct BusbarView *view,
                                      BusbarViewCallback callback,
                                      void *context,
                                      int32_t on_own_thread);

// Calls the callback for each event that waits, on this thread. Returns the number of events, at
// most 1024; a number below 0 is a status.
BUSBAR_API int32_t busbar_view_dispatch(const struct BusbarView *view);

// Returns the newest picture of a view without a window. The result is 1 where it differs from
// that of the call before, 0 where it does not, below 0 a status. Set `frame->struct_size` first.
// One thread at a time. The library marks a picture that is old: see BusbarViewLiveness.
BUSBAR_API int32_t busbar_view_frame(const struct BusbarView *view, struct BusbarViewFrame *frame);

// Returns the process id of the viewer, 0 while there is none. For diagnosis.
BUSBAR_API uint32_t busbar_view_process(const struct BusbarView *view);

// Sets the size of the pictures. A view in a window follows the window's size by itself.
BUSBAR_API
BusbarStatus busbar_view_resize(const struct BusbarView *view,
                                uint32_t width,
                                uint32_t height);

// Sets whether anybody can see the picture; it is not drawn otherwise. Alarms continue.
BUSBAR_API BusbarStatus busbar_view_set_visible(const struct BusbarView *view, int32_t visible);

// Moves the camera to one of the configuration.
BUSBAR_API BusbarStatus busbar_view_use_camera(const struct BusbarView *view, const char *name);

// Moves the camera to `eye`, looking at `target`: three numbers each, world space in metres.
BUSBAR_API
BusbarStatus busbar_view_look(const struct BusbarView *view,
                              const double *eye,
                              const double *target);

// Selects and frames a piece of equipment, by its id or an alias.
BUSBAR_API BusbarStatus busbar_view_focus(const struct BusbarView *view, const char *id);

// Sets theta of every model, 0 (full detail) to 1; below 0 their policies choose again.
BUSBAR_API BusbarStatus busbar_view_set_theta(const struct BusbarView *view, double theta);

// Shows or hides an overlay, by the name of its plugin instance.
BUSBAR_API
BusbarStatus busbar_view_set_layer(const struct BusbarView *view,
                                   const char *layer,
                                   int32_t shown);

// Sets tags, at most 4096 at once; all of them or none. Set them again before their freshness
// ends: a value that nobody repeats goes stale, whatever the reason.
BUSBAR_API
BusbarStatus busbar_view_set_tags(const struct BusbarView *view,
                                  const struct BusbarViewTag *tags,
                                  size_t count);

// Applies an operator's action to an alarm. `shelve_seconds` is the shelving time. A null
// `operator_name` stands for that of the options.
BUSBAR_API
BusbarStatus busbar_view_act_on_alarm(const struct BusbarView *view,
                                      const char *alarm,
                                      BusbarViewAlarmAction action,
                                      uint32_t shelve_seconds,
                                      const char *operator_name);

// Sets an alarm that your program decides on ("mirrored") to a state.
BUSBAR_API
BusbarStatus busbar_view_mirror_alarm(const struct BusbarView *view,
                                      const char *alarm,
                                      BusbarViewAlarmState state);

// Sets the instant that a chart in the scene shows, nanoseconds since 1970-01-01 UTC;
// BUSBAR_VIEW_NO_TIME shows all.
BUSBAR_API BusbarStatus busbar_view_set_time(const struct BusbarView *view, int64_t unix_nanos);

// Loads a configuration, or null for the present one, anew. The present scene stays until the new
// one is loaded without a fault (BUSBAR_VIEW_EVENT_KIND_RELOADED). It stays for good where the new
// one has a fault (BUSBAR_VIEW_EVENT_KIND_ERROR).
BUSBAR_API BusbarStatus busbar_view_reload(const struct BusbarView *view, const char *config);

// Selects the equipment at a pixel, which a BUSBAR_VIEW_EVENT_KIND_PICKED reports.
BUSBAR_API BusbarStatus busbar_view_pick(const struct BusbarView *view, uint32_t x, uint32_t y);

// Sends pointer input over the picture of a view without a window. `x` and `y` are in pixels from
// the top left; `button` is 1 the left, 2 the middle, 3 the right one; `steps` are those of the
// wheel.
BUSBAR_API
BusbarStatus busbar_view_point(const struct BusbarView *view,
                               BusbarViewPointer input,
                               float x,
                               float y,
                               uint32_t button,
                               float steps);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BUSBAR_H */
