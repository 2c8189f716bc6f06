/* A plugin as it was built on the day the entry, the factory and the host table
 * froze. Its binary beside this file must load in every 1.x; see build.sh.
 *
 * It has no capability: those were drafts. Its settings are ignored, but for
 * a text that begins with `[`, which it refuses. */

#include <busbar_plugin.h>

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define TEXT(literal) {(const uint8_t *)(literal), sizeof(literal) - 1}

static int running;

typedef struct Frozen {
    BusbarPlugin plugin;
    const BusbarHost *host;
} Frozen;

static int same(BusbarStr a, BusbarStr b) {
    return a.len == b.len && (a.len == 0 || (a.ptr && memcmp(a.ptr, b.ptr, a.len) == 0));
}

static int aligned(const void *pointer) {
    return pointer != NULL && (uintptr_t)pointer % _Alignof(BusbarHost) == 0;
}

static void fail(BusbarError *error, BusbarStatus status, const char *message) {
    if (error == NULL || (uintptr_t)error % _Alignof(BusbarError) != 0 ||
        error->struct_size < sizeof *error) {
        return;
    }
    error->status = status;
    error->message_len = (uint32_t)strlen(message);
    memcpy(error->message, message, error->message_len);
}

static void say(const BusbarHost *host, const char *text) {
    BusbarStr line = {(const uint8_t *)text, strlen(text)};
    if (host->log != NULL) {
        host->log(host->context, BUSBAR_LOG_INFO, line);
    }
}

static BusbarStatus init(BusbarError *error) {
    (void)error;
    running++;
    return BUSBAR_OK;
}

static void deinit(void) {
    if (running > 0) {
        running--;
    }
}

static const BusbarPluginDescriptor DESCRIPTOR = {
    .struct_size = sizeof(BusbarPluginDescriptor),
    .capability_count = 0,
    .id = TEXT("com.example.frozen"),
    .name = TEXT("Frozen"),
    .version = TEXT("1.0.0"),
    .description = TEXT("Built when ABI 1.0 froze."),
    .settings_schema = TEXT("{\"type\":\"object\",\"additionalProperties\":false}"),
    .capabilities = NULL,
};

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    (void)plugin;
    (void)id;
    return NULL;
}

static void destroy(BusbarPlugin *plugin) {
    if (!aligned(plugin)) {
        return;
    }
    Frozen *frozen = plugin->data;
    say(frozen->host, "frozen: destroyed");
    free(frozen);
}

static uint32_t count(void) {
    return 1;
}

static const BusbarPluginDescriptor *descriptor(uint32_t index) {
    return index == 0 ? &DESCRIPTOR : NULL;
}

static BusbarPlugin *create(BusbarStr id, BusbarStr settings, const BusbarHost *host,
                            BusbarError *error) {
    if (!same(id, DESCRIPTOR.id)) {
        fail(error, BUSBAR_INVALID_ARGUMENT, "this library has 'com.example.frozen' alone");
        return NULL;
    }
    if (!aligned(host) || host->struct_size < sizeof *host) {
        fail(error, BUSBAR_INVALID_ARGUMENT, "create: host is null, misaligned or too small");
        return NULL;
    }
    if (settings.len > 0 && settings.ptr != NULL && settings.ptr[0] == '[') {
        fail(error, BUSBAR_INVALID_SETTINGS, "settings: a list is no object; write {}");
        return NULL;
    }
    Frozen *frozen = calloc(1, sizeof *frozen);
    if (frozen == NULL) {
        fail(error, BUSBAR_FAILED, "no memory is left");
        return NULL;
    }
    frozen->host = host;
    frozen->plugin.struct_size = sizeof(BusbarPlugin);
    frozen->plugin.data = frozen;
    frozen->plugin.destroy = destroy;
    frozen->plugin.get_capability = get_capability;
    say(host, "frozen: created");
    return &frozen->plugin;
}

static const BusbarPluginFactory FACTORY = {
    .struct_size = sizeof(BusbarPluginFactory),
    .count = count,
    .descriptor = descriptor,
    .create = create,
};

static const void *get_factory(BusbarStr id) {
    BusbarStr wanted = TEXT(BUSBAR_PLUGIN_FACTORY_ID);
    return same(id, wanted) ? &FACTORY : NULL;
}

BUSBAR_EXPORT const BusbarPluginEntry busbar_plugin_entry = {
    .struct_size = sizeof(BusbarPluginEntry),
    .abi_major = BUSBAR_ABI_MAJOR,
    .abi_minor = BUSBAR_ABI_MINOR,
    .init = init,
    .deinit = deinit,
    .get_factory = get_factory,
};
