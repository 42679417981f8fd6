"""The implicit probabilistic model of human motion (Sidenbladh, Black & Sigal 2002, sections 4 and 5).

Given the last ten frames Φ_t, the next pose is the one that follows a window Ψ_i of the database, drawn with

    p(Ψ_i | Φ_t) ∝ exp(-½ (c_i - c_t)ᵀ Σ̃⁻² (c_i - c_t) / β)                            (eq. 3, Observation 1)

where c are the coefficients in the database's principal components and β is the temperature. `method="tree"` draws
with the paper's probabilistic search (eq. 7, 8), which is very fast but only approximates that distribution;
`method="exact"` draws from the distribution itself.
"""

import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from motionenv._core.representation import OneLine
from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.arguments import Request
from motionenv.errors import ModelError, MotionError
from motionenv.models.base import GaitModel
from motionenv.models.motion_tree.database import Clip, Database, History, Recent, build_database, recent_frames
from motionenv.models.motion_tree.features import FPS, PARTS, placed
from motionenv.models.motion_tree.forecast import fit_forecast, following, steps
from motionenv.models.motion_tree.search.basis import fit_basis, project
from motionenv.models.motion_tree.search.exact import BLOCK, ExactSampler
from motionenv.models.motion_tree.search.tree import LEAVES, METHODS, SPLITS, CoefficientTree
from motionenv.models.motion_tree.serialization import pack, unpack
from motionenv.models.motion_tree.synthesis.generator import MotionGenerator, Options, start_window
from motionenv.models.transforms import resample, scaled
from motionenv.models.types import Components, Target, Walker
from motionenv.types import Motion, Skeleton

_IN_MEMORY = 2**28  # bytes of coefficients; more of them lie in a file, whose pages the system may take back
_CHUNK = 2**16  # windows


@dataclass(frozen=True, eq=False, repr=False)
class Samples(OneLine):
    """Samples of the next pose.

    Attributes:
        poses: (..., n, 25) [m, rad], in the world of the history.
        windows: (..., n) indices of the drawn windows; `MotionTree.frames_[windows]` is the last frame of each.
        log_probability: (..., n) log-probability of each drawn window.
    """

    poses: np.ndarray
    windows: np.ndarray
    log_probability: np.ndarray


class MotionTree(GaitModel):
    """A database of motion as a probability distribution over the next pose.

    Args:
        splits: "sign" as in the paper, or "median" for the balanced tree that the paper mentions.
        part: body part that the tree uses and predicts, a key of `PARTS`.

    Attributes:
        database_: the `Database`.
        basis_: the `Basis` of its windows.
        frames_: (n,) last frame of each window.
        index_: the windows' coefficients, and exact draws.
        descent_: the paper's tree.
        forecast_: prediction of the pose after a window.
        card_: the model card.

    Raises:
        MotionError: an unknown `splits` or `part`.
    """

    kind: ClassVar[str] = "tree"
    about: ClassVar[str] = "Motion without end, grown frame by frame from clips of captured motion."
    steady: ClassVar[bool] = False
    steerable: ClassVar[bool] = True
    compressed: ClassVar[bool] = False

    def __init__(self, *, splits: str = "sign", part: str = "body") -> None:
        if part not in PARTS:
            raise MotionError(f"part must be one of {', '.join(PARTS)}, got {part!r}")
        if splits not in SPLITS:
            raise MotionError(f"splits must be {' or '.join(map(repr, SPLITS))}, got {splits!r}")
        self.splits, self.part = splits, part
        self.card_: dict = {}

    def fit(self, motions: Iterable[Motion], subjects: Sequence[str] | None = None) -> "MotionTree":
        """Build a `Database` of motions of any kind, on the body of the first, and fit the tree to it.

        Args:
            motions: (frames, 25) at any frame rate; a gap splits a motion into clips. Names become activities. Any
                iterable: memory holds one motion at a time, and the database lies in a temporary file.
            subjects: the person's label for each motion; None takes each motion for a different person.

        Raises:
            MotionError: labels don't match the motions, or no motion is longer than ten frames at 30 frames/s.
        """
        return self.fit_database(build_database(_clips(motions, subjects)))

    def fit_database(self, database: Database) -> "MotionTree":
        """Fit the tree to `database`, whose arrays are kept without a copy; a MotionError if it isn't finite."""
        channels = np.array(PARTS[self.part])
        self.database_ = database
        self.basis_ = fit_basis(database, np.concatenate([channels, channels + 25]))
        n = len(database.windows)
        rows = _room((-(-n // BLOCK) * BLOCK, len(self.basis_.deviation)))
        project(database, self.basis_, rows)
        if not all(np.isfinite(rows[i : min(i + _CHUNK, n)]).all() for i in range(0, n, _CHUNK)):
            raise MotionError("the database's poses must be finite: build_database leaves out frames with gaps")
        self.forecast_ = fit_forecast(database, rows[:n])
        self.index_ = ExactSampler.build(rows, n)
        self.frames_ = database.windows
        self.descent_ = CoefficientTree.build(self.index_.blocks, self.index_.n, self.splits)
        self.activities = tuple(sorted(set(database.activities)))
        return self

    def coefficients(self, history: History) -> np.ndarray:
        """Standardised coefficients c / σ (..., b) float32 of the last ten frames of a history.

        Args:
            history: (..., frames, 25) poses at 30 frames/s, oldest first, or a `Motion` of that rate. Uses the last ten
                frames and, for velocities, up to two before them.

        Raises:
            MotionError: fewer than ten frames, another shape or rate, or NaN.
        """
        self.check()
        return self.basis_.coefficients(self.recent(history).parameters).astype(np.float32)

    def sample(
        self, history: History, n: int = 1, *, temperature: float = 0.05, seed: int | np.random.Generator | None = None,
        method: str = "tree", leaf: str = "uniform", noise: float = 0.0, carry: bool = False,
    ) -> Samples:  # fmt: skip
        """Draw samples of the next pose.

        Args:
            history: (..., frames, 25), see `coefficients`; leading axes are batches.
            n: draws for each history.
            temperature: β; near 0 the nearest window is drawn, and larger values draw windows that are farther away.
            seed: int or Generator.
            method: "tree", the paper's search, or "exact".
            leaf: choice within a leaf of "tree", "uniform" or by the "kernel" p(c_i | c_t).
            noise: standard deviation of Gaussian noise on the poses, as a factor on the predictions' RMS error.
            carry: add a share of the difference between history and window (`motionenv.models.motion_tree.forecast`);
                False takes the pose after the window, as the paper does.

        Raises:
            MotionError: an invalid history (see `coefficients`), or an option out of range.
        """
        self.check()
        checked_number(noise, "noise", 0)
        n = checked_whole(n, "n", 1, unit="draws")
        recent = self.recent(history)
        probes = self.basis_.coefficients(recent.parameters).astype(np.float32)
        flat = probes.reshape(-1, probes.shape[-1])
        rng = random_generator(seed)
        key = int(rng.integers(2**64, dtype=np.uint64))
        windows, log_probability = self.draw(flat, n, temperature, key, method, leaf)
        windows = windows.reshape(*probes.shape[:-1], n)
        if carry:
            now, after = steps(self.database_, self.frames_[windows])
            after = self.forecast_.carried(recent.parameters[..., -1:, :], now, after)
        else:
            after = following(self.database_, self.frames_[windows])
        if noise > 0:
            deviation = self.forecast_.deviation if carry else self.forecast_.plain_deviation
            after = after + noise * deviation * rng.standard_normal(after.shape)
        return Samples(self._poses(recent, after), windows, log_probability.reshape(windows.shape))

    def draw(
        self, probes: np.ndarray, n: int, temperature: float, key: int, method: str, leaf: str
    ) -> tuple[np.ndarray, np.ndarray]:
        """Draw windows (B, n) for each of the coefficients `probes`; return them and their log-probabilities.

        Args:
            probes: (B, b) float32, from `coefficients`.
            n, temperature, method, leaf: see `sample`.
            key: whole number that seeds the draws.

        Raises:
            MotionError: an option out of range.
            ModelError: not fitted, or its file was changed in place.
        """
        self.check()
        if method not in METHODS:
            raise MotionError(f"method must be {' or '.join(map(repr, METHODS))}, got {method!r}")
        if leaf not in LEAVES:
            raise MotionError(f"leaf must be {' or '.join(map(repr, LEAVES))}, got {leaf!r}")
        probes, temperature = self.index_.checked(probes, temperature)
        if method == "tree":
            return self.descent_.draw(probes, n, temperature, key, leaf, self.index_.blocks)
        return self.index_.draw(probes, n, temperature, key)

    def components(self) -> Components:
        """No components: the database isn't a linear model."""
        return Components()

    def treadmill(self) -> None:
        """No treadmill: motion has no closed form."""

    def body(self, height: float | None = None) -> Skeleton:
        """The database's body, scaled to `height` [m]."""
        self.check()
        body = self.database_.skeleton
        return body if height is None else scaled(Motion(np.zeros((0, 25)), body, FPS), height).skeleton

    def dimensions(self) -> dict[str, int]:
        """Frames and windows of the database."""
        self.check()
        return {"pose": 25, "frames": len(self.database_.poses), "windows": len(self.frames_)}

    def draw_walker(
        self, rng: np.random.Generator, speed: float | None = None, height: float | None = None, person: str = "adult"
    ) -> Walker:
        """A random window of the database, picked with `rng`; `speed`, `height`, `person` have no effect."""
        self.check()
        return Walker(self.kind, start=start_window(self, None, rng))

    def make_motion(self, walker: Walker, request: Request, rng: np.random.Generator) -> Motion:
        """Generate motion at 30 frames/s from the window of `walker` with `rng`, and resample it to the `request`."""
        own = self.body().height
        wanted = None if request.speed is None else request.speed * own / (request.height or own)
        growth = self.generator(walker.start, seed=rng, target=Target(speed=wanted))
        motion = growth.motion(request.seconds + 2 / FPS)
        if request.fps != FPS:
            motion = Motion(resample(motion, request.fps)[0], motion.skeleton, request.fps, motion.name)
        motion = Motion(motion.poses[: request.frames], motion.skeleton, request.fps, motion.name)
        return motion if request.height is None else scaled(motion, request.height)

    def generator(
        self, start: int | str | History | None = None, *, seed: int | np.random.Generator | None = None,
        upper: "MotionTree | None" = None, target: Target | None = None, **options: Any,
    ) -> MotionGenerator:  # fmt: skip
        """A generator of motion from this tree: `step(frames)` returns the next poses, `motion(seconds)` a `Motion`.

        Args:
            start: poses, a `Motion`, an activity, a window or None; see `MotionGenerator`.
            seed: int or Generator.
            upper: tree of the "upper" body, if this one is of the "lower".
            target: activity, heading and speed to steer to.
            options: `temperature` and others of `motionenv.models.motion_tree.Options`.

        Raises:
            MotionError: an option out of range; see also `MotionGenerator`.
        """
        return MotionGenerator(self, start, seed=seed, upper=upper, options=Options(**options), target=target)

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and settings from which `from_arrays` restores the tree."""
        self.check()
        return pack(self)

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> "MotionTree":
        """As `ModelFile.from_arrays`, from `arrays`, which are kept without a copy, and `meta`."""
        tree = cls(splits=meta["splits"], part=meta["part"])
        unpack(tree, arrays, meta)
        tree.activities = tuple(sorted(set(tree.database_.activities)))
        return tree

    def source(self, windows: np.ndarray) -> np.ndarray:
        """Index (...) of the database's sequence of each of `windows` (...)."""
        self.check()
        return self.database_.sequence_of(self.frames_[windows])

    def leaf(self, windows: np.ndarray) -> np.ndarray:
        """Index (...) of the leaf of the paper's tree that holds each of `windows` (...)."""
        self.check()
        return self.descent_.leaf_of(windows)

    def recent(self, history: History) -> Recent:
        """Parameters of the last frames of a `history`, on the database's body; errors as in `coefficients`."""
        return recent_frames(history, self.database_)

    def _poses(self, recent: Recent, after: np.ndarray) -> np.ndarray:
        """Next poses (..., n, 25) in the world of the history, from their local parameters `after` (..., n, 25)."""
        poses = placed(recent.last, after)
        if self.part != "body":
            others = [i for i in range(25) if i not in PARTS[self.part]]
            poses[..., others] = recent.last[..., None, others]
        if recent.scale != 1.0:
            poses[..., :3] /= recent.scale
        return poses

    def check(self) -> None:
        """Raise ModelError if it isn't fitted."""
        if not hasattr(self, "index_"):
            raise ModelError("this MotionTree is not fitted: call fit(motions) first, or motionenv.load")


def _clips(motions: Iterable[Motion], subjects: Iterable | None) -> Iterator[Clip]:
    """Motions as clips, each made when its turn comes."""
    people = None if subjects is None else [str(s) for s in subjects]
    n = 0
    for n, motion in enumerate(motions, 1):
        if people is not None and n > len(people):
            raise MotionError(f"fit needs a subject for each motion, got {len(people)} and more motions")
        yield Clip(motion, motion.name, motion.name or "motion", str(n - 1) if people is None else people[n - 1])
    if people is not None and n < len(people):
        raise MotionError(f"fit needs a subject for each motion, got {n} motions and {len(people)} subjects")


def _room(shape: tuple[int, int]) -> np.ndarray:
    """An array of float32 for what is computed: in memory, or mapped from an unnamed temporary file if it is large."""
    size = 4 * shape[0] * shape[1]
    if size <= _IN_MEMORY:
        return np.empty(shape, dtype=np.float32)
    with tempfile.TemporaryFile() as file:
        file.truncate(size)
        return np.asarray(np.memmap(file, np.float32, "r+", shape=shape))
