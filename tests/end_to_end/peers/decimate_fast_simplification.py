"""fast-simplification (quadric edge collapse) as a peer of the bench."""

import fast_simplification

import decimation

decimation.main(
    prepare=lambda points, faces: (points.copy(), faces.astype("int32")),
    simplify=lambda mesh, triangles: fast_simplification.simplify(
        *mesh, target_count=max(triangles, 1)
    ),
    arrays=lambda level: level,
)
