"""Renderer Open3D without a window, which reads every picture back."""

import open3d
from open3d.visualization import rendering as o3d

import rendering


class Open3d:
    """Renderer Open3D without a window."""

    def load(self, path: str, size: tuple[int, int], samples: int) -> None:
        self.renderer = o3d.OffscreenRenderer(*size)
        view = self.renderer.scene.view
        view.set_antialiasing(samples > 1)
        view.set_ambient_occlusion(False)
        view.set_post_processing(False)
        scene = self.renderer.scene
        scene.set_background([0.8, 0.8, 0.8, 1.0])
        scene.set_lighting(
            o3d.Open3DScene.LightingProfile.NO_SHADOWS,
            [-component for component in rendering.SUN_DIRECTION],
        )
        for number, part in enumerate(open3d.io.read_triangle_model(path).meshes):
            material = o3d.MaterialRecord()
            material.shader = "defaultLit"
            scene.add_geometry(f"{number} {part.mesh_name}", part.mesh, material)
        self.picture = None

    def look(self, camera: rendering.Camera) -> None:
        self.renderer.setup_camera(
            camera["fov_degrees"], camera["target"], camera["eye"], [0.0, 1.0, 0.0]
        )

    def draw(self) -> None:
        self.picture = self.renderer.render_to_image()

    def write(self, path: str) -> None:
        open3d.io.write_image(path, self.picture)


rendering.serve(Open3d())
