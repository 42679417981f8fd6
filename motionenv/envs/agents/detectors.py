"""Detect markers and walkers in the observations of n environments."""

from collections.abc import Sequence

import numpy as np

from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.types import Camera

_HEIGHT = 1.75  # [m] average body height
_TALL = 0.06  # relative standard deviation of body height
_BESIDE = 0.03  # [m] standard deviation of the silhouette's centre about the body's
_LEVEL = 0.95  # [m] typical height of that centre
_AREA = 0.45  # [m²] typical area of a silhouette
_CREDIBLE = 0.3, 2.0  # plausible range of a silhouette's area, relative to the typical one
_SURE = 0.9  # foreground probability above which a pixel of a colour image counts


class SeenPoints:
    """2D points of n environments, extrapolated at constant velocity while they are missing.

    Args:
        never: (15, 2), assumed positions of points that have never been seen.
        n: number of environments.
    """

    def __init__(self, never: np.ndarray, n: int):
        self._never = never
        self._points = np.tile(never, (2, n, 1, 1))  # the last two seen
        self._times = np.zeros((2, n, 15))
        self._time = np.zeros(n)

    def forget(self, began: np.ndarray) -> None:
        """Reset the environments `began` (n,)."""
        self._points[:, began] = self._never
        self._times[0, began], self._times[1, began] = -1.0, -2.0
        self._time[began] = 0.0

    def at(self, points: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Current positions of the points (n, 15, 2), given those that are seen (n, 15)."""
        seen = seen > 0
        now = np.repeat(self._time[:, None], 15, axis=1)
        first = seen & (self._times[0] < 0)  # seen for the first time: start with zero velocity
        self._points[1] = np.where((seen & ~first)[..., None], self._points[0], self._points[1])
        self._times[1] = np.where(seen & ~first, self._times[0], self._times[1])
        self._points[1] = np.where(first[..., None], points, self._points[1])
        self._points[0] = np.where(seen[..., None], points, self._points[0])
        self._times[0] = np.where(seen, now, self._times[0])
        self._time += 1.0
        velocity = (self._points[0] - self._points[1]) / (self._times[0] - self._times[1])[..., None]
        return self._points[0] + velocity * (now - self._times[0])[..., None]


class SeenWalkers:
    """Positions of walkers along x, from their silhouettes in n environments.

    Args:
        n: number of environments.
    """

    def __init__(self, n: int):
        self._cameras: list[Camera | None] = [None] * n
        self._backgrounds = [Background() for _ in range(n)]
        self._first, self._last = np.zeros((2, n, 2))  # time and position
        self._time = np.zeros(n)
        self._found = np.zeros(n, dtype=bool)

    def forget(self, began: np.ndarray, cameras: Sequence[Camera]) -> None:
        """Reset the environments `began` (n,), with one camera for each of them."""
        for slot, camera in zip(np.flatnonzero(began), cameras, strict=True):
            self._cameras[slot], self._backgrounds[slot] = camera, Background()
        self._first[began] = self._last[began] = 0.0
        self._time[began] = 0.0
        self._found[began] = False

    def at(self, pictures: dict[str, np.ndarray], far: float) -> np.ndarray:
        """The walkers' x (n,) [m].

        Args:
            pictures: by name, "mask", "depth" or "rgb", each (n, height, width, channels).
            far: depth [m] of the background.
        """
        for slot in range(len(self._time)):
            if "mask" in pictures:
                foreground = pictures["mask"][slot, ..., 0] > 0
            elif "depth" in pictures:
                foreground = pictures["depth"][slot, ..., 0] < far
            else:
                rgb, background = pictures["rgb"][slot], self._backgrounds[slot]
                background.observe(rgb)
                foreground = foreground_probability(rgb, background.estimate()) > _SURE
            self._place(slot, foreground)
        self._time += 1.0
        went = self._last - self._first
        speed = went[:, 1] / np.maximum(went[:, 0], 1.0)
        return self._last[:, 1] + speed * (self._time - 1.0 - self._last[:, 0])

    def _place(self, slot: int, foreground: np.ndarray) -> None:
        """Process one silhouette (height, width), unless its area is implausible."""
        camera, size = self._cameras[slot], float(foreground.sum())
        assert camera is not None, "call forget() first"
        usual = _AREA * (camera.K[1, 1] / np.linalg.norm(camera.centre)) ** 2
        if not _CREDIBLE[0] * usual < size < _CREDIBLE[1] * usual:
            return
        columns, rows = foreground.sum(0), foreground.sum(1).cumsum()
        middle = columns @ np.arange(len(columns)) / size
        high = np.searchsorted(rows, 0.99 * size) - np.searchsorted(rows, 0.01 * size) + 1
        here = self._time[slot], walker_at(camera, float(middle), float(high))
        if not self._found[slot]:
            self._first[slot] = here
        self._last[slot], self._found[slot] = here, True


def walker_at(camera: Camera, column: float, rows: float) -> float:
    """The x [m] of a walker on the line y = 0, by least squares.

    Args:
        camera: the camera.
        column: centre of the silhouette [pixels].
        rows: height of the silhouette [pixels].
    """
    ray = (column - camera.K[0, 2]) / camera.K[0, 0]
    across, along = camera.R[0] - ray * camera.R[2], camera.R[2]
    depth = camera.K[1, 1] * _HEIGHT / rows
    a = np.array([across[0] / _BESIDE, along[0] / (_TALL * depth)])
    b = np.array(
        [
            -(across[2] * _LEVEL + camera.t[0] - ray * camera.t[2]) / _BESIDE,
            (depth - along[2] * _LEVEL - camera.t[2]) / (_TALL * depth),
        ]
    )
    return float(a @ b / (a @ a))
