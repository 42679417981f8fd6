"""The pyrender engine: OpenGL (EGL) with pyrender's own lights and shadows; the visual reference.

Depth and ids come from its segmentation pass, which samples pixel centres; its colour pass is multisampled.
"""

import weakref
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from motionenv.render.opengl import _context as _opengl
from motionenv.render.request import batch, enlarged
from motionenv.render.scene import Scene
from motionenv.types import Camera, Frame, Skeleton


class PyrenderRenderer:
    """Renders bodies in a `scene` with pyrender; its OpenGL context is created with the first image.

    Thread-safe: all OpenGL calls are made in one thread. Must not be used across a fork.
    """

    def __init__(self, scene: Scene | None = None) -> None:
        self.scene = scene or Scene()
        self._state = _State(self.scene)
        weakref.finalize(self, _close, self._state).atexit = False

    def render(
        self, poses: np.ndarray, skeleton: Skeleton, cameras: Camera | Sequence[Camera], *, rgb: bool = True
    ) -> Frame:
        """Render poses.

        Args:
            poses, skeleton, cameras: as of `motionenv.render.render`.
            rgb: whether to render colours too.

        Raises:
            MotionError: see `motionenv.render.request.batch`.
            EngineError: OpenGL can't be used here; the message says what to install.
        """
        work = batch(poses, skeleton, cameras)
        frame = work.empty(rgb)
        _opengl.load()
        _opengl.thread.run(self._state.draw, work, skeleton, work.flat(frame))
        return frame

    def close(self) -> None:
        """Delete the context; the next image creates a new one."""
        _close(self._state)

    def __reduce__(self):
        return PyrenderRenderer, (self.scene,)


class _State:
    """State of the OpenGL thread: the context, and the meshes of the most recent skeleton."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.offscreen: Any = None
        self._skeleton: tuple | None = None
        self._gl: Any = None

    def draw(self, work, skeleton: Skeleton, flat: Frame) -> None:
        """Render `work` into `flat`."""
        from motionenv.render.opengl._scene import GlScene

        height, width = work.size
        if self.offscreen is None:
            self.offscreen = _opengl.offscreen(width, height)
        key = skeleton.offsets.tobytes(), skeleton.radii.tobytes(), skeleton.height
        if key != self._skeleton:
            self._skeleton, self._gl = key, GlScene(skeleton, self.scene)
        for i, (pose, camera) in enumerate(zip(work.poses, (work.cameras[k] for k in work.which), strict=True)):
            self._gl.pose(pose)
            flat.depth[i], flat.limbs[i] = self._masks(camera)
            if flat.rgb is not None:
                flat.rgb[i] = self._picture(camera)

    def _masks(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
        """Depth and ids, from pixel centres."""
        from pyrender import RenderFlags

        self._look(camera)
        colour, depth = self.offscreen.render(self._gl.pyrender, RenderFlags.SEG, self._gl.ids)
        ids = colour[..., 0]
        return np.where(ids > 0, depth, np.inf), ids

    def _picture(self, camera: Camera) -> np.ndarray:
        from pyrender import RenderFlags

        samples = self.scene.samples
        self._look(enlarged(camera, samples))
        shadows = self.scene.shadows and self.scene.ground
        flags = RenderFlags.SHADOWS_DIRECTIONAL if shadows else RenderFlags.NONE
        colour, _ = self.offscreen.render(self._gl.pyrender, flags)
        blocks = colour.reshape(camera.height, samples, camera.width, samples, 3)
        return colour if samples == 1 else np.rint(blocks.mean((1, 3))).astype(np.uint8)

    def _look(self, camera: Camera) -> None:
        self._gl.look(camera)
        self.offscreen.viewport_width, self.offscreen.viewport_height = camera.width, camera.height

    def delete(self) -> None:
        """Delete the context and everything in it."""
        if self.offscreen is not None:
            self.offscreen.delete()
        self.offscreen = self._skeleton = self._gl = None


def _close(state: _State) -> None:
    if state.offscreen is not None:
        _opengl.thread.submit(state.delete)


@lru_cache(maxsize=4)
def shared_renderer(scene: Scene | None = None) -> PyrenderRenderer:
    """The renderer of `motionenv.render.render` for `scene`; a few are cached because contexts are expensive."""
    return PyrenderRenderer(scene)
