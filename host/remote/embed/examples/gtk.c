/* A view in a GTK window, drawn by the program itself. Usage: gtk CONFIG
 * Build: cc -std=c99 gtk.c -o gtk $(pkg-config --cflags --libs busbar gtk+-3.0)
 */
#include <busbar.h>
#include <glib-unix.h>
#include <gtk/gtk.h>
#include <stdbool.h>

static BusbarView *view;

static gboolean draw(GtkWidget *area, cairo_t *cairo, gpointer data)
{
    (void)area, (void)data;
    BusbarViewFrame frame = {.struct_size = sizeof frame};
    busbar_view_frame(view, &frame);
    if (!frame.pixels)
        return FALSE;
    cairo_surface_t *picture = cairo_image_surface_create_for_data(
        (unsigned char *)frame.pixels, CAIRO_FORMAT_RGB24, (int)frame.width, (int)frame.height, (int)frame.stride);
    cairo_set_source_surface(cairo, picture, 0, 0);
    cairo_paint(cairo);
    cairo_surface_destroy(picture);
    return TRUE;
}

static gboolean happened(gint descriptor, GIOCondition condition, gpointer area)
{
    (void)descriptor, (void)condition;
    BusbarViewEvent event = {.struct_size = sizeof event};
    while (busbar_view_next_event(view, &event) == 1)
        if (event.kind == BUSBAR_VIEW_EVENT_KIND_FRAME)
            gtk_widget_queue_draw(area);
        else if (event.kind == BUSBAR_VIEW_EVENT_KIND_PICKED)
            printf("picked %s\n", event.id), fflush(stdout);
        else if (event.kind == BUSBAR_VIEW_EVENT_KIND_READY || event.kind == BUSBAR_VIEW_EVENT_KIND_ERROR)
            printf("%s %s\n", event.kind == BUSBAR_VIEW_EVENT_KIND_READY ? "ready" : "error", event.text), fflush(stdout);
    return TRUE;
}

static gboolean pointed(GtkWidget *area, GdkEvent *event, gpointer data)
{
    (void)area, (void)data;
    bool is_press = event->type == GDK_BUTTON_PRESS, is_release = event->type == GDK_BUTTON_RELEASE;
    if (!is_press && !is_release && event->type != GDK_MOTION_NOTIFY)
        return FALSE;
    BusbarViewPointer input = is_press     ? BUSBAR_VIEW_POINTER_PRESSED
                              : is_release ? BUSBAR_VIEW_POINTER_RELEASED
                                           : BUSBAR_VIEW_POINTER_MOVED;
    double x = 0, y = 0;
    guint button = 1;
    gdk_event_get_coords(event, &x, &y);
    gdk_event_get_button(event, &button);
    busbar_view_point(view, input, (float)x, (float)y, button, 0);
    return FALSE;
}

static void resized(GtkWidget *area, GdkRectangle *size, gpointer data)
{
    (void)area, (void)data;
    busbar_view_resize(view, (uint32_t)size->width, (uint32_t)size->height);
}

int main(int argc, char **argv)
{
    gtk_init(&argc, &argv);
    BusbarViewOptions options = {.struct_size = sizeof options, .width = 800, .height = 500};
    options.config = argc == 2 ? argv[1] : NULL;
    if (busbar_view_open(&options, &view) != BUSBAR_STATUS_OK)
        return fprintf(stderr, "usage: gtk CONFIG\n"), 2;
    GtkWidget *window = gtk_window_new(GTK_WINDOW_TOPLEVEL), *area = gtk_drawing_area_new();
    gtk_window_set_default_size(GTK_WINDOW(window), 800, 500);
    gtk_container_add(GTK_CONTAINER(window), area);
    gtk_widget_add_events(area, GDK_BUTTON_PRESS_MASK | GDK_BUTTON_RELEASE_MASK | GDK_POINTER_MOTION_MASK);
    g_signal_connect(area, "draw", G_CALLBACK(draw), NULL);
    g_signal_connect(area, "event", G_CALLBACK(pointed), NULL);
    g_signal_connect(area, "size-allocate", G_CALLBACK(resized), NULL);
    g_signal_connect(window, "destroy", G_CALLBACK(gtk_main_quit), NULL);
    g_unix_fd_add(busbar_view_descriptor(view), G_IO_IN, happened, area);
    gtk_widget_show_all(window);
    gtk_main();
    busbar_view_close(view);
    return 0;
}
