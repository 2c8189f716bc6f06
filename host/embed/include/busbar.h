/* libbusbar: a live 3D view of power equipment in your program.
 * Generated from host/embed by cbindgen; the test `header` compares the two.
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

// Version of this interface: of another one, do not use the library.
#define BUSBAR_VIEW_ABI 2

// Done.
#define BUSBAR_VIEW_OK 0

// An argument is null, too small, too large, not UTF-8, or not finite. Nothing was done.
#define BUSBAR_VIEW_INVALID -1

// Too much waits for the viewer already. Nothing was done: try again later.
#define BUSBAR_VIEW_FULL -2

// The system has no descriptor, no memory or no thread left. Nothing was done.
#define BUSBAR_VIEW_SYSTEM -3

// A fault of the library itself; the view does nothing any more. Close it.
#define BUSBAR_VIEW_FAULT -4

// Flag of BusbarViewOptions: show Busbar's own panels beside the scene.
#define BUSBAR_VIEW_PANELS 1

// The picture shows values that were read at most `silent_millis` ago; where frames take long,
// two frame times, at most 900 ms.
#define BUSBAR_VIEW_LIVE 0

// The viewer is silent or gone: no value in the picture may be relied on. The library has taken
// its colour and hatched it.
#define BUSBAR_VIEW_DEAD 1

// The viewer goes on, and is too slow: the picture shows values that were read more than
// `silent_millis` ago. The library has taken its colour and hatched it, as a dead one.
#define BUSBAR_VIEW_LATE 2

// Usable.
#define BUSBAR_VIEW_GOOD 0

// Doubtful.
#define BUSBAR_VIEW_UNCERTAIN 1

// Not usable.
#define BUSBAR_VIEW_BAD 2

// `number` is a measurement.
#define BUSBAR_VIEW_F64 0

// `integer` is a counter or code.
#define BUSBAR_VIEW_I64 1

// `integer` is 0 or 1.
#define BUSBAR_VIEW_BOOL 2

// `integer` is a switch position: 0 travelling, 1 open, 2 closed, 3 invalid
// (IEC 60870-5-101, 7.2.6.2).
#define BUSBAR_VIEW_DOUBLE_POINT 3

// No value: something is said of the quality alone.
#define BUSBAR_VIEW_NO_VALUE 4

// No time is known.
#define BUSBAR_VIEW_NO_TIME INT64_MIN

// The first picture is there. `text`: the graphics device.
#define BUSBAR_VIEW_READY 1

// busbar_view_frame has something new. Merged: one waits at most.
#define BUSBAR_VIEW_FRAME 2

// Something was picked. `id`: its equipment, empty for nothing.
#define BUSBAR_VIEW_PICKED 3

// The pointer is over `id`, or over nothing. Merged.
#define BUSBAR_VIEW_HOVERED 4

// The camera is at `eye` and looks at `target`. Merged.
#define BUSBAR_VIEW_CAMERA 5

// The alarm `id` is in `state`: 'A' to 'I' by IEC 62682, since `unix_nanos`. Each change
// comes while there is room, and the last one of each alarm always.
#define BUSBAR_VIEW_ALARM 6

// An operator wants something of the alarm `id`, which your program decides on. `state`:
// BUSBAR_VIEW_ACKNOWLEDGE and so on; `number`: seconds on the shelf.
#define BUSBAR_VIEW_ASKED 7

// The tag `id` is good, uncertain or bad (`state`), for the reason `text`. `origins` says of
// what its value is besides the live process: mark a value that has any. Merged by tag.
#define BUSBAR_VIEW_QUALITY 8

// The plugin instance `id` goes as `text` says. Merged by plugin.
#define BUSBAR_VIEW_PLUGIN 9

// Something could not be done, or goes wrong; `text` says what, and what helps.
#define BUSBAR_VIEW_ERROR 10

// The picture is not live; `text` says how. `state`: BUSBAR_VIEW_DEAD where the viewer is silent
// or gone, BUSBAR_VIEW_LATE where it goes on too slowly. In a window the library has covered the
// picture with hatching, in memory it hatches it: say beside it that it is not live.
#define BUSBAR_VIEW_LOST 11

// The picture is live again. Of another viewer it is with its last good configuration, camera,
// alarms and tags.
#define BUSBAR_VIEW_RECOVERED 12

// The configuration `id` is shown from here on.
#define BUSBAR_VIEW_RELOADED 13

// The verdict of an overlay on the equipment `id` is `state`: BUSBAR_VIEW_NORMAL,
// BUSBAR_VIEW_ABNORMAL, BUSBAR_VIEW_UNKNOWN or BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL. `text` is the
// overlay's name, a line feed, and the reason; `number` is 1 where it rests on a default, which
// the reason names. Merged by overlay and equipment.
#define BUSBAR_VIEW_VERDICT 14

// Origin of a value that a person or program put in place of the measured one.
#define BUSBAR_VIEW_SUBSTITUTED 1

// Origin of a value from a device under test.
#define BUSBAR_VIEW_TEST 2

// Origin of a value that a simulator made.
#define BUSBAR_VIEW_SIMULATED 4

// Origin of a value that is replayed from a recording.
#define BUSBAR_VIEW_RECORDED 8

// Origin of a value of the past, as its source says.
#define BUSBAR_VIEW_HISTORICAL 16

// Within its limits.
#define BUSBAR_VIEW_NORMAL 0

// Outside its limits, or in a state that needs attention.
#define BUSBAR_VIEW_ABNORMAL 1

// Nobody can judge it.
#define BUSBAR_VIEW_UNKNOWN 2

// Nobody can judge it, and it was abnormal when it was last known.
#define BUSBAR_VIEW_UNKNOWN_AFTER_ABNORMAL 3

// Acknowledge an alarm.
#define BUSBAR_VIEW_ACKNOWLEDGE 1

// Put an alarm on the shelf.
#define BUSBAR_VIEW_SHELVE 2

// Take an alarm off the shelf.
#define BUSBAR_VIEW_UNSHELVE 3

// Let go of an alarm's latch.
#define BUSBAR_VIEW_RESET 4

// The pointer moved to x, y.
#define BUSBAR_VIEW_MOVED 1

// A button went down at x, y.
#define BUSBAR_VIEW_PRESSED 2

// A button went up at x, y.
#define BUSBAR_VIEW_RELEASED 3

// The wheel turned by `steps`, away from the hand above 0.
#define BUSBAR_VIEW_SCROLLED 4

// The pointer left the picture.
#define BUSBAR_VIEW_LEFT 5

// One view.
typedef struct BusbarView BusbarView;

// What a view is to show. Set all to 0 first, then `struct_size`, `config` and the size.
typedef struct BusbarViewOptions {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // BUSBAR_VIEW_PANELS or 0.
  uint32_t flags;
  // Width of the picture, pixels: 1 to 8192.
  uint32_t width;
  // Height, likewise; width times height at most 16,777,216.
  uint32_t height;
  // X11 window to draw into; 0 draws offscreen.
  uint32_t window;
  // Milliseconds since the values in the picture were read after which it is not live: it is
  // hatched; 0 for 500. Where frames take so long that no picture could be younger it is two
  // frame times, at most 900 ms. A window is covered at most 50 ms later, on a machine with a CPU to
  // spare.
  uint32_t silent_millis;
  // Milliseconds without a heartbeat and without progress of its process after which the
  // viewer is ended and started again; 0 for 1000. At least silent_millis. A viewer that
  // makes progress is slow and not hung: it is ended after 30 s without a frame, one that
  // sleeps after 5 s, one that a signal stopped after 10 s; later where hung_millis is more,
  // or where its last frames took more than an eighth of that.
  uint32_t hung_millis;
  // The longest delay before a viewer that keeps dying is started again, milliseconds;
  // 0 for 5000.
  uint32_t max_restart_millis;
  // Path of the configuration, UTF-8.
  const char *config;
  // Path of the program `busbar`; null looks for it in PATH.
  const char *program;
  // Who acts on alarms, for the audit log; null for nobody.
  const char *operator_name;
} BusbarViewOptions;

// What happened. Texts end with a zero byte and are never null; they stay as they are
// until the next event of the view is taken, or until the callback returns.
typedef struct BusbarViewEvent {
  // Size of this struct, bytes; set it before the call.
  uint32_t struct_size;
  // BUSBAR_VIEW_READY and so on.
  uint32_t kind;
  // See the kind.
  uint32_t state;
  // Events that were dropped since the last one for want of room; never of alarms.
  uint32_t dropped;
  // See the kind; nanoseconds since 1970-01-01 UTC.
  int64_t unix_nanos;
  // See the kind.
  double number;
  // Sum of BUSBAR_VIEW_SUBSTITUTED and so on; 0 for a live value, and for other kinds of event.
  uint32_t origins;
  // Always 0.
  uint32_t reserved;
  // Where the camera stands, world space in metres.
  float eye[3];
  // What it looks at.
  float target[3];
  // See the kind.
  const char *id;
  // See the kind.
  const char *text;
} BusbarViewEvent;

// Told of each event. It must not close the view, and not unwind.
typedef void (*BusbarViewCallback)(void *context, const struct BusbarViewEvent *event);

// A picture. Its pixels are blue, green, red and 255, rows from the top.
typedef struct BusbarViewFrame {
  // Size of this struct, bytes; set it before the call.
  uint32_t struct_size;
  // BUSBAR_VIEW_LIVE, BUSBAR_VIEW_LATE or BUSBAR_VIEW_DEAD.
  uint32_t state;
  // Pixels in a row; 0 where there is no picture yet.
  uint32_t width;
  // Rows.
  uint32_t height;
  // Bytes from row to row.
  uint32_t stride;
  // Leftmost column of what may differ from the picture of the call before.
  uint32_t damage_x;
  // Topmost row of it.
  uint32_t damage_y;
  // Its columns; 0 where nothing differs.
  uint32_t damage_width;
  // Its rows.
  uint32_t damage_height;
  // Milliseconds since the values that the picture shows were read.
  uint32_t age_millis;
  // Number of the picture in its viewer, from 1.
  uint64_t sequence;
  // The first pixel; null where there is no picture yet. Stays as it is until the next
  // call of busbar_view_frame or busbar_view_close.
  const uint8_t *pixels;
} BusbarViewFrame;

// A value of a tag that the configuration marks with "set_by_host". Its age counts from the
// call, or from its source time if that is earlier; past the tag's freshness it is stale.
typedef struct BusbarViewTag {
  // Id of the tag, UTF-8.
  const char *id;
  // BUSBAR_VIEW_F64 and so on.
  uint32_t kind;
  // BUSBAR_VIEW_GOOD, BUSBAR_VIEW_UNCERTAIN or BUSBAR_VIEW_BAD.
  uint32_t quality;
  // When it was so, nanoseconds since 1970-01-01 UTC, or BUSBAR_VIEW_NO_TIME.
  int64_t source_unix_nanos;
  // The value of kind BUSBAR_VIEW_F64.
  double number;
  // The value of the other kinds.
  int64_t integer;
} BusbarViewTag;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of this library's interface: BUSBAR_VIEW_ABI where library and header fit.
uint32_t busbar_view_abi(void);

// Opens a view and starts its viewer, a process of its own. `*view` is yours: close it.
// Whatever is wrong with the configuration comes as BUSBAR_VIEW_ERROR; the viewer is then
// tried again, less and less often. The library has one thread a view, two for one in a window,
// and must not be unloaded. Returns BUSBAR_VIEW_OK, INVALID or SYSTEM; `*view` is then null.
//
// Your part:
// `options` points to a struct as its `struct_size` says, with texts that end with a zero
// byte; `view` to room for a pointer. Neither is kept.
int32_t busbar_view_open(const struct BusbarViewOptions *options, struct BusbarView **view);

// Closes a view; its viewer ends by itself soon after. No callback runs after this; one that
// runs on another thread is waited for. Null is no view and no fault.
//
// Your part:
// `view` is null or from [`busbar_view_open`]; no other call on it is under way or comes
// later; not from its own callback.
void busbar_view_close(struct BusbarView *view);

// A descriptor that is readable while events wait, for your event loop. It is the view's:
// do not read, write or close it. Below 0 is a status.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_descriptor(const struct BusbarView *view);

// Takes the next event: 1 where there is one, 0 where none waits, below 0 a status. Set
// `event->struct_size` first. Its texts stay until the next call.
//
// Your part:
// `view` is null or open; `event` points to a struct as its `struct_size` says. One thread
// at a time.
int32_t busbar_view_next_event(const struct BusbarView *view, struct BusbarViewEvent *event);

// Sets who is told of events; null for nobody. With `on_own_thread` 0 the callback runs
// within busbar_view_dispatch alone; else the view's own thread calls it, as soon as
// something happens, and it must not take long: the viewer is not watched meanwhile.
//
// Your part:
// `view` is null or open; `callback` can be called with `context` until another is set or
// the view is closed. Not from a callback on the view's own thread.
int32_t busbar_view_set_callback(const struct BusbarView *view,
                                 BusbarViewCallback callback,
                                 void *context,
                                 int32_t on_own_thread);

// Calls the callback for each event that waits, on this thread. Returns how many, at most
// 1024; below 0 is a status.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_dispatch(const struct BusbarView *view);

// Gives the newest picture of a view without a window: 1 where it differs from that of the
// call before, 0 where it does not, below 0 a status. Set `frame->struct_size` first. A
// picture that is old is marked by the library: see BUSBAR_VIEW_DEAD and BUSBAR_VIEW_LATE.
//
// Your part:
// `view` is null or open; `frame` points to a struct as its `struct_size` says. One thread
// at a time.
int32_t busbar_view_frame(const struct BusbarView *view, struct BusbarViewFrame *frame);

// The process of the viewer, 0 while there is none. For diagnosis.
//
// Your part:
// `view` is null or open.
uint32_t busbar_view_process(const struct BusbarView *view);

// Draws pictures of another size. A view in a window follows that by itself.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_resize(const struct BusbarView *view, uint32_t width, uint32_t height);

// Says whether anybody can see the picture; if not, few are drawn. Alarms go on.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_set_visible(const struct BusbarView *view, int32_t visible);

// Goes to a camera of the configuration.
//
// Your part:
// `view` is null or open; `name` null or a text.
int32_t busbar_view_use_camera(const struct BusbarView *view, const char *name);

// Stands at `eye` and looks at `target`: three numbers each, world space in metres.
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

// Draws an overlay, by the name of its plugin instance, or leaves it out.
//
// Your part:
// `view` is null or open; `layer` null or a text.
int32_t busbar_view_set_layer(const struct BusbarView *view, const char *layer, int32_t shown);

// Sets tags, at most 4096 at once; all of them or none. Say them again before their
// freshness ends: a value that nobody repeats goes stale, whatever the reason.
//
// Your part:
// `view` is null or open; `tags` null or so many tags with texts.
int32_t busbar_view_set_tags(const struct BusbarView *view,
                             const struct BusbarViewTag *tags,
                             size_t count);

// Does what an operator does to an alarm: BUSBAR_VIEW_ACKNOWLEDGE and so on; `seconds` on
// the shelf. `operator_name` null is that of the options.
//
// Your part:
// `view` is null or open; texts are null or texts.
int32_t busbar_view_act_on_alarm(const struct BusbarView *view,
                                 const char *alarm,
                                 uint32_t action,
                                 uint32_t seconds,
                                 const char *operator_name);

// Sets an alarm that your program decides on ("mirrored") to a state, 'A' to 'I' by
// IEC 62682.
//
// Your part:
// `view` is null or open; `alarm` null or a text.
int32_t busbar_view_mirror_alarm(const struct BusbarView *view, const char *alarm, char state);

// Says what instant a chart in the scene shows, nanoseconds since 1970-01-01 UTC;
// BUSBAR_VIEW_NO_TIME shows all.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_set_time(const struct BusbarView *view, int64_t unix_nanos);

// Loads a configuration, or null for the present one, anew. The scene before stays until
// that is loaded without a fault (BUSBAR_VIEW_RELOADED), and for good where it has one
// (BUSBAR_VIEW_ERROR).
//
// Your part:
// `view` is null or open; `config` null or a text.
int32_t busbar_view_reload(const struct BusbarView *view, const char *config);

// Selects what is at a pixel; BUSBAR_VIEW_PICKED tells what that is.
//
// Your part:
// `view` is null or open.
int32_t busbar_view_pick(const struct BusbarView *view, uint32_t x, uint32_t y);

// Tells what the pointer did over the picture of a view without a window:
// BUSBAR_VIEW_MOVED and so on; x and y in pixels from the top left; `button` 1 the left,
// 2 the middle, 3 the right one; `steps` of the wheel.
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
