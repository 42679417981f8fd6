"""Motion of any length from a tree, frame by frame (paper C, section 5), with extensions.

For each frame, a window i is drawn from p(i | t), given the last ten frames, and the pose after it is the next pose.
These extensions of the paper can each be switched off in `Options`:

- persistence: a clip continues more often than by p(i | t) alone, and a draw close to the last window counts as its
  continuation. Otherwise the motion changes clips twenty times a second.
- blending: at jumps between clips, the difference from the database's pose decays (`_generator_kernels._blend`).
- future: windows that lead to dead ends are avoided (`future_cost`).
- contact: stance feet stay in place on the ground (`_footing_kernels`). The next windows are matched to the motion
  before this correction.
- a `Target` weights the candidates. With r = target - prediction over the next second, the log weights are -4 for
  another activity, -½ (r / 0.25 rad)² for the turn, limited to 1.2 rad/s, and -½ (r / 0.15 m/s)² for the speed. Another
  activity also has a future cost, and so has what doesn't turn while the heading is more than 0.3 rad off: there may be
  no candidate that does, and the motion must first come near one.
- two trees, for the lower and the upper body: the upper body's windows are weighted by exp(-|c_i - c_t|² / 2β) with
  the coefficients c of the lower body, so that the arms match the legs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import ModelError, MotionError
from motionenv.models.motion_tree.database import Database, History
from motionenv.models.motion_tree.features import FPS, PARTS, WINDOW, parameters, turned_towards
from motionenv.models.motion_tree.search.exact import BLOCK
from motionenv.models.motion_tree.search.tree import METHODS
from motionenv.models.motion_tree.synthesis._footing_kernels import footing_on
from motionenv.models.motion_tree.synthesis._generator_kernels import Settings, Source, State, grow
from motionenv.models.motion_tree.synthesis.future_cost import FutureCost, fit_future_cost
from motionenv.models.types import Target
from motionenv.types import SECONDS_MOST, Motion

if TYPE_CHECKING:
    from motionenv.models.motion_tree.model import MotionTree

_ANGLES = [3, 4, *range(6, 25)]
_SHORTEST = 1e-3  # least half-life of blending [s]; below, powers of its rate overflow
_NOISIEST = 100.0  # greatest noise; above, poses overflow
_LEAD = 30  # least number of windows left in the clip at which a motion starts


@dataclass(frozen=True)
class Options:
    """Options of the synthesis.

    Attributes:
        temperature: β; near 0 draws the nearest window, at 1 windows as spread as the database.
        method: "exact" draws from p(i | t), "tree" by the paper's search.
        persistence: mean time [s] for which a clip continues before a draw may change it; 0 as in the paper.
        candidates: number of windows drawn and weighted for each frame.
        blend: half-life [s] of differences at jumps between clips; 0 doesn't blend.
        future: whether to avoid windows that lead to dead ends.
        contact: whether to keep stance feet in place.
        noise: standard deviation of Gaussian noise on each pose, as a factor on the predictions' RMS error.

    Raises:
        MotionError: an option out of range.
    """

    temperature: float = 0.05
    method: str = "exact"
    persistence: float = 0.3
    candidates: int = 16
    blend: float = 0.1
    future: bool = True
    contact: bool = True
    noise: float = 0.0

    def __post_init__(self) -> None:
        checked_number(self.temperature, "temperature", above=0)
        _check(self.method in METHODS, "method", self.method, " or ".join(map(repr, METHODS)))
        checked_number(self.persistence, "persistence", 0, unit="seconds")
        object.__setattr__(self, "candidates", checked_whole(self.candidates, "candidates", 1))
        fine = self.blend == 0 or _SHORTEST <= self.blend < np.inf
        _check(fine, "blend", self.blend, f"0 or seconds from {_SHORTEST}")
        checked_number(self.noise, "noise", 0, _NOISIEST)


class MotionGenerator:
    """Generates motion from a tree at 30 frames/s.

    Args:
        tree: tree of the whole body, or of the "lower" body if `upper` is given.
        start: poses (frames, 25) or a `Motion` at 30 frames/s to continue, of which the last 10 to 12 frames count; an
            activity of the database, of which the seed picks a window; the position of a window; or None for a random
            window.
        seed: int or Generator. The motion doesn't depend on its division into steps.
        upper: tree of the "upper" body, fitted to the same database.
        options: see `Options`.
        target: see `Target`; may change between steps.

    Attributes:
        skeleton: the body of the poses: that of a `Motion` given as `start`, otherwise the database's.
        fps: frame rate, 30.

    Raises:
        MotionError: an invalid history (see `MotionTree.sample`), an unknown activity, or trees that don't match.
    """

    def __init__(
        self, tree: MotionTree, start: int | str | History | None=None, *,
        seed: int | np.random.Generator | None = None, upper: MotionTree | None = None, options: Options | None = None,
        target: Target | None = None,
    ) -> None:  # fmt: skip
        self._trees = (tree,) if upper is None else (tree, upper)
        for each in self._trees:
            each.check()
        _check_parts(self._trees)
        self._options = options or Options()
        self._futures = [future_cost_of(t) for t in self._trees]
        self._sources = tuple(_source(t, o) for t, o in zip(self._trees, self._futures, strict=True))
        self.target = target or Target()
        self.fps = FPS
        self._name = start if isinstance(start, str) else ""
        self.skeleton = start.skeleton if isinstance(start, Motion) else tree.database_.skeleton
        rng = random_generator(seed)
        self._scale = 1.0
        self._state = self._started(start, rng)
        self._key = np.uint64(rng.integers(2**64, dtype=np.uint64))

    @property
    def target(self) -> Target:
        """Target to which the motion is steered."""
        return self._target

    @target.setter
    def target(self, target: Target) -> None:
        known = self._futures[0].activities
        if target.activity is not None and target.activity not in known:
            raise MotionError(_unknown(target.activity, known), "activity")
        self._target = target
        self._activity = -1 if target.activity is None else known.index(target.activity)
        courses = [future.courses(self._activity, turns=target.heading is not None) for future in self._futures]
        self._sources = tuple(
            source._replace(cost=_fixed(cost), way_out=_fixed(way_out))
            for source, (cost, way_out) in zip(self._sources, courses, strict=True)
        )

    @property
    def windows(self) -> np.ndarray:
        """Position (trees,) of the window before the last frame in each tree; -1 before the first frame."""
        return self._state.windows.copy()

    def step(self, frames: int) -> np.ndarray:
        """The next poses (frames, 25) [m, rad].

        Raises:
            MotionError: `frames` isn't a whole number above 0.
            ModelError: the tree's file was changed in place, or isn't finite.
        """
        frames = checked_whole(frames, "frames", 1)
        for tree in self._trees:
            tree.check()
        out = np.empty((int(frames), 25))
        stands, poses = self._futures[0].stands, self._trees[0].database_.poses
        offsets, height = self.skeleton.offsets * self._scale, self.skeleton.height * self._scale
        grow(self._sources, self._settings(), self._state, _fixed(poses), stands, offsets, height, self._key, out)
        if not np.isfinite(out).all():
            raise ModelError("the tree's database holds NaN or infinity, so its file is damaged: build it again")
        out[:, :3] /= self._scale
        return out

    def motion(self, seconds: float) -> Motion:
        """The next `seconds` [s], up to an hour, as a motion (frames, 25) of at least one frame.

        Raises:
            MotionError: `seconds` out of range.
            ModelError: see `step`.
        """
        checked_number(seconds, "seconds", high=SECONDS_MOST, above=0)
        return Motion(self.step(max(1, round(seconds * FPS))), self.skeleton, FPS, self._name)

    def _settings(self) -> Settings:
        o, wanted = self._options, self._target
        noise = np.zeros(25)
        for tree in self._trees if o.noise else ():
            own = list(PARTS[tree.part])
            noise[own] = o.noise * tree.forecast_.plain_deviation[own]
        return Settings(
            temperature=float(o.temperature), paper=o.method == "tree",
            stay=float(np.exp(-1 / (o.persistence * FPS))) if o.persistence else 0.0, candidates=int(o.candidates),
            quickness=2 * np.log(2) / o.blend if o.blend else np.inf, future=bool(o.future), contact=bool(o.contact),
            noise=noise, activity=self._activity, heading=np.nan if wanted.heading is None else float(wanted.heading),
            pace=np.nan if wanted.speed is None else float(wanted.speed) * self._scale,
        )  # fmt: skip

    def _started(self, start, rng: np.random.Generator) -> State:
        """The state after a history, or at a window picked with `rng`."""
        if start is None or isinstance(start, str):
            return self._started_in_database(start_window(self._trees[0], start, rng))
        if isinstance(start, int):
            count = len(self._trees[0].frames_)
            _check(0 <= start < count, "start", start, f"the position of one of the {count} windows")
            return self._started_in_database(start)
        recent = self._trees[0].recent(start)
        if recent.last.ndim != 1:
            raise MotionError("start must be one history (frames, 25), got a batch")
        self._scale = recent.scale
        ground = (0.0, ANKLE_HEIGHT * self.skeleton.height * self._scale, 0.0)
        return _state(recent.parameters, recent.last, np.full(len(self._trees), -1), ground)

    def _started_in_database(self, i: int) -> State:
        database, future = self._trees[0].database_, self._futures[0]
        frame = self._trees[0].frames_[i]
        recent = parameters(_leading_to(database, frame))[-WINDOW:]
        pose = database.poses[frame].astype(np.float64)
        pose[[0, 1, 5]] = 0.0
        windows = np.array([o.place[frame - 1] for o in self._futures])
        return _state(recent, pose, windows, future.ground[i])


def history(
    tree: MotionTree, activity: str | None = None, *, seed: int | np.random.Generator | None = None
) -> np.ndarray:
    """The 10 to 12 poses (frames, 25) [m, rad] at 30 frames/s up to a random window of the database of a `tree`.

    The window is one of `activity`, if not None; a `seed` picks the same one as for `MotionGenerator`.

    Raises:
        MotionError: an unknown activity.
    """
    i = start_window(tree, activity, random_generator(seed))
    return _leading_to(tree.database_, tree.frames_[i]).astype(np.float64)


_FUTURE_COSTS: WeakKeyDictionary[MotionTree, FutureCost] = WeakKeyDictionary()


def future_cost_of(tree: MotionTree) -> FutureCost:
    """Future cost of the windows of a fitted tree, cached as long as the tree lives."""
    tree.check()
    if tree not in _FUTURE_COSTS:
        _FUTURE_COSTS[tree] = fit_future_cost(tree.database_, tree.frames_, _fixed(tree.index_.blocks))
    return _FUTURE_COSTS[tree]


def start_window(tree: MotionTree, activity: str | None, rng: np.random.Generator) -> int:
    """Position of a random window of an activity from which a motion can start; a MotionError for unknown ones."""
    future = future_cost_of(tree)
    if activity is not None and activity not in future.activities:
        raise MotionError(_unknown(activity, future.activities), "start")
    known = _STARTS.setdefault(tree, {})
    if activity not in known:
        known[activity] = _starts(tree, future, activity)
    among = known[activity]
    return int(among[rng.integers(len(among))])


_STARTS: WeakKeyDictionary[MotionTree, dict[str | None, np.ndarray]] = WeakKeyDictionary()


def _starts(tree: MotionTree, future: FutureCost, activity: str | None) -> np.ndarray:
    """Positions of the windows from which motion can start, in an order that all trees of a database share."""
    database, frames = tree.database_, tree.frames_
    among = np.arange(len(frames)) if activity is None else np.flatnonzero(
        future.activity == future.activities.index(activity)
    )  # fmt: skip
    left = database.starts[1:][database.sequence_of(frames[among])] - frames[among]
    among = among[left >= min(_LEAD, left.max())]
    return among[np.argsort(frames[among])]


def _leading_to(database: Database, frame: int) -> np.ndarray:
    """The last 10 to 12 poses (frames, 25) of a clip up to one of its frames."""
    first = database.starts[database.sequence_of(frame)]
    return database.poses[max(first, frame - WINDOW - 1) : frame + 1]


def _source(tree: MotionTree, future: FutureCost) -> Source:
    """A tree as input of the loop. Arrays are read-only, so that mapped and fitted trees use the same compiled code."""
    weights, offset = tree.basis_.filter
    blocks, descent = _fixed(tree.index_.blocks), tree.descent_
    return Source(
        blocks=blocks, kernels=np.empty((len(blocks), BLOCK)), sums=np.empty(len(blocks)),
        nodes=_fixed(descent.nodes), leaves=_fixed(descent.starts), members=_fixed(descent.members),
        leaf_weights=np.empty(descent.largest), frames=_fixed(tree.frames_),
        cost=_fixed(future.courses()[0]), turn=_fixed(future.turn), speed=_fixed(future.speed),
        activity=_fixed(future.activity), way_out=_fixed(future.courses()[1]), ground=_fixed(future.ground),
        place=_fixed(future.place), channels=_fixed(tree.basis_.channels), weights=_fixed(weights),
        offset=_fixed(offset), owns=_fixed(np.isin(np.arange(25), PARTS[tree.part])),
    )  # fmt: skip


def _fixed(array: np.ndarray) -> np.ndarray:
    view = np.ascontiguousarray(np.asarray(array)).view()
    view.flags.writeable = False
    return view


def _state(recent: np.ndarray, pose: np.ndarray, windows: np.ndarray, ground) -> State:
    """The state after ten frames of parameters `recent` (10, 50), with the last pose `pose` (25,)."""
    earliest = recent[:1, :25] - recent[:1, 25:] / FPS
    rows = np.concatenate([recent[::-1, :25], earliest])
    for i in range(len(rows)):
        rows[i, _ANGLES] = turned_towards(rows[i], rows[i - 1] if i else pose)[_ANGLES]
    nothing, count = np.zeros(25), np.zeros(1, dtype=np.int64)
    return State(rows, nothing, nothing.copy(), pose.copy(), windows.astype(np.int64), count, footing_on(ground))


def _check_parts(trees) -> None:
    parts = [tree.part for tree in trees]
    if parts not in (["body"], ["lower", "upper"]):
        raise MotionError(
            f"synthesis needs a tree of the whole body, or one of the lower and upper= of the upper body, got {parts}"
        )
    poses = [tree.database_.poses for tree in trees]
    if len(poses) == 2 and not (poses[0].shape == poses[1].shape and np.array_equal(poses[0][::97], poses[1][::97])):
        raise MotionError("tree and upper must be fitted to the same database: their poses differ")


def _check(fine, name: str, value, expected: str) -> None:
    if not fine:
        raise MotionError(f"{name} must be {expected}, got {value!r}")


def _unknown(activity: str, known) -> str:
    return f"the database has no activity {activity!r}; it has: {', '.join(known)}"
