"""Groups of walkers: the motion from which the samples of a data set are cut.

A group of `WALKERS` walkers is made at once, from random numbers that depend on the seed and the group's number alone.
Each is a recording with its phase and the contacts of its feet; a sample shows a stretch of one of them.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from motionenv._core.runs import runs
from motionenv.body import LIMBS, feet, limb_segments
from motionenv.body.joints_kernel import joints_of
from motionenv.data.specification import Specification
from motionenv.errors import MotionError
from motionenv.models.base import GaitModel
from motionenv.models.paths import bend, random_path
from motionenv.models.registry import gait_model
from motionenv.types import MARKERS, POSE, SPEED_RANGE, Motion, Skeleton

#: Walkers in a group.
WALKERS = 16
#: Independent streams of random numbers, so that a change of one part leaves the others as they are.
MOTION, VIEW, SCENERY, PASSERS, DETECTOR, LIGHT, CLOTHES = range(7)

#: Index of the pelvis among the joints.
PELVIS = MARKERS.index("pelvis")

_BEFORE = 1.8  # [s] before and after what is shown, so that its phase lies between two that are seen
_SPARE = 2.0  # [s], more than a stride, in which a sample begins
_LOW, _SLOW = 0.02, 0.5  # [m], [m/s]: an end of a foot that is lower and slower than this is on the ground
_ROOM = 2.0  # [m] of a path beyond the walk
_LEAN = 0.5  # [s²/m] least radius of a turn, over squared speed: the body leans by 12° there
_HEADING = POSE.index("root_heading")
_FEET = [LIMBS.index("left_foot"), LIMBS.index("right_foot")]


@dataclass(frozen=True, eq=False)
class RecordedWalk:
    """A walker in motion.

    Attributes:
        poses: (frames, 25) [m, rad], on the ground z = 0.
        skeleton: the body.
        phase: (frames,) [cycles] from 0 to 1; at 0 the left leg is furthest ahead of the right (paper A, section 3.3).
        contact: (frames, 2) whether the left and the right foot are on the ground.
    """

    poses: np.ndarray
    skeleton: Skeleton
    phase: np.ndarray
    contact: np.ndarray


def generator(seed: int, number: int, stream: int) -> np.random.Generator:
    """The random numbers of one `stream` (`MOTION`, `VIEW`, ...) of the group or sample `number` of a set's `seed`."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream, number)))


def frames_of(spec: Specification) -> tuple[int, int, int]:
    """Frames of a recording, and the first and last of the frames with which a sample of `spec` may begin."""
    before, spare = round(_BEFORE * spec.fps), round(_SPARE * spec.fps)
    return before + spare + spec.clip + before, before, before + spare


def record(spec: Specification, group: int, stream: int = MOTION) -> list[RecordedWalk]:
    """The recordings of a group, by its number; `stream` is `MOTION`, or `PASSERS` for the people who pass by.

    Raises:
        ModelError: no such model.
        MotionError: a model that doesn't walk steadily.
    """
    rng, people = generator(spec.seed, group, stream), spec.people
    model = _model(people.models[int(rng.integers(len(people.models)))])
    if not model.steady:
        raise MotionError(
            f"people.models takes models that walk steadily, such as walk/fpca; a {model.kind} model doesn't"
        )
    heights = [None] * WALKERS if people.height is None else rng.uniform(*people.height, WALKERS).tolist()
    drawn = rng.uniform(*(people.speed or SPEED_RANGE[:2]), WALKERS).tolist()
    speeds = [None] * WALKERS if people.speed is None else drawn
    seconds = frames_of(spec)[0] / spec.fps
    made = model.synthesize_batch(seconds, spec.fps, heights=heights, speeds=speeds, person=people.person, seed=rng)
    turning = rng.random(WALKERS) < people.turning
    courses = rng.integers(2**63, size=WALKERS)
    return [
        _recording(motion, people.radius if turns else None, int(course))
        for motion, turns, course in zip(made, turning, courses, strict=True)
    ]


@lru_cache(maxsize=8)
def _model(name: str) -> GaitModel:
    """The model of a name or file, read once in a process: a tenth of what a group takes."""
    return gait_model(name)


def _recording(motion: Motion, radius: float | None, course: int) -> RecordedWalk:
    """A straight walk as a recording, bent along a random path of `course` if there is a least `radius` [m]."""
    phase = phases(motion)
    if radius is not None:
        length = float(np.ptp(motion.poses[:, 0])) + _ROOM
        fast = (length - _ROOM) * motion.fps / len(motion.poses)
        path = random_path(np.random.default_rng(course), length, radius=max(radius, _LEAN * fast**2))
        motion = bend(motion, path)
    return RecordedWalk(motion.poses, motion.skeleton, phase, contacts(motion))


def phases(motion: Motion) -> np.ndarray:
    """Phase (frames,) [cycles] of a straight walk along x, from 0 to 1; a MotionError for less than a stride.

    It is 0 where the left ankle is furthest ahead of the right one, to a part of a frame, and linear in between; beyond
    the first and the last such moment it goes on at the same rate.
    """
    ankles = feet(motion.poses, motion.skeleton)[0][..., 0]
    ahead = ankles[:, 0] - ankles[:, 1]
    whole = [(first, end) for first, end in runs(ahead > 0.5 * ahead.max()) if 0 < first and end < len(ahead)]
    tops = [_summit(ahead, first + int(np.argmax(ahead[first:end]))) for first, end in whole]
    if len(tops) < 2:
        raise MotionError(f"{motion.name or 'the walk'} is too slow for a phase: raise people.speed")
    frames = np.arange(len(ahead))
    cycles = np.interp(frames, tops, np.arange(len(tops)))
    first, last = tops[1] - tops[0], tops[-1] - tops[-2]
    cycles = np.where(frames < tops[0], (frames - tops[0]) / first, cycles)
    cycles = np.where(frames > tops[-1], (frames - tops[-1]) / last, cycles)
    return cycles % 1.0


def _summit(values: np.ndarray, frame: int) -> float:
    """Vertex [frames] of the parabola through a maximum at `frame` and its neighbours."""
    before, here, after = values[frame - 1 : frame + 2]
    curved = before - 2 * here + after
    return frame + (0.5 * (before - after) / curved if curved < 0 else 0.0)


def contacts(motion: Motion) -> np.ndarray:
    """Whether left and right foot of a `motion` are on the ground, (frames, 2): heel or toe is low and at rest."""
    ends = limb_segments(motion.poses, motion.skeleton)[:, _FEET]  # (frames, 2 feet, heel and toe, 3)
    lowest = ends[..., 2] - motion.skeleton.radii[_FEET]
    speed = np.linalg.norm(np.gradient(ends[..., :2], axis=0), axis=-1) * motion.fps
    return ((lowest < _LOW) & (speed < _SLOW)).any(axis=-1)


def shown(recordings: list[RecordedWalk], who: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, ...]:
    """Poses (n, frames, 25), and offsets, radii and heights of the bodies of recordings `who` (n,) at `frames`."""
    bodies = [r.skeleton for r in recordings]
    poses = np.stack([r.poses for r in recordings])[who[:, None], frames]
    offsets, radii = np.stack([b.offsets for b in bodies]), np.stack([b.radii for b in bodies])
    return poses, offsets[who], radii[who], np.array([b.height for b in bodies])[who]


def mean_heading(poses: np.ndarray) -> np.ndarray:
    """Mean heading (n,) [rad] of poses (n, frames, 25)."""
    return np.arctan2(np.sin(poses[..., _HEADING]).mean(axis=1), np.cos(poses[..., _HEADING]).mean(axis=1))


def turned(poses: np.ndarray, angle: np.ndarray) -> None:
    """Turn poses (n, frames, 25) about the vertical through the origin by `angle` (n,) [rad], in place."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = poses[..., 0].copy(), poses[..., 1]
    poses[..., 0], poses[..., 1] = c * x - s * y, s * x + c * y
    poses[..., _HEADING] += angle[:, None]


def joints_in(poses: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Joints (n, frames, 15, 3) [m] of poses (n, frames, 25) of bodies with `offsets` (n, 16, 3) [m]."""
    joints = np.empty((*poses.shape[:2], 15, 3))
    joints_of(0, len(poses), np.ascontiguousarray(poses), np.ascontiguousarray(offsets), joints)
    return joints
