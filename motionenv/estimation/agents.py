"""Simple agents that play the tracking environments: what any better one has to beat, and what none can.

    >>> env = gymnasium.make("motionenv/MarkerTracking-v0")
    >>> play(env, ConstantVelocity(env), episodes=20, seed=1).errors.mean()     # [m] per joint

`MeanPose` never looks. `ConstantVelocity` takes what is seen in 2D, carries it on at its last velocity where nothing is
seen, and leaves the rest to the mean pose. `Oracle` reads the truth: no agent does better. They know what any agent may
know: the spaces, and of pictures the camera. Poses are those of walking; where a belief is asked for, it is as wide as
walkers differ.
"""

from functools import lru_cache

import numpy as np

from motionenv.body import from_height, markers
from motionenv.errors import MotionError
from motionenv.estimation._looking import SeenPoints, SeenWalkers
from motionenv.estimation.actions import Actions
from motionenv.estimation.numeric import as_number
from motionenv.models.reaching import RIGHT_ARM, reach
from motionenv.models.store import load
from motionenv.types import POSE

_WALK = "walk/fpca"
_CYCLE = 64  # frames of a cycle, of which the mean is taken
_REACHED = 20_000  # frames of reaching, of which the mean is taken
_STANDING = 0.53  # of the height: how high the pelvis of a standing body is
_SPREAD = 0.02  # [m, rad] of the oracle's beliefs


class MeanPose:
    """Says always the same: the mean pose of walking, in the middle of the world; of an arm, where it is on average.

    Where the direction of walking is unknown, as in MarkerTracking, the mean is over all directions.

    Args:
        env: the environment, single or vector.
    """

    def __init__(self, env):
        self._actions = Actions(env)
        self._poses = (reaching_poses if self._actions.arm else walking_poses)(self._actions.samples)
        joints = markers(self._poses, from_height())
        if self._actions.points:
            joints[..., :2] = 0.0
        self._joints = joints

    def reset(self, observation, began=None) -> None:
        """Nothing to remember; see `Agent` for `observation` and `began`."""

    def act(self, observation) -> np.ndarray:
        """The mean pose, whatever the `observation`."""
        return self._actions.of(self._poses[None], self._joints[None])


class ConstantVelocity:
    """Goes by what is seen in 2D, and where nothing is seen by the velocity of what was.

    Markers: the last two points seen of each are extrapolated; depth, which isn't seen, is the mean pose's. Pictures:
    the mean pose of walking is moved to where the silhouette is. It walks along x, so one number says where: it fits
    best the middle column of the silhouette and, through the average body's height, its number of rows.

    Args:
        env: the environment, single or vector; its pictures are masks, depths or rgb, or several.

    Raises:
        MotionError: ArmTracking, where silhouettes stay where they are.
    """

    def __init__(self, env):
        self._actions = Actions(env)
        if self._actions.arm:
            raise MotionError("ConstantVelocity follows markers and walkers: for an arm that moves take another agent")
        self._poses = walking_poses(self._actions.samples)
        self._joints = markers(self._poses, from_height())
        self._look: SeenPoints | SeenWalkers
        if self._actions.points:
            never = np.stack([np.zeros(15), self._joints[0, :, 2]], axis=-1)
            self._look = SeenPoints(never, self._actions.n)
        else:
            self._look = SeenWalkers(self._actions.n)

    def reset(self, observation, began=None) -> None:
        """Forget the episodes before; see `Agent` for `observation` and `began`."""
        began = np.ones(self._actions.n, bool) if began is None else np.asarray(began, dtype=bool)
        if isinstance(self._look, SeenPoints):
            self._look.forget(began)
        else:
            world = self._actions.env.world
            self._look.forget(began, [world.observation_model(slot).camera for slot in np.flatnonzero(began)])

    def act(self, observation) -> np.ndarray:
        """The mean pose, or markers, moved to where `observation` shows them."""
        seen = self._actions.batched(observation)
        if isinstance(self._look, SeenPoints):
            joints = np.zeros((self._actions.n, 1, 15, 3))
            joints[:, 0, :, [0, 2]] = np.moveaxis(self._look.at(seen["points"], seen["seen"]), -1, 0)
            return self._actions.of(None, joints)
        x = self._look.at(seen, self._actions.far)[:, None]
        poses, joints = np.tile(self._poses, (len(x), 1, 1)), np.tile(self._joints, (len(x), 1, 1, 1))
        poses[..., 0] += x
        joints[..., 0] += x[..., None]
        return self._actions.of(poses, joints)


class Oracle:
    """Says the truth; as a belief, poses about it.

    Args:
        env: the environment, single or vector.
        spread: standard deviation of each entry of a belief's poses [m, rad]; 0 is the best score there is.
        seed: of the spread.

    Raises:
        MotionError: a negative spread.
    """

    def __init__(self, env, spread: float = _SPREAD, seed: int | None = 0):
        if not 0 <= as_number(spread) < np.inf:
            raise MotionError(f"spread must be a finite number from 0, got {spread!r}")
        self._env, self._actions, self._spread = env, Actions(env), spread
        self._rng = np.random.default_rng(seed)

    def reset(self, observation, began=None) -> None:
        """Nothing to remember; see `Agent` for `observation` and `began`."""

    def act(self, observation) -> np.ndarray:
        """The truth of the current frame, whatever the `observation`."""
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
    """Poses (n, 25) of walkers along x at x = y = 0; for n = 1 the mean pose over the mean walker's cycle.

    Args:
        n: how many; more than one are of different walkers at different phases, always the same ones.
    """
    model = load(_WALK)
    if n == 1:
        mean = model.person_mean_
        stride = type(model.sample(1, seed=0))(mean[None, :-2], np.exp(mean[-2:-1]))
        fps = _CYCLE / float(stride.seconds[0])
        cycle = model.synthesize(_CYCLE / fps, fps, stride=stride, variation=0.0, height=1.75).poses
        poses = cycle.mean(axis=0, keepdims=True)
    else:
        rng = np.random.default_rng(0)
        walks = model.synthesize(1.2, 30.0, n=n, seed=rng, height=1.75).poses
        poses = walks[np.arange(n), rng.integers(walks.shape[1], size=n)]
    poses[:, :2] = 0.0
    poses.flags.writeable = False
    return poses


@lru_cache(maxsize=4)
def reaching_poses(n: int) -> np.ndarray:
    """Poses (n, 25) of people who stand at x = y = 0 and reach with the right arm; for n = 1 the mean.

    Args:
        n: how many; more than one are independent, always the same ones.
    """
    angles = reach(_REACHED, 30.0, np.random.default_rng(0))
    poses = np.zeros((n, len(POSE)))
    poses[:, 2] = _STANDING * from_height().height
    poses[:, RIGHT_ARM] = angles.mean(axis=0) if n == 1 else angles[np.linspace(0, _REACHED - 1, n).astype(int)]
    poses.flags.writeable = False
    return poses
