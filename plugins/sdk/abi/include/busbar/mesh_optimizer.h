/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/mesh_optimizer.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.mesh-optimizer/1-draft`: from a triangle mesh to a sequence of half-edge
 * collapses.
 */

#ifndef BUSBAR_MESH_OPTIMIZER_H
#define BUSBAR_MESH_OPTIMIZER_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>

// Id of the capability.
#define BUSBAR_MESH_OPTIMIZER_ID "busbar.mesh-optimizer/1-draft"

// Flag of a sequence whose proportion of simplified vertices, theta, is that of its mesh. Without
// it a host shares one theta among all meshes of a model by error.
#define BUSBAR_COLLAPSES_THETA_BY_MESH 1

// Flag of a plugin whose `optimize` reads positions and triangles alone, so that the host need not
// pass wedges.
#define BUSBAR_OPTIMIZER_NO_WEDGES 1

// Half-edge collapse. Array element.
typedef struct BusbarCollapse {
  // Index of the position that is removed. No later entry may name it.
  uint32_t removed;
  // Index of the position that replaces it; must not have been removed before.
  uint32_t kept;
  // Geometric error after this collapse, metres: finite, at least 0, never
  // decreasing along the sequence.
  float error;
} BusbarCollapse;

// Time of one stage of the work. Array element.
typedef struct BusbarStage {
  // UTF-8 name, padded with zeros.
  uint8_t name[24];
  // Duration of the stage, milliseconds.
  double millis;
} BusbarStage;

// Buffers for the result. The caller owns them; the plugin fills in the
// counts.
typedef struct BusbarCollapseOutput {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Room in `collapses`: at least `position_count`.
  uint32_t collapse_capacity;
  // Number of collapses written.
  uint32_t collapse_count;
  // Capacity of `stages`, in elements.
  uint32_t stage_capacity;
  // Number of stages written.
  uint32_t stage_count;
  // `BUSBAR_COLLAPSES_...`, written by the plugin, or 0. Bits that a host does not know are
  // ignored.
  uint32_t flags;
  // The sequence, in order.
  struct BusbarCollapse *collapses;
  // Times of the stages, for reports.
  struct BusbarStage *stages;
} BusbarCollapseOutput;

// Triangle mesh over welded positions, and the wedges that split them.
//
// A *wedge* is one position with one set of attributes; a position on a
// normal, texture or material seam has several. The fields from `wedge_count`
// on came later: they are there if `struct_size` reaches over them, and count
// and pointers are zero where the host has no attributes or the plugin wants
// none (`BUSBAR_OPTIMIZER_NO_WEDGES`). Either all five arrays are given or none.
typedef struct BusbarMesh {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of positions in `positions`.
  uint32_t position_count;
  // Number of triangles in `triangles`.
  uint32_t triangle_count;
  // Reserved; must be zero.
  uint32_t reserved;
  // Coordinates x, y, z of each position, finite, metres.
  const float *positions;
  // Three different position indices of each triangle, counter-clockwise.
  const uint32_t *triangles;
  // Number of wedges: at least one for each position, or 0.
  uint32_t wedge_count;
  // Reserved; must be zero.
  uint32_t wedge_reserved;
  // Three wedge indices of each triangle, each standing on the position
  // that `triangles` names there.
  const uint32_t *corners;
  // The position of each wedge. Wedges of one position follow one another.
  // A wedge of a removed position becomes, of the first 64 wedges of the
  // kept one, that of the same section, then of the least sum of
  // 1 - cosine of the normals and distance of the coordinates, then the
  // first.
  const uint32_t *wedge_positions;
  // x, y, z of the normal of each wedge, finite, not always of length 1.
  const float *wedge_normals;
  // u, v of each wedge, finite; zero where there are none.
  const float *wedge_uvs;
  // A number for the material of each wedge.
  const uint32_t *wedge_sections;
} BusbarMesh;

// Progress and cancellation of a long call.
typedef struct BusbarProgress {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Passed back in `report`.
  void *context;
  // `[the thread of the call]` Says how much is done, 0 to 1. Returns 0 if
  // the plugin must stop and return `BUSBAR_CANCELLED`. May be null.
  uint32_t (*report)(void *context, float fraction);
} BusbarProgress;

// Function table of `busbar.mesh-optimizer/1-draft`.
typedef struct BusbarMeshOptimizer {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // `BUSBAR_OPTIMIZER_...`, or 0. Bits that a host does not know are ignored.
  uint32_t flags;
  // `[any-thread]` Orders the half-edge collapses of a mesh, the least
  // important first. The same mesh and settings give the same sequence,
  // bit for bit, on every machine. Borrows everything for the call.
  // Fails with `BUSBAR_INVALID_ARGUMENT`, `BUSBAR_BUFFER_TOO_SMALL`,
  // `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
  BusbarStatus (*optimize)(const struct BusbarPlugin *plugin,
                           const struct BusbarMesh *mesh,
                           const struct BusbarProgress *progress,
                           struct BusbarCollapseOutput *output,
                           struct BusbarError *error);
} BusbarMeshOptimizer;

#endif  /* BUSBAR_MESH_OPTIMIZER_H */
