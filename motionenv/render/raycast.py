"""The raycast engine: exact tapered cylinders with rounded ends, in compiled code, without a graphics library.

The same bits come out on every call, in any order, with any number of threads.
"""

import os
import threading
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from motionenv.body import limb_segments
from motionenv.errors import MotionError
from motionenv.render._draw_kernel import View, draw, draw_smooth
from motionenv.render._ground_kernel import draw_background
from motionenv.render._shade_kernel import encoding
from motionenv.render.batch import Batch, batch, enlarged
from motionenv.render.scene import Scene, linear
from motionenv.types import Camera, Frame, Skeleton

_CACHED_VIEWS = 8
_CHUNK = 64  # bodies per piece of work: enough to hide the call, few enough to share among threads


class Raycaster:
    """Draws bodies in a scene; keeps the background of the cameras that it saw last.

    Args:
        scene: what is drawn besides the body.
        threads: how many pictures are drawn at a time.
    """

    def __init__(self, scene: Scene | None = None, *, threads: int = 1):
        if isinstance(threads, bool) or not isinstance(threads, int) or threads < 1:
            raise MotionError(f"threads must be a whole number from 1, got {threads!r}")
        self.scene = scene or Scene()
        self.threads = threads
        self._views: OrderedDict[tuple, View] = OrderedDict()
        self._lock = threading.Lock()
        self._pool: ThreadPoolExecutor | None = None
        self._process = 0

    def render(
        self,
        poses,
        skeleton: Skeleton,
        cameras: Camera | Sequence[Camera],
        *,
        rgb: bool = True,
        out: Frame | None = None,
    ) -> Frame:
        """Draw poses.

        Args:
            poses: (..., 25) [m, rad].
            skeleton: the body, the same in all pictures.
            cameras: one for all poses, or a sequence that broadcasts against them (see `motionenv.render.render`).
            rgb: whether to draw colours, which takes most of the time.
            out: a frame of an earlier call of the same shape, to be overwritten instead of making a new one.

        Returns:
            The pictures; `rgb` is None when not asked for.

        Raises:
            MotionError: see `motionenv.render.batch.batch`; or `out` doesn't fit.
        """
        work = batch(poses, skeleton, cameras)
        frame = out or work.empty(rgb)
        if (frame.rgb is not None) != rgb:
            raise MotionError(f"out.rgb must be {'an array' if rgb else 'None'} when rgb={rgb}")
        flat = work.flat(frame)
        pieces = _pieces(work, max(1, min(_CHUNK, -(-len(work.poses) // self.threads))))
        if self.threads == 1:
            for camera, index in pieces:
                self._draw(work, skeleton, camera, index, flat)
        else:
            self._share(work, skeleton, pieces, flat)
        return frame

    def _share(self, work: Batch, skeleton: Skeleton, pieces: Iterator, flat: Frame) -> None:
        """Draw the pieces in the pool's threads."""
        if self._pool is None or self._process != os.getpid():  # threads don't survive a fork
            self._pool, self._process = ThreadPoolExecutor(self.threads, thread_name_prefix="raycast"), os.getpid()
        pool = self._pool
        for done in [pool.submit(self._draw, work, skeleton, camera, index, flat) for camera, index in pieces]:
            done.result()

    def _draw(self, work: Batch, skeleton: Skeleton, camera: Camera, index: np.ndarray, flat: Frame) -> None:
        """Draw bodies `index`, all seen by `camera`."""
        ends = limb_segments(work.poses[index], skeleton)
        radii = skeleton.radii
        view = self._view(camera, 1, flat.rgb is not None)
        nothing = np.empty((0, 0, 0, 3), np.uint8)
        smooth = flat.rgb is not None and self.scene.samples > 1
        draw(index, ends, radii, view, flat.depth, flat.limbs, nothing if flat.rgb is None or smooth else flat.rgb)
        if smooth:
            samples = self.scene.samples
            draw_smooth(index, ends, radii, self._view(camera, samples, True), samples, flat.rgb)

    def _view(self, camera: Camera, samples: int, rgb: bool) -> View:
        """The view of `camera` with so many samples per pixel and axis, from the cache where it is there."""
        parts = (camera.K.tobytes(), camera.R.tobytes(), camera.t.tobytes(), camera.width, camera.height)
        key = (*parts, samples, rgb)
        with self._lock:
            if key in self._views:
                self._views.move_to_end(key)
                return self._views[key]
        view = make_view(enlarged(camera, samples), self.scene, rgb=rgb)
        with self._lock:
            self._views[key] = view
            while len(self._views) > _CACHED_VIEWS:
                self._views.popitem(last=False)
        return view

    def __getstate__(self):
        return {"scene": self.scene, "threads": self.threads}

    def __setstate__(self, state):
        self.__init__(state["scene"], threads=state["threads"])  # type: ignore[misc]


def _pieces(work: Batch, most: int) -> Iterator[tuple[Camera, np.ndarray]]:
    """Cameras, each with some of the bodies that it sees, `most` at most."""
    for i, camera in enumerate(work.cameras):
        mine = np.flatnonzero(work.which == i)
        for start in range(0, len(mine), most):
            yield camera, mine[start : start + most]


def make_view(camera: Camera, scene: Scene, *, rgb: bool = True) -> View:
    """Everything about `camera` and `scene` that all its pictures share, the drawn background above all.

    Args:
        camera: whose view it is.
        scene: what is there.
        rgb: False leaves the background out.
    """
    k, kinv = camera.K, np.linalg.inv(camera.K)
    centre = camera.centre
    lights = scene.lights
    size = (camera.height, camera.width, 3) if rgb else (0, 0, 3)
    lit, dark = np.empty(size, np.uint8), np.empty(size, np.uint8)
    encode, ambient = encoding(), np.array(scene.ambient)
    sky = linear([*scene.tiles, scene.horizon, scene.zenith])
    settings = np.array([scene.tile, scene.fade, float(scene.ground)])
    draw_background(camera.R.T @ kinv, centre, settings, lights, ambient, sky, encode, lit, dark)
    turned = np.concatenate([lights[:, :3] @ camera.R.T, lights[:, 3:]], axis=1)
    shadows = bool(scene.shadows and scene.ground and rgb and centre[2] > 1e-3)
    across, to_pixel = _light_plane(scene, k @ camera.R, k @ camera.t)
    from_pixel = np.linalg.inv(to_pixel) if shadows else np.zeros((3, 3))
    return View(
        k, kinv, camera.R, camera.t, turned.astype(np.float32), ambient.astype(np.float32),
        scene.limb_colours.astype(np.float32), encode, lit, dark, shadows, across, to_pixel, from_pixel,
    )  # fmt: skip


def _light_plane(scene: Scene, kr: np.ndarray, kt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (2, 3) at right angles to the key light, and the map (3, 3) from their plane to pixels.

    A point of the ground (x, y, 0) has coordinates (s, t) along the two vectors; (s, t, 1) maps to pixel times depth.
    """
    light = np.array(scene.key)
    first = np.cross(light, (0.0, 1.0, 0.0))
    first /= np.linalg.norm(first)
    across = np.stack([first, np.cross(light, first)])
    to_ground = np.linalg.inv(across[:, :2])
    return across, np.column_stack([kr[:, :2] @ to_ground, kt])
