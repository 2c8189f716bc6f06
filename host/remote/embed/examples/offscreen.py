"""A view without a window, in Python alone. Usage: offscreen.py CONFIG PICTURE.ppm

Waits for a calm picture, writes it, picks what is in its middle, and ends."""
import select
import sys
from ctypes import CDLL, POINTER, Structure, byref, c_char_p, c_double, c_int64
from ctypes import c_uint32, c_uint64, c_ubyte, c_void_p, sizeof, string_at


class Options(Structure):
    _fields_ = [(name, c_uint32) for name in ("struct_size flags width height window_system "
                "silent_millis hung_millis max_restart_millis").split()] + [("window", c_uint64)] + [
                (name, c_char_p) for name in ("config", "program", "operator_name")]


class Event(Structure):
    _fields_ = [(name, c_uint32) for name in ("struct_size kind dropped liveness alarm_state "
                "alarm_action shelve_seconds quality origins verdict is_assumed reserved").split()] + [
        ("unix_nanos", c_int64), ("eye", c_double * 3), ("target", c_double * 3),
        ("id", c_char_p), ("overlay", c_char_p), ("text", c_char_p)]


class Frame(Structure):
    _fields_ = [(name, c_uint32) for name in ("struct_size liveness width height stride damage_x "
                "damage_y damage_width damage_height age_millis").split()] + [
                ("sequence", c_uint64), ("pixels", POINTER(c_ubyte))]


READY, PICKED, ERROR, LIVE = 1, 3, 10, 0


def events(view, seconds):
    """Those that come within some time, as they come."""
    event = Event(sizeof(Event))
    select.select([busbar.busbar_view_descriptor(view)], [], [], seconds)
    while busbar.busbar_view_next_event(view, byref(event)) == 1:
        yield event.kind, event.id.decode(), event.text.decode()


busbar = CDLL("libbusbar.so")
options = Options(sizeof(Options), 0, 640, 360, config=sys.argv[1].encode())
view = c_void_p()
assert busbar.busbar_view_open(byref(options), byref(view)) == 0
frame, is_ready, picked = Frame(sizeof(Frame)), False, None
while picked is None:
    for kind, name, text in events(view, 10):
        if kind == READY:
            is_ready = True
        elif kind == PICKED:
            picked = name
        elif kind == ERROR:
            sys.exit(text)
    if is_ready and busbar.busbar_view_frame(view, byref(frame)) == 1 and frame.liveness == LIVE:
        busbar.busbar_view_pick(view, frame.width // 2, frame.height // 2)
busbar.busbar_view_frame(view, byref(frame))
bgra = string_at(frame.pixels, frame.stride * frame.height)
rgb = bytearray(frame.width * frame.height * 3)
rgb[0::3], rgb[1::3], rgb[2::3] = bgra[2::4], bgra[1::4], bgra[0::4]
with open(sys.argv[2], "wb") as picture:
    picture.write(b"P6 %d %d 255\n" % (frame.width, frame.height) + rgb)
busbar.busbar_view_close(view)
print("picked", picked)
