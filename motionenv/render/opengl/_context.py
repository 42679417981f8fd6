"""Compatibility patches for pyrender, OpenGL contexts, and the rendering thread.

pyrender 0.1.45 and the PyOpenGL 3.1.0 that it requires are older than current NumPy and Python; `load` patches them
before the import. OpenGL needs all calls of a context from one thread, and hangs in a forked child; so all contexts
live in one thread, which starts with the first of them.
"""

import ctypes
import ctypes.util
import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np

from motionenv.errors import EngineError

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
        """Result of `call(*arguments)` in the thread."""
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


def offscreen(width: int, height: int):
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
