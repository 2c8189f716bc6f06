// Plugins for the tests of isolation, several in one library: those that behave
// are there to be killed, and those that do not show that nothing else suffers.

#include <arpa/inet.h>
#include <errno.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <busbar/overlay.h>
#include <busbar/telemetry.h>

enum { GREED = 1 << 22, MAX_TAGS = 64, FLOOD_BATCH = 4096, SLOW_AFTER_DRAWS = 3 };

enum Kind { STEADY, FLOOD, SEGFAULT, GREEDY, PARENT, ECHO, SLOW, SOCKET, KINDS };

typedef struct Trouble {
    BusbarPlugin base;
    enum Kind kind;
    uint32_t handles[MAX_TAGS];
    uint32_t nodes[MAX_TAGS];
    size_t count;
    const BusbarSampleSink *sink;
    pthread_t thread;
    atomic_int running;
    int draws;
} Trouble;

static BusbarStr text(const char *words) {
    BusbarStr str = {(const uint8_t *)words, strlen(words)};
    return str;
}

static int is(BusbarStr str, const char *words) {
    return str.len == strlen(words) && memcmp(str.ptr, words, str.len) == 0;
}

static int fail(BusbarError *error, int status, const char *words) {
    int length = snprintf((char *)error->message, sizeof error->message, "%s", words);
    error->message_len = (uint32_t)length;
    error->status = status;
    return status;
}

static BusbarSample sample(uint32_t tag, double value) {
    return (BusbarSample){
        .tag = tag,
        .kind = BUSBAR_VALUE_KIND_F64,
        .number = value,
        .source_time_unix_nanos = BUSBAR_NO_TIME,
    };
}

// Values as fast as they go.
static void flood(Trouble *self) {
    static BusbarSample batch[FLOOD_BATCH];
    for (size_t i = 0; i < FLOOD_BATCH; i++) {
        batch[i] = sample(self->handles[i % self->count], 1.0);
    }
    while (atomic_load(&self->running)) {
        self->sink->publish(self->sink->context, batch, FLOOD_BATCH);
    }
}

// Memory without end, and then none.
static void devour(void) {
    for (;;) {
        char *piece = malloc(GREED);
        if (piece == NULL) {
            fprintf(stderr, "no more memory\n");
            abort();
        }
        memset(piece, 1, GREED);
        usleep(1000);
    }
}

// A child that would outlive it; its number, or 0.
static double bear(void) {
    pid_t child = fork();
    if (child == 0) {
        pause();
        _exit(0);
    }
    return child > 0 ? child : 0;
}

static void *run(void *data) {
    Trouble *self = data;
    double value = self->kind == PARENT ? bear() : 1.0;
    if (self->kind == FLOOD) {
        flood(self);
        return NULL;
    }
    BusbarSample batch[MAX_TAGS];
    for (int turn = 0; atomic_load(&self->running); turn++) {
        for (size_t i = 0; i < self->count; i++) {
            batch[i] = sample(self->handles[i], value);
        }
        self->sink->publish(self->sink->context, batch, self->count);
        if (self->kind == GREEDY && turn == 40) {
            devour();
        }
        if (self->kind == SEGFAULT && turn == 40) {
            fprintf(stderr, "about to fall over\n");
            int *volatile nowhere = NULL;
            *nowhere = 1;
        }
        usleep(5000);
    }
    return NULL;
}

static int start(const BusbarPlugin *plugin, const BusbarTagSpec *tags, size_t count,
                 const BusbarSampleSink *sink, BusbarError *error) {
    Trouble *self = plugin->data;
    if (count > MAX_TAGS) {
        return fail(error, BUSBAR_FAILED, "too many tags");
    }
    for (size_t i = 0; i < count; i++) {
        self->handles[i] = tags[i].tag;
    }
    self->count = count;
    self->sink = sink;
    atomic_store(&self->running, 1);
    sink->report_link(sink->context, BUSBAR_LINK_STATE_UP, text("steady"));
    return pthread_create(&self->thread, NULL, run, self) == 0
        ? BUSBAR_OK
        : fail(error, BUSBAR_FAILED, "no thread");
}

static void stop(const BusbarPlugin *plugin) {
    Trouble *self = plugin->data;
    atomic_store(&self->running, 0);
    pthread_join(self->thread, NULL);
}

static int configure(const BusbarPlugin *plugin, const BusbarBinding *bindings, size_t count,
                     BusbarError *error) {
    Trouble *self = plugin->data;
    if (self->kind == SOCKET) {
        int made = socket(AF_INET, SOCK_STREAM, 0);
        return fail(error, BUSBAR_FAILED, made < 0 ? strerror(errno) : "a socket was made");
    }
    self->count = count < MAX_TAGS ? count : MAX_TAGS;
    for (size_t i = 0; i < self->count; i++) {
        self->nodes[i] = bindings[i].node;
    }
    return BUSBAR_OK;
}

static int draw(const BusbarPlugin *plugin, const BusbarOverlayFrame *frame,
                BusbarOverlayOutput *output, BusbarError *error) {
    Trouble *self = plugin->data;
    (void)error;
    if (self->kind == SLOW && self->draws++ == SLOW_AFTER_DRAWS) {
        sleep(30);
    }
    if (output->primitive_capacity < self->count || output->text_capacity < 1) {
        return BUSBAR_BUFFER_TOO_SMALL;
    }
    output->text[0] = '1';
    output->text_len = 1;
    for (uint32_t i = 0; i < self->count; i++) {
        BusbarOverlayPrimitive line = {.kind = BUSBAR_PRIMITIVE_KIND_LINE, .binding = i};
        line.node = self->nodes[i];
        line.severity = frame->values[i].quality == BUSBAR_QUALITY_GOOD
            ? BUSBAR_SEVERITY_NORMAL
            : BUSBAR_SEVERITY_WARNING;
        line.text_len = 1;
        output->primitives[i] = line;
    }
    output->primitive_count = (uint32_t)self->count;
    return BUSBAR_OK;
}

static const BusbarTelemetry telemetry = {
    .struct_size = sizeof(BusbarTelemetry), .start = start, .stop = stop};
static const BusbarOverlay overlay = {
    .struct_size = sizeof(BusbarOverlay), .configure = configure, .draw = draw};

static void destroy(BusbarPlugin *plugin) { free(plugin->data); }

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    Trouble *self = plugin->data;
    if (self->kind < ECHO) {
        return is(id, BUSBAR_TELEMETRY_ID) ? &telemetry : NULL;
    }
    return is(id, BUSBAR_OVERLAY_ID) ? &overlay : NULL;
}

static const char *const IDS[KINDS] = {"trouble.steady", "trouble.flood", "trouble.segfault",
                                       "trouble.greedy", "trouble.parent", "trouble.echo",
                                       "trouble.slow",   "trouble.socket"};

static uint32_t count(void) { return KINDS; }

static const BusbarPluginDescriptor *descriptor(uint32_t index) {
    static BusbarStr capabilities[KINDS];
    static BusbarPluginDescriptor descriptors[KINDS];
    if (index >= KINDS) {
        return NULL;
    }
    capabilities[index] = text(index < ECHO ? BUSBAR_TELEMETRY_ID : BUSBAR_OVERLAY_ID);
    BusbarPluginDescriptor made = {.struct_size = sizeof(BusbarPluginDescriptor)};
    made.id = made.name = text(IDS[index]);
    made.version = text("1.0");
    made.description = text("For tests.");
    made.settings_schema = text("");
    made.capability_count = 1;
    made.capabilities = &capabilities[index];
    descriptors[index] = made;
    return &descriptors[index];
}

static BusbarPlugin *create(BusbarStr id, BusbarStr settings, const BusbarHost *host,
                            BusbarError *error) {
    (void)settings;
    (void)host;
    for (int kind = 0; kind < KINDS; kind++) {
        if (is(id, IDS[kind])) {
            Trouble *self = calloc(1, sizeof *self);
            if (self == NULL) {
                break;
            }
            self->kind = (enum Kind)kind;
            self->base.struct_size = sizeof(BusbarPlugin);
            self->base.data = self;
            self->base.destroy = destroy;
            self->base.get_capability = get_capability;
            return &self->base;
        }
    }
    fail(error, BUSBAR_INVALID_ARGUMENT, "no such plugin");
    return NULL;
}

static const BusbarPluginFactory factory = {.struct_size = sizeof(BusbarPluginFactory),
                                            .count = count,
                                            .descriptor = descriptor,
                                            .create = create};

static const void *get_factory(BusbarStr id) {
    return is(id, "busbar.plugin-factory/1") ? &factory : NULL;
}

BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = {
    .struct_size = sizeof(BusbarPluginEntry),
    .abi_major = BUSBAR_ABI_MAJOR,
    .abi_minor = BUSBAR_ABI_MINOR,
    .get_factory = get_factory};
