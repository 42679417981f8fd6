"""Detect markers and walkers in the observations of n environments."""

from collections.abc import Sequence

import numpy as np

from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.types import Camera

_HEIGHT = 1.75  # [m] average body height
_TALL = 0.1  # [m] standard deviation of body height
_PIXELS = 0.5  # [pixels] standard deviation of the rows of head and feet
_STILL = 0.05  # [s²] variance of one frame's position over that of velocities
_MOVES = 0.2  # [m/s] least speed that tells a heading
_AREA = 0.45  # [m²] typical area of a silhouette
_CREDIBLE = 0.3, 2.0  # plausible range of a silhouette's area, relative to the typical one
_AGREE = 1.4  # ratio of the two distances above which feet or head are hidden
_SURE = 0.9  # foreground probability above which a pixel of a colour image counts


class SeenPoints:
    """2D points of `n` environments, extrapolated at constant velocity while missing; at `never` (15, 2) until seen."""

    def __init__(self, never: np.ndarray, n: int) -> None:
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
    """Positions and headings of walkers on the ground, from their silhouettes in n environments.

    A line through the positions over time, by least squares, is extrapolated while nothing is seen. A frame weighs
    `kept` times as much as the next; 0 uses only the last frame in which a walker was seen.
    """

    def __init__(self, n: int, kept: float = 0.97) -> None:
        self._kept = kept
        self._cameras: list[Camera | None] = [None] * n
        self._backgrounds = [Background() for _ in range(n)]
        self._sums = np.zeros((n, 3))  # of weights, and of their products with the time and its square [s]
        self._places = np.zeros((n, 2, 2))  # of products with the position, and with time and position
        self._time = np.zeros(n)

    def forget(self, began: np.ndarray, cameras: Sequence[Camera]) -> None:
        """Reset the environments `began` (n,), with one camera for each of them."""
        for slot, camera in zip(np.flatnonzero(began), cameras, strict=True):
            self._cameras[slot], self._backgrounds[slot] = camera, Background()
        self._sums[began], self._places[began], self._time[began] = 0.0, 0.0, 0.0

    def at(self, pictures: dict[str, np.ndarray], far: float, fps: float) -> tuple[np.ndarray, np.ndarray]:
        """The walkers' x and y (n, 2) [m], and their headings (n,) [rad], 0 while unknown.

        `pictures` are "mask", "depth" or "rgb" by name, each (n, height, width, channels), with a background at depth
        `far` [m]; `fps` is the frame rate [Hz].
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
        weight = np.maximum(self._sums[:, 0], 1e-9)
        middle, mean = self._sums[:, 1] / weight, self._places[:, 0] / weight[:, None]
        spread = self._sums[:, 2] - weight * middle**2 + _STILL
        velocity = (self._places[:, 1] - (weight * middle)[:, None] * mean) / spread[:, None]
        place = mean + velocity * (self._time - middle)[:, None]
        self._time += 1.0 / fps
        moves = np.hypot(*velocity.T) > _MOVES
        return place, np.where(moves, np.arctan2(velocity[:, 1], velocity[:, 0]), 0.0)

    def _place(self, slot: int, foreground: np.ndarray) -> None:
        """Process one silhouette (height, width), unless its area is implausible."""
        camera, size = self._cameras[slot], float(foreground.sum())
        assert camera is not None, "call forget() first"
        columns, rows = foreground.sum(0), foreground.sum(1).cumsum()
        if not size:
            return
        column = columns @ np.arange(len(columns)) / size
        top, bottom = (float(np.searchsorted(rows, share * size)) for share in (0.01, 0.99))
        place, depth = walker_at(camera, float(column), top - 0.5, bottom + 0.5)
        usual = _AREA * (camera.K[1, 1] / depth) ** 2
        if not _CREDIBLE[0] * usual < size < _CREDIBLE[1] * usual:
            return
        time = self._time[slot]
        self._sums[slot] = self._kept * self._sums[slot] + (1.0, time, time**2)
        self._places[slot] = self._kept * self._places[slot] + np.outer((1.0, time), place)


def walker_at(camera: Camera, column: float, top: float, bottom: float) -> tuple[np.ndarray, float]:
    """Where somebody stands, x and y (2,) [m], and the distance along the camera's axis [m].

    The highest row tells a distance if the body has average height, the lowest if the feet are on the ground. It is
    their mean, weighted by their precision, or the smaller one if they disagree: who is partly hidden seems farther.

    Args:
        camera: a level camera, above the ground and below the head.
        column: centre of the silhouette [pixels].
        top, bottom: its first and last row [pixels].
    """
    focal, horizon, eye = camera.K[1, 1], camera.K[1, 2], camera.centre[2]
    rows = np.maximum([horizon - top, bottom - horizon], 1.0)
    depths = focal * np.array([_HEIGHT - eye, eye]) / rows
    precise = 1.0 / ((_PIXELS / rows) ** 2 + [(_TALL / (_HEIGHT - eye)) ** 2, 0.0])
    agree = depths.max() < _AGREE * depths.min()
    depth = float(depths @ precise / precise.sum() if agree else depths.min())
    ray = np.array([(column - camera.K[0, 2]) / camera.K[0, 0], 0.0, 1.0])
    return camera.centre[:2] + depth * (camera.R.T @ ray)[:2], depth
