"""The pyrender engine: OpenGL (EGL, or OSMesa), lights and shadows by pyrender's own shader, the reference for looks.

Depth and ids come from its segmentation pass, which samples pixel centres; its colour pass takes several samples.
"""

import weakref
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from motionenv.render import _opengl
from motionenv.render.batch import batch, enlarged
from motionenv.render.scene import Scene
from motionenv.types import Camera, Frame, Skeleton


class PyrenderRenderer:
    """Draws bodies through pyrender; its OpenGL context is made at the first picture.

    Safe to call from any thread: all OpenGL work is done in one. Not to be used across a fork.

    Args:
        scene: what is drawn besides the body.
    """

    def __init__(self, scene: Scene | None = None):
        self.scene = scene or Scene()
        self._state = _State(self.scene)
        weakref.finalize(self, _close, self._state).atexit = False

    def render(
        self, poses, skeleton: Skeleton, cameras: Camera | Sequence[Camera], *, rgb: bool = True, masks: bool = True
    ) -> Frame:
        """Draw poses.

        Args:
            poses: (..., 25) [m, rad].
            skeleton: the body.
            cameras: one for all poses, or a sequence that broadcasts against them (see `motionenv.render.render`).
            rgb: whether to draw colours.
            masks: whether to draw depth and ids; without, those two arrays are of length 0.

        Raises:
            MotionError: see `motionenv.render.batch.batch`.
            EngineError: OpenGL can't be used here; says what to install.
        """
        work = batch(poses, skeleton, cameras)
        frame = work.empty(rgb)
        flat = work.flat(frame)
        _opengl.load()
        _opengl.thread.run(self._state.draw, work, skeleton, flat, masks)
        return frame if masks else Frame(frame.rgb, frame.depth[:0], frame.limbs[:0])

    def close(self) -> None:
        """Free the context; the next picture makes a new one."""
        _close(self._state)

    def __getstate__(self):
        return {"scene": self.scene}

    def __setstate__(self, state):
        self.__init__(state["scene"])  # type: ignore[misc]


class _State:
    """What belongs to OpenGL's thread: the context, and the meshes of the skeleton drawn last."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.offscreen: Any = None
        self._skeleton: tuple | None = None
        self._gl: Any = None

    def draw(self, work, skeleton: Skeleton, flat: Frame, masks: bool) -> None:
        """Fill `flat` with the pictures of `work`."""
        from motionenv.render._gl_scene import GlScene

        height, width = work.size
        if self.offscreen is None:
            self.offscreen = _opengl.offscreen(width, height)
        key = skeleton.offsets.tobytes(), skeleton.radii.tobytes(), skeleton.height
        if key != self._skeleton:
            self._skeleton, self._gl = key, GlScene(skeleton, self.scene)
        for i, (pose, camera) in enumerate(zip(work.poses, (work.cameras[k] for k in work.which), strict=True)):
            self._gl.pose(pose)
            if masks:
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
        """Colours."""
        from pyrender import RenderFlags

        samples = self.scene.samples
        self._look(enlarged(camera, samples))
        shadows = self.scene.shadows and self.scene.ground
        flags = RenderFlags.SHADOWS_DIRECTIONAL if shadows else RenderFlags.NONE
        colour, _ = self.offscreen.render(self._gl.pyrender, flags)
        blocks = colour.reshape(camera.height, samples, camera.width, samples, 3)
        return colour if samples == 1 else np.rint(blocks.mean((1, 3))).astype(np.uint8)

    def _look(self, camera: Camera) -> None:
        """Set camera and picture size."""
        self._gl.look(camera)
        self.offscreen.viewport_width, self.offscreen.viewport_height = camera.width, camera.height

    def delete(self) -> None:
        """Free the context and all in it."""
        if self.offscreen is not None:
            self.offscreen.delete()
        self.offscreen = self._skeleton = self._gl = None


def _close(state: _State) -> None:
    """Free the state's context, if it has one, in OpenGL's thread."""
    if state.offscreen is not None:
        _opengl.thread.submit(state.delete)


@lru_cache(maxsize=4)
def shared_renderer(scene: Scene | None = None) -> PyrenderRenderer:
    """The renderer that `motionenv.render.render` uses for `scene`: contexts are dear, so the last few are kept.

    Args:
        scene: as of `PyrenderRenderer`.
    """
    return PyrenderRenderer(scene)
