"""The pyrender engine: OpenGL (EGL) with pyrender's own lights and shadows; the visual reference.

Depth and ids come from its segmentation pass, which samples pixel centres; its colour pass is multisampled.

pyrender 0.1.45 and the PyOpenGL 3.1.0 that it requires are older than current NumPy and Python; `load` patches them
before the import. OpenGL needs all calls of a context from one thread, and hangs in a forked child; so all contexts
live in one thread, which starts with the first of them.
"""

import ctypes
import ctypes.util
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
        load()
        thread.run(self._state.draw, work, skeleton, work.flat(frame))
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
        from motionenv.render.opengl._scene import GlScene

        height, width = work.size
        if self.offscreen is None:
            self.offscreen = _offscreen(width, height)
        key = skeleton.offsets.tobytes(), skeleton.radii.tobytes(), skeleton.height
        if key != self._skeleton:
            self._skeleton, self._gl = key, GlScene(skeleton, self.scene)
        for i, (pose, camera) in enumerate(zip(work.poses, (work.cameras[k] for k in work.which), strict=True)):
            self._gl.pose(pose)
            flat.depth[i], flat.limbs[i] = self._masks(camera)
            if flat.rgb is not None:
                flat.rgb[i] = self._picture(camera)

    def _masks(self, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
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
        if self.offscreen is not None:
            self.offscreen.delete()
        self.offscreen = self._skeleton = self._gl = None


def _close(state: _State) -> None:
    if state.offscreen is not None:
        thread.submit(state.delete)


@lru_cache(maxsize=4)
def shared_renderer(scene: Scene | None = None) -> PyrenderRenderer:
    """The renderer of `motionenv.render.render` for `scene`; a few are cached because contexts are expensive."""
    return PyrenderRenderer(scene)


_INSTALL = (
    "install OpenGL (Debian, Ubuntu: apt-get install --no-install-recommends libegl1 libgl1), "
    "or use engine='raycast', which doesn't need it"
)
#: Exceptions of pyrender, PyOpenGL and its platforms if OpenGL is missing or broken.
BROKEN = (ImportError, OSError, AttributeError, ValueError, RuntimeError, AssertionError, TypeError)


class _Thread:
    """The thread of all OpenGL calls of this process."""

    def __init__(self):
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0

    def submit(self, call: Callable, *arguments) -> Future:
        """Run `call(*arguments)` in the thread; an `EngineError` in a fork of a process that had started OpenGL."""
        if self._pool is None:
            self._pool = ThreadPoolExecutor(1, thread_name_prefix="opengl")
            self._process = os.getpid()
        if self._process != os.getpid():
            raise EngineError(
                "OpenGL can't be used in this process, because its parent used it before forking: start processes "
                "with multiprocessing's 'spawn' or 'forkserver', or use engine='raycast'"
            )
        return self._pool.submit(call, *arguments)

    def run(self, call: Callable, *arguments):
        return self.submit(call, *arguments).result()


thread = _Thread()


@cache
def load():
    """Import pyrender with compatibility patches; an `EngineError` if OpenGL's libraries are missing."""
    _check_egl()
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
        import pyrender
    except BROKEN as error:
        raise EngineError(f"pyrender can't start ({error}): {_INSTALL}") from error
    return pyrender


def _check_egl() -> None:
    """Raise an `EngineError` without EGL's library."""
    for library in ("libEGL.so.1", ctypes.util.find_library("EGL") or "EGL"):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return
    raise EngineError(f"engine='pyrender' didn't find EGL: {_INSTALL}")


def _offscreen(width: int, height: int):
    """A new pyrender OffscreenRenderer, for use in `thread` only; an `EngineError` if no context can be created.

    Its deletion doesn't affect other renderers. Its size [pixels] can be changed later.
    """
    load()
    from OpenGL.error import Error

    try:
        return _offscreen_class()(width, height)
    except (*BROKEN, Error) as error:
        raise EngineError(f"OpenGL can't create a context ({error!r}): {_INSTALL}") from error


@cache
def _offscreen_class() -> type:
    """Pyrender's OffscreenRenderer with our platform and renderer; defined lazily, like pyrender's import."""
    from pyrender import OffscreenRenderer
    from pyrender.renderer import Renderer

    class ShadowRenderer(Renderer):
        """Only what `casts_shadow` and is `shown` casts a shadow, and only in the light of lights with `casts`."""

        def _shadow_mapping_pass(self, scene, light_node, flags):
            if not (light_node.light.casts and any(n.casts_shadow and n.shown for n in scene.mesh_nodes)):
                self._configure_shadow_mapping_viewport(light_node.light, flags)  # an empty map
                return
            for node in scene.mesh_nodes:
                node.mesh.is_visible = node.casts_shadow and node.shown
            super()._shadow_mapping_pass(scene, light_node, flags)
            for node in scene.mesh_nodes:
                node.mesh.is_visible = node.shown

    class Offscreen(OffscreenRenderer):
        def _create(self):
            self._platform = _egl_class()(self.viewport_width, self.viewport_height)
            self._platform.init_context()
            self._platform.make_current()
            self._renderer = ShadowRenderer(self.viewport_width, self.viewport_height)

        def __del__(self):
            """Nothing: a context may only be deleted in `thread`, by `delete`."""

    return Offscreen


@cache
def _egl_class() -> type:
    """Pyrender's EGL platform, modified to keep the display that all contexts share, and to delete contexts."""
    from OpenGL import EGL
    from pyrender.platforms.egl import EGLPlatform

    class Egl(EGLPlatform):
        _egl_context: object

        def make_uncurrent(self):
            EGL.eglMakeCurrent(self._egl_display, EGL.EGL_NO_SURFACE, EGL.EGL_NO_SURFACE, EGL.EGL_NO_CONTEXT)

        def delete_context(self):
            if self._egl_context is not None:
                self.make_uncurrent()
                EGL.eglDestroyContext(self._egl_display, self._egl_context)
                self._egl_context = None

        def __del__(self):
            """Nothing: see `Offscreen`."""

    return Egl
