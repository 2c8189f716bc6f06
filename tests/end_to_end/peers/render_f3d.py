"""F3D as a renderer, by its library and without a window. Its program is timed from its start."""

import f3d

import rendering


class F3d:
    """Renderer F3D without a window."""

    def load(self, path: str, size: tuple[int, int], samples: int) -> None:
        f3d.Engine.autoload_plugins()
        self.engine = f3d.Engine.create(True)
        options = self.engine.options
        # It smooths edges by one of these, and has no samples to be told.
        options["render.effect.antialiasing.mode"] = "ssaa" if samples > 1 else "none"
        options["ui.axis"] = False
        options["render.grid.enable"] = False
        self.engine.window.size = size
        self.engine.scene.add(path)
        self.picture = None

    def look(self, camera: rendering.Camera) -> None:
        active = self.engine.window.camera
        active.position = camera["eye"]
        active.focal_point = camera["target"]
        active.view_up = (0.0, 1.0, 0.0)
        active.view_angle = camera["fov_degrees"]

    def draw(self) -> None:
        self.engine.window.render()

    def write(self, path: str) -> None:
        self.engine.window.render_to_image().save(path)


rendering.serve(F3d())
