"""The pyrender engine: OpenGL (EGL) with pyrender's own lights and shadows; the visual reference.

Depth and ids come from its segmentation pass, which samples pixel centres; its colour pass is multisampled.

pyrender 0.1.45 and the PyOpenGL 3.1.0 that it requires are older than current NumPy and Python; `load` patches them
before the import. OpenGL needs all calls of a context from one thread, and hangs in a forked child; so the process has
one context, in one thread, which starts with the first image.
"""

import os
import weakref
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache, lru_cache
from typing import Any

import numpy as np

from motionenv.errors import EngineError
from motionenv.render.request import batch, enlarged
from motionenv.render.scene import Scene
from motionenv.types import Camera, Frame, Skeleton

_INSTALL = (
    "install OpenGL (Debian, Ubuntu: apt-get install --no-install-recommends libegl1 libgl1), "
    "or use engine='raycast', which doesn't need it"
)


class PyrenderRenderer:
    """Renders bodies in a `scene` with pyrender; its buffers are created with the first image.

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
        _submit(self._state.draw, work, skeleton, work.flat(frame)).result()
        return frame

    def close(self) -> None:
        """Free the buffers; the next image creates new ones."""
        _close(self._state)

    def __reduce__(self):
        return PyrenderRenderer, (self.scene,)


class _State:
    """State of a renderer in the OpenGL thread: pyrender's, and the meshes of the most recent skeleton."""

    def __init__(self, scene: Scene):
        self.scene = scene
        self.renderer: Any = None
        self._skeleton: tuple | None = None
        self._body: Any = None

    def draw(self, work, skeleton: Skeleton, flat: Frame) -> None:
        load()
        from motionenv.render.opengl._scene import BodyRenderer, BodyScene

        self.renderer = self.renderer or BodyRenderer(1, 1)
        key = skeleton.offsets.tobytes(), skeleton.radii.tobytes(), skeleton.height
        if key != self._skeleton:
            self._skeleton, self._body = key, BodyScene(skeleton, self.scene)
        for i, (pose, camera) in enumerate(zip(work.poses, (work.cameras[k] for k in work.which), strict=True)):
            self._body.pose(pose)
            colour, depth = self.renderer.draw(self._body, camera, ids=True)
            flat.limbs[i] = colour[..., 0]
            flat.depth[i] = np.where(flat.limbs[i] > 0, depth, np.inf)
            if flat.rgb is not None:
                flat.rgb[i] = self._picture(camera)

    def _picture(self, camera: Camera) -> np.ndarray:
        samples = self.scene.samples
        colour, _ = self.renderer.draw(self._body, enlarged(camera, samples))
        blocks = colour.reshape(camera.height, samples, camera.width, samples, 3)
        return colour if samples == 1 else np.rint(blocks.mean((1, 3))).astype(np.uint8)

    def delete(self) -> None:
        if self.renderer is not None:
            self.renderer.delete()
        self.renderer = self._skeleton = self._body = None


def _close(state: _State) -> None:
    if state.renderer is not None:
        _submit(state.delete)


@lru_cache(maxsize=4)
def shared_renderer(scene: Scene | None = None) -> PyrenderRenderer:
    """The renderer of `motionenv.render.render` for `scene`; a few are cached because they are slow to start."""
    return PyrenderRenderer(scene)


_thread = ThreadPoolExecutor(1, thread_name_prefix="opengl")  # starts with the first call
_processes: set[int] = set()  # that have used it: this one, and those from which it was forked


def _submit(call: Callable, *arguments) -> Future:
    """Run `call(*arguments)` in the OpenGL thread; an `EngineError` in a fork of a process that had started OpenGL."""
    _processes.add(os.getpid())
    if len(_processes) > 1:
        raise EngineError(
            "OpenGL can't be used in this process, because its parent used it before forking: start processes "
            "with multiprocessing's 'spawn' or 'forkserver', or use engine='raycast'"
        )
    return _thread.submit(call, *arguments)


@cache
def load() -> None:
    """Import pyrender with compatibility patches, and make a context current in this thread, for good.

    Raises:
        EngineError: OpenGL is missing or broken.
    """
    os.environ["PYOPENGL_PLATFORM"] = "egl"
    if not hasattr(np, "infty"):
        setattr(np, "infty", np.inf)  # noqa: B010 (NPY201 takes the plain assignment for a use)
    try:
        import pyglet

        pyglet.options["headless"] = True  # otherwise pyrender's viewer needs X libraries at import
        import OpenGL.plugins

        for handler in OpenGL.plugins.FormatHandler.all():
            if handler.name == "ctypesparameter":
                handler.check.append("_ctypes.CArgObject")  # its name since Python 3.12
        from pyrender.platforms.egl import EGLPlatform

        context = EGLPlatform(1, 1)
        context.delete_context = lambda: None  # at exit, it would be another thread that does so
        context.init_context()
    except Exception as error:
        raise EngineError(f"engine='pyrender' can't start OpenGL ({error!r}): {_INSTALL}") from error
