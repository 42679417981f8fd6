"""A database of motion (paper C, section 4): concatenated sequences of poses at 30 frames/s, with labels.

A motion to continue is scaled to its body (`recent_frames`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.body.gaps import listed, missing_parts
from motionenv.body.skeleton import NODES, mirror
from motionenv.errors import MotionError
from motionenv.models.motion_tree.features import FPS, WINDOW, parameters
from motionenv.models.transforms import resample
from motionenv.types import Motion, Skeleton, frozen

_LEG = [NODES.index(n) for n in ("left_knee", "left_ankle", "right_knee", "right_ankle")]


@dataclass(frozen=True, eq=False, repr=False)
class Clip(OneLine):
    """A `motion` of one sequence (frames, 25), its `name` or file, its `activity` and the label of its `person`."""

    motion: Motion
    name: str = ""
    activity: str = ""
    person: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Database(OneLine):
    """Concatenated sequences of poses of one body.

    Attributes:
        poses: (frames, 25) [m, rad], float32. Each sequence starts at the world's origin, heading along x, with lengths
            scaled to the legs of `skeleton`.
        starts: (sequences + 1,) first frame of each sequence, then the number of frames.
        clips, activities, persons: labels of each sequence.
        mirrored: (sequences,) whether the sequence is the left-right mirror image of its clip.
        skeleton: the body.
    """

    poses: np.ndarray
    starts: np.ndarray
    clips: tuple[str, ...]
    activities: tuple[str, ...]
    persons: tuple[str, ...]
    mirrored: np.ndarray
    skeleton: Skeleton

    @cached_property
    def windows(self) -> np.ndarray:
        """Last frame (n,) of every window of ten frames that has a successor in its sequence."""
        spans = [np.arange(a + WINDOW - 1, b - 1) for a, b in zip(self.starts[:-1], self.starts[1:], strict=True)]
        return np.concatenate(spans).astype(np.int32)

    def sequence_of(self, frames: ArrayLike) -> np.ndarray:
        """Index (...) of the sequence of each of `frames` (...)."""
        return np.searchsorted(self.starts, frames, side="right") - 1

    def motion(self, sequence: int) -> Motion:
        """One `sequence`, by its index, as a motion at 30 frames/s; raises MotionError if there is none."""
        if not 0 <= sequence < len(self.clips):
            raise MotionError(f"sequence must be from 0 to {len(self.clips) - 1}, got {sequence!r}")
        part = self.poses[self.starts[sequence] : self.starts[sequence + 1]]
        return Motion(part, self.skeleton, 30.0, self.clips[sequence])


def build_database(
    clips: Iterable[Clip], *, skeleton: Skeleton | None = None, mirrored: bool = False,
    on_short: Callable[[str], None] = lambda name: None,
) -> Database:  # fmt: skip
    """Build a database from clips. Poses are spooled to a temporary file, so that memory holds one clip at a time.

    Args:
        clips: motions at any frame rate; a gap (NaN) splits a clip into sequences.
        skeleton: the database's body; None takes the first clip's.
        mirrored: also include the left-right mirror image of every clip.
        on_short: called with the name of each clip without 11 contiguous frames at 30 frames/s (a window of ten and its
            successor).

    Raises:
        MotionError: no clip is long enough.
    """
    starts, labels, short = [0], [], ""
    with tempfile.TemporaryFile() as spool:
        for clip in clips:
            skeleton = skeleton or clip.motion.skeleton
            stretches = [s for s in resample(clip.motion) if len(s) > WINDOW]
            if not stretches:
                missing = missing_parts(clip.motion.poses)
                short = f"{clip.name!r}" + (f", which doesn't show {listed(missing)}: fill it first" if missing else "")
                on_short(clip.name)
            scale = leg_length(skeleton) / leg_length(clip.motion.skeleton)
            for stretch, flipped in product(stretches, (False, True) if mirrored else (False,)):
                spool.write(_from_origin(mirror(stretch) if flipped else stretch, scale).tobytes())
                starts.append(starts[-1] + len(stretch))
                labels.append((clip.name, clip.activity, clip.person, flipped))
        if not labels or skeleton is None:
            raise MotionError(
                f"a database needs clips of at least {WINDOW + 1} frames at 30 frames/s (a window of {WINDOW} and its "
                "successor); there are " + (f"only shorter ones, the last {short}" if short else "no clips at all")
            )
        spool.flush()
        poses = np.asarray(np.memmap(spool, np.float32, "r", shape=(starts[-1], 25)))
    names, activities, persons, flags = zip(*labels, strict=True)
    return Database(poses, np.array(starts), names, activities, persons, np.array(flags), skeleton)


def _from_origin(poses: np.ndarray, scale: float) -> np.ndarray:
    """Poses (frames, 25) moved so that the first is at the origin and heads along x, with lengths times `scale`."""
    c, s = np.cos(poses[0, 5]), np.sin(poses[0, 5])
    away = (poses[:, :2] - poses[0, :2]) @ np.array([[c, -s], [s, c]])
    moved = poses.copy()
    moved[:, :2] = away * scale
    moved[:, 2] *= scale
    moved[:, 5] -= poses[0, 5]
    return moved.astype(np.float32)


def leg_length(skeleton: Skeleton) -> float:
    """Length of the legs of `skeleton` [m], hip to ankle, the mean of both."""
    return float(np.linalg.norm(skeleton.offsets[_LEG], axis=1).sum() / 2)


@dataclass(frozen=True, eq=False)
class Recent:
    """A history scaled to the database's body."""

    parameters: np.ndarray  # (..., 10, 50) parameters of the last ten frames
    last: np.ndarray  # (..., 25) the last pose
    scale: float  # factor from the history's lengths to the database's


#: What went before: a motion, or its poses (..., frames, 25).
History = Motion | np.ndarray


def recent_frames(history: History, database: Database) -> Recent:
    """Parameters of a history's last frames, (..., frames, 25) at 30 frames/s, scaled to the body of a database.

    Raises:
        MotionError: fewer than ten frames, another shape or rate, or NaN.
    """
    poses, scale = _checked(history, database)
    if scale != 1.0:
        poses = poses.copy()
        poses[..., :3] *= scale
    return Recent(parameters(poses)[..., -WINDOW:, :], poses[..., -1, :], scale)


def _checked(history, database: Database) -> tuple[np.ndarray, float]:
    """The last frames (..., 10 to 12, 25) of a history, and the factor from its lengths to the database's."""
    scale = 1.0
    if isinstance(history, Motion):
        if not np.isclose(history.fps, FPS, rtol=1e-6):
            raise MotionError(
                f"history must be at {FPS:g} frames/s, got {history.fps:g}: see motionenv.models.motion_tree.resample"
            )
        scale = leg_length(database.skeleton) / leg_length(history.skeleton)
        history = history.poses
    poses = frozen(history, (..., None, 25), "history")
    if poses.shape[-2] < WINDOW:
        raise MotionError(f"history must have shape (..., {WINDOW} or more frames, 25), got {poses.shape}")
    recent = poses[..., -WINDOW - 2 :, :]
    if not np.isfinite(recent).all():
        raise MotionError(
            f"history has NaN or infinite values in its last {recent.shape[-2]} frames: fill the gap or start after it"
        )
    return recent, scale
