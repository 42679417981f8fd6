"""Where the motion of an episode comes from: walkers drawn from a model, or people who were captured.

A source holds recordings, of which each episode shows a piece that starts at a random time. A model's recordings are
those of `WALKERS` walkers per split, made when first needed from seeds that depend on split and number only; every
environment of a process that asks for the same shares them. Captured people are on one side or the other for good:
those whose label hashes to a multiple of `EVAL_SHARE` are for evaluation. With a seed of its own, a model's motion is
the one that `motionenv.synthesize` makes with that seed, in every episode.
"""

import zipfile
import zlib
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from motionenv.body.skeleton import limb_radii
from motionenv.errors import MotionError
from motionenv.mocap.world import metres_per
from motionenv.models import store
from motionenv.models.synthesis import scaled, synthesize
from motionenv.models.tree.frames import resample
from motionenv.models.walking import Stride, WalkingModel
from motionenv.types import Motion, Skeleton, checked_fps

#: Whom an agent may learn from, and whom it is tried on.
SPLITS = ("train", "eval")
#: Walkers that a model gives to each split.
WALKERS = 512
#: One in so many captured people is for evaluation.
EVAL_SHARE = 4
#: Heights of a model's walkers [m], if not told otherwise.
HEIGHT = (1.5, 1.95)

_WALKING_KINDS = {"walking", "eigenwalkers", "tree"}
_TOGETHER = 32  # walkers of a walking model made at a time
_SPARE = 1.5  # seconds that a model's recording is longer than an episode, so that episodes start at any phase
_SPEEDS, _HEIGHTS = (0.1, 3.0), (0.5, 2.5)
_FPS, _LONGEST = (1.0, 1000.0), 3590.0  # frames per second, and seconds, that models make


def episode_frames(horizon: int) -> int:
    """Frames of an episode in which `horizon` estimates are asked for.

    Raises:
        MotionError: `horizon` isn't a whole number from 1 to 100,000.
    """
    if isinstance(horizon, bool) or not isinstance(horizon, int) or not 1 <= horizon <= 100_000:
        raise MotionError(f"horizon must be a whole number of estimates from 1 to 100000, got {horizon!r}")
    return horizon + 1


@dataclass(frozen=True)
class Source:
    """What motion is asked for. Equal ones share their recordings.

    Attributes:
        motion: name or path of a model that walks, a file of motion, or a folder of capture files.
        split: one of `SPLITS`. A file is one person, so it serves either.
        frames: of an episode.
        fps: frames per second of an episode.
        speed: least and greatest walking speed [m/s] of a model's walkers; None leaves them to the model.
        height: least and greatest body height [m]; None is `HEIGHT` for models, and captured people's own.
        file_fps: frames per second of capture files that don't say.
        unit: unit of length of capture files that don't say.
        seed: None, or that of `motionenv.synthesize`, whose motion every episode then shows from its first frame on,
            in either split; `speed` and `height` are then one number twice, or None for the model's own.
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

    def __post_init__(self):
        if self.split not in SPLITS:
            raise MotionError(f"split must be one of {', '.join(SPLITS)}, got {self.split!r}")
        object.__setattr__(self, "motion", str(self.motion))
        object.__setattr__(self, "fps", checked_fps(self.fps))
        if not _FPS[0] <= self.fps <= _FPS[1]:
            raise MotionError(f"fps must be from {_FPS[0]:g} to {_FPS[1]:g}, got {self.fps:g}")
        if self.frames / self.fps > _LONGEST:
            raise MotionError(
                f"horizon must end within {_LONGEST:g} seconds, got {self.frames - 1} estimates at {self.fps:g} fps"
            )
        _check_reading(self.file_fps, self.unit)
        object.__setattr__(self, "speed", _checked_range("speed", self.speed, *_SPEEDS, "m/s"))
        object.__setattr__(self, "height", _checked_range("height", self.height, *_HEIGHTS, "m"))
        if self.seed is not None:
            _check_seeded(self.seed, self.speed, self.height)

    def open(self) -> "Recordings":
        """The recordings, shared with every equal source of this process.

        Raises:
            MotionError: no such motion, nobody in this split, or a recording that is too short; names it.
        """
        return _opened(self)


class Recordings(Protocol):
    """Motion from which episodes are cut."""

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        """Poses (frames, 25) of an episode, a view that must not be written to, and the body.

        Args:
            rng: the episode's generator.
        """


@lru_cache(maxsize=8)
def _opened(source: Source) -> Recordings:
    path = Path(source.motion)
    if source.motion in store.names() or (path.is_file() and _is_model(path)):
        return _Walkers(source) if source.seed is None else _Repeated(source)
    if source.seed is not None:
        raise MotionError(f"motion_seed is for models, which synthesise: leave it out for motion {source.motion!r}")
    if source.speed is not None:
        raise MotionError(f"speed is the walkers' own in captured motion: leave it out for motion {source.motion!r}")
    if not path.exists():
        raise MotionError(
            f"motion must be a model ({', '.join(store.names())}, or the file of one), a file of motion, or a folder "
            f"of capture files; {source.motion!r} is none of them"
        )
    return _Captured(source)


class _Walkers:
    """Recordings of a model's walkers, made a few at a time when first asked for."""

    def __init__(self, source: Source):
        self._source = source
        self._made: dict[int, list[Motion]] = {}
        self._together = _TOGETHER if self._model.kind == "walking" else 1
        if self._model.kind not in _WALKING_KINDS:
            raise MotionError(f"motion {source.motion!r} is a {self._model.kind} model, which doesn't walk")

    @cached_property
    def _model(self) -> Any:
        return store.load(self._source.motion)

    def draw(self, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        block, number = divmod(int(rng.integers(WALKERS)), self._together)
        if block not in self._made:
            self._made[block] = self._make(block)
        return _piece(self._made[block][number], self._source.frames, rng)

    def _make(self, block: int) -> list[Motion]:
        """The walkers of a block."""
        source, n = self._source, self._together
        key = (SPLITS.index(source.split), block)
        rng = np.random.default_rng(np.random.SeedSequence(0, spawn_key=key))
        heights = rng.uniform(*(source.height or HEIGHT), n)
        speeds = [None] * n if source.speed is None else rng.uniform(*source.speed, n).tolist()
        seconds = source.frames / source.fps + _SPARE
        if isinstance(self._model, WalkingModel):
            return _walks(self._model, seconds, source.fps, heights, speeds, rng)
        pairs = zip(heights, speeds, strict=True)
        made = [synthesize(self._model, seconds, source.fps, seed=rng, speed=v, height=float(h)) for h, v in pairs]
        return [_ahead(motion) for motion in made] if self._model.kind == "tree" else made


class _Repeated:
    """The one motion that a model makes with the source's seed, the same in every episode."""

    def __init__(self, source: Source):
        speed, height = (None if wanted is None else wanted[0] for wanted in (source.speed, source.height))
        seconds = source.frames / source.fps
        self._motion = synthesize(source.motion, seconds, source.fps, seed=source.seed, speed=speed, height=height)

    def draw(self, _: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
        return self._motion.poses, self._motion.skeleton


def _walks(model: WalkingModel, seconds: float, fps: float, heights, speeds, rng) -> list[Motion]:
    """Walks of people of `heights` [m] at `speeds` [m/s], all at once, which takes a fraction of one by one.

    A walker of another height is the mean one scaled, at a speed scaled likewise. Stride times are set by how fast a
    first attempt walks, so that the speeds are met within a few percent.
    """
    scale = heights / model.height_
    wanted = [None if v is None else v / s for v, s in zip(speeds, scale, strict=True)]
    strides = [model.sample(1, seed=rng, speed=None if v is None else float(np.clip(v, *_SPEEDS))) for v in wanted]
    stride = Stride(*(np.concatenate([getattr(s, name) for s in strides]) for name in ("scores", "seconds")))
    seed = int(rng.integers(2**63))
    make = lambda stride: model.synthesize(seconds, fps, n=len(scale), seed=seed, stride=stride).poses
    if wanted[0] is not None:
        trial = make(stride)
        fast = (trial[:, -1, 0] - trial[:, 0, 0]) * fps / (trial.shape[1] - 1)
        stride = Stride(stride.scores, stride.seconds * np.clip(fast / np.array(wanted), 0.5, 2.0))
    poses = make(stride)
    return [scaled(Motion(p, model.skeleton(), fps, "walk"), float(h)) for p, h in zip(poses, heights, strict=True)]


class _Captured:
    """Recordings of people who were captured, all in memory."""

    def __init__(self, source: Source):
        self._source = source
        path = Path(source.motion)
        files = path.rglob("*") if path.is_dir() else [path]
        if source.file_fps is None and any(file.suffix.lower() == ".amc" for file in files):
            raise MotionError("file_fps must be given: AMC files don't say theirs; it is 120 for the CMU database")
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
        return poses, Skeleton(body.offsets * factor, limb_radii(height), height)


def is_evaluated(person: str) -> bool:
    """Whether a captured person is for evaluation; the others are for training.

    Args:
        person: the label, as `motionenv.models.tree.capture.read_clips` takes it from the file's name.
    """
    return zlib.crc32(person.encode()) % EVAL_SHARE == 0


def _read_folder(source: Source) -> list[tuple[str, Motion]]:
    """Names and motions of the split's people in a folder.

    Raises:
        MotionError: a file can't be read, or there is nobody in the split.
    """
    from motionenv.models.tree.capture import read_clips

    def refuse(name: str, why: str) -> None:
        raise MotionError(f"{name} in {source.motion} can't be used: {why}")

    clips = list(read_clips(source.motion, fps=source.file_fps, unit=source.unit, on_left_out=refuse))
    chosen = [(c.name, c.motion) for c in clips if is_evaluated(c.person) == (source.split == "eval")]
    if not chosen:
        people = ", ".join(sorted({c.person for c in clips}))
        raise MotionError(
            f"no one in {source.motion} belongs to split {source.split!r}: people ({people}) are split by a hash of "
            "their label, about one in four for eval; give a folder of more people, or a file for each split"
        )
    return chosen


def _read_file(source: Source) -> Motion:
    from motionenv.mocap.loading import read_motion

    return read_motion(source.motion, fps=source.file_fps, unit=source.unit)


def _stretches(name: str, motion: Motion, source: Source) -> list[Motion]:
    """The gapless stretches of a motion that an episode fits into, at the source's rate.

    Raises:
        MotionError: there is none.
    """
    found = resample(motion, source.fps)
    long = [Motion(poses, motion.skeleton, source.fps, name) for poses in found if len(poses) >= source.frames]
    if not long:
        longest = max((len(poses) for poses in found), default=0)
        raise MotionError(
            f"{name} is too short: its longest stretch without gaps is {longest} frames at {source.fps:g} fps, an "
            f"episode takes {source.frames} (horizon + 1); lower horizon, or leave the file out"
        )
    return long


def _piece(recording: Motion, frames: int, rng: np.random.Generator) -> tuple[np.ndarray, Skeleton]:
    """A piece of a recording that starts at a random frame."""
    start = int(rng.integers(len(recording.poses) - frames + 1))
    return recording.poses[start : start + frames], recording.skeleton


def _ahead(motion: Motion) -> Motion:
    """The motion turned about the vertical so that on average it faces along x, and begun at the origin."""
    heading = motion.poses[:, 5]
    turn = np.arctan2(np.sin(heading).mean(), np.cos(heading).mean())
    c, s = np.cos(turn), np.sin(turn)
    poses = motion.poses.copy()
    poses[:, :2] = (poses[:, :2] - poses[0, :2]) @ np.array([[c, -s], [s, c]])
    poses[:, 5] -= turn
    return Motion(poses, motion.skeleton, motion.fps, motion.name)


def _is_model(path: Path) -> bool:
    """Whether a file holds a model of motion rather than a motion."""
    if not zipfile.is_zipfile(path):
        return False
    with zipfile.ZipFile(path) as archive:
        return "header.npy" in archive.namelist()


def _check_reading(file_fps: float | None, unit: str | None) -> None:
    """Refuse what capture files can't be read with.

    Raises:
        MotionError: not a rate, or not a unit of length.
    """
    number = isinstance(file_fps, int | float | np.number) and not isinstance(file_fps, bool)
    if file_fps is not None and not (number and 0 < file_fps < np.inf):
        raise MotionError(f"file_fps must be a finite number of frames per second above 0, got {file_fps!r}")
    if unit is not None:
        metres_per(unit)


def _check_seeded(seed, speed: tuple[float, float] | None, height: tuple[float, float] | None) -> None:
    """Refuse what one motion can't be made with.

    Raises:
        MotionError: no seed, or a range of speeds or heights.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise MotionError(f"motion_seed must be a whole number from 0, got {seed!r}")
    for name, wanted in (("speed", speed), ("height", height)):
        if wanted is not None and wanted[0] != wanted[1]:
            raise MotionError(f"with motion_seed every episode shows the same motion: {name} must be one, as "
                              f"({wanted[0]:g}, {wanted[0]:g}), got {wanted!r}")  # fmt: skip


def _checked_range(name: str, value, least: float, most: float, unit: str) -> tuple[float, float] | None:
    """(low, high) as a tuple of floats.

    Raises:
        MotionError: not two numbers in order within `least` and `most`.
    """
    if value is None:
        return None
    try:
        low, high = (float(v) for v in value)
    except (TypeError, ValueError):
        low = high = np.nan
    if not least <= low <= high <= most:
        raise MotionError(f"{name} must be (low, high) in {unit}, from {least:g} to {most:g}, got {value!r}")
    return low, high
