"""A walk as what its feet do, and the poses whose legs do it."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from motionenv._core.rotations import to_euler, unwrap_euler
from motionenv._core.runs import runs
from motionenv.body.kinematics import feet, forward
from motionenv.body.skeleton import NODES, SEGMENTS
from motionenv.errors import GapError, MotionError
from motionenv.types import POSE, Motion, Skeleton

HIPS = [POSE.index("left_hip_flexion"), POSE.index("right_hip_flexion")]
_SIGNS = np.array([[-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])  # of the hip's angles, left and right
_HIP_NODES = [NODES.index("left_hip"), NODES.index("right_hip")]
_KNEE_NODES = [NODES.index("left_knee"), NODES.index("right_knee")]
_ANKLE_NODES = [NODES.index("left_ankle"), NODES.index("right_ankle")]
_SHINS = [SEGMENTS.index("left_shin"), SEGMENTS.index("right_shin")]
_STANDS = (0.15, 0.2)  # [m/s], and share of the walk's speed, below which a ball on the floor rests
_BRIEF = 0.1  # [s] for which a foot stands at least
_LANDS = 0.012  # [s] standard deviation of the smoothing of feet that land and leave
_SHIFTS = 0.05  # [s] the same of the weight between the feet
_STRIDES = 0.45  # [s] the same of the way and the speed, over which steps even out
_STRAIGHT = 0.9998  # greatest distance from hip to ankle, as a share of the leg: the knee is bent by 2.3°
_HEEL = 0.05  # body heights by which the heel of a foot behind the body rises more than in the walk, if it must
_BEHIND = 0.1  # body heights
_SOFT = 0.0015  # [m] over which legs come to be straight, and too short ones lower the body
_YIELDS = 0.04  # [s] standard deviation of the smoothing of that lowering, before and after the leg that is too short
_ROUNDS = 4  # in which feet that follow their shins come to be where they should


@dataclass(frozen=True, eq=False)
class Steps:
    """A walk: the body's poses, and what its feet do beside."""

    poses: np.ndarray  # (frames, 25); hips, knees and root height hold no more than a first guess
    balls: np.ndarray  # (frames, 2, 2) [m] of the feet, left then right; constant while a foot stands
    ankles: np.ndarray  # (frames, 2) heights [m]
    yaws: np.ndarray  # (frames, 2) directions of the feet [rad]
    reach: np.ndarray  # (frames, 2) [m] from hip to ankle of a leg that carries the body
    stands: np.ndarray  # (frames, 2) bool
    fps: float

    @property
    def speed(self) -> np.ndarray:
        """Speed (frames,) [m/s] along x, smoothed over steps."""
        return smooth(np.gradient(self.poses[:, 0]) * self.fps, _STRIDES * self.fps)


def steps_of(motion: Motion) -> Steps:
    """The steps of a straight walk (frames, 25) along x, each standing foot put where it stands on average.

    Raises:
        MotionError: not one motion, or shorter than two frames.
        GapError: unknown legs or root.
    """
    if motion.poses.ndim != 2 or len(motion.poses) < 2:
        raise MotionError(f"a path takes one motion of two frames or more, (frames, 25), got {motion.poses.shape}")
    if not np.isfinite(motion.poses[:, [*range(6), *range(HIPS[0], 25)]]).all():
        raise GapError("a path takes motions with a known root and legs: fill the gaps first (motionenv.fill)")
    nodes, rotations = forward(motion.poses, motion.skeleton)
    balls = feet(motion.poses, motion.skeleton)[1][..., :2].copy()
    across = rotations[..., 1][:, _SHINS]
    ankles = nodes[:, _ANKLE_NODES]
    yaws = np.unwrap(np.arctan2(-across[..., 0], across[..., 1]), axis=0)
    yaws -= 2 * np.pi * np.round(yaws[0] / (2 * np.pi))
    reach = np.linalg.norm(ankles - nodes[:, _HIP_NODES], axis=-1)
    poses = motion.poses.copy()
    even = even_way(poses[:, :2], _STRIDES * motion.fps)
    # Walks drift to a side; a shear of the ground makes them straight, and feet that stand stay where they are.
    drift = lambda x: np.interp(x, even[:, 0], even[:, 1])
    turn = np.arctan2(np.gradient(even[:, 1]), np.maximum(np.gradient(even[:, 0]), 1e-3))
    poses[:, 1] -= drift(poses[:, 0])
    balls[..., 1] -= drift(balls[..., 0])
    poses[:, POSE.index("root_heading")] -= turn
    found = Steps(poses, balls, ankles[..., 2], yaws - turn[:, None], reach, np.zeros(yaws.shape, bool), motion.fps)
    limit = _STANDS[0] + _STANDS[1] * np.abs(found.speed)
    for side in range(2):
        pace = np.linalg.norm(np.gradient(smooth(balls[:, side], _LANDS * found.fps), axis=0), axis=-1) * found.fps
        for first, stop in runs(pace < limit):
            if stop - first >= _BRIEF * found.fps:
                found.stands[first:stop, side] = True
        _plant(balls[:, side], found.stands[:, side], found.fps)
    return found


def even_way(root: np.ndarray, width: float) -> np.ndarray:
    """The way of a root (frames, 2) [m] without its sway, smoothed over `width` [frames]; x doesn't go back."""
    line = np.linspace(0.0, 1.0, len(root))[:, None] * (root[-1] - root[0])
    even = smooth(root - line, width) + line
    return np.column_stack([np.maximum.accumulate(even[:, 0]), even[:, 1]])


def _plant(ball: np.ndarray, stands: np.ndarray, fps: float) -> None:
    """Keep a ball (frames, 2) in place wherever it stands, and move its swings so that they lead there."""
    if not stands.any():
        return
    shift = np.zeros_like(ball)
    for first, stop in runs(stands):
        shift[first:stop] = ball[first:stop].mean(axis=0) - ball[first:stop]
    frames, known = np.arange(len(ball)), np.flatnonzero(stands)
    for axis in range(2):
        ball[:, axis] += np.interp(frames, known, shift[known, axis])
    ball[:] = smooth(ball, _LANDS * fps)


def posed(steps: Steps, skeleton: Skeleton) -> np.ndarray:
    """Poses (frames, 25) whose feet are where the steps say, with limbs as long as the skeleton's.

    The body is as high as the legs that carry it say, and low enough for both to reach the ground; the heel of the one
    behind rises for that. Each leg is solved
    in closed form: the knee by the cosine rule, the hip by the plane in which the leg bends, which is that of its foot.
    """
    poses = steps.poses.copy()
    thigh, shin = (-skeleton.offsets[nodes, 2] for nodes in (_KNEE_NODES, _ANKLE_NODES))
    ahead = np.stack([np.cos(steps.yaws), np.sin(steps.yaws)], axis=-1)
    before, balls = (a[..., :2] for a in feet(poses, skeleton))
    toes = np.linalg.norm(balls - before, axis=-1)
    ankles = np.concatenate([steps.balls - toes[..., None] * ahead, steps.ankles[..., None]], axis=-1)
    weight = _weights(steps)
    for i in range(_ROUNDS):
        nodes, rotations = forward(poses, skeleton)
        apart = ankles - nodes[:, _HIP_NODES]
        level = (apart[..., :2] ** 2).sum(-1)
        wanted, most = (
            np.sqrt(np.maximum(length**2 - level, 1e-4)) + apart[..., 2]
            for length in (steps.reach, _STRAIGHT * (thigh + shin))
        )
        wanted = (weight * wanted).sum(-1)
        behind = -(apart[..., :2] * ahead).sum(-1) / (_BEHIND * skeleton.height)
        heel = _HEEL * skeleton.height * np.clip(behind, 0.0, 1.0)
        short = wanted - _least(np.concatenate([wanted[:, None], most + heel], axis=-1))
        width = _YIELDS * steps.fps
        lift = wanted - smooth(maximum_filter1d(short, 2 * round(width) + 1), width)
        poses[:, 2] += lift
        rise = np.maximum(lift[:, None] - most, 0.0)
        apart[..., 2] += rise - lift[:, None]
        for side in range(2):
            turn = _leg(apart[:, side], ahead[:, side], thigh[side], shin[side])
            local = rotations[:, 0].swapaxes(-1, -2) @ turn[0]
            at = HIPS[side]
            angles = to_euler("YXZ", local)
            last = i == _ROUNDS - 1  # before, which of the angles of a rotation they are makes no difference
            poses[:, at : at + 3] = (unwrap_euler(angles) if last else angles) * _SIGNS[side]
            poses[:, at + 3] = turn[1]
        ankles[..., :2] += steps.balls - feet(poses, skeleton)[1][..., :2]
    return poses


def _leg(apart, ahead, thigh: float, shin: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation of the thigh (frames, 3, 3) and the knee's flexion (frames,) [rad] of a leg of such lengths [m].

    From hip to ankle it goes `apart` (frames, 3) [m], and its foot points `ahead` (frames, 2).
    """
    length = np.linalg.norm(apart, axis=-1, keepdims=True)
    up = -apart / length
    # Softly, because a knee that comes to its end at once would stop at once.
    spare = (thigh + shin - length[:, 0]) / _SOFT
    length = thigh + shin - _SOFT * np.logaddexp(0.0, spare)
    across = np.stack([-ahead[:, 1], ahead[:, 0], np.zeros(len(ahead))], axis=-1)
    across[:, 2] = -(across * up).sum(-1) / np.where(np.abs(up[:, 2]) > 1e-6, up[:, 2], 1e-6)
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    front = np.cross(across, up)
    cosine = lambda a, b, c: np.clip((a**2 + b**2 - c**2) / (2 * a * b), -1.0, 1.0)
    knee = np.pi - np.arccos(cosine(thigh, shin, length))
    swing = np.arccos(cosine(thigh, length, shin))[:, None]
    along = np.cos(swing) * up - np.sin(swing) * front
    return np.stack([np.cross(across, along), across, along], axis=-1), knee


def _weights(steps: Steps) -> np.ndarray:
    """Share of the body's weight on each leg (frames, 2)."""
    share = smooth(steps.stands + 1e-3, _SHIFTS * steps.fps)
    return share / share.sum(-1, keepdims=True)


def _least(values: np.ndarray) -> np.ndarray:
    """The smooth minimum (frames,) of values (frames, n) [m], nowhere above it."""
    least = values.min(-1, keepdims=True)
    return least[:, 0] - _SOFT * np.log(np.exp((least - values) / _SOFT).sum(-1))


def smooth(values: np.ndarray, width: float) -> np.ndarray:
    """`values` (frames, ...) smoothed over time by a Gaussian of standard deviation `width` [frames]."""
    return gaussian_filter1d(np.asarray(values, dtype=np.float64), width, axis=0, mode="nearest")
