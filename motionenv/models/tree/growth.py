"""Motion of any length from a tree, frame by frame (paper C, section 5), with what the paper leaves to the future.

For each frame a window i is drawn from p(i | t), the last ten frames given, and the pose after it comes next. Beyond
the paper, and each to be switched off in `Options`:

- persistence: a draw from the place where the last one was counts as going on there, and more often than by p(i | t)
  alone a clip is played on; otherwise the motion changes clips twenty times a second.
- blending: where it jumps, what is shown less what the database says fades away (`_growth_kernels._blend`).
- future: windows that lead nowhere are avoided (`outlook`).
- contact: feet that stand stay where they are, on the ground (`_footing_kernels`). What is matched next is the motion
  without that.
- a `Target`, by weighting what was drawn. With r = wanted - promised over the next second, the log weights are
  -4 for another activity, which costs future too, -½ (r / 0.25 rad)² for the turn, of at most 1.2 rad/s, and
  -½ (r / 0.15 m/s)² for the speed.
- two trees, for the lower and the upper body: the upper body's windows are weighted by
  exp(-|c_i - c_t|² / 2β) with the coefficients c of the lower body, so that arms go with legs.
"""

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from motionenv.body.skeleton import ANKLE_HEIGHT
from motionenv.errors import ModelError, MotionError
from motionenv.models.tree._exact_kernels import scratch
from motionenv.models.tree._footing_kernels import footing_on
from motionenv.models.tree._growth_kernels import Settings, Source, State, grow
from motionenv.models.tree.database import Database
from motionenv.models.tree.frames import FPS, WINDOW, parameters, turned_towards
from motionenv.models.tree.model import METHODS, PARTS, MotionTree
from motionenv.models.tree.outlook import Outlook, look_ahead
from motionenv.types import Motion

_ANGLES = [3, 4, *range(6, 25)]
_SHORTEST = 1e-3  # [s] of blending: below, powers of its rate overflow
_NOISIEST = 100.0  # beyond, poses are of no body, and overflow
_LEAD = 30  # windows that follow in the clip, at least, where a motion starts


@dataclass(frozen=True)
class Options:
    """How a motion grows.

    Attributes:
        temperature: β; near 0 the nearest window follows, at 1 anything of the database's own spread.
        method: "exact" draws from p(i | t), "tree" by the paper's search.
        persistence: [s] mean time for which a clip is played on before a draw counts; 0 as in the paper.
        candidates: how many windows are drawn for each frame and weighted against each other.
        blend: [s] half-life of differences where the motion jumps; 0 shows the jumps.
        future: whether windows that lead nowhere are avoided.
        contact: whether feet are kept on their place while they stand.
        noise: Gaussian noise added to each pose, as a share of how far predictions are off on average.

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

    def __post_init__(self):
        _check(0 < self.temperature < np.inf, "temperature", self.temperature, "a number above 0")
        _check(self.method in METHODS, "method", self.method, " or ".join(map(repr, METHODS)))
        _check(0 <= self.persistence < np.inf, "persistence", self.persistence, "seconds from 0")
        _check(_is_count(self.candidates), "candidates", self.candidates, "a whole number from 1")
        fine = self.blend == 0 or _SHORTEST <= self.blend < np.inf
        _check(fine, "blend", self.blend, f"0 or seconds from {_SHORTEST}")
        _check(0 <= self.noise <= _NOISIEST, "noise", self.noise, f"a share from 0 to {_NOISIEST:g}")


@dataclass(frozen=True)
class Target:
    """What a motion is steered to; None leaves it free.

    Attributes:
        activity: a label of the database, such as "walk".
        heading: [rad] of the pelvis in the world, 0 along x.
        speed: [m/s] over the ground.

    Raises:
        MotionError: a number out of range.
    """

    activity: str | None = None
    heading: float | None = None
    speed: float | None = None

    def __post_init__(self):
        _check(self.heading is None or np.isfinite(self.heading), "heading", self.heading, "a finite number of radians")
        _check(self.speed is None or 0 <= self.speed < np.inf, "speed", self.speed, "metres per second from 0")


class Growth:
    """A motion that grows from a tree, 30 frames a second.

    Args:
        tree: of the whole body, or of the "lower" one where `upper` is given.
        start: what the motion follows: poses (frames, 25) or a `Motion` at 30 frames/s, of which the last 10 to 12
            frames count; an activity of the database, of which the seed picks a window; or None, for any window.
        seed: int or Generator; what comes out doesn't depend on how it is cut into steps.
        upper: tree of the "upper" body, of the same database.
        options: see `Options`.
        target: see `Target`; may be set anew between steps.

    Attributes:
        skeleton: the body whose poses they are: that of a `Motion` to start from, else the database's.

    Raises:
        MotionError: a history as in `MotionTree.sample`, an activity that the database doesn't have, or trees that
            don't go together.
    """

    def __init__(
        self,
        tree: MotionTree,
        start=None,
        *,
        seed=None,
        upper: MotionTree | None = None,
        options: Options | None = None,
        target: Target | None = None,
    ):
        self._trees = (tree,) if upper is None else (tree, upper)
        for each in self._trees:
            each.check()
        _check_parts(self._trees)
        self._options = options or Options()
        self._outlooks = [outlook_of(t) for t in self._trees]
        self._sources = tuple(_source(t, o) for t, o in zip(self._trees, self._outlooks, strict=True))
        self.target = target or Target()
        self.skeleton = start.skeleton if isinstance(start, Motion) else tree.database_.skeleton
        rng = np.random.default_rng(seed)
        self._scale = 1.0
        self._state = self._started(start, rng)
        self._key = np.uint64(rng.integers(2**64, dtype=np.uint64))

    @property
    def target(self) -> Target:
        """What the motion is steered to."""
        return self._target

    @target.setter
    def target(self, target: Target) -> None:
        known = self._outlooks[0].activities
        if target.activity is not None and target.activity not in known:
            raise MotionError(_unknown(target.activity, known))
        self._target = target
        self._activity = -1 if target.activity is None else known.index(target.activity)
        futures = [outlook.towards(self._activity) for outlook in self._outlooks]
        self._sources = tuple(
            source._replace(cost=_fixed(cost), way_out=_fixed(way_out))
            for source, (cost, way_out) in zip(self._sources, futures, strict=True)
        )

    @property
    def windows(self) -> np.ndarray:
        """Position (trees,) of the window that the last frame followed, in each tree; -1 before the first."""
        return self._state.windows.copy()

    def step(self, frames: int) -> np.ndarray:
        """The next poses (frames, 25) [m, rad].

        Args:
            frames: how many, from 1.

        Raises:
            MotionError: not such a number.
            ModelError: the tree's file was changed in place, or holds NaN.
        """
        _check(_is_count(frames), "frames", frames, "a whole number from 1")
        for tree in self._trees:
            tree.check()
        out = np.empty((int(frames), 25))
        stands, poses = self._outlooks[0].stands, self._trees[0].database_.poses
        offsets, height = self.skeleton.offsets * self._scale, self.skeleton.height * self._scale
        grow(self._sources, self._settings(), self._state, _fixed(poses), stands, offsets, height, self._key, out)
        if not np.isfinite(out).all():
            raise ModelError("the tree's database holds NaN or infinity, so its file is damaged: build it again")
        out[:, :3] /= self._scale
        return out

    def _settings(self) -> Settings:
        o, wanted = self._options, self._target
        noise = np.zeros(25)
        for tree in self._trees if o.noise else ():
            own = list(PARTS[tree.part])
            noise[own] = o.noise * tree.forecast_.plain_deviation[own]
        return Settings(
            temperature=float(o.temperature),
            paper=o.method == "tree",
            stay=float(np.exp(-1 / (o.persistence * FPS))) if o.persistence else 0.0,
            candidates=int(o.candidates),
            quickness=2 * np.log(2) / o.blend if o.blend else np.inf,
            future=bool(o.future),
            contact=bool(o.contact),
            noise=noise,
            activity=self._activity,
            heading=np.nan if wanted.heading is None else float(wanted.heading),
            pace=np.nan if wanted.speed is None else float(wanted.speed) * self._scale,
        )

    def _started(self, start, rng: np.random.Generator) -> State:
        """The state after a history, or at a window that `rng` picks."""
        if start is None or isinstance(start, str):
            return self._started_in_database(start, rng)
        recent = self._trees[0].recent(start)
        if recent.last.ndim != 1:
            raise MotionError("a motion starts from one history (frames, 25), got a batch of them")
        self._scale = recent.scale
        ground = (0.0, ANKLE_HEIGHT * self.skeleton.height * self._scale, 0.0)
        return _state(recent.parameters, recent.last, np.full(len(self._trees), -1), ground)

    def _started_in_database(self, activity: str | None, rng: np.random.Generator) -> State:
        database, outlook = self._trees[0].database_, self._outlooks[0]
        i = _start_window(self._trees[0], activity, rng)
        frame = self._trees[0].frames_[i]
        recent = parameters(_leading_to(database, frame))[-WINDOW:]
        pose = database.poses[frame].astype(np.float64)
        pose[[0, 1, 5]] = 0.0
        windows = np.array([o.place[frame - 1] for o in self._outlooks])
        return _state(recent, pose, windows, outlook.ground[i])


def history(tree: MotionTree, activity: str | None = None, *, seed=None) -> np.ndarray:
    """The last 10 to 12 poses (frames, 25) [m, rad] at 30 frames/s of a window of the database, to start from.

    Args:
        tree: whose database.
        activity: a label of the database, or None for any window.
        seed: int or Generator, which picks the window: the one that `Growth` starts from with the same seed.

    Raises:
        MotionError: an activity that the database doesn't have.
    """
    i = _start_window(tree, activity, np.random.default_rng(seed))
    return _leading_to(tree.database_, tree.frames_[i]).astype(np.float64)


def synthesize(
    tree: MotionTree,
    seconds: float,
    *,
    start=None,
    temperature: float = 0.05,
    seed=None,
    method: str = "exact",
    upper: MotionTree | None = None,
    target: Target | None = None,
    **others,
) -> Motion:
    """A motion (frames, 25) at 30 frames/s from a tree.

    Args:
        tree: of the whole body, or of the "lower" one where `upper` is given.
        seconds: duration [s], up to an hour; `Growth` goes on for longer.
        start: a history, an activity or None, as in `Growth`; the history itself is not repeated.
        temperature: β.
        seed: int or Generator.
        method: "exact" or "tree".
        upper: tree of the "upper" body.
        target: activity, heading and speed to steer to.
        others: further `Options`.

    Raises:
        MotionError: an option out of range, or as `Growth`.
    """
    _check(0 < seconds <= 3600, "seconds", seconds, "a number above 0, up to 3600")
    options = Options(temperature=temperature, method=method, **others)
    growth = Growth(tree, start, seed=seed, upper=upper, options=options, target=target)
    poses = growth.step(max(1, round(seconds * FPS)))
    return Motion(poses, growth.skeleton, FPS, start if isinstance(start, str) else "")


_OUTLOOKS: WeakKeyDictionary[MotionTree, Outlook] = WeakKeyDictionary()


def outlook_of(tree: MotionTree) -> Outlook:
    """What comes after each window of a fitted tree; worked out once, as long as the tree lives."""
    tree.check()
    if tree not in _OUTLOOKS:
        index = tree.index_
        _OUTLOOKS[tree] = look_ahead(tree.database_, tree.frames_, _fixed(index.blocks), _fixed(index.boxes))
    return _OUTLOOKS[tree]


def _start_window(tree: MotionTree, activity: str | None, rng: np.random.Generator) -> int:
    """Position of a window of an activity that a motion can start from.

    Raises:
        MotionError: an activity that the database doesn't have.
    """
    outlook = outlook_of(tree)
    if activity is not None and activity not in outlook.activities:
        raise MotionError(_unknown(activity, outlook.activities))
    known = _STARTS.setdefault(tree, {})
    if activity not in known:
        known[activity] = _starts(tree, outlook, activity)
    among = known[activity]
    return int(among[rng.integers(len(among))])


_STARTS: WeakKeyDictionary[MotionTree, dict[str | None, np.ndarray]] = WeakKeyDictionary()


def _starts(tree: MotionTree, outlook: Outlook, activity: str | None) -> np.ndarray:
    """Positions of the windows that motion can start from, in an order that all trees of a database share."""
    database, frames = tree.database_, tree.frames_
    among = np.arange(len(frames)) if activity is None else np.flatnonzero(
        outlook.activity == outlook.activities.index(activity)
    )  # fmt: skip
    left = database.starts[1:][database.sequence_of(frames[among])] - frames[among]
    among = among[left >= min(_LEAD, left.max())]
    return among[np.argsort(frames[among])]


def _leading_to(database: Database, frame: int) -> np.ndarray:
    """The poses (10 to 12, 25) of a clip up to one of its frames."""
    first = database.starts[database.sequence_of(frame)]
    return database.poses[max(first, frame - WINDOW - 1) : frame + 1]


def _source(tree: MotionTree, outlook: Outlook) -> Source:
    """A tree as the loop sees it. All read-only, so that mapped trees and fitted ones take the same compiled code."""
    weights, offset = tree.basis_.filter
    index, descent = tree.index_, tree.descent_
    return Source(
        blocks=_fixed(index.blocks),
        boxes=_fixed(index.boxes),
        n=int(index.n),
        scratch=scratch(index.n, index.boxes.shape[3]),
        nodes=_fixed(descent.nodes),
        leaves=_fixed(descent.starts),
        members=_fixed(descent.members),
        leaf_weights=np.empty(descent.largest),
        frames=_fixed(tree.frames_),
        cost=_fixed(outlook.towards()[0]),
        turn=_fixed(outlook.turn),
        speed=_fixed(outlook.speed),
        activity=_fixed(outlook.activity),
        way_out=_fixed(outlook.towards()[1]),
        ground=_fixed(outlook.ground),
        place=_fixed(outlook.place),
        channels=_fixed(tree.basis_.channels),
        weights=_fixed(weights),
        offset=_fixed(offset),
        owns=_fixed(np.isin(np.arange(25), PARTS[tree.part])),
    )


def _fixed(array: np.ndarray) -> np.ndarray:
    """A read-only contiguous view of an array, or copy."""
    view = np.ascontiguousarray(np.asarray(array)).view()
    view.flags.writeable = False
    return view


def _state(recent: np.ndarray, pose: np.ndarray, windows: np.ndarray, ground) -> State:
    """The state after ten frames of parameters `recent` (10, 50), with `pose` (25,) the last shown."""
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
            f"synthesis needs a tree of the whole body, or of the lower and with upper= of the upper, got {parts}"
        )
    poses = [tree.database_.poses for tree in trees]
    if len(poses) == 2 and not (poses[0].shape == poses[1].shape and np.array_equal(poses[0][::97], poses[1][::97])):
        raise MotionError("tree and upper must be fitted to the same database: their poses differ")


def _is_count(value) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool) and bool(value >= 1)


def _check(fine, name: str, value, expected: str) -> None:
    if not fine:
        raise MotionError(f"{name} must be {expected}, got {value!r}")


def _unknown(activity: str, known) -> str:
    return f"the database has no activity {activity!r}; it has: {', '.join(known)}"
