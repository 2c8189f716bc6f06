/* Tests: `make test`. */

#include "plugin.c"

#undef NDEBUG
#include <assert.h>

int main(void) {
    /* Two triangles; the edge from 1 to 2 is the shortest. */
    float positions[] = {0, 0, 0, 1, 0, 0, 1, 0.25f, 0, 0, 1, 0};
    uint32_t triangles[] = {0, 1, 2, 0, 2, 3};
    BusbarMesh mesh = {.struct_size = MESH_SIZE,
                       .position_count = 4,
                       .triangle_count = 2,
                       .positions = positions,
                       .triangles = triangles};
    BusbarCollapse collapses[4];
    BusbarCollapseOutput output = {
        .struct_size = sizeof output, .collapse_capacity = 4, .collapses = collapses};
    BusbarError error = {.struct_size = sizeof error};
    Instance self = {.plugin = {.struct_size = sizeof self.plugin}};
    self.plugin.data = &self;
    assert(optimize(&self.plugin, &mesh, NULL, &output, &error) == BUSBAR_OK);
    assert(output.collapse_count > 0 && collapses[0].kept == 1 && collapses[0].removed == 2);
    assert(collapses[0].error == 0.25f);
    triangles[5] = 4;
    assert(optimize(&self.plugin, &mesh, NULL, &output, &error) == BUSBAR_INVALID_ARGUMENT);
    puts("2 tests passed");
    return 0;
}
