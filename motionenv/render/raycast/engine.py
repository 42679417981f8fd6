"""The ray casting engine: exact tapered cylinders with rounded ends, in compiled code, without a graphics library.

The result is bit-identical for every call, order and number of threads.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from motionenv._core.precompilation import precompile
from motionenv._core.threads import Workers
from motionenv.body import limb_segments
from motionenv.body.gaps import known_limbs
from motionenv.errors import MotionError
from motionenv.render.raycast._draw_kernel import View, draw
from motionenv.render.raycast._ground_kernel import colour_background
from motionenv.render.raycast._shade_kernel import encoding
from motionenv.render.request import Batch, batch, enlarged
from motionenv.render.scene import Scene, linear
from motionenv.types import Camera, Frame, Skeleton

Kept = TypeVar("Kept")

_CACHED_VIEWS = 8
_ENCODING = encoding()
_CHUNK = 64  # bodies per task: large enough to amortise the call, small enough to balance threads


class Raycaster:
    """Renders bodies in a `scene` in some `threads`; caches the ground colours of recent views."""

    def __init__(self, scene: Scene | None = None, *, threads: int | None = 1) -> None:
        self.scene = scene or Scene()
        self._workers = Workers(threads, "raycast")
        self._views: OrderedDict[tuple, View] = OrderedDict()
        self._colours: OrderedDict[tuple, tuple[np.ndarray, np.ndarray]] = OrderedDict()
        self._lock = threading.Lock()

    @property
    def threads(self) -> int:
        """Number of threads."""
        return self._workers.threads

    def render(
        self, poses: np.ndarray, skeleton: Skeleton, cameras: Camera | Sequence[Camera], *, rgb: bool = True,
        out: Frame | None = None,
    ) -> Frame:  # fmt: skip
        """Render poses; colours take most of the time.

        Args:
            poses, skeleton, cameras: as of `motionenv.render.render`.
            rgb: whether to render colours; otherwise `rgb` of the images is None.
            out: a frame of an earlier call with the same shape, to be overwritten.

        Raises:
            MotionError: see `motionenv.render.request.batch`; or `out` has a wrong shape.
        """
        precompile("render")
        work = batch(poses, skeleton, cameras)
        frame = out or work.empty(rgb)
        if (frame.rgb is not None) != rgb:
            raise MotionError(f"out.rgb must be {'an array' if rgb else 'None'} if rgb={rgb}")
        flat = work.flat(frame)
        pieces = list(_pieces(work, max(1, min(_CHUNK, -(-len(work.poses) // self.threads)))))
        if self.threads > 1 and pieces:  # fill the cache once, instead of in each thread
            self._view(pieces[0][0], rgb)

        def draw_pieces(start: int, stop: int) -> None:
            for camera, index in pieces[start:stop]:
                self._draw(work, skeleton, camera, index, flat)

        self._workers.share(draw_pieces, len(pieces))
        return frame

    def _draw(self, work: Batch, skeleton: Skeleton, camera: Camera, index: np.ndarray, flat: Frame) -> None:
        """Render bodies `index`, all seen by `camera`."""
        poses, radii = work.poses[index], skeleton.radii
        ends = limb_segments(poses, skeleton)
        view = self._view(camera, flat.rgb is not None)
        rgb = np.empty((0, 0, 0, 3), np.uint8) if flat.rgb is None else flat.rgb
        if not np.isnan(poses).any():
            draw(index, ends, radii, view, self.scene.samples, flat.depth, flat.limbs, rgb)
            return
        shown, which = np.unique(known_limbs(poses), axis=0, return_inverse=True)
        for k, some in enumerate(shown):
            mine = which.reshape(-1) == k
            part = view._replace(colours=view.colours[some])
            seen, thick = np.ascontiguousarray(ends[mine][:, some]), radii[some]
            thick.flags.writeable = False  # like a skeleton's, so that kernels need no second version
            draw(index[mine], seen, thick, part, self.scene.samples, flat.depth, flat.limbs, rgb)
            ids = np.concatenate([[0], 1 + np.flatnonzero(some)]).astype(np.uint8)
            for i in index[mine]:
                flat.limbs[i] = ids[flat.limbs[i]]

    def _view(self, camera: Camera, rgb: bool) -> View:
        parts = (camera.K.tobytes(), camera.R.tobytes(), camera.width, camera.height, rgb)
        height = round(float(camera.centre[2]), 6)  # the height of a moving camera varies by rounding errors
        colours = self._kept(self._colours, (*parts, height), lambda: ground_colours(camera, height, self.scene, rgb))
        return self._kept(self._views, (*parts, camera.t.tobytes()), lambda: make_view(camera, self.scene, *colours))

    def _kept(self, kept: OrderedDict[tuple, Kept], key: tuple, make: Callable[[], Kept]) -> Kept:
        """The cached result of `make`. Threads don't wait for each other: at worst they compute a value twice."""
        with self._lock:
            if key in kept:
                kept.move_to_end(key)
                return kept[key]
        made = make()
        with self._lock:
            kept[key] = made
            while len(kept) > _CACHED_VIEWS:
                kept.popitem(last=False)
        return made

    def __reduce__(self):
        return partial(Raycaster, self.scene, threads=self.threads), ()


def _pieces(work: Batch, most: int) -> Iterator[tuple[Camera, np.ndarray]]:
    """Pairs of a camera and at most `most` of the bodies that it sees."""
    for i, camera in enumerate(work.cameras):
        mine = np.flatnonzero(work.which == i)
        for start in range(0, len(mine), most):
            yield camera, mine[start : start + most]


def ground_colours(camera: Camera, height: float, scene: Scene, rgb: bool) -> tuple[np.ndarray, np.ndarray]:
    """Bytes (3, height, width, 3) of ground and sky in full light and without the key light: `colour_background`.

    They depend on the camera's intrinsics, rotation and height [m]. Without `rgb` they stay empty.
    """
    size = (3, camera.height, camera.width, 3) if rgb else (3, 0, 0, 3)
    lit, dark = np.empty(size, np.uint8), np.empty(size, np.uint8)
    to_world = camera.R.T @ np.linalg.inv(camera.K)
    settings = np.array([scene.fade, float(scene.ground)])
    colours = linear([*scene.tiles, scene.horizon, scene.zenith])
    colour_background(to_world, height, settings, scene.lights, np.array(scene.ambient), colours, _ENCODING, lit, dark)
    return lit, dark


def make_view(camera: Camera, scene: Scene, lit: np.ndarray, dark: np.ndarray) -> View:
    """Precomputed values of `camera` and `scene` that all images share; for `lit` and `dark` see `ground_colours`."""
    k, kinv = camera.K, np.linalg.inv(camera.K)
    fine = enlarged(camera, scene.samples).K
    lights = scene.lights
    lights[:, :3] = lights[:, :3] @ camera.R.T
    centre = camera.centre / scene.tile
    centre[:2] %= 2  # the pattern's period
    shadows = bool(scene.shadows and scene.ground and lit.size and camera.centre[2] > 1e-3)
    across, to_pixel = _light_plane(scene, fine @ camera.R, fine @ camera.t)
    from_pixel = np.linalg.inv(to_pixel) if shadows else np.zeros((3, 3))
    to_world = (camera.R.T @ kinv).astype(np.float32)
    return View(
        k, kinv, camera.R, camera.t, fine, np.linalg.inv(fine), lights.astype(np.float32),
        np.array(scene.ambient, np.float32), scene.limb_colours.astype(np.float32), _ENCODING,
        to_world, centre.astype(np.float32), lit, dark, shadows, across, to_pixel, from_pixel,
    )  # fmt: skip


def _light_plane(scene: Scene, kr: np.ndarray, kt: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors (2, 3) perpendicular to the key light, and the map (3, 3) from their plane to pixels.

    A ground point (x, y, 0) has coordinates (s, t) along the two vectors; (s, t, 1) maps to pixel times depth.
    """
    light = np.array(scene.key)
    first = np.cross(light, (0.0, 1.0, 0.0))
    first /= np.linalg.norm(first)
    across = np.stack([first, np.cross(light, first)])
    to_ground = np.linalg.inv(across[:, :2])
    return across, np.column_stack([kr[:, :2] @ to_ground, kt])
