/* Telemetry plugin `my_plugin`: reads lines `NAME VALUE` from a TCP server. */

#define _POSIX_C_SOURCE 200809L

#include "support.h"

#include <busbar/telemetry.h>

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <netdb.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#define ID "com.example.my_plugin"
#define MAX_ADDRESS 128  /* bytes of the setting */
#define MAX_NAME 64      /* bytes of a name */
#define MAX_LINE 256     /* bytes of a line */
#define MAX_TAGS 100000
#define TIMEOUT_MILLIS 1000 /* to connect, and of silence */
#define RETRY_MILLIS 1000

typedef struct Tag {
    uint32_t tag;
    BusbarValueKind kind;
    char name[MAX_NAME];
} Tag;

typedef struct Instance {
    BusbarPlugin plugin; /* first: the host's pointer is this one */
    char host[MAX_ADDRESS];
    char port[MAX_ADDRESS];
    int active;
    int has_thread; /* while active, if there are tags */
    pthread_t thread;
    int wake[2]; /* a byte in this pipe ends the thread */
    const BusbarSampleSink *sink;
    Tag *tags;
    size_t tag_count;
} Instance;

/* ---- values ---- */

static void publish(const Instance *self, const BusbarSample *sample) {
    self->sink->publish(self->sink->context, sample, 1);
}

/* A sample without a value, for a reason. */
static BusbarSample bad(const Tag *tag, BusbarReason reason) {
    return (BusbarSample){
        .tag = tag->tag,
        .kind = BUSBAR_VALUE_KIND_NONE,
        .quality = BUSBAR_QUALITY_BAD,
        .reason = reason,
        .source_time_unix_nanos = BUSBAR_NO_TIME,
    };
}

static void publish_bad(const Instance *self, BusbarReason reason) {
    for (size_t i = 0; i < self->tag_count; i++) {
        BusbarSample sample = bad(&self->tags[i], reason);
        publish(self, &sample);
    }
}

static void report(const Instance *self, BusbarLinkState state, const char *text) {
    BusbarStr message = {(const uint8_t *)text, strlen(text)};
    self->sink->report_link(self->sink->context, state, message);
}

/* Sets the value of a sample of its kind from text, which it borrows; 0 if it is none. */
static int parse_value(const char *text, BusbarSample *sample) {
    char *end;
    if (sample->kind == BUSBAR_VALUE_KIND_TEXT) {
        sample->text = (BusbarStr){(const uint8_t *)text, strlen(text)};
        return 1;
    }
    if (sample->kind == BUSBAR_VALUE_KIND_F64) {
        sample->number = strtod(text, &end);
        return end != text && *end == '\0' && isfinite(sample->number);
    }
    errno = 0;
    sample->integer = strtoll(text, &end, 10);
    int most = sample->kind == BUSBAR_VALUE_KIND_BOOL ? 1 : 3;
    int fits = sample->kind == BUSBAR_VALUE_KIND_I64 ||
               (sample->integer >= 0 && sample->integer <= most);
    return end != text && *end == '\0' && errno == 0 && fits;
}

static void read_line(const Instance *self, char *line) {
    char *space = strchr(line, ' ');
    if (space == NULL) {
        return;
    }
    *space = '\0';
    for (size_t i = 0; i < self->tag_count; i++) {
        const Tag *tag = &self->tags[i];
        if (strcmp(tag->name, line) != 0) {
            continue;
        }
        BusbarSample sample = {
            .tag = tag->tag,
            .kind = tag->kind,
            .source_time_unix_nanos = BUSBAR_NO_TIME,
        };
        if (!parse_value(space + 1, &sample)) {
            sample = bad(tag, BUSBAR_REASON_CONFIGURATION);
        }
        publish(self, &sample);
    }
}

/* ---- the thread ---- */

/* Waits for a descriptor (or none, -1): 1 ready, 0 too late, -1 told to stop. */
static int wait_for(const Instance *self, int descriptor, short events, int millis) {
    struct pollfd polled[2] = {{self->wake[0], POLLIN, 0}, {descriptor, events, 0}};
    int ready = poll(polled, 2, millis);
    if (polled[0].revents != 0) {
        return -1;
    }
    return ready > 0 ? 1 : 0;
}

/* A connected socket, or -1. */
static int connect_to_server(const Instance *self) {
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICHOST | AI_NUMERICSERV};
    struct addrinfo *found;
    if (getaddrinfo(self->host, self->port, &hints, &found) != 0) {
        return -1;
    }
    int server = socket(found->ai_family, SOCK_STREAM, 0);
    if (server >= 0) {
        fcntl(server, F_SETFD, FD_CLOEXEC);
        fcntl(server, F_SETFL, O_NONBLOCK);
        int status = connect(server, found->ai_addr, found->ai_addrlen);
        int fault = status == 0 ? 0 : errno;
        socklen_t size = sizeof fault;
        if (fault == EINPROGRESS && wait_for(self, server, POLLOUT, TIMEOUT_MILLIS) == 1) {
            getsockopt(server, SOL_SOCKET, SO_ERROR, &fault, &size);
        }
        if (fault != 0) {
            close(server);
            server = -1;
        }
    }
    freeaddrinfo(found);
    return server;
}

/* Reads lines until the server goes, is silent, or the plugin stops. */
static void read_lines(const Instance *self, int server) {
    char buffer[MAX_LINE + 1];
    size_t used = 0;
    while (wait_for(self, server, POLLIN, TIMEOUT_MILLIS) == 1) {
        ssize_t got = recv(server, buffer + used, MAX_LINE - used, 0);
        if (got <= 0) {
            return;
        }
        used += (size_t)got;
        char *line = buffer, *end;
        while ((end = memchr(line, '\n', used - (size_t)(line - buffer))) != NULL) {
            *end = '\0';
            read_line(self, line);
            line = end + 1;
        }
        used -= (size_t)(line - buffer);
        memmove(buffer, line, used);
        if (used == MAX_LINE) {
            return; /* no line is that long: this is no such server */
        }
    }
}

static void *work(void *context) {
    const Instance *self = context;
    report(self, BUSBAR_LINK_STATE_CONNECTING, "connecting");
    do {
        int server = connect_to_server(self);
        if (server >= 0) {
            report(self, BUSBAR_LINK_STATE_UP, "connected");
            read_lines(self, server);
            close(server);
        }
        const char *reason = server >= 0 ? "the connection ended" : "cannot connect";
        report(self, BUSBAR_LINK_STATE_DOWN, reason);
        publish_bad(self, BUSBAR_REASON_COMMUNICATION);
    } while (wait_for(self, -1, 0, RETRY_MILLIS) == 0);
    return NULL;
}

static int start_thread(Instance *self) {
    if (pipe(self->wake) != 0) {
        return 0;
    }
    fcntl(self->wake[0], F_SETFD, FD_CLOEXEC);
    fcntl(self->wake[1], F_SETFD, FD_CLOEXEC);
    self->has_thread = pthread_create(&self->thread, NULL, work, self) == 0;
    if (!self->has_thread) {
        close(self->wake[0]);
        close(self->wake[1]);
    }
    return self->has_thread;
}

/* ---- telemetry ---- */

/* Reads tags into `into`, or only looks at them if that is null. */
static BusbarStatus parse_tags(const BusbarTagSpec *tags, size_t count, Tag *into,
                               BusbarError *error) {
    for (size_t i = 0; i < count; i++) {
        const BusbarTagSpec *spec = &tags[i];
        Tag tag = {.tag = spec->tag, .kind = spec->kind};
        size_t at = 0;
        if (spec->kind < BUSBAR_VALUE_KIND_F64 || spec->kind > BUSBAR_VALUE_KIND_TEXT) {
            return fail(error, BUSBAR_INVALID_ARGUMENT, "tag %u: unknown kind %u", (unsigned)spec->tag,
                        (unsigned)spec->kind);
        }
        if (!read_string(spec->address_json, &at, tag.name, sizeof tag.name) ||
            at != spec->address_json.len || tag.name[0] == '\0' || strchr(tag.name, ' ') != NULL) {
            return fail(error, BUSBAR_INVALID_SETTINGS,
                        "tag '%.*s': the address must be a name as JSON text, such as \"oil\", of "
                        "less than %d bytes",
                        (int)cut(spec->id.ptr, spec->id.len, 200), (const char *)spec->id.ptr,
                        MAX_NAME);
        }
        if (into != NULL) {
            into[i] = tag;
        }
    }
    return BUSBAR_OK;
}

static BusbarStatus check(const BusbarPlugin *plugin, const BusbarTagSpec *tags, size_t count,
                          BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN_ARRAY(tags, count, BusbarTagSpec) ||
        count > MAX_TAGS) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "check: an argument is null or misaligned");
    }
    return parse_tags(tags, count, NULL, error);
}

static BusbarStatus start(const BusbarPlugin *plugin, const BusbarTagSpec *tags, size_t count,
                          const BusbarSampleSink *sink, BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN_ARRAY(tags, count, BusbarTagSpec) ||
        !GIVEN(sink, BusbarSampleSink) || count > MAX_TAGS) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "start: an argument is null or misaligned");
    }
    Instance *self = plugin->data;
    if (self->active) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "start: already started; stop it first");
    }
    self->tags = calloc(count + 1, sizeof *self->tags);
    if (self->tags == NULL) {
        return fail(error, BUSBAR_FAILED, "start: no memory is left");
    }
    BusbarStatus status = parse_tags(tags, count, self->tags, error);
    self->tag_count = count;
    self->sink = sink;
    if (status == BUSBAR_OK && count > 0 && !start_thread(self)) {
        status = fail(error, BUSBAR_FAILED, "start: no pipe or thread is left");
    }
    self->active = status == BUSBAR_OK;
    if (!self->active) {
        free(self->tags);
        self->tags = NULL;
    }
    return status;
}

static void stop(const BusbarPlugin *plugin) {
    if (!GIVEN(plugin, BusbarPlugin)) {
        return;
    }
    Instance *self = plugin->data;
    if (self->has_thread) {
        ssize_t written = write(self->wake[1], "", 1);
        (void)written; /* an empty pipe takes a byte */
        pthread_join(self->thread, NULL);
        close(self->wake[0]);
        close(self->wake[1]);
    }
    free(self->tags);
    self->tags = NULL;
    self->has_thread = self->active = 0;
}

static const BusbarTelemetry TELEMETRY = {
    .struct_size = sizeof(BusbarTelemetry), .check = check, .start = start, .stop = stop};

/* ---- plugin, factory, entry ---- */

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    (void)plugin;
    return same_text(id, BUSBAR_TELEMETRY_ID) ? &TELEMETRY : NULL;
}

static void destroy(BusbarPlugin *plugin) {
    if (GIVEN(plugin, BusbarPlugin)) {
        stop(plugin);
        free(plugin->data);
    }
}

static const BusbarStr CAPABILITIES[] = {TEXT(BUSBAR_TELEMETRY_ID)};
static const BusbarPluginDescriptor DESCRIPTOR = {
    .struct_size = sizeof(BusbarPluginDescriptor),
    .capability_count = 1,
    .id = TEXT(ID),
    .name = TEXT("MyPlugin"),
    .version = TEXT("0.1.0"),
    .description = TEXT("Reads lines of names and values over TCP."),
    .settings_schema = TEXT("{\"type\":\"object\",\"additionalProperties\":false,"
                            "\"required\":[\"address\"],\"properties\":{\"address\":{"
                            "\"type\":\"string\",\"description\":\"Server, IP:PORT\","
                            "\"maxLength\":127,\"examples\":[\"127.0.0.1:7070\"]}}}"),
    .capabilities = CAPABILITIES,
};

static uint32_t count(void) {
    return 1;
}

static const BusbarPluginDescriptor *descriptor(uint32_t index) {
    return index == 0 ? &DESCRIPTOR : NULL;
}

/* Reads {"address": "IP:PORT"}; the host has checked it against the schema. */
static int parse_settings(BusbarStr json, char *host, char *port) {
    char key[16], *colon;
    size_t at = 0;
    if (json.ptr == NULL || json.len == 0 || (skip_space(json, &at), json.ptr[at++] != '{')) {
        return 0;
    }
    skip_space(json, &at);
    if (!read_string(json, &at, key, sizeof key) || strcmp(key, "address") != 0) {
        return 0;
    }
    skip_space(json, &at);
    if (at >= json.len || json.ptr[at++] != ':') {
        return 0;
    }
    skip_space(json, &at);
    if (!read_string(json, &at, host, MAX_ADDRESS) || (colon = strrchr(host, ':')) == NULL) {
        return 0;
    }
    *colon = '\0';
    memcpy(port, colon + 1, strlen(colon + 1) + 1);
    return 1;
}

static BusbarPlugin *create(BusbarStr id, BusbarStr settings, const BusbarHost *host,
                            BusbarError *error) {
    if (!same_text(id, ID) || !GIVEN(host, BusbarHost)) {
        fail(error, BUSBAR_INVALID_ARGUMENT, "create: this is %s, and it needs a host", ID);
        return NULL;
    }
    Instance *self = calloc(1, sizeof *self);
    if (self == NULL) {
        fail(error, BUSBAR_FAILED, "create: no memory is left");
        return NULL;
    }
    if (!parse_settings(settings, self->host, self->port)) {
        fail(error, BUSBAR_INVALID_SETTINGS, "settings: write {\"address\": \"127.0.0.1:7070\"}");
        free(self);
        return NULL;
    }
    self->plugin.struct_size = sizeof self->plugin;
    self->plugin.data = self;
    self->plugin.destroy = destroy;
    self->plugin.get_capability = get_capability;
    return &self->plugin;
}

static const BusbarPluginFactory FACTORY = {.struct_size = sizeof(BusbarPluginFactory),
                                            .count = count,
                                            .descriptor = descriptor,
                                            .create = create};

static const void *get_factory(BusbarStr id) {
    return same_text(id, BUSBAR_PLUGIN_FACTORY_ID) ? &FACTORY : NULL;
}

BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = {
    .struct_size = sizeof(BusbarPluginEntry),
    .abi_major = BUSBAR_ABI_MAJOR,
    .abi_minor = BUSBAR_ABI_MINOR,
    .get_factory = get_factory,
};
