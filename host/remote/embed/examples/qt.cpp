// A view in a Qt widget's window. Usage: qt CONFIG
// Build: c++ -std=c++17 -fPIC qt.cpp -o qt $(pkg-config --cflags --libs busbar Qt6Widgets)
#include <QApplication>
#include <QLabel>
#include <QSocketNotifier>
#include <QVBoxLayout>
#include <QWidget>
#include <busbar.h>
#include <cstdio>

int main(int argc, char **argv)
{
    QApplication application(argc, argv);
    QWidget window, *pane = new QWidget;
    QLabel *picked = new QLabel("nothing picked");
    QVBoxLayout *column = new QVBoxLayout(&window);
    column->addWidget(picked);
    column->addWidget(pane, 1);
    window.resize(800, 500);
    window.show();

    BusbarViewOptions options{};
    options.struct_size = sizeof options;
    options.config = argc == 2 ? argv[1] : nullptr;
    options.width = pane->width(), options.height = pane->height();
    options.window_system = BUSBAR_VIEW_WINDOW_SYSTEM_X11;
    options.window = pane->winId();
    BusbarView *view;
    if (busbar_view_open(&options, &view) != BUSBAR_STATUS_OK)
        return std::fprintf(stderr, "usage: qt CONFIG\n"), 2;
    QSocketNotifier events(busbar_view_descriptor(view), QSocketNotifier::Read);
    QObject::connect(&events, &QSocketNotifier::activated, [&] {
        BusbarViewEvent event{};
        event.struct_size = sizeof event;
        while (busbar_view_next_event(view, &event) == 1) {
            if (event.kind == BUSBAR_VIEW_EVENT_KIND_PICKED) {
                picked->setText(QString("picked ") + event.id);
                std::printf("picked %s\n", event.id);
            } else if (event.kind == BUSBAR_VIEW_EVENT_KIND_READY || event.kind == BUSBAR_VIEW_EVENT_KIND_ERROR) {
                std::printf("%s %s\n", event.kind == BUSBAR_VIEW_EVENT_KIND_READY ? "ready" : "error", event.text);
            } else if (event.kind == BUSBAR_VIEW_EVENT_KIND_LOST || event.kind == BUSBAR_VIEW_EVENT_KIND_RECOVERED) {
                // The library has hatched the picture; the line above it says so as well.
                bool is_lost = event.kind == BUSBAR_VIEW_EVENT_KIND_LOST;
                picked->setText(is_lost ? QString("NOT LIVE: ") + event.text : QString("live again"));
                std::printf("%s %s\n", is_lost ? "lost" : "recovered", event.text);
            }
            std::fflush(stdout);
        }
    });
    int code = application.exec();
    busbar_view_close(view);
    return code;
}
