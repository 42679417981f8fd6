"""Sources of an episode's motion: walkers drawn from a model, or captured people.

A source holds recordings; each episode shows a segment that starts at a random time. A model's recordings are those of
`WALKERS` walkers per split, made when first needed from seeds that depend only on split and index; all environments of
a process with equal sources share them. Captured people belong permanently to one split: those whose label hashes to a
multiple of `EVAL_SHARE` are for evaluation. With a seed, a model's motion is the one that `motionenv.synthesize` makes
with that seed, in every episode.
"""

import zipfile
import zlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from motionenv._core.validation import (
    checked_choice,
    checked_fps,
    checked_number,
    checked_range,
    checked_whole,
    did_you_mean,
)
from motionenv.body.gaps import PARTS, check_shown
from motionenv.body.limbs import resized
from motionenv.errors import MotionError
from motionenv.mocap.units_axes import metres_per
from motionenv.models.registry import gait_model, names
from motionenv.models.synthesis import synthesize
from motionenv.models.transforms import resample
from motionenv.types import FPS_RANGE, HEIGHT_RANGE, PEOPLE, SECONDS_MOST, SPEED_RANGE, Motion, Skeleton

#: Splits of walkers for training and evaluation of agents.
SPLITS = ("train", "eval")
#: Number of a model's walkers in each split.
WALKERS = 512
#: One in this many captured people is for evaluation.
EVAL_SHARE = 4

_SPARE = 1.5  # [s] length of a recording beyond that of an episode, so that episodes start at any phase
_LONGEST = SECONDS_MOST - 10.0  # of an episode, as recordings of models are longer


def episode_frames(horizon: int) -> int:
    """Number of frames of an episode with `horizon` estimates, 1 to 100,000; otherwise raises MotionError."""
    return checked_whole(horizon, "horizon", 1, 100_000, "estimates") + 1


@dataclass(frozen=True)
class Source:
    """Specification of motion. Equal sources share their recordings.

    Attributes:
        motion: name or path of a walking model, a motion file, or a folder of capture files.
        split: one of `SPLITS`. A single file is one person, used in both.
        frames, fps: number of frames of an episode, and their rate [Hz].
        speed: (low, high) walking speed [m/s] of a model's walkers; None uses the model's own.
        height: (low, high) body height [m]; None is people's own.
        file_fps, unit: frame rate and unit of length of capture files that don't specify them.
        seed: None, or the seed of `motionenv.synthesize`, whose motion every episode then shows from its first frame,
            in both splits; `speed` and `height` must then be one number given twice, or None for the model's own.
        person: kind of people of a model, one of `motionenv.types.PEOPLE`.
    """

    motion: str
    split: str
    frames: int
    fps: float
    speed: tuple[float, float] | None = None
    height: tuple[float, float] | None = None
    file_fps: float | None = None
    unit: str | None = None
    seed: int | None = None
    person: str = "adult"

    def __post_init__(self) -> None:
        checked_choice(self.split, "split", SPLITS)
        object.__setattr__(self, "motion", str(self.motion))
        object.__setattr__(self, "fps", checked_number(self.fps, "fps", *FPS_RANGE))
        if self.frames / self.fps > _LONGEST:
            raise MotionError(
                f"horizon must be at most {_LONGEST:g} seconds, got {self.frames - 1} estimates at {self.fps:g} fps"
            )
        if self.file_fps is not None:
            checked_fps(self.file_fps, "file_fps")
        if self.unit is not None:
            metres_per(self.unit)
        if self.speed is not None:
            object.__setattr__(self, "speed", checked_range(self.speed, "speed", *SPEED_RANGE))
        if self.height is not None:
            object.__setattr__(self, "height", checked_range(self.height, "height", *HEIGHT_RANGE))
        checked_choice(self.person, "person", PEOPLE)
        if self.seed is not None:
            _check_seeded(self.seed, self.speed, self.height)

    def open(self) -> "Recordings":
        """The recordings, shared with every equal source of this process.

        Raises:
            MotionError: no such motion, no people in this split, or a recording that is too short.
        """
        return _opened(self)


class Recordings(Protocol):
    """Motion from which episodes are cut."""

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        """Poses (frames, 25) of an episode, a read-only view, and the body; drawn with the episode's `rng`."""


@lru_cache(maxsize=8)
def _opened(source: Source) -> Recordings:
    path = Path(source.motion)
    if source.motion in names() or (path.is_file() and _is_model(path)):
        return _Walkers(source) if source.seed is None else _Repeated(source)
    if source.seed is not None:
        raise MotionError(f"motion_seed needs a model as motion: omit it for motion {source.motion!r}")
    if source.speed is not None:
        raise MotionError(f"speed needs a model as motion: omit it for captured motion {source.motion!r}")
    if not path.exists():
        raise MotionError(
            f"motion must be a model ({', '.join(names())}, or a model file), a motion file, or a folder of capture "
            f"files; got {source.motion!r}" + did_you_mean(source.motion, names())
        )
    return _Captured(source)


class _Walkers:
    """Recordings of a model's walkers, made in batches when first needed."""

    def __init__(self, source: Source):
        self._source, self._model = source, gait_model(source.motion)
        self._made: dict[int, list[Motion]] = {}

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        block, number = divmod(int(rng.integers(WALKERS)), self._model.batch_size)
        if block not in self._made:
            self._made[block] = self._make(block)
        return _piece(self._made[block][number], self._source.frames, rng)

    def _make(self, block: int) -> list[Motion]:
        source, n = self._source, self._model.batch_size
        key = (SPLITS.index(source.split), block)
        rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=key))
        heights = [None] * n if source.height is None else rng.uniform(*source.height, n).tolist()
        speeds = [None] * n if source.speed is None else rng.uniform(*source.speed, n).tolist()
        seconds = source.frames / source.fps + _SPARE
        made = self._model.synthesize_batch(
            seconds, source.fps, heights=heights, speeds=speeds, person=source.person, seed=rng
        )
        check_shown(made[0].poses, PARTS, f"an episode of {source.motion}")
        return made if self._model.steady else [_ahead(motion) for motion in made]


class _Repeated:
    """The motion that a model makes with the source's seed, the same in every episode."""

    def __init__(self, source: Source):
        speed, height = (None if wanted is None else wanted[0] for wanted in (source.speed, source.height))
        seconds = source.frames / source.fps
        self._motion = synthesize(
            source.motion, seconds, source.fps, seed=source.seed, speed=speed, height=height, person=source.person
        )
        check_shown(self._motion.poses, PARTS, f"an episode of {source.motion}")

    def draw(self, _: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        return self._motion.poses, self._motion.skeleton


class _Captured:
    """Recordings of captured people, all in memory."""

    def __init__(self, source: Source):
        self._source = source
        path = Path(source.motion)
        files = path.rglob("*") if path.is_dir() else [path]
        if source.file_fps is None and any(file.suffix.lower() == ".amc" for file in files):
            raise MotionError("file_fps is required, because AMC files don't specify it; the CMU database has 120")
        clips = _read_folder(source) if path.is_dir() else [(path.name, _read_file(source))]
        self._pieces = [_ahead(piece) for name, motion in clips for piece in _stretches(name, motion, source)]
        starts = np.array([len(piece.poses) - source.frames + 1 for piece in self._pieces])
        self._until = np.cumsum(starts)

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        which = int(np.searchsorted(self._until, rng.integers(self._until[-1]), side="right"))
        poses, body = _piece(self._pieces[which], self._source.frames, rng)
        if self._source.height is None:
            return poses, body
        height = float(rng.uniform(*self._source.height))
        factor = height / body.height
        poses = poses.copy()
        poses[:, :3] *= factor
        return poses, resized(body, height)


def is_evaluated(person: str) -> bool:
    """Whether a captured `person`, a label as by `read_clips`, is in the "eval" split rather than in "train"."""
    return zlib.crc32(person.encode()) % EVAL_SHARE == 0


def _read_folder(source: Source) -> list[tuple[str, Motion]]:
    from motionenv.models.motion_tree.training import read_clips

    def refuse(name: str, why: str) -> None:
        raise MotionError(f"{name} in {source.motion} can't be used: {why}")

    clips = list(read_clips(source.motion, fps=source.file_fps, unit=source.unit, on_left_out=refuse))
    chosen = [(c.name, c.motion) for c in clips if is_evaluated(c.person) == (source.split == "eval")]
    if not chosen:
        people = ", ".join(sorted({c.person for c in clips}))
        raise MotionError(
            f"split {source.split!r} of {source.motion} is empty: people ({people}) are split by a hash of their "
            "label, about one in four for eval; use a folder of more people, or a file for each split"
        )
    return chosen


def _read_file(source: Source) -> Motion:
    from motionenv.mocap import read_motion

    motion = read_motion(source.motion, fps=source.file_fps, unit=source.unit)
    check_shown(motion.poses, PARTS, f"an episode of {source.motion}")
    return motion


def _stretches(name: str, motion: Motion, source: Source) -> list[Motion]:
    """The gapless stretches of a motion that are long enough for an episode, at the source's rate."""
    found = resample(motion, source.fps)
    long = [Motion(poses, motion.skeleton, source.fps, name) for poses in found if len(poses) >= source.frames]
    if not long:
        longest = max((len(poses) for poses in found), default=0)
        raise MotionError(
            f"{name} is too short: its longest stretch without gaps is {longest} frames at {source.fps:g} fps, but an "
            f"episode needs {source.frames} (horizon + 1); lower horizon, or remove the file"
        )
    return long


def _piece(recording: Motion, frames: int, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
    start = int(rng.integers(len(recording.poses) - frames + 1))
    return recording.poses[start : start + frames], recording.skeleton


def _ahead(motion: Motion) -> Motion:
    """The motion turned about the vertical so that its mean heading is x, starting at the origin."""
    heading = motion.poses[:, 5]
    turn = np.arctan2(np.sin(heading).mean(), np.cos(heading).mean())
    c, s = np.cos(turn), np.sin(turn)
    poses = motion.poses.copy()
    poses[:, :2] = (poses[:, :2] - poses[0, :2]) @ np.array([[c, -s], [s, c]])
    poses[:, 5] -= turn
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def _is_model(path: Path) -> bool:
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return "header.npy" in archive.namelist()


def _check_seeded(seed, speed: tuple[float, float] | None, height: tuple[float, float] | None) -> None:
    checked_whole(seed, "motion_seed", 0)
    for name, wanted in (("speed", speed), ("height", height)):
        if wanted is not None and wanted[0] != wanted[1]:
            raise MotionError(f"{name} must be a single value with motion_seed, such as "
                              f"({wanted[0]:g}, {wanted[0]:g}), got {wanted!r}")  # fmt: skip
