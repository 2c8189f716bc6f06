/* A view in a window of plain X11. Usage: x11 CONFIG
 * Build: cc -std=c99 x11.c -o x11 $(pkg-config --cflags --libs busbar x11)
 */
#include <X11/Xlib.h>
#include <busbar.h>
#include <poll.h>
#include <stdio.h>

int main(int argc, char **argv)
{
    Display *display = XOpenDisplay(NULL);
    if (argc != 2 || !display)
        return fprintf(stderr, "usage: x11 CONFIG, with a display\n"), 2;
    Window window = XCreateSimpleWindow(display, DefaultRootWindow(display), 0, 0, 800, 500, 0, 0, 0);
    XStoreName(display, window, "Busbar in X11");
    XSelectInput(display, window, StructureNotifyMask);
    XMapWindow(display, window);
    XSync(display, False);

    BusbarViewOptions options = {0};
    options.struct_size = sizeof options;
    options.config = argv[1];
    options.width = 800, options.height = 500;
    options.window_system = BUSBAR_VIEW_WINDOW_SYSTEM_X11;
    options.window = window;
    BusbarView *view;
    if (busbar_view_open(&options, &view) != BUSBAR_STATUS_OK)
        return fprintf(stderr, "no view\n"), 1;

    for (;;) {
        struct pollfd polled[2] = {{ConnectionNumber(display), POLLIN, 0},
                                   {busbar_view_descriptor(view), POLLIN, 0}};
        poll(polled, 2, -1);
        BusbarViewEvent event = {.struct_size = sizeof event};
        while (busbar_view_next_event(view, &event) == 1)
            if (event.kind == BUSBAR_VIEW_EVENT_KIND_PICKED)
                printf("picked %s\n", event.id), fflush(stdout);
            else if (event.kind == BUSBAR_VIEW_EVENT_KIND_READY || event.kind == BUSBAR_VIEW_EVENT_KIND_ERROR)
                printf("%s %s\n", event.kind == BUSBAR_VIEW_EVENT_KIND_READY ? "ready" : "error", event.text), fflush(stdout);
            else if (event.kind == BUSBAR_VIEW_EVENT_KIND_LOST || event.kind == BUSBAR_VIEW_EVENT_KIND_RECOVERED) {
                /* The library has hatched the picture; the title says so as well. */
                int is_lost = event.kind == BUSBAR_VIEW_EVENT_KIND_LOST;
                XStoreName(display, window, is_lost ? "NOT LIVE - Busbar in X11" : "Busbar in X11");
                XFlush(display);
                printf("%s %s\n", is_lost ? "lost" : "recovered", event.text), fflush(stdout);
            }
        while (XPending(display)) {
            XEvent happened;
            XNextEvent(display, &happened);
            if (happened.type == DestroyNotify)
                return busbar_view_close(view), 0;
        }
    }
}
