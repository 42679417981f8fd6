r"""Motion as a database knows it (paper C, sections 3 and 6).

Each particle has a history Φ_t of ten frames, and goes on as one of the windows Ψ_i that are like it:

    Φ_t+1 = Φ_t and Ψ_i's next frame, i ~ p(Ψ_i | Φ_t);    φ_t+1 = ψ_t+1 + δ_t+1;    δ_t+1 = a δ_t + η

Windows are drawn by the tree of `motionenv.models.tree`, and how window and history differ is carried over. In the
paper the history is that of the tracked poses themselves. People whom the database doesn't know, noise, and whatever
moves particles from outside leave the database, though, and histories out there are like no window: what follows is
at random. So the history is kept within what the database says, and δ holds what the pose is beside it.

The paper's first particles are windows "whose last time step correspond well" with the given pose: here drawn by a
Gaussian kernel, as narrow as leaves enough of them.
"""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from motionenv.body import from_height
from motionenv.errors import MotionError
from motionenv.estimation.numeric import as_number, checked_whole
from motionenv.estimation.tracking import _tree_prior_kernels as kernels
from motionenv.estimation.tracking.priors import Start
from motionenv.models.reaching import RIGHT_ARM, reach
from motionenv.models.store import load
from motionenv.models.tree.database import Clip, build_database, leg_length
from motionenv.models.tree.forecast import steps
from motionenv.models.tree.frames import FPS, WINDOW, local, turned_towards
from motionenv.models.tree.model import METHODS, PARTS, MotionTree
from motionenv.types import POSE, Motion, Skeleton

_ENOUGH = 20.0  # windows that each candidate of a start is drawn from, as an effective number
_BISECTIONS = 30
_LIKE, _STEP = 0.08, 0.02  # [m, rad] how far windows are from people in poses, and in the steps of a frame
_MEMORY = 1.0  # [s] of δ
_INCREMENTS = (0, 1, 5)


@dataclass(frozen=True, eq=False)
class TreeState:
    """N bodies with their histories.

    Attributes:
        poses: (N, 25) [m, rad].
        history: (N, 11, c) float32, local parameters (`motionenv.models.tree.frames.local`) of the last frames, oldest
            first, of the tree's part of the body and in its lengths; the oldest is there for velocities.
        rest: (N, c) δ, in the tree's lengths; 0 for steps and turns of the way, which place and heading add up.
    """

    poses: np.ndarray
    history: np.ndarray
    rest: np.ndarray

    def take(self, which: np.ndarray) -> "TreeState":
        """The bodies `which` (n,)."""
        return TreeState(self.poses[which], self.history[which], self.rest[which])


class TreePrior:
    """Bodies that go on as somebody in a database did.

    Args:
        tree: a fitted `MotionTree`, or the name or path of one. One of a part of the body moves that part alone.
        temperature: β of the draws; near 0 the nearest window follows.
        method: "tree", the paper's search, or "exact", which is several times slower.
        leaf: of "tree": how a window is chosen in the leaf, "uniform" or by the "kernel".
        noise: η, as a share of how far predictions from windows are off on average.
        skeleton: the body; None takes the database's.
        fps: frames per second; a tree knows 30 only.

    Raises:
        MotionError: another model, or a number out of range.
    """

    def __init__(
        self,
        tree: MotionTree | str = "mixed/tree",
        *,
        temperature: float = 0.05,
        method: str = "tree",
        leaf: str = "kernel",
        noise: float = 1.0,
        skeleton: Skeleton | None = None,
        fps: float = FPS,
    ):
        tree = load(tree) if isinstance(tree, str) else tree
        if not isinstance(tree, MotionTree):
            raise MotionError(f"a TreePrior needs a MotionTree such as mixed/tree, got {type(tree).__name__}")
        tree.check()
        if fps != FPS:
            raise MotionError(f"a tree knows how bodies move at {FPS:g} frames/s, got fps={fps!r}: use another prior")
        if method not in METHODS or not 0 < temperature < np.inf or not 0 <= noise < np.inf:
            raise MotionError(
                f"method must be one of {', '.join(METHODS)}, temperature above 0 and noise from 0, "
                f"got {method!r}, {temperature!r} and {noise!r}"
            )
        self.fps, self.tree = FPS, tree
        self.skeleton = tree.database_.skeleton if skeleton is None else skeleton
        self._scale = leg_length(tree.database_.skeleton) / leg_length(self.skeleton)
        self._entries = np.array(PARTS[tree.part])
        self._scaled = np.where(self._entries < 3, self._scale, 1.0)
        self._increment = np.isin(self._entries, _INCREMENTS)
        self._temperature, self._method, self._leaf = float(temperature), method, leaf
        self._noise = noise * tree.forecast_.deviation[self._entries]
        self._weights, self._offset = _filter(tree)

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> TreeState:
        """Bodies (n) in the poses of `start`, with the histories of windows that end like them.

        Args:
            start: the first frame.
            n: how many.
            rng: of the draws.
        """
        row, drawn, _ = start.draw(n, rng)
        poses = start.poses[row]
        poses[:, self._entries] = drawn[:, self._entries]
        windows = np.empty(n, dtype=np.int64)
        for candidate in np.unique(row):
            mine = np.flatnonzero(row == candidate)
            edges = self._likeness(start, candidate).cumsum()
            windows[mine] = np.searchsorted(edges[:-1], edges[-1] * rng.random(len(mine)), side="right")
        history = self._histories(self.tree.frames_[windows])
        rest = self._left_over(poses, history[:, -1])
        return TreeState(poses, history, rest)

    def propagate(self, state: TreeState, rng: np.random.Generator) -> TreeState:
        """The bodies one frame later; see `motionenv.estimation.tracking.priors.Prior`.

        Args:
            state: (N).
            rng: of draws and noise.
        """
        tree, entries = self.tree, self._entries
        probes = np.empty((len(state.poses), len(self._offset)), dtype=np.float32)
        kernels.coefficients_of(state.history, self._weights, self._offset, probes)
        key = int(rng.integers(2**64, dtype=np.uint64))
        windows, _ = tree.draw(probes, 1, self._temperature, key, self._method, self._leaf, False)
        now, after = steps(tree.database_, tree.frames_[windows[:, 0]])
        share = tree.forecast_
        history, poses = np.empty_like(state.history), np.empty_like(state.poses)
        kernels.carried_on(state.history, entries, now, after, share.pose, share.velocity, FPS, history)
        noise = self._noise * rng.standard_normal(state.rest.shape)
        rest = np.where(self._increment, 0.0, np.exp(-1 / (FPS * _MEMORY)) * state.rest + noise)
        kernels.placed_after(state.poses, history, rest, entries, noise, self._scale, poses)
        return TreeState(poses, history, rest)

    def diffuse(self, state: TreeState, share: float, rng: np.random.Generator) -> TreeState:
        """The bodies in the same frame, with `share` of a step's noise.

        Args:
            state: (N).
            share: 0 to 1.
            rng: of the noise.
        """
        poses = state.poses.copy()
        poses[:, self._entries] += share * (self._noise / self._scaled) * rng.standard_normal(state.rest.shape)
        return self.moved(state, poses)

    def moved(self, state: TreeState, poses: np.ndarray) -> TreeState:
        """The bodies in other `poses` (N, 25): what the history doesn't say becomes δ.

        Args:
            state: (N).
            poses: (N, 25) [m, rad]; entries of other parts of the body are left as they are.
        """
        new = state.poses.copy()
        new[:, self._entries] = poses[:, self._entries]
        return TreeState(new, state.history, self._left_over(new, state.history[:, -1]))

    def log_transition(self, before: TreeState, after: TreeState, later: TreeState | None = None) -> NoReturn:
        """None: these bodies can't be smoothed by backward simulation.

        The next frame of a history is a function of the history and of the window drawn, without noise; only its own
        past, frame by frame, can have led to a history, and motions drawn backwards would be the particles' lines of
        descent. Poses alone, freed of their histories, would need a sum over all windows of all frames to come, as
        each is drawn for a history that hangs on those before. Leaving either out would smooth another model.

        Args:
            before: one frame.
            after: the next.
            later: the one after that.

        Raises:
            MotionError: always.
        """
        raise MotionError(
            "a TreePrior can't be smoothed: none but its own past can have led to a particle's history; "
            "take an FPCAPrior or a VelocityPrior"
        )

    def _left_over(self, poses: np.ndarray, said: np.ndarray) -> np.ndarray:
        """δ (n, c): what `poses` (n, 25) are more than local parameters `said` (n, c)."""
        rest = np.zeros((len(poses), len(POSE)))
        rest[:, self._entries] = np.where(self._increment, 0.0, poses[:, self._entries] * self._scaled - said)
        return turned_towards(rest, np.zeros(len(POSE)))[:, self._entries]

    def _likeness(self, start: Start, candidate: int) -> np.ndarray:
        """How likely (windows,) each window is to end like a candidate of `start`: a linear search, as in the paper."""
        tree, entries = self.tree, self._entries
        pose, previous = start.poses[candidate], start.previous[candidate]
        wanted = np.stack([np.where(self._increment, local(previous, pose)[entries], pose[entries]),
                           (pose - previous)[entries]]) * self._scaled  # fmt: skip
        spread = np.hypot(_LIKE, start.spread[entries] * self._scaled)
        precision = np.stack([np.where(self._increment, _STEP, spread) ** -2, np.full(len(entries), _STEP**-2)])
        precision[1, self._increment] = 0.0
        precision[np.isnan(wanted)] = 0.0
        cost = np.empty(len(tree.frames_))
        kernels.misfits(tree.database_.poses, tree.frames_, entries, np.nan_to_num(wanted), precision, cost)
        return _wide_enough(cost - cost.min())

    def _histories(self, frames: np.ndarray) -> np.ndarray:
        """Local parameters (n, 11, c) of the windows that end at `frames` (n,), and of the frame before each."""
        now, _ = steps(self.tree.database_, frames[:, None] + np.arange(1 - WINDOW, 1))
        history = np.concatenate([now[:, :1, :25] - now[:, :1, 25:] / FPS, now[..., :25]], axis=1)
        return history[..., self._entries].astype(np.float32)


def reaching_tree(clips: int = 300, seconds: float = 8.0, *, seed: int = 0) -> MotionTree:
    """A tree of the right arm that reaches here and there (`motionenv.models.reaching`), for arms without a capture.

    Args:
        clips: how many arms.
        seconds: that each reaches.
        seed: of the postures.

    Raises:
        MotionError: clips of less than half a second, or none.
    """
    clips = checked_whole(clips, "clips", 1)
    if not 0.5 <= as_number(seconds) < np.inf:
        raise MotionError(f"seconds must be a finite number from 0.5, got {seconds!r}")
    body = from_height()

    def arm(number: int) -> Clip:
        angles = reach(round(seconds * FPS), FPS, np.random.default_rng([seed, number]))
        poses = np.zeros((len(angles), len(POSE)))
        poses[:, RIGHT_ARM] = angles
        return Clip(Motion(poses, body, FPS), f"reach {number}", "reach", str(number))

    return MotionTree(part="right_arm").fit(build_database(arm(number) for number in range(clips)))


def _filter(tree: MotionTree) -> tuple[np.ndarray, np.ndarray]:
    """Weights (11, c, b) and offsets (b,), float32, that give coefficients of eleven frames without velocities."""
    weights, offset = tree.basis_.filter  # last frame first; parameters, then velocities
    half = weights.shape[1] // 2
    pose, velocity = weights[::-1, :half], weights[::-1, half:] * FPS
    out = np.zeros((WINDOW + 1, half, weights.shape[2]))
    out[1:] += pose + velocity
    out[:-1] -= velocity
    return out.astype(np.float32), offset.astype(np.float32)


def _wide_enough(cost: np.ndarray) -> np.ndarray:
    """exp(-½ power · cost), with the highest power up to 1 that leaves enough windows."""
    low, high = 0.0, 1.0
    if _effective(cost, high) >= _ENOUGH:
        return np.exp(-0.5 * cost)
    for _ in range(_BISECTIONS):
        power = 0.5 * (low + high)
        low, high = (power, high) if _effective(cost, power) >= _ENOUGH else (low, power)
    return np.exp(-0.5 * low * cost)


def _effective(cost: np.ndarray, power: float) -> float:
    weights = np.exp(-0.5 * power * cost)
    return float(weights.sum() ** 2 / (weights**2).sum())
