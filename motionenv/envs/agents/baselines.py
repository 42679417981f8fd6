"""Baseline agents: lower and upper bounds for the tracking environments.

    >>> import gymnasium, motionenv.envs
    >>> from motionenv.envs.agents import ConstantVelocity, evaluate
    >>> env = gymnasium.make("motionenv/MarkerTracking-v1")
    >>> error = evaluate(env, ConstantVelocity(env), episodes=2, seed=1).errors.mean()  # [m] per joint

`MeanPose` ignores observations. `Blob` puts the mean pose where the silhouette or the markers are. `ConstantVelocity`
uses 2D detections, extrapolates them at constant velocity while they are missing, and takes the rest from the mean
pose. `Oracle` reads the ground truth. The others use only what agents may know: the spaces and, for images, the camera.
Poses are those of walking; beliefs have the spread of the population of walkers.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, random_generator
from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.envs.agents.action_adapter import Actions
from motionenv.envs.base import Observation
from motionenv.errors import MotionError
from motionenv.likelihoods.background import Background, foreground_probability
from motionenv.models.registry import load
from motionenv.models.types import Walker
from motionenv.types import POSE, Camera

_WALK = "walk/fpca"
_CYCLE = 64  # frames of a cycle over which poses are averaged
_REACHED = 20_000  # frames of reaching over which poses are averaged
_STANDING = 0.53  # pelvis height of a standing body, relative to body height
_SPREAD = 0.02  # [m, rad] standard deviation of the oracle's beliefs


class _Baseline:
    _actions: Actions

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._actions.env!r})"


class MeanPose(_Baseline):
    """Always the mean pose of walking in the middle of the world of `env`; for an arm, the mean of reaching.

    If the walking direction is unknown, as in MarkerTracking, the mean is over all directions.
    """

    def __init__(self, env: Any) -> None:
        self._actions = Actions(env)
        self._poses = (reaching_poses if self._actions.arm else walking_poses)(self._actions.samples)
        joints = markers(self._poses, from_height())
        if self._actions.points:
            joints[..., :2] = 0.0
        self._joints = joints

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Nothing to reset; see `Agent` for `observation` and `began`."""

    def act(self, observation: Observation) -> np.ndarray:
        """The mean pose; `observation` is ignored."""
        return self._actions.of(self._poses[None], self._joints[None])


class ConstantVelocity(_Baseline):
    """Follows 2D detections, and extrapolates them at constant velocity while there are none.

    Markers: the last two visible positions of each are extrapolated; depth is the mean pose's. Images: the mean pose of
    walking is moved to where the silhouette is on the ground, as its feet and its height tell, and turned to where it
    goes.

    Args:
        env: the environment, single or vector; its images are masks, depths or rgb, or several.

    Raises:
        MotionError: ArmTracking, where silhouettes don't move.
    """

    _kept = 0.97  # weight of a frame relative to the next

    def __init__(self, env: Any) -> None:
        self._actions = Actions(env)
        if self._actions.arm:
            raise MotionError("ConstantVelocity supports markers and walkers only: use another agent for ArmTracking")
        self._poses = walking_poses(self._actions.samples)
        self._joints = markers(self._poses, from_height())
        self._look: SeenPoints | SeenWalkers
        if self._actions.points:
            never = np.stack([np.zeros(15), self._joints[0, :, 2]], axis=-1)
            self._look = SeenPoints(never, self._actions.n)
        else:
            self._look = SeenWalkers(self._actions.n, self._kept)

    def reset(self, observation: Observation, began: ArrayLike | None = None) -> None:
        """Forget ended episodes; see `Agent` for `observation` and `began`."""
        began = np.ones(self._actions.n, bool) if began is None else np.asarray(began, dtype=bool)
        if isinstance(self._look, SeenPoints):
            self._look.forget(began)
        else:
            world = self._actions.env.world
            self._look.forget(began, [world.observation_model(slot).camera for slot in np.flatnonzero(began)])

    def act(self, observation: Observation) -> np.ndarray:
        """The mean pose, or markers, moved to the detections in `observation`."""
        seen = self._actions.batched(observation)
        if isinstance(self._look, SeenPoints):
            joints = np.zeros((self._actions.n, 1, 15, 3))
            joints[:, 0, :, [0, 2]] = np.moveaxis(self._look.at(seen["points"], seen["seen"]), -1, 0)
            return self._actions.of(None, joints)
        place, heading = self._look.at(seen, self._actions.far, self._actions.env.world.fps)
        poses, turn = np.tile(self._poses, (len(place), 1, 1)), np.zeros((len(place), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
        turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = np.sin(heading), -np.sin(heading), 1.0
        joints = self._joints @ turn[:, None]
        poses[..., 5] += heading[:, None]
        poses[..., :2] += place[:, None]
        joints[..., :2] += place[:, None, None]
        return self._actions.of(poses, joints)


class Blob(ConstantVelocity):
    """The mean pose at the centre of what the last frame of `env` shows; it remembers nothing else.

    Raises:
        MotionError: ArmTracking, where silhouettes don't move.
    """

    _kept = 0.0

    def act(self, observation: Observation) -> np.ndarray:
        """The mean pose, moved to what `observation` shows."""
        if not self._actions.points:
            return super().act(observation)
        seen = self._actions.batched(observation)
        shown = (seen["seen"] > 0)[..., None]
        mean = self._joints.copy()
        mean[..., :2] = 0.0  # walkers face anywhere
        shift = (shown * (seen["points"] - mean[:, :, [0, 2]])).sum(1) / np.maximum(shown.sum(1), 1)
        joints = np.repeat(mean[None], len(shift), axis=0)
        joints[..., [0, 2]] += shift[:, None, None]
        return self._actions.of(None, joints)


class Oracle(_Baseline):
    """Returns the ground truth of `env`; as a belief, poses around it.

    Args:
        spread: standard deviation of each entry of a belief's poses [m, rad]; 0 gives the best possible score.
        seed: of the spread.

    Raises:
        MotionError: a negative spread.
    """

    def __init__(self, env: Any, spread: float = _SPREAD, seed: int | None = 0) -> None:
        self._env, self._actions, self._spread = env, Actions(env), checked_number(spread, "spread", 0)
        self._rng = random_generator(seed)

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Nothing to reset; see `Agent` for `observation` and `began`."""

    def act(self, observation: Observation) -> np.ndarray:
        """The ground truth of the current frame; `observation` is ignored."""
        truths = self._env.unwrapped.truth()
        truths = truths if isinstance(truths, list) else [truths]
        joints = np.stack([truth["joints"] for truth in truths])[:, None]
        if self._actions.form == "joints":
            return self._actions.of(None, joints)
        poses = np.stack([truth["pose"] for truth in truths])[:, None]
        if self._actions.form == "belief":
            shape = (len(poses), self._actions.samples, len(POSE))
            poses = poses + self._spread * self._rng.standard_normal(shape)
        return self._actions.of(poses, joints)


@lru_cache(maxsize=4)
def walking_poses(n: int) -> np.ndarray:
    """`n` poses (n, 25) of different walkers along x at x = y = 0, always the same; for n = 1 the mean over a cycle."""
    model = load(_WALK)
    if n == 1:
        mean = model.person_mean_
        seconds = float(np.exp(mean[-2]))
        walker, fps = Walker(model.kind, mean[:-2], seconds), _CYCLE / seconds
        cycle = model.synthesize(_CYCLE / fps, fps, walker=walker, variation=0.0, height=1.75).poses
        poses = cycle.mean(axis=0, keepdims=True)
    else:
        rng = np.random.default_rng(0)
        walks = model.walks(1.2, 30.0, n=n, seed=rng, skeleton=model.skeleton(1.75)).poses
        poses = walks[np.arange(n), rng.integers(walks.shape[1], size=n)]
    poses[:, :2] = 0.0
    poses.flags.writeable = False
    return poses


@lru_cache(maxsize=4)
def reaching_poses(n: int) -> np.ndarray:
    """`n` poses (n, 25) of people at x = y = 0 who reach with the right arm, always the same; for n = 1 the mean."""
    angles = reach(_REACHED, 30.0, np.random.default_rng(0))
    poses = np.zeros((n, len(POSE)))
    poses[:, 2] = _STANDING * from_height().height
    poses[:, RIGHT_ARM] = angles.mean(axis=0) if n == 1 else angles[np.linspace(0, _REACHED - 1, n).astype(int)]
    poses.flags.writeable = False
    return poses


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
