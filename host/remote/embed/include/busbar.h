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
 *   if (busbar_view_open(&options, &view) != BUSBAR_VIEW_OK) ...
 *   // whenever busbar_view_descriptor(view) is readable:
 *   while (busbar_view_next_event(view, &event) == 1) ...
 *   // on BUSBAR_VIEW_FRAME:
 *   busbar_view_frame(view, &frame);   // draw frame.pixels
 *
 * What holds everywhere:
 * - Text is UTF-8 and ends with a zero byte; an id or a path has at most 4096 bytes.
 *   What you pass is read during the call and not kept.
 * - Any thread may call, unless a function says otherwise; calls take microseconds, a
 *   busbar_view_frame that marks a picture some milliseconds.
 * - No callback runs on a thread that is not yours unless you ask for that.
 * - Numbers below 0 are a status: INVALID, FULL, SYSTEM or FAULT. Nothing was done then.
 * - Nothing old passes for live. A picture is as old as the values in it, not as its arrival.
 *   Past silent_millis (500, or two frame times where frames take long, at most 900) the library
 *   itself marks it, whatever the viewer does: it hatches
 *   pictures in memory, and covers an X11 window with a hatched child of its own, which says
 *   since when, until the picture has been live for 400 ms. One that a signal stopped is marked
 *   within 300 ms. What is left: a process that is itself stopped marks nothing, and where all
 *   CPUs are busy the mark waits for one as all else does (a second at most was seen).
 */

#ifndef BUSBAR_H
#define BUSBAR_H

#include <stddef.h>
#include <stdint.h>

// Version of this interface; a library of another version must not be used.
#define BUSBAR_VIEW_ABI 2

// Success of a call.
#define BUSBAR_VIEW_OK 0

// Status of an argument that is null, too small, too large, not UTF-8, or not finite. Nothing was
// done.
#define BUSBAR_VIEW_INVALID -1

// Status of a full command queue. Nothing was done: try again later.
#define BUSBAR_VIEW_FULL -2

// Status of a system without a descriptor, memory or a thread left. Nothing was done.
#define BUSBAR_VIEW_SYSTEM -3

// Status of an internal fault of the library; the view does nothing any more. Close it.
#define BUSBAR_VIEW_FAULT -4

// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
#define BUSBAR_VIEW_PANELS 1

// State of a picture whose values were read at most `silent_millis` ago. Where frames take long,
// the limit is two frame times, at most 900 ms.
#define BUSBAR_VIEW_LIVE 0

// State of a picture whose viewer is silent or gone: no value in it may be relied on. The library
// has removed its colour and hatched it.
#define BUSBAR_VIEW_DEAD 1

// State of a picture whose viewer makes progress too slowly: its values were read more than
// `silent_millis` ago. The library has removed its colour and hatched it, like a dead one.
#define BUSBAR_VIEW_LATE 2

// Quality of a usable value.
#define BUSBAR_VIEW_GOOD 0

// Quality of a doubtful value.
#define BUSBAR_VIEW_UNCERTAIN 1

// Quality of an unusable value.
#define BUSBAR_VIEW_BAD 2

// Value kind of a measurement, in `number`.
#define BUSBAR_VIEW_F64 0

// Value kind of a counter or code, in `integer`.
#define BUSBAR_VIEW_I64 1

// Value kind of a single point: `integer` is 0 or 1.
#define BUSBAR_VIEW_BOOL 2

// Value kind of a switch position in `integer`: 0 travelling, 1 open, 2 closed, 3 invalid (IEC
// 60870-5-101, 7.2.6.2).
#define BUSBAR_VIEW_DOUBLE_POINT 3

// Value kind of an update that sets the quality alone.
#define BUSBAR_VIEW_NO_VALUE 4

// Source timestamp that is not known.
#define BUSBAR_VIEW_NO_TIME INT64_MIN

// Event of the first picture. `text`: the graphics device.
#define BUSBAR_VIEW_READY 1

// Event of a new picture, or a new state of the last one, for busbar_view_frame. Merged: one waits
// at most.
#define BUSBAR_VIEW_FRAME 2

// Event of a pick. `id`: the equipment, empty for nothing.
#define BUSBAR_VIEW_PICKED 3

// Event of the pointer over the equipment `id`, or over nothing. Merged.
#define BUSBAR_VIEW_HOVERED 4

// Event of a camera at `eye` that looks at `target`. Merged.
#define BUSBAR_VIEW_CAMERA 5

// Event of the alarm `id` in `state`: 'A' to 'I' by IEC 62682, since `unix_nanos`. Each change is
// delivered while there is room, and the last one of each alarm always.
#define BUSBAR_VIEW_ALARM 6

// Event of an operator's request for the alarm `id`, which your program decides on. `state`:
// BUSBAR_VIEW_ACKNOWLEDGE and so on; `number`: shelving time, seconds.
#define BUSBAR_VIEW_ASKED 7

// Event of the tag `id` whose quality `state` is good, uncertain or bad, for the reason `text`.
// `origins` names the sources of its value besides the live process: mark a value that has any.
// Merged by tag.
#define BUSBAR_VIEW_QUALITY 8

// Event of the plugin instance `id`, whose state is `text`. Merged by plugin.
#define BUSBAR_VIEW_PLUGIN 9

// Event of a failed command or another fault; `text` names it and a remedy.
#define BUSBAR_VIEW_ERROR 10

// Event of a picture that is not live, for the reason `text`. `state`: BUSBAR_VIEW_DEAD where the
// viewer is silent or gone, BUSBAR_VIEW_LATE where it is too slow. The library has covered the
// picture in a window with hatching, and hatches it in memory: state beside it that it is not
// live.
#define BUSBAR_VIEW_LOST 11

// Event of a picture that is live again. A new viewer has the last good configuration, camera,
// alarms and tags.
#define BUSBAR_VIEW_RECOVERED 12

// Event of the configuration `id`, shown from now on.
#define BUSBAR_VIEW_RELOADED 13

// Event of an overlay's verdict `state` on the equipment `id`: BUSBAR_VIEW_NORMAL,
// BUSBAR_VIEW_ABNORMAL, BUSBAR_VIEW_UNKNOWN or BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL. `text` is the
// overlay's name, a line feed, and the reason. `number` is 1 where the verdict rests on a default,
// which the reason names. Merged by overlay and equipment.
#define BUSBAR_VIEW_VERDICT 14

// Origin of a value that a person or program substituted for the measured one.
#define BUSBAR_VIEW_SUBSTITUTED 1

// Origin of a value from a device under test.
#define BUSBAR_VIEW_TEST 2

// Origin of a value that a simulator made.
#define BUSBAR_VIEW_SIMULATED 4

// Origin of a value that is replayed from a recording.
#define BUSBAR_VIEW_RECORDED 8

// Origin of a value that its source calls historical.
#define BUSBAR_VIEW_HISTORICAL 16

// Verdict on equipment within its limits.
#define BUSBAR_VIEW_NORMAL 0

// Verdict on equipment outside its limits, or in a state that needs attention.
#define BUSBAR_VIEW_ABNORMAL 1

// Verdict on equipment that cannot be judged.
#define BUSBAR_VIEW_UNKNOWN 2

// Verdict on equipment that cannot be judged, and was abnormal at the last judgment.
#define BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL 3

// Acknowledgement of an alarm.
#define BUSBAR_VIEW_ACKNOWLEDGE 1

// Shelving of an alarm.
#define BUSBAR_VIEW_SHELVE 2

// Unshelving of an alarm.
#define BUSBAR_VIEW_UNSHELVE 3

// Reset of a latched alarm.
#define BUSBAR_VIEW_RESET 4

// Movement of the pointer to x, y.
#define BUSBAR_VIEW_MOVED 1

// Press of a button at x, y.
#define BUSBAR_VIEW_PRESSED 2

// Release of a button at x, y.
#define BUSBAR_VIEW_RELEASED 3

// Turn of the wheel by `steps`, positive away from the user.
#define BUSBAR_VIEW_SCROLLED 4

// Pointer leaves the picture.
#define BUSBAR_VIEW_LEFT 5

// View of a viewer process.
typedef struct BusbarView BusbarView;

// Content and limits of a view. Set all to 0 first, then `struct_size`, `config` and the size.
typedef struct BusbarViewOptions {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Flags of the view: BUSBAR_VIEW_PANELS or 0.
  uint32_t flags;
  // Width of the picture, pixels: 1 to 8192.
  uint32_t width;
  // Height of the picture, pixels: 1 to 8192; width times height at most 16,777,216.
  uint32_t height;
  // X11 window to draw into; 0 draws offscreen.
  uint32_t window;
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
  // Kind of the event: BUSBAR_VIEW_READY and so on.
  uint32_t kind;
  // State, by the kind of the event.
  uint32_t state;
  // Events dropped for want of room since the last one; events of alarms are never dropped.
  uint32_t dropped;
  // Time by the kind of the event, nanoseconds since 1970-01-01 UTC.
  int64_t unix_nanos;
  // Number, by the kind of the event.
  double number;
  // Origins, a sum of BUSBAR_VIEW_SUBSTITUTED and so on; 0 for a live value, and for other kinds of event.
  uint32_t origins;
  // Reserved field, always 0.
  uint32_t reserved;
  // Position of the camera, world space in metres.
  float eye[3];
  // Point that the camera looks at, world space in metres.
  float target[3];
  // Identifier, by the kind of the event.
  const char *id;
  // Text, by the kind of the event.
  const char *text;
} BusbarViewEvent;

// Callback for events. It must not close the view, and not unwind.
typedef void (*BusbarViewCallback)(void *context, const struct BusbarViewEvent *event);

// Picture of a view. Its pixels are blue, green, red and 255, rows from the top.
typedef struct BusbarViewFrame {
  // Size of this struct, bytes; set it before the call.
  uint32_t struct_size;
  // Liveness of the picture: BUSBAR_VIEW_LIVE, BUSBAR_VIEW_LATE or BUSBAR_VIEW_DEAD.
  uint32_t state;
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
  // Kind of the value: BUSBAR_VIEW_F64 and so on.
  uint32_t kind;
  // Quality of the value: BUSBAR_VIEW_GOOD, BUSBAR_VIEW_UNCERTAIN or BUSBAR_VIEW_BAD.
  uint32_t quality;
  // Source timestamp, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
  int64_t source_unix_nanos;
  // Value of kind BUSBAR_VIEW_F64.
  double number;
  // Value of the other kinds.
  int64_t integer;
} BusbarViewTag;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the version of this library's interface: BUSBAR_VIEW_ABI where library and header fit.
uint32_t busbar_view_abi(void);

// Opens a view and starts its viewer, a process of its own. `*view` is yours: close it. A fault of
// the configuration arrives as BUSBAR_VIEW_ERROR; the viewer is then started again with growing
// delays. The library has one thread a view, two for one in a window, and must not be unloaded.
// Returns BUSBAR_VIEW_OK, INVALID or SYSTEM; `*view` is then null.
//
// Your part:
// `options` points to a struct as its `struct_size` says, with texts that end with a zero
// byte; `view` to room for a pointer. Neither is kept.
int32_t busbar_view_open(const struct BusbarViewOptions *options, struct BusbarView **view);

// Closes a view; its viewer ends by itself soon after. No callback runs after this; one that runs
// on another thread is waited for. A null view is no fault.
//
// Your part:
// `view` is null or from [`busbar_view_open`]; no other call on it is under way or comes
// later; not from its own callback.
void busbar_view_close(struct BusbarView *view);

// Returns a descriptor that is readable while events wait, for your event loop. The view owns it:
// do not read, write or close it. A number below 0 is a status.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_descriptor(const struct BusbarView *view);

// Takes the next event: 1 where there is one, 0 where none waits, below 0 a status. Set
// `event->struct_size` first. Its texts stay valid until the next call.
//
// Your part:
// `view` is null or open; `event` points to a struct as its `struct_size` says. One thread
// at a time.
int32_t busbar_view_next_event(const struct BusbarView *view, struct BusbarViewEvent *event);

// Sets the callback for events; null for none. With `on_own_thread` 0 the callback runs within
// busbar_view_dispatch alone. Otherwise the view's own thread calls it at once. It must not take
// long there: the viewer is not supervised meanwhile.
//
// Your part:
// `view` is null or open; `callback` can be called with `context` until another is set or
// the view is closed. Not from a callback on the view's own thread.
int32_t busbar_view_set_callback(const struct BusbarView *view,
                                 BusbarViewCallback callback,
                                 void *context,
                                 int32_t on_own_thread);

// Calls the callback for each event that waits, on this thread. Returns the number of events, at
// most 1024; a number below 0 is a status.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_dispatch(const struct BusbarView *view);

// Returns the newest picture of a view without a window. The result is 1 where it differs from
// that of the call before, 0 where it does not, below 0 a status. Set `frame->struct_size` first.
// The library marks a picture that is old: see BUSBAR_VIEW_DEAD and BUSBAR_VIEW_LATE.
//
// Your part:
// `view` is null or open; `frame` points to a struct as its `struct_size` says. One thread
// at a time.
int32_t busbar_view_frame(const struct BusbarView *view, struct BusbarViewFrame *frame);

// Returns the process id of the viewer, 0 while there is none. For diagnosis.
//
// Your part:
// `view` is null or open.
uint32_t busbar_view_process(const struct BusbarView *view);

// Sets the size of the pictures. A view in a window follows the window's size by itself.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_resize(const struct BusbarView *view, uint32_t width, uint32_t height);

// Sets whether anybody can see the picture; few frames are rendered otherwise. Alarms continue.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_set_visible(const struct BusbarView *view, int32_t visible);

// Moves the camera to one of the configuration.
//
// Your part:
// `view` is null or open; `name` null or a text.
int32_t busbar_view_use_camera(const struct BusbarView *view, const char *name);

// Moves the camera to `eye`, looking at `target`: three numbers each, world space in metres.
//
// Your part:
// `view` is null or open; `eye` and `target` null or three numbers.
int32_t busbar_view_look(const struct BusbarView *view, const float *eye, const float *target);

// Selects and frames a piece of equipment, by its id or an alias.
//
// Your part:
// `view` is null or open; `id` null or a text.
int32_t busbar_view_focus(const struct BusbarView *view, const char *id);

// Sets theta of every model, 0 (full detail) to 1; below 0 their policies choose again.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_set_theta(const struct BusbarView *view, double theta);

// Shows or hides an overlay, by the name of its plugin instance.
//
// Your part:
// `view` is null or open; `layer` null or a text.
int32_t busbar_view_set_layer(const struct BusbarView *view, const char *layer, int32_t shown);

// Sets tags, at most 4096 at once; all of them or none. Set them again before their freshness
// ends: a value that nobody repeats goes stale, whatever the reason.
//
// Your part:
// `view` is null or open; `tags` null or so many tags with texts.
int32_t busbar_view_set_tags(const struct BusbarView *view,
                             const struct BusbarViewTag *tags,
                             size_t count);

// Applies an operator's action to an alarm: BUSBAR_VIEW_ACKNOWLEDGE and so on. `seconds` is the
// shelving time. A null `operator_name` stands for that of the options.
//
// Your part:
// `view` is null or open; texts are null or texts.
int32_t busbar_view_act_on_alarm(const struct BusbarView *view,
                                 const char *alarm,
                                 uint32_t action,
                                 uint32_t seconds,
                                 const char *operator_name);

// Sets an alarm that your program decides on ("mirrored") to a state, 'A' to 'I' by IEC 62682.
//
// Your part:
// `view` is null or open; `alarm` null or a text.
int32_t busbar_view_mirror_alarm(const struct BusbarView *view, const char *alarm, char state);

// Sets the instant that a chart in the scene shows, nanoseconds since 1970-01-01 UTC;
// BUSBAR_VIEW_NO_TIME shows all.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_set_time(const struct BusbarView *view, int64_t unix_nanos);

// Loads a configuration, or null for the present one, anew. The present scene stays until the new
// one is loaded without a fault (BUSBAR_VIEW_RELOADED). It stays for good where the new one has a
// fault (BUSBAR_VIEW_ERROR).
//
// Your part:
// `view` is null or open; `config` null or a text.
int32_t busbar_view_reload(const struct BusbarView *view, const char *config);

// Selects the equipment at a pixel, which a BUSBAR_VIEW_PICKED reports.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_pick(const struct BusbarView *view, uint32_t x, uint32_t y);

// Sends pointer input over the picture of a view without a window: BUSBAR_VIEW_MOVED and so on. x
// and y are in pixels from the top left; `button` is 1 the left, 2 the middle, 3 the right one;
// `steps` are those of the wheel.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_point(const struct BusbarView *view,
                          uint32_t what,
                          float x,
                          float y,
                          uint32_t button,
                          float steps);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BUSBAR_H */
