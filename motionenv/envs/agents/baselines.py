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

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, random_generator
from motionenv.body import from_height, markers
from motionenv.body.arm_reaching import RIGHT_ARM, reach
from motionenv.envs.agents.action_adapter import Actions
from motionenv.envs.agents.detectors import SeenPoints, SeenWalkers
from motionenv.envs.base import Observation
from motionenv.errors import MotionError
from motionenv.models.registry import load
from motionenv.models.types import Walker
from motionenv.types import POSE

_WALK = "walk/fpca"
_CYCLE = 64  # frames of a cycle over which poses are averaged
_REACHED = 20_000  # frames of reaching over which poses are averaged
_STANDING = 0.53  # pelvis height of a standing body, relative to body height
_SPREAD = 0.02  # [m, rad] standard deviation of the oracle's beliefs


class MeanPose:
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


class ConstantVelocity:
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


class Oracle:
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
        walks = model.walks(1.2, 30.0, n=n, seed=rng, height=1.75).poses
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
