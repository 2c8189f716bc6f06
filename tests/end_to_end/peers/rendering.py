"""Shared parts of the renderers that the bench compares with: they are asked in lines of
JSON and answer in lines of JSON.

    {"do": "load", "path": FILE, "size": [WIDTH, HEIGHT], "samples": 1 or 4}  -> {}
    {"do": "frames", "cameras": [CAMERA, ...]}             -> {"millis": [NUMBER, ...]}
    {"do": "picture", "camera": CAMERA, "path": PNG}       -> {}

A camera is {"eye": [x, y, z], "target": [x, y, z], "fov_degrees": vertical angle}, metres, y up.
A frame counts from its beginning until the picture is finished.
"""

import json
import os
import sys
import time
from typing import Any, Protocol

Camera = dict[str, Any]
# Unit vector towards the one directional light, as in Busbar's shader.
SUN_DIRECTION = (0.3596, 0.7392, 0.5694)


class Renderer(Protocol):
    """A viewer of a library, without a window."""

    def load(self, path: str, size: tuple[int, int], samples: int) -> None:
        """Loads a GLB."""

    def look(self, camera: Camera) -> None:
        """Places the camera."""

    def draw(self) -> None:
        """Draws a frame and waits until it is finished."""

    def write(self, path: str) -> None:
        """Writes the last frame as a PNG."""


def serve(renderer: Renderer) -> None:
    """Answers until the input ends. What libraries print goes to the errors."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for line in sys.stdin:
        print(json.dumps(answer(renderer, json.loads(line))), file=answers)


def answer(renderer: Renderer, wanted: dict[str, Any]) -> dict[str, Any]:
    """Does what is wanted."""
    if wanted["do"] == "load":
        width, height = wanted["size"]
        renderer.load(wanted["path"], (width, height), wanted["samples"])
        return {}
    if wanted["do"] == "picture":
        renderer.look(wanted["camera"])
        renderer.draw()
        renderer.write(wanted["path"])
        return {}
    return {"millis": [millis(renderer, camera) for camera in wanted["cameras"]]}


def millis(renderer: Renderer, camera: Camera) -> float:
    """Milliseconds of one frame."""
    started = time.perf_counter()
    renderer.look(camera)
    renderer.draw()
    return (time.perf_counter() - started) * 1e3
