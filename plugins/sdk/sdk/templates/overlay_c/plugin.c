/* Overlay plugin `my_plugin`: a line for every value, colour outside its band, and a verdict on
 * every piece of equipment. */

#include "support.h"

#include <busbar/overlay.h>

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#define ID "com.example.my_plugin"
#define MAX_PART 256 /* bytes of a caption, of a value, and of a reason */
#define MAX_BINDINGS 1000000

typedef struct Binding {
    uint32_t node;
    size_t piece, next; /* its equipment, and the next binding of that */
    double limit_low, limit_high; /* NaN for none */
    size_t name_len, unit_len;
    char name[MAX_PART], unit[MAX_PART / 4];
} Binding;

typedef struct Piece {
    char id[MAX_PART];
    size_t first, last; /* its bindings */
} Piece;

typedef struct Instance {
    BusbarPlugin plugin; /* first: the host's pointer is this one */
    Binding *bindings;
    size_t count;
    Piece *pieces; /* equipment that bindings name */
    BusbarStr *ids;
    size_t piece_count;
} Instance;

/* ---- overlay ---- */

static size_t keep(char *into, size_t room, BusbarStr text) {
    size_t len = cut(text.ptr, text.len, room);
    if (len > 0) {
        memcpy(into, text.ptr, len);
    }
    return len;
}

static void clear(Instance *self) {
    free(self->bindings);
    free(self->pieces);
    free(self->ids);
}

/* Adds a binding to its piece of equipment, which is new or not; the number of pieces. */
static size_t add_to_piece(Piece *pieces, BusbarStr *ids, size_t count, Binding *bindings,
                           size_t index, BusbarStr id) {
    size_t len = cut(id.ptr, id.len, MAX_PART), at = 0;
    while (at < count &&
           (ids[at].len != len || (len > 0 && memcmp(ids[at].ptr, id.ptr, len) != 0))) {
        at++;
    }
    if (at < count) {
        bindings[pieces[at].last].next = index;
    } else {
        keep(pieces[at].id, sizeof pieces[at].id, id);
        ids[at].ptr = (const uint8_t *)pieces[at].id;
        ids[at].len = len;
        pieces[at].first = index;
        count++;
    }
    pieces[at].last = index;
    bindings[index].piece = at;
    return count;
}

static BusbarStatus configure(const BusbarPlugin *plugin, const BusbarBinding *bindings,
                              size_t count, BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN_ARRAY(bindings, count, BusbarBinding) ||
        count > MAX_BINDINGS) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "configure: an argument is null or misaligned");
    }
    Binding *kept = calloc(count + 1, sizeof *kept);
    Piece *pieces = calloc(count + 1, sizeof *pieces);
    BusbarStr *ids = calloc(count + 1, sizeof *ids);
    if (kept == NULL || pieces == NULL || ids == NULL) {
        free(kept);
        free(pieces);
        free(ids);
        return fail(error, BUSBAR_FAILED, "configure: no memory is left");
    }
    size_t piece_count = 0;
    for (size_t i = 0; i < count; i++) {
        kept[i].node = bindings[i].node;
        kept[i].limit_low = bindings[i].limit_low;
        kept[i].limit_high = bindings[i].limit_high;
        kept[i].name_len = keep(kept[i].name, sizeof kept[i].name, bindings[i].tag_name);
        kept[i].unit_len = keep(kept[i].unit, sizeof kept[i].unit, bindings[i].unit);
        kept[i].next = count;
        piece_count = add_to_piece(pieces, ids, piece_count, kept, i, bindings[i].node_id);
    }
    Instance *self = plugin->data;
    clear(self);
    self->bindings = kept;
    self->count = count;
    self->pieces = pieces;
    self->ids = ids;
    self->piece_count = piece_count;
    return BUSBAR_OK;
}

/* Says which equipment is judged: every piece that a binding names. */
static BusbarStatus describe(const BusbarPlugin *plugin, BusbarOverlayDescription *into,
                             BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN(into, BusbarOverlayDescription)) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "describe: an argument is null or misaligned");
    }
    const Instance *self = plugin->data;
    BusbarOverlayDescription description = {.struct_size = into->struct_size,
                                            .equipment_count = (uint32_t)self->piece_count,
                                            .equipment = self->ids};
    *into = description;
    return BUSBAR_OK;
}

/* A value with its unit; its length. The host adds marks for quality and age. */
static size_t format(const BusbarTagValue *value, const Binding *binding, char *into) {
    static const char *const POSITIONS[] = {"travelling", "open", "closed", "invalid"};
    int unit = (int)binding->unit_len, len;
    switch (value->kind) {
    case BUSBAR_VALUE_KIND_F64:
        /* Plus 0: no "-0". */
        len = snprintf(into, MAX_PART, "%.4g %.*s", value->number + 0.0, unit, binding->unit);
        break;
    case BUSBAR_VALUE_KIND_I64:
        len = snprintf(into, MAX_PART, "%" PRId64 " %.*s", value->integer, unit, binding->unit);
        break;
    case BUSBAR_VALUE_KIND_BOOL:
        len = snprintf(into, MAX_PART, "%s", value->integer ? "on" : "off");
        break;
    case BUSBAR_VALUE_KIND_DOUBLE_POINT:
        len = snprintf(into, MAX_PART, "%s", POSITIONS[value->integer & 3]);
        break;
    case BUSBAR_VALUE_KIND_TEXT:
        len = value->text.len == 0 ? snprintf(into, MAX_PART, "(empty)")
                                   : snprintf(into, MAX_PART, "%.*s", (int)value->text.len,
                                              (const char *)value->text.ptr);
        break;
    default:
        len = snprintf(into, MAX_PART, "-");
    }
    return len < 0 ? 0 : len < MAX_PART ? (size_t)len : MAX_PART - 1;
}

/* The number of a value; 0 if it is none. */
static int read_number(const BusbarTagValue *value, double *number) {
    switch (value->kind) {
    case BUSBAR_VALUE_KIND_F64:
        *number = value->number;
        return 1;
    case BUSBAR_VALUE_KIND_I64:
        *number = (double)value->integer;
        return 1;
    default:
        return 0;
    }
}

static BusbarSeverity judge(const BusbarTagValue *value, const Binding *binding) {
    double number;
    if (!read_number(value, &number)) {
        return BUSBAR_SEVERITY_NORMAL;
    }
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
        .kind = BUSBAR_PRIMITIVE_KIND_LINE,
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
    BusbarOverlayPrimitive tint = {.kind = BUSBAR_PRIMITIVE_KIND_TINT,
                                   .binding = index,
                                   .node = binding->node,
                                   .severity = line.severity};
    return line.severity == BUSBAR_SEVERITY_NORMAL || add(output, tint);
}

static int add_basis(BusbarOverlayOutput *output, size_t binding) {
    if (output->basis_count >= output->basis_capacity) {
        return 0;
    }
    output->basis[output->basis_count++] = (uint32_t)binding;
    return 1;
}

/* The verdict of a value with limits. What is not known is unknown, never normal. */
static BusbarVerdict verdict_of(const BusbarTagValue *value, const Binding *binding) {
    double number;
    if (value->quality != BUSBAR_QUALITY_GOOD || !read_number(value, &number) ||
        !isfinite(number)) {
        return BUSBAR_VERDICT_UNKNOWN;
    }
    int is_normal = judge(value, binding) == BUSBAR_SEVERITY_NORMAL;
    return is_normal ? BUSBAR_VERDICT_NORMAL : BUSBAR_VERDICT_ABNORMAL;
}

/* Judges a piece of equipment: abnormal if any value is, else unknown if any is, else normal.
 * Every piece has a verdict in every frame; silence would mean "judged healthy". */
static int judge_piece(const Instance *self, size_t piece, const BusbarTagValue *values,
                       BusbarOverlayOutput *output) {
    static const char *const REASONS[] = {"", "", "is outside its limits", "is not good"};
    BusbarOverlayVerdict verdict = {.equipment = (uint32_t)piece,
                                    .verdict = BUSBAR_VERDICT_NORMAL,
                                    .reason_offset = output->text_len,
                                    .basis_offset = output->basis_count};
    size_t cause = self->count;
    int has_limits = 0;
    for (size_t i = self->pieces[piece].first; i < self->count; i = self->bindings[i].next) {
        const Binding *binding = &self->bindings[i];
        if (isnan(binding->limit_low) && isnan(binding->limit_high)) {
            continue;
        }
        BusbarVerdict own = verdict_of(&values[i], binding);
        has_limits = 1;
        if (own == BUSBAR_VERDICT_ABNORMAL ||
            (own == BUSBAR_VERDICT_UNKNOWN && verdict.verdict == BUSBAR_VERDICT_NORMAL)) {
            verdict.verdict = own;
            cause = i;
        }
        if (verdict.verdict == BUSBAR_VERDICT_NORMAL && !add_basis(output, i)) {
            return 0;
        }
    }
    char reason[MAX_PART];
    int len = 0;
    if (cause < self->count) {
        const Binding *binding = &self->bindings[cause];
        int room = MAX_PART / 2;
        len = snprintf(reason, sizeof reason, "%.*s %s",
                       (int)cut((const uint8_t *)binding->name, binding->name_len, (size_t)room),
                       binding->name, REASONS[verdict.verdict]);
        output->basis_count = verdict.basis_offset;
        if (!add_basis(output, cause)) {
            return 0;
        }
    } else if (!has_limits) {
        verdict.flags = BUSBAR_VERDICT_FLAG_ASSUMED;
        len = snprintf(reason, sizeof reason, "assumed: no limits are configured");
    }
    verdict.reason_len = len < 0 ? 0 : (uint32_t)len;
    verdict.basis_count = output->basis_count - verdict.basis_offset;
    if (!add_text(output, reason, verdict.reason_len) ||
        output->verdict_count >= output->verdict_capacity) {
        return 0;
    }
    output->verdicts[output->verdict_count++] = verdict;
    return 1;
}

static BusbarStatus draw(const BusbarPlugin *plugin, const BusbarOverlayFrame *frame,
                         BusbarOverlayOutput *output, BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN(frame, BusbarOverlayFrame) ||
        !GIVEN(output, BusbarOverlayOutput) ||
        !GIVEN_ARRAY(frame->values, frame->value_count, BusbarTagValue) ||
        !GIVEN_ARRAY(output->primitives, output->primitive_capacity, BusbarOverlayPrimitive) ||
        !GIVEN_ARRAY(output->text, output->text_capacity, uint8_t) ||
        !GIVEN_ARRAY(output->verdicts, output->verdict_capacity, BusbarOverlayVerdict) ||
        !GIVEN_ARRAY(output->basis, output->basis_capacity, uint32_t)) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "draw: an argument is null or misaligned");
    }
    const Instance *self = plugin->data;
    if (frame->value_count != self->count) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "draw: %u values for %u bindings",
                    (unsigned)frame->value_count, (unsigned)self->count);
    }
    output->primitive_count = 0;
    output->text_len = 0;
    output->quantity_count = 0;
    output->verdict_count = 0;
    output->basis_count = 0;
    for (uint32_t i = 0; i < frame->value_count; i++) {
        if (!draw_binding(&self->bindings[i], i, &frame->values[i], output)) {
            return fail(error, BUSBAR_BUFFER_TOO_SMALL, "draw: binding %u does not fit", (unsigned)i);
        }
    }
    for (size_t i = 0; i < self->piece_count; i++) {
        if (!judge_piece(self, i, frame->values, output)) {
            return fail(error, BUSBAR_BUFFER_TOO_SMALL, "draw: verdict %u does not fit", (unsigned)i);
        }
    }
    return BUSBAR_OK;
}

static const BusbarOverlay OVERLAY = {.struct_size = sizeof(BusbarOverlay),
                                      .configure = configure,
                                      .draw = draw,
                                      .describe = describe};

/* ---- plugin, factory, entry ---- */

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    (void)plugin;
    return same_text(id, BUSBAR_OVERLAY_ID) ? &OVERLAY : NULL;
}

static void destroy(BusbarPlugin *plugin) {
    if (GIVEN(plugin, BusbarPlugin)) {
        Instance *self = plugin->data;
        clear(self);
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
