/* Optimiser plugin `my_plugin`: collapses the shortest edges first. */

#include "support.h"

#include <busbar/mesh_optimizer.h>

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#define ID "com.example.my_plugin"
#define REPORT_EVERY 4096 /* edges between two reports of progress */
/* What this plugin reads of a mesh: a host may be older than its attributes. */
#define MESH_SIZE offsetof(BusbarMesh, wedge_count)

typedef struct Edge {
    float length;
    uint32_t kept, removed;
} Edge;

typedef struct Instance {
    BusbarPlugin plugin; /* first: the host's pointer is this one */
} Instance;

/* ---- optimiser ---- */

static int by_length(const void *left, const void *right) {
    const Edge *a = left, *b = right;
    if (a->length != b->length) {
        return a->length < b->length ? -1 : 1;
    }
    /* Ties go by number, so that the order is the same on every machine. */
    if (a->kept != b->kept) {
        return a->kept < b->kept ? -1 : 1;
    }
    return a->removed < b->removed ? -1 : a->removed > b->removed;
}

static Edge edge_between(const float *positions, uint32_t a, uint32_t b) {
    const float *p = positions + 3 * (size_t)a, *q = positions + 3 * (size_t)b;
    double squared = 0;
    for (int i = 0; i < 3; i++) {
        double step = (double)p[i] - (double)q[i];
        squared += step * step;
    }
    Edge edge = {(float)sqrt(squared), a < b ? a : b, a < b ? b : a};
    return edge;
}

static int is_mesh(const BusbarMesh *mesh) {
    if (!is_given(mesh, MESH_SIZE, _Alignof(BusbarMesh)) ||
        !GIVEN_ARRAY(mesh->positions, mesh->position_count, float) ||
        !GIVEN_ARRAY(mesh->triangles, mesh->triangle_count, uint32_t)) {
        return 0;
    }
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *t = mesh->triangles + 3 * i;
        if (t[0] >= mesh->position_count || t[1] >= mesh->position_count ||
            t[2] >= mesh->position_count || t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
            return 0;
        }
    }
    return 1;
}

/* Whether to go on. */
static int go_on(const BusbarProgress *progress, float fraction) {
    return progress == NULL || progress->report == NULL ||
           progress->report(progress->context, fraction) != 0;
}

/* Walks the edges in order; a collapse where both ends live. */
static BusbarStatus collapse(const Edge *edges, size_t count, uint8_t *removed,
                             const BusbarProgress *progress, BusbarCollapseOutput *output,
                             BusbarError *error) {
    for (size_t i = 0; i < count; i++) {
        const Edge *edge = &edges[i];
        if (i % REPORT_EVERY == 0 && !go_on(progress, (float)i / (float)count)) {
            return fail(error, BUSBAR_CANCELLED, "cancelled");
        }
        if (removed[edge->kept] || removed[edge->removed]) {
            continue;
        }
        if (output->collapse_count >= output->collapse_capacity) {
            return fail(error, BUSBAR_BUFFER_TOO_SMALL, "optimize: more than %u collapses",
                        (unsigned)output->collapse_capacity);
        }
        removed[edge->removed] = 1;
        BusbarCollapse entry = {edge->removed, edge->kept, edge->length};
        output->collapses[output->collapse_count++] = entry;
    }
    return BUSBAR_OK;
}

static BusbarStatus optimize(const BusbarPlugin *plugin, const BusbarMesh *mesh,
                             const BusbarProgress *progress, BusbarCollapseOutput *output,
                             BusbarError *error) {
    if (!GIVEN(plugin, BusbarPlugin) || !GIVEN(output, BusbarCollapseOutput) ||
        !GIVEN_ARRAY(output->collapses, output->collapse_capacity, BusbarCollapse) ||
        (progress != NULL && !GIVEN(progress, BusbarProgress))) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "optimize: an argument is null or misaligned");
    }
    if (!is_mesh(mesh)) {
        return fail(error, BUSBAR_INVALID_ARGUMENT, "optimize: the mesh is null or names "
                                                    "positions that are not there");
    }
    output->collapse_count = output->stage_count = 0;
    size_t count = 3 * (size_t)mesh->triangle_count;
    Edge *edges = malloc((count + 1) * sizeof *edges);
    uint8_t *removed = calloc((size_t)mesh->position_count + 1, 1);
    BusbarStatus status = BUSBAR_OK;
    if (edges == NULL || removed == NULL) {
        status = fail(error, BUSBAR_FAILED, "optimize: no memory is left");
    } else if (!go_on(progress, 0.0f)) {
        status = fail(error, BUSBAR_CANCELLED, "cancelled");
    } else {
        for (size_t i = 0; i < count; i++) {
            uint32_t a = mesh->triangles[i];
            uint32_t b = mesh->triangles[i % 3 == 2 ? i - 2 : i + 1];
            edges[i] = edge_between(mesh->positions, a, b);
        }
        qsort(edges, count, sizeof *edges, by_length);
        status = collapse(edges, count, removed, progress, output, error);
    }
    free(edges);
    free(removed);
    return status;
}

static const BusbarMeshOptimizer OPTIMIZER = {.struct_size = sizeof(BusbarMeshOptimizer),
                                              .optimize = optimize};

/* ---- plugin, factory, entry ---- */

static const void *get_capability(const BusbarPlugin *plugin, BusbarStr id) {
    (void)plugin;
    return same_text(id, BUSBAR_MESH_OPTIMIZER_ID) ? &OPTIMIZER : NULL;
}

static void destroy(BusbarPlugin *plugin) {
    if (GIVEN(plugin, BusbarPlugin)) {
        Instance *self = plugin->data;
        free(self);
    }
}

static const BusbarStr CAPABILITIES[] = {TEXT(BUSBAR_MESH_OPTIMIZER_ID)};
static const BusbarPluginDescriptor DESCRIPTOR = {
    .struct_size = sizeof(BusbarPluginDescriptor),
    .capability_count = 1,
    .id = TEXT(ID),
    .name = TEXT("MyPlugin"),
    .version = TEXT("0.1.0"),
    .description = TEXT("Collapses the shortest edges first."),
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
