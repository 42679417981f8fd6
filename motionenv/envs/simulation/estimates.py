"""Action spaces and scoring: a pose, joints, or a belief, and its distance from the ground truth."""

import math
from collections.abc import Sequence

import numpy as np
from gymnasium import spaces

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_choice, checked_whole
from motionenv.body.joints_kernel import joints_of
from motionenv.metrics import energy_score
from motionenv.metrics.joint_kernel import mean_distances
from motionenv.types import MARKERS, POSE

#: Allowed values of `estimate`.
FORMS = ("pose", "joints", "belief")
#: Kinds of actions.
ACTIONS = ("normalised", "metric")
#: Bounds of metric actions: positions [m], angles [rad], and log weights.
FAR, TURNED, LOG_WEIGHT = 100.0, 4 * math.pi, 100.0

_AS_IT_IS = np.ones(3), np.zeros(3)  # factor and centre of estimates in metres
_WEIGHT = -1  # instead of an index into `POSE`: the column of log weights
_MIDDLE, _TALL, _LIKELIER = 1.0, 2.0, 10.0  # [m] height of a normalised 0; [m] and log weight of a normalised 1


class ActionScale:
    """The action space, and the affine map from actions to estimates [m, rad].

    A normalised action is from -1 to 1 in each entry. It says x and y = `reach` · a, z = 1 m + 2 m · a, angles = π · a,
    and log weights = 10 · a. A metric action is the estimate itself.

    Args:
        actions: "normalised" or "metric".
        reach: largest distance of x and y from the origin in a normalised action [m].
        shape, columns: of an action, and the meaning of each column of its last axis: an index into `POSE`, or -1 for a
            log weight.

    Attributes:
        space: of actions, float32.
        factor, centre: (columns,) of the map from actions to estimates.

    Raises:
        MotionError: no such kind of actions.
    """

    def __init__(self, actions: str, reach: float, shape: tuple[int, ...], columns: Sequence[int]) -> None:
        checked_choice(actions, "actions", ACTIONS)
        at = np.array(columns)
        kinds = [at == _WEIGHT, at < 2, at == 2]
        self._angles, self._metric = at > 2, actions == "metric"
        self.reach = FAR if self._metric else reach
        self.factor, self.centre = np.ones(len(at)), np.zeros(len(at))
        if not self._metric:
            self.factor = np.select(kinds, [_LIKELIER, reach, _TALL], math.pi)
            self.centre[at == 2] = _MIDDLE
        bound = np.select(kinds, [LOG_WEIGHT, FAR, FAR], TURNED) if self._metric else np.ones(len(at))
        high = np.broadcast_to(bound.astype(np.float32), shape)
        self.space = spaces.Box(-high, high, dtype=np.float32)

    def estimates(self, actions: np.ndarray) -> np.ndarray:
        """What actions (..., columns), float64, say [m, rad]."""
        return actions if self._metric else actions * self.factor + self.centre

    def actions(self, estimates: np.ndarray) -> np.ndarray:
        """The actions that say estimates (..., *shape) [m, rad], float32; out of bounds goes to the bound.

        Angles of normalised actions are taken within half a turn of 0.
        """
        said = np.array(estimates, dtype=np.float64)
        if not self._metric:
            said[..., self._angles] = np.remainder(said[..., self._angles] + np.pi, 2 * np.pi) - np.pi
            said = (said - self.centre) / self.factor
        return np.clip(said, self.space.low, self.space.high).astype(np.float32)


class Estimates:
    """Estimates of a part of the body, in one of three forms.

    A pose is applied to the true body, so that its error consists of angles and position only. Other entries and joints
    are taken from the ground truth.

    Args:
        form: "pose" (entries of the pose vector), "joints" (k, 3) positions [m], or "belief" (n_belief, entries + 1)
            weighted poses, each followed by its log weight.
        n_belief: number of poses in a belief.
        entries, joints: indices into `POSE` that a pose contains and into `MARKERS` that are scored; None is all.
        threads: for scoring beliefs.
        actions, reach: of the `ActionScale`, which is `scale`.
    """

    def __init__(
        self, form: str, n_belief: int = 64, *, entries: Sequence[int] | None = None,
        joints: Sequence[int] | None = None, threads: int | None = 1, actions: str = "metric", reach: float = FAR,
    ) -> None:  # fmt: skip
        checked_choice(form, "estimate", FORMS)
        n_belief = checked_whole(n_belief, "n_belief", 1, 4096, "poses")
        self.form = form
        self._entries = list(range(len(POSE)) if entries is None else entries)
        self._scored = list(range(len(MARKERS)) if joints is None else joints)
        self._whole = entries is None and joints is None
        self._workers = Workers(threads, "estimates")
        shape, columns = {
            "pose": ((len(self._entries),), self._entries),
            "joints": ((len(self._scored), 3), [0, 1, 2]),
            "belief": ((n_belief, len(self._entries) + 1), [*self._entries, _WEIGHT]),
        }[form]
        self.scale = ActionScale(actions, reach, shape, columns)

    def judge(self, actions: np.ndarray, poses: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean error per scored joint (n,) [m], and reward (n,), of `actions`, `poses` and `offsets` as in `points`.

        The reward is minus that error. For a belief, the error is that of its mean, and the reward is minus the energy
        score divided by √joints, which makes it comparable with an error per joint.
        """
        true, actions = true_joints(poses, offsets), self.scale.estimates(actions)
        joints = self._joints_of(actions, true, poses, offsets)
        error = self._error(self._point(actions, joints), true)
        if self.form != "belief":
            return error, -error
        score = np.empty(len(actions))

        def some(start: int, stop: int) -> None:
            part = slice(start, stop)
            score[part] = energy_score(joints[part], actions[part, :, -1], true[part])

        self._workers.share(some, len(actions))
        return error, -score / math.sqrt(len(self._scored))

    def points(self, actions: np.ndarray, poses: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """The 15 estimated joints (n, 15, 3) [m], of a belief their mean; the parameters are as of `judge`.

        Needs `actions`, `poses` and `offsets`.
        """
        true, actions = true_joints(poses, offsets), self.scale.estimates(actions)
        return self._point(actions, self._joints_of(actions, true, poses, offsets))

    def close(self) -> None:
        """End the worker threads."""
        self._workers.close()

    def _joints_of(self, actions, true, poses, offsets) -> np.ndarray:
        """The 15 joints (n, k, 15, 3) [m] of estimates; k is 1, or the number of poses in a belief."""
        if self.form == "joints":
            if self._whole:
                return actions[:, None]
            said = true.copy()
            said[:, self._scored] = actions
            return said[:, None]
        said = (actions[:, None] if self.form == "pose" else actions)[..., : len(self._entries)]
        if not self._whole:
            whole = np.repeat(poses[:, None], said.shape[1], axis=1)
            whole[..., self._entries] = said
            said = whole
        joints = np.empty((*said.shape[:2], 15, 3))
        self._workers.share(lambda start, stop: joints_of(start, stop, said, offsets, joints), len(said))
        return joints

    def _point(self, actions: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """The mean (n, 15, 3) [m] of the joints (n, k, 15, 3) of estimates."""
        if self.form != "belief":
            return joints[:, 0]
        weights = np.exp(actions[..., -1] - actions[..., -1].max(axis=1, keepdims=True))
        weights /= weights.sum(axis=1, keepdims=True)
        return (weights[..., None, None] * joints).sum(axis=1)

    def _error(self, joints: np.ndarray, true: np.ndarray) -> np.ndarray:
        error = np.empty(len(joints))
        mean_distances(joints, true, error, _AS_IT_IS[0], _AS_IT_IS[1])
        return error if self._whole else error * (len(MARKERS) / len(self._scored))


def true_joints(poses: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """The joints (n, 15, 3) [m] of `poses` (n, 25) of bodies with `offsets` (n, 16, 3)."""
    joints = np.empty((len(poses), 1, 15, 3))
    joints_of(0, len(poses), poses[:, None], offsets, joints)
    return joints[:, 0]
