"""Open3D's quadric decimation as a peer of the bench."""

import numpy
import open3d

import decimation


def prepare(points, faces):
    return open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(points.astype("float64")),
        open3d.utility.Vector3iVector(faces.astype("int32")),
    )


decimation.main(
    prepare,
    simplify=lambda mesh, triangles: mesh.simplify_quadric_decimation(triangles),
    arrays=lambda level: (numpy.asarray(level.vertices), numpy.asarray(level.triangles)),
)
