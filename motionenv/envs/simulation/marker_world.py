"""The world of motionenv/MarkerTracking-v1: walkers in place, seen as markers."""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from gymnasium import Space, spaces

from motionenv.body import markers
from motionenv.envs.base import World
from motionenv.envs.simulation.estimates import FAR, ActionScale
from motionenv.envs.simulation.motion_sources import SPLITS, Source
from motionenv.likelihoods import MarkerLikelihood
from motionenv.metrics.joint_kernel import mean_distances
from motionenv.models.eigenwalkers.batch import WalkerBatch, draw_walkers
from motionenv.models.registry import load
from motionenv.render.cameras import Orthographic
from motionenv.render.cameras import view as camera_at
from motionenv.render.draw2d.overlay import draw_pose
from motionenv.render.draw2d.point_lights import render_points
from motionenv.render.sensors.marker_sensor import EYE_HEIGHT, MarkerSensor
from motionenv.types import MARKERS, Camera

#: Reach of normalised actions [m].
REACH = 2.0
#: What can be observed: markers in an image, or their true positions, which makes the environment fully observable.
SENSES = ("points", "joints")
#: Fourier walkers per split.
WALKERS = 4096

_FOURIER = "walk/eigenwalkers"
_SIZE, _WIDE = 320, 2.4  # width of a rendered image [pixels] and [m]
_SHAPE = 0.03  # [m] standard deviation of markers from those of the average body, for the observation model


class MarkerWorld(World):
    """A `motionenv.envs.World` of n walkers in place and a static camera.

    Args:
        n, actions: number of episodes, and as in `ActionScale`.
        source: of the motion; its frames are horizon + 1.
        sensor: marker sensor model.
        angles: range (low, high) of view angles [rad].
        full: whether the true positions are observed instead of the sensor's.
    """

    def __init__(
        self, n: int, source: Source, sensor: MarkerSensor, angles: tuple[float, float], actions: str,
        full: bool = False,
    ) -> None:  # fmt: skip
        self.n = n
        self.horizon = source.frames - 1
        self.fps = source.fps
        self.full = full
        self.observation_space: Space = spaces.Box(-FAR, FAR, (len(MARKERS), 3), np.float32)
        if not full:
            points, seen = spaces.Box(-FAR, FAR, (len(MARKERS), 2), np.float32), spaces.MultiBinary(len(MARKERS))
            self.observation_space = spaces.Dict({"points": points, "seen": seen})
        self.scale = ActionScale(actions, REACH, (len(MARKERS), 3), (0, 1, 2))
        self.action_space: spaces.Box = self.scale.space
        self.time = np.zeros(n, dtype=np.intp)
        self._angles, self._sensor = angles, sensor
        self._camera = _camera(sensor.distance)
        self._motion = _Series(source, n) if source.motion == _FOURIER else _Recorded(source, n)
        self._view = sensor.view(n)
        self._before = self._view.points.copy(), self._view.seen.copy()
        self._alphas = np.zeros(n)
        self._keys = np.zeros(n, dtype=np.uint64)

    def begin(self, slots: np.ndarray, rngs: Sequence[np.random.Generator]) -> None:
        self.time[slots] = 0
        for slot, rng in zip(slots, rngs, strict=True):
            self._keys[slot] = rng.integers(2**64, dtype=np.uint64)
            self._alphas[slot] = rng.uniform(*self._angles)
            self._motion.begin(slot, rng)
        self._look(slots)

    def observe(self, slots: np.ndarray) -> np.ndarray | dict[str, np.ndarray]:
        if self.full:
            return self._view.joints[slots].astype(np.float32)
        return {"points": self._view.points[slots], "seen": self._view.seen[slots]}

    def judge(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        error = np.empty(self.n)
        mean_distances(actions, self._view.joints, error, self.scale.factor, self.scale.centre)
        return error, -error

    def advance(self, slots: np.ndarray) -> None:
        self._before[0][:], self._before[1][:] = self._view.points, self._view.seen
        self.time[slots] += 1
        self._look(slots)

    def truth(self, slot: int) -> dict[str, Any]:
        return {"joints": self._view.joints[slot].copy(), "alpha": float(self._alphas[slot]), "camera": self._camera}

    def render(self, slot: int, estimate: np.ndarray | None) -> np.ndarray:
        points, seen = (self._view.points, self._view.seen) if estimate is None else self._before
        plane = np.full((len(MARKERS), 3), np.nan)
        shown = seen[slot] > 0
        plane[shown] = np.insert(points[slot, shown], 1, 0.0, axis=-1)
        picture = render_points(plane, self._camera)
        if estimate is None:
            return picture
        return draw_pose(picture, self.scale.estimates(estimate), self._camera, width=1.5)

    def observation_model(self, slot: int) -> MarkerLikelihood:
        """Likelihood of poses, in the camera's world, for the current observation of `slot`."""
        camera, noise = self._camera, math.hypot(self._sensor.noise, _SHAPE)
        points, seen = self._view.points[slot].astype(np.float64), self._view.seen[slot]
        if isinstance(camera, Orthographic):
            model = MarkerLikelihood(0.0, noise=noise)
        else:
            model = MarkerLikelihood(camera, noise=noise * _SIZE / _WIDE)
            points = camera.project(np.insert(points, 1, 0.0, axis=-1))[0]
        model.observe(points, seen)
        return model

    def _look(self, slots: np.ndarray) -> None:
        walkers = self._motion.positions(slots, self.time)
        self._view.look(slots, walkers, self._alphas, self._keys, self.time)


class _Series:
    """Fourier walkers."""

    def __init__(self, source: Source, n: int):
        self._source = source
        self._walkers = fourier_walkers(source.split)
        self._which = np.zeros(n, dtype=np.intp)
        self._sizes, self._start, self._step = np.zeros((3, n))

    def begin(self, slot: int, rng: np.random.Generator) -> None:
        """Draw the walker of `slot`, and the initial phase."""
        which = int(rng.integers(WALKERS))
        phase, tall, fast = rng.random(3)
        source, walkers = self._source, self._walkers
        size = 1.0 if source.height is None else _between(source.height, tall) / walkers.heights[which]
        frequency = walkers.frequencies[which]
        if source.speed is not None:
            frequency = _between(source.speed, fast) / (size * walkers.strides[which])
        self._which[slot], self._sizes[slot] = which, size
        self._start[slot], self._step[slot] = 2 * np.pi * phase, 2 * np.pi * frequency / source.fps

    def positions(self, slots: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Markers (k, 15, 3) [m] of `slots` in the frames `time` (n,), walking along x with mean position x = y = 0."""
        phases = self._start[slots] + self._step[slots] * time[slots]
        return self._walkers.positions(self._which[slots], phases, self._sizes[slots])


class _Recorded:
    """Segments of recordings, with their straight path removed; used like `_Series`."""

    def __init__(self, source: Source, n: int):
        self._recordings = source.open()
        self._tracks = np.zeros((n, source.frames, len(MARKERS), 3), dtype=np.float32)

    def begin(self, slot: int, rng: np.random.Generator) -> None:
        track = markers(*self._recordings.draw(rng))
        clock = np.arange(len(track))
        pelvis = track[:, MARKERS.index("pelvis"), :2]
        slope, start = np.polyfit(clock, pelvis, 1)
        track[..., :2] -= (start + slope * clock[:, None])[:, None]
        self._tracks[slot] = track

    def positions(self, slots: np.ndarray, time: np.ndarray) -> np.ndarray:
        return self._tracks[slots, time[slots]].astype(np.float64)


@lru_cache(maxsize=4)
def fourier_walkers(split: str) -> WalkerBatch:
    """The Fourier walkers of a `split`, one of `SPLITS`; the same in every process."""
    seed = np.random.SeedSequence(0, spawn_key=(SPLITS.index(split),))
    return draw_walkers(load(_FOURIER), WALKERS, np.random.default_rng(seed))


def _camera(distance: float | None) -> Camera | Orthographic:
    target = (0.0, 0.0, EYE_HEIGHT)
    if distance is None:
        return Orthographic(0.0, _SIZE / _WIDE, target, _SIZE, _SIZE)
    fov = 2 * np.degrees(np.arctan2(_WIDE / 2, distance))
    return camera_at(
        0.0, distance=distance, eye_height=EYE_HEIGHT, target=target, width=_SIZE, height=_SIZE, fov_degrees=float(fov)
    )


def _between(bounds: tuple[float, float], share: float) -> float:
    return bounds[0] + (bounds[1] - bounds[0]) * share
