"""Action spaces and scoring: a pose, joints, or a belief, and its distance from the ground truth."""

import math
from collections.abc import Sequence

import numpy as np
from gymnasium import spaces

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_whole
from motionenv.body.joints_kernel import joints_of
from motionenv.errors import MotionError
from motionenv.metrics import energy_score
from motionenv.metrics.joint_kernel import mean_distances
from motionenv.types import MARKERS, POSE

#: Allowed values of `estimate`.
FORMS = ("pose", "joints", "belief")
#: Bounds of an estimate's positions [m], angles [rad], and log weights.
FAR, TURNED, LOG_WEIGHT = 100.0, 4 * math.pi, 100.0


class Estimates:
    """Estimates of a part of the body, in one of three forms.

    A pose is applied to the true body, so that its error consists of angles and position only. Other entries and joints
    are taken from the ground truth.

    Args:
        form: "pose" (entries of the pose vector), "joints" (k, 3) positions [m], or "belief" (n_belief, entries + 1)
            weighted poses, each followed by its log weight.
        n_belief: number of poses in a belief.
        entries: indices into `POSE` that a pose contains; None is all.
        joints: indices into `MARKERS` that are scored; None is all.
        threads: for scoring beliefs.
    """

    def __init__(
        self,
        form: str,
        n_belief: int = 64,
        *,
        entries: Sequence[int] | None = None,
        joints: Sequence[int] | None = None,
        threads: int | None = 1,
    ):
        if form not in FORMS:
            raise MotionError(f"estimate must be one of {', '.join(FORMS)}, got {form!r}")
        n_belief = checked_whole(n_belief, "n_belief", 1, 4096, "poses")
        self.form = form
        self._entries = list(range(len(POSE)) if entries is None else entries)
        self._scored = list(range(len(MARKERS)) if joints is None else joints)
        self._whole = entries is None and joints is None
        self._workers = Workers(threads, "estimates")
        bounds = np.array([FAR if i < 3 else TURNED for i in self._entries], np.float32)
        high = {
            "pose": bounds,
            "joints": np.full((len(self._scored), 3), FAR, np.float32),
            "belief": np.tile(np.append(bounds, np.float32(LOG_WEIGHT)), (n_belief, 1)),
        }[form]
        self.space: spaces.Box = spaces.Box(-high, high, dtype=np.float32)

    def judge(self, actions: np.ndarray, poses: np.ndarray, offsets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean error per scored joint (n,) [m], and reward (n,).

        The reward is minus that error. For a belief, the error is that of its mean, and the reward is minus the energy
        score divided by √joints, which makes it comparable with an error per joint.

        Args:
            actions: (n, ...) of `space`, float64.
            poses: (n, 25), true poses.
            offsets: (n, 16, 3) [m], of the true bodies.
        """
        true = _true_joints(poses, offsets)
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
        """The 15 estimated joints (n, 15, 3) [m]; for a belief their mean.

        Args:
            actions: (n, ...) of `space`, float64.
            poses: (n, 25), true poses.
            offsets: (n, 16, 3) [m], of the true bodies.
        """
        true = _true_joints(poses, offsets)
        return self._point(actions, self._joints_of(actions, true, poses, offsets))

    def close(self) -> None:
        """Stop the threads; they restart when needed."""
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
        """Mean distance (n,) [m] over the scored joints; the other joints are equal."""
        error = np.empty(len(joints))
        mean_distances(joints, true, error)
        return error if self._whole else error * (len(MARKERS) / len(self._scored))


def _true_joints(poses: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """The joints (n, 15, 3) [m] of poses (n, 25)."""
    joints = np.empty((len(poses), 1, 15, 3))
    joints_of(0, len(poses), poses[:, None], offsets, joints)
    return joints[:, 0]
