"""Baseline agents: lower and upper bounds for the tracking environments.

    >>> import gymnasium, motionenv.envs
    >>> from motionenv.envs.agents import Kalman, evaluate
    >>> env = gymnasium.make("motionenv/MarkerTracking-v1")
    >>> error = evaluate(env, Kalman(env), episodes=2, seed=1).errors.mean()  # [m] per joint

`MeanPose` ignores observations. `Kalman` filters 2D detections, and takes the rest from the mean pose; `Blob` does so
from the last frame alone. `Oracle` reads the ground truth. The others use only what agents may know: the spaces and,
for images, the camera. Poses are those of walking; beliefs have the spread of the population of walkers.
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
from motionenv.likelihoods.background import cluttered, foreground_probability, row_medians
from motionenv.likelihoods.pixel_history import PixelHistory
from motionenv.models.registry import load
from motionenv.models.types import Walker
from motionenv.types import POSE, Camera

_WALK = "walk/fpca"
_CYCLE = 64  # frames of a cycle over which poses are averaged
_REACHED = 20_000  # frames of reaching over which poses are averaged
_STANDING = 0.53  # pelvis height of a standing body, relative to body height
_SAMPLES = 400  # poses whose variance is that of markers
_SPREAD = 0.02  # [m, rad] standard deviation of the oracle's beliefs


class _Baseline:
    _actions: Actions

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._actions.env!r})"

    def reset(self, observation: Observation, began: np.ndarray | None = None) -> None:
        """Nothing to reset; see `Agent` for `observation` and `began`."""


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

    def act(self, observation: Observation) -> np.ndarray:
        """The mean pose; `observation` is ignored."""
        return self._actions.of(self._poses[None], self._joints[None])


class Kalman(_Baseline):
    """Kalman filters (Kalman 1960) of what detections show, and the mean pose for the rest.

    Markers: each coordinate in the picture is a constant of its own plus a damped oscillation at the rate of strides;
    depth is the mean pose's. Images: detections of the silhouette on the ground, as its feet and its height tell,
    correct a place that moves at a velocity that fades; the mean pose of walking is moved there and turned to where it
    goes. Who isn't detected is where the filter expects them. Settings were chosen on split "train".

    Args:
        env: the environment, single or vector, of markers, or whose images are masks, depths or rgb, or several.

    Raises:
        MotionError: ArmTracking, where silhouettes don't move, or an environment that shows the truth alone.
    """

    _remembers = True

    def __init__(self, env: Any) -> None:
        self._actions = Actions(env)
        name, world = type(self).__name__, self._actions.env.world
        if self._actions.arm:
            raise MotionError(f"{name} supports markers and walkers only: use another agent for ArmTracking")
        if self._actions.names == ["joints"]:
            raise MotionError(f"{name} looks at images or points, and this environment shows joints: use Oracle")
        self._poses = walking_poses(self._actions.samples)
        self._joints = markers(self._poses, from_height())
        seen = SeenPoints if self._actions.points else SeenWalkers
        self._look = seen(self._actions.n, world.fps, self._remembers)

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
        place, heading = self._look.at(seen, self._actions.far)
        poses, turn = np.tile(self._poses, (len(place), 1, 1)), np.zeros((len(place), 3, 3))
        turn[:, 0, 0] = turn[:, 1, 1] = np.cos(heading)
        turn[:, 0, 1], turn[:, 1, 0], turn[:, 2, 2] = np.sin(heading), -np.sin(heading), 1.0
        joints = self._joints @ turn[:, None]
        poses[..., 5] += heading[:, None]
        poses[..., :2] += place[:, None]
        joints[..., :2] += place[:, None, None]
        return self._actions.of(poses, joints)


class Blob(Kalman):
    """As `Kalman`, but from the last frame of `env` alone: of earlier ones it remembers only the empty scene.

    Raises:
        MotionError: as of `Kalman`.
    """

    _remembers = False


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
_MOVES = 0.2  # [m/s] least speed that tells a heading
_AREA = 0.45  # [m²] typical area of a silhouette
_CREDIBLE = 0.3, 2.0  # plausible range of a silhouette's area, relative to the typical one
_AGREE = 1.4  # ratio of the two distances above which feet or head are hidden
_UNSURE = 0.15  # standard deviation of a distance where they disagree, relative to it
_SURE = 0.9  # foreground probability above which a pixel before a plain wall counts
_PLAIN = 8  # first pictures of a plain wall, which tells more by its rows' colours than by its history
_SMALL = 12  # least pixels of a part of the foreground that may be somebody
_ASIDE = 0.12  # [m] standard deviation of a silhouette's centre from the root, across the line of sight
_START = 1.6, 1.0  # [m, m/s] standard deviation of where people start, and of their velocity
_FADES, _PUSHED = 1.5, 0.6  # [s] in which a velocity fades, and noise of accelerations [m/s²·√s]
_GATE = 9.0  # squared Mahalanobis distance above which a detection is of something else
_LOST = 5  # frames in a row in which all detections are of something else, after which the filter starts anew

_RATES = 2 * np.pi * np.array([0.95, 1.9])  # [rad/s] of markers' oscillations to the side and up: strides, and steps
_DAMPED = 2.0  # [s] in which an oscillation is forgotten
_BLUR = 0.015  # [m] standard deviation of a marker's position in a picture


class SeenPoints:
    """Kalman filters of the 2D points of `n` environments at `fps` [Hz]; without `remembers`, of each frame alone.

    The state of a coordinate: its constant, its oscillation [m], and the oscillation's quadrature [m]. Means and
    variances are those of walkers who walk in any direction.
    """

    def __init__(self, n: int, fps: float, remembers: bool = True) -> None:
        joints = markers(walking_poses(_SAMPLES), from_height())
        high, around = joints[..., 2], np.square(joints[..., :2]).mean(0) / 2  # forward and left, seen from anywhere
        self._mean = np.stack([np.zeros(15), high.mean(0)], axis=-1)
        self._start = np.zeros((15, 2, 3, 3))
        self._start[..., 0, 0] = np.stack([around[:, 1] + _BLUR**2, (high.mean(0) * _TALL / _HEIGHT) ** 2], -1)
        self._start[..., 1, 1] = self._start[..., 2, 2] = np.stack([around.sum(-1), high.var(0)], -1)
        kept, angle = np.exp(-1 / (fps * _DAMPED)), _RATES / fps
        self._move = np.zeros((2, 3, 3))
        self._move[:, 0, 0] = 1.0
        self._move[:, 1, 1] = self._move[:, 2, 2] = kept * np.cos(angle)
        self._move[:, 1, 2], self._move[:, 2, 1] = kept * np.sin(angle), -kept * np.sin(angle)
        self._noise = (1 - kept**2) * self._start * np.diag([0.0, 1.0, 1.0])
        self._states, self._spread = np.zeros((n, 15, 2, 3)), np.tile(self._start, (n, 1, 1, 1, 1))
        self._remembers = remembers

    def forget(self, began: np.ndarray) -> None:
        self._states[began], self._spread[began] = 0.0, self._start

    def at(self, points: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """Current positions of the points (n, 15, 2), given those that are seen (n, 15)."""
        if not self._remembers:
            self.forget(np.ones(len(points), bool))
        spread, read = self._spread, np.array([1.0, 1.0, 0.0])
        covers = spread @ read
        gain = covers / (covers @ read + _BLUR**2)[..., None] * (seen > 0)[..., None, None]
        off = np.where(seen[..., None] > 0, points - self._mean - self._states @ read, 0.0)
        states = self._states + gain * off[..., None]
        spread = spread - gain[..., :, None] * covers[..., None, :]
        self._states = np.einsum("cij,nmcj->nmci", self._move, states)
        self._spread = self._move @ spread @ np.swapaxes(self._move, -1, -2) + self._noise
        return self._mean + states @ read


class SeenWalkers:
    """Kalman filters of the positions and velocities of walkers on the ground, from their silhouettes.

    Args:
        n, fps: number of environments, and their frame rate [Hz].
        remembers: whether more than the current frame counts.
    """

    def __init__(self, n: int, fps: float, remembers: bool = True) -> None:
        self._remembers, dt, both = remembers, 1 / fps, np.eye(2)
        self._cameras: list[Camera | None] = [None] * n
        self._scenes = [PixelHistory() for _ in range(n)]
        kept = np.exp(-dt / _FADES)
        self._move = np.kron([[1.0, dt], [0.0, kept]], both)
        self._noise = _PUSHED**2 * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], both)
        self._start = np.diag(np.repeat(_START, 2) ** 2)
        self._states, self._spread = np.zeros((n, 4)), np.tile(self._start, (n, 1, 1))
        self._missed = np.zeros(n, int)

    def forget(self, began: np.ndarray, cameras: Sequence[Camera]) -> None:
        for slot, camera in zip(np.flatnonzero(began), cameras, strict=True):
            self._cameras[slot], self._scenes[slot] = camera, PixelHistory()
        self._states[began], self._spread[began], self._missed[began] = 0.0, self._start, 0

    def at(self, pictures: dict[str, np.ndarray], far: float) -> tuple[np.ndarray, np.ndarray]:
        """The walkers' x and y (n, 2) [m], and their headings (n,) [rad], 0 while unknown.

        `pictures` are "mask", "depth" or "rgb" by name, each (n, height, width, channels), with a background at depth
        `far` [m].
        """
        if not self._remembers:
            self._states[:], self._spread[:] = 0.0, self._start
        for slot in range(len(self._states)):
            if "mask" in pictures:
                foreground = pictures["mask"][slot, ..., 0] > 0
            elif "depth" in pictures:
                foreground = pictures["depth"][slot, ..., 0] < far
            else:
                foreground = self._foreground(slot, pictures["rgb"][slot])
            self._correct(slot, foreground)
        place, velocity = self._states[:, :2].copy(), self._states[:, 2:].copy()
        self._states = self._states @ self._move.T
        self._spread = self._move @ self._spread @ self._move.T + self._noise
        return place, np.where(np.hypot(*velocity.T) > _MOVES, np.arctan2(velocity[:, 1], velocity[:, 0]), 0.0)

    def _foreground(self, slot: int, rgb: np.ndarray) -> np.ndarray:
        """Where (height, width) a picture `rgb` (height, width, 3) shows something before the scene."""
        seen = self._scenes[slot].observe(rgb) > 0.5
        if self._scenes[slot].frames > _PLAIN or cluttered(rgb):
            return seen
        return foreground_probability(rgb, row_medians(rgb)) > _SURE

    def _correct(self, slot: int, foreground: np.ndarray) -> None:
        """Correct the state by the likeliest detection in a `foreground` (height, width), if it is credible."""
        camera, spread = self._cameras[slot], self._spread[slot]
        assert camera is not None, "call forget() first"
        best: tuple[float, np.ndarray, np.ndarray] | None = None
        found = detections(camera, foreground)
        for place, noise in found:
            off, precise = place - self._states[slot, :2], np.linalg.inv(spread[:2, :2] + noise)
            away = float(off @ precise @ off)
            cost = away - np.linalg.slogdet(precise)[1]
            if away < _GATE and (best is None or cost < best[0]):
                best = cost, off, spread[:, :2] @ precise
        self._missed[slot] = 0 if best else self._missed[slot] + bool(found)
        if best is not None:
            _, off, gain = best
            self._states[slot] += gain @ off
            self._spread[slot] = spread - gain @ spread[:2]
        elif self._missed[slot] > _LOST:
            self._states[slot], self._spread[slot], self._missed[slot] = 0.0, self._start, 0


def detections(camera: Camera, foreground: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Where people may stand, x and y (2,) [m], and covariances (2, 2) [m²], as a foreground (height, width) shows.

    Parts of the `foreground` that touch count, and all of it together, as something thin may stand before somebody; the
    `camera` is as of `walker_at`. Left out is what is too small or too large for a person.
    """
    from scipy.ndimage import label

    parts, count = label(foreground, np.ones((3, 3)))
    found = []
    for part in [foreground, *(parts == k for k in range(1, count + 1) if count > 1)]:
        size = float(part.sum())
        if size < _SMALL:
            continue
        columns, rows = part.sum(0), part.sum(1).cumsum()
        column = float(columns @ np.arange(len(columns)) / size)
        top, bottom = (float(np.searchsorted(rows, share * size)) for share in (0.01, 0.99))
        place, depth, spread = walker_at(camera, column, top - 0.5, bottom + 0.5)
        usual = _AREA * (camera.K[1, 1] / depth) ** 2
        if _CREDIBLE[0] * usual < size < _CREDIBLE[1] * usual:
            forward = camera.R[2, :2]
            found.append((place, _ASIDE**2 * np.eye(2) + spread**2 * np.outer(forward, forward)))
    return found


def walker_at(camera: Camera, column: float, top: float, bottom: float) -> tuple[np.ndarray, float, float]:
    """Where somebody stands, x and y (2,) [m], the distance along the camera's axis, and its standard deviation [m].

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
    spread = depth * (precise.sum() ** -0.5 if agree else _UNSURE)
    return camera.centre[:2] + depth * (camera.R.T @ ray)[:2], depth, float(spread)
