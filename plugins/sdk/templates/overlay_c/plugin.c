/* Overlay plugin `my_plugin`: a line for every value, and colour outside its band. */

#include "support.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#define ID "com.example.my_plugin"
#define MAX_PART 256 /* bytes of a caption, and of a value */
#define MAX_BINDINGS 1000000

typedef struct Binding {
    uint32_t node;
    double limit_low, limit_high; /* NaN for none */
    size_t name_len, unit_len;
    char name[MAX_PART], unit[MAX_PART / 4];
} Binding;

typedef struct Instance {
    BusbarPlugin plugin; /* first: the host's pointer is this one */
    Binding *bindings;
    size_t count;
} Instance;

/* ---- overlay ---- */

static size_t keep(char *into, size_t room, BusbarStr text) {
    size_t len = cut(text.ptr, text.len, room);
    if (len > 0) {
        memcpy(into, text.ptr, len);
    }
    return len;
}

static BusbarStatus configure(const BusbarPlugin *plugin, const BusbarBinding *bindings,
                              size_t count, BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN_ARRAY(bindings, count, BusbarBinding) ||
        count > MAX_BINDINGS) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "configure: an argument is null or misaligned");
    }
    Binding *kept = calloc(count + 1, sizeof *kept);
    if (kept == NULL) {
        return fail(error, BUSBAR_FAILED, "configure: no memory is left");
    }
    for (size_t i = 0; i < count; i++) {
        kept[i].node = bindings[i].node;
        kept[i].limit_low = bindings[i].limit_low;
        kept[i].limit_high = bindings[i].limit_high;
        kept[i].name_len = keep(kept[i].name, sizeof kept[i].name, bindings[i].tag_name);
        kept[i].unit_len = keep(kept[i].unit, sizeof kept[i].unit, bindings[i].unit);
    }
    Instance *self = plugin->data;
    free(self->bindings);
    self->bindings = kept;
    self->count = count;
    return BUSBAR_OK;
}

/* A value with its unit; its length. The host adds marks for quality and age. */
static size_t format(const BusbarTagValue *value, const Binding *binding, char *into) {
    static const char *const POSITIONS[] = {"travelling", "open", "closed", "invalid"};
    int unit = (int)binding->unit_len, len;
    double number;
    switch (value->kind) {
    case BUSBAR_VALUE_F64:
        memcpy(&number, &value->value, sizeof number);
        len = snprintf(into, MAX_PART, "%.4g %.*s", number, unit, binding->unit);
        break;
    case BUSBAR_VALUE_I64:
        len = snprintf(into, MAX_PART, "%" PRId64 " %.*s", (int64_t)value->value, unit, binding->unit);
        break;
    case BUSBAR_VALUE_BOOL:
        len = snprintf(into, MAX_PART, "%s", value->value ? "on" : "off");
        break;
    case BUSBAR_VALUE_DOUBLE_POINT:
        len = snprintf(into, MAX_PART, "%s", POSITIONS[value->value & 3]);
        break;
    default:
        len = snprintf(into, MAX_PART, "-");
    }
    return len < 0 ? 0 : len < MAX_PART ? (size_t)len : MAX_PART - 1;
}

static uint32_t judge(const BusbarTagValue *value, const Binding *binding) {
    double number;
    if (value->kind != BUSBAR_VALUE_F64) {
        return BUSBAR_SEVERITY_NORMAL;
    }
    memcpy(&number, &value->value, sizeof number);
    /* Comparisons with NaN, which stands for no limit, are false. */
    int outside = number < binding->limit_low || number > binding->limit_high;
    return outside ? BUSBAR_SEVERITY_WARNING : BUSBAR_SEVERITY_NORMAL;
}

/* Adds text to the output; 0 if it does not fit. */
static int add_text(BusbarOverlayOutput *output, const char *text, size_t len) {
    if (len > output->text_capacity - output->text_len) {
        return 0;
    }
    if (len > 0) {
        memcpy(output->text + output->text_len, text, len);
    }
    output->text_len += (uint32_t)len;
    return 1;
}

static int add(BusbarOverlayOutput *output, BusbarOverlayPrimitive primitive) {
    if (output->primitive_count >= output->primitive_capacity) {
        return 0;
    }
    output->primitives[output->primitive_count++] = primitive;
    return 1;
}

static int draw_binding(const Binding *binding, uint32_t index, const BusbarTagValue *value,
                        BusbarOverlayOutput *output) {
    char text[MAX_PART];
    size_t len = format(value, binding, text);
    BusbarOverlayPrimitive line = {
        .kind = BUSBAR_OVERLAY_LINE,
        .binding = index,
        .node = binding->node,
        .severity = judge(value, binding),
        .caption_offset = output->text_len,
        .caption_len = (uint32_t)binding->name_len,
        .text_offset = output->text_len + (uint32_t)binding->name_len,
        .text_len = (uint32_t)len,
    };
    if (!add_text(output, binding->name, binding->name_len) || !add_text(output, text, len) ||
        !add(output, line)) {
        return 0;
    }
    BusbarOverlayPrimitive tint = {.kind = BUSBAR_OVERLAY_TINT,
                                   .binding = index,
                                   .node = binding->node,
                                   .severity = line.severity};
    return line.severity == BUSBAR_SEVERITY_NORMAL || add(output, tint);
}

static BusbarStatus draw(const BusbarPlugin *plugin, const BusbarOverlayFrame *frame,
                         BusbarOverlayOutput *output, BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN(frame, BusbarOverlayFrame) ||
        !GIVEN(output, BusbarOverlayOutput) ||
        !GIVEN_ARRAY(frame->values, frame->value_count, BusbarTagValue) ||
        !GIVEN_ARRAY(output->primitives, output->primitive_capacity, BusbarOverlayPrimitive) ||
        !GIVEN_ARRAY(output->text, output->text_capacity, uint8_t)) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "draw: an argument is null or misaligned");
    }
    const Instance *self = plugin->data;
    output->primitive_count = 0;
    output->text_len = 0;
    for (uint32_t i = 0; i < frame->value_count && i < self->count; i++) {
        if (!draw_binding(&self->bindings[i], i, &frame->values[i], output)) {
            return fail(error, BUSBAR_BUFFER_TOO_SMALL, "draw: binding %u does not fit", (unsigned)i);
        }
    }
    return BUSBAR_OK;
}

static const BusbarOverlay OVERLAY = {
    .struct_size = sizeof(BusbarOverlay), .configure = configure, .draw = draw};

/* ---- plugin, factory, entry ---- */

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    (void)plugin;
    return same_text(id, BUSBAR_OVERLAY_ID) ? &OVERLAY : NULL;
}

static void destroy(BusbarPlugin *plugin) {
    if (GIVEN(plugin, BusbarPlugin)) {
        Instance *self = plugin->data;
        free(self->bindings);
        free(self);
    }
}

static const BusbarStr CAPABILITIES[] = {TEXT(BUSBAR_OVERLAY_ID)};
static const BusbarPluginDescriptor DESCRIPTOR = {
    .struct_size = sizeof(BusbarPluginDescriptor),
    .capability_count = 1,
    .id = TEXT(ID),
    .name = TEXT("MyPlugin"),
    .version = TEXT("0.1.0"),
    .description = TEXT("Values at the equipment."),
    .settings_schema = TEXT("{\"type\":\"object\",\"additionalProperties\":false}"),
    .capabilities = CAPABILITIES,
};

static uint32_t count(void) {
    return 1;
}

static const BusbarPluginDescriptor *descriptor(uint32_t index) {
    return index == 0 ? &DESCRIPTOR : NULL;
}

static BusbarPlugin *create(BusbarStr id, BusbarStr settings, const BusbarHost *host,
                            BusbarError *error) {
    (void)settings; /* none; the host has checked them against the schema */
    if (!same_text(id, ID) || !GIVEN(host, BusbarHost)) {
        fail(error, BUSBAR_INVALID_ARGUMENT, "create: this is %s, and it needs a host", ID);
        return NULL;
    }
    Instance *self = calloc(1, sizeof *self);
    if (self == NULL) {
        fail(error, BUSBAR_FAILED, "create: no memory is left");
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
