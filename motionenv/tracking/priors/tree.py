r"""Motion prior from a database (paper C, sections 3 and 6).

Each particle has a history Φ_t of ten frames, and continues like one of the similar windows Ψ_i:

    Φ_t+1 = Φ_t and Ψ_i's next frame, i ~ p(Ψ_i | Φ_t);    φ_t+1 = ψ_t+1 + δ_t+1;    δ_t+1 = a δ_t + η

The tree of `motionenv.models.motion_tree` draws the windows, and the difference between window and history is carried
over. As people turn more, bodies turn beyond their windows at people's rates. In the paper the history consists of the
tracked poses. But people outside of the database, noise and other priors move particles away from the database, where
no window is similar and the continuation is random. Here the history stays close to the database, and δ is the pose's
deviation from it.

The paper's first particles are windows "whose last time step correspond well" with the given pose. Here a Gaussian
kernel draws them, as narrow as possible while enough windows remain.
"""

from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_choice, checked_number
from motionenv.errors import MotionError
from motionenv.models.motion_tree.database import leg_length
from motionenv.models.motion_tree.features import FPS, WINDOW, local, turned_towards
from motionenv.models.motion_tree.forecast import steps
from motionenv.models.motion_tree.model import METHODS, PARTS, MotionTree
from motionenv.models.paths.bending import TURN_MEMORY, TURN_RATE
from motionenv.models.registry import load
from motionenv.tracking.priors import _tree_kernels as kernels
from motionenv.tracking.priors.base import Prior, Start, tempered
from motionenv.types import POSE, Skeleton

_ENOUGH = 20.0  # least effective number of windows for each candidate of a start
_LIKE, _STEP = 0.08, 0.02  # [m, rad] deviations of people from windows, in poses and in changes per frame
_MEMORY = 1.0  # [s] correlation time of δ
_INCREMENTS = (0, 1, 5)


@dataclass(frozen=True, eq=False)
class TreeState:
    """N bodies with their histories.

    Attributes:
        poses: (N, 25) [m, rad].
        history: (N, 11, c) float32, local parameters (`motionenv.models.motion_tree.features.local`) of the last
            frames, oldest first, for the tree's part of the body and scaled to its lengths; the oldest gives
            velocities.
        rest: (N, c) δ, scaled to the tree's lengths; 0 for steps and turns, which accumulate in position and heading.
        turn: (N,) rate of turning beyond the windows' [rad/s]; 0 for a part of the body.
    """

    poses: np.ndarray
    history: np.ndarray
    rest: np.ndarray
    turn: np.ndarray
    sizes = None

    def take(self, which: np.ndarray) -> "TreeState":
        return TreeState(self.poses[which], self.history[which], self.rest[which], self.turn[which])


class TreePrior(Prior):
    """Bodies that continue like windows of a motion database.

    Args:
        tree: a fitted `MotionTree`, or its name or path. A tree of a part of the body moves that part only.
        temperature: β of the draws; near 0 the nearest window is chosen.
        method: "tree", the paper's search, or "exact", which is several times slower.
        leaf: how "tree" chooses a window in the leaf: "uniform" or "kernel".
        noise: η, relative to the mean prediction error of windows, and turning beyond them, relative to people's.
        skeleton: the body; None uses the database's.
        fps: frame rate [Hz]; must be 30.

    Raises:
        MotionError: another model, or a number out of range.
    """

    def __init__(
        self, tree: MotionTree | str = "mixed/tree", *, temperature: float = 0.05, method: str = "tree",
        leaf: str = "kernel", noise: float = 1.0, skeleton: Skeleton | None = None, fps: float = FPS,
    ) -> None:  # fmt: skip
        tree = load(tree) if isinstance(tree, str) else tree
        if not isinstance(tree, MotionTree):
            raise MotionError(f"tree must be a MotionTree such as mixed/tree, got {type(tree).__name__}")
        tree.check()
        if fps != FPS:
            raise MotionError(f"fps must be {FPS:g} frames/s, the rate of motion trees, got {fps!r}: use another prior")
        checked_choice(method, "method", METHODS)
        checked_number(temperature, "temperature", above=0)
        checked_number(noise, "noise", 0)
        self.fps, self.size, self.tree = FPS, 0.0, tree
        self.skeleton = tree.database_.skeleton if skeleton is None else skeleton
        self._scale = leg_length(tree.database_.skeleton) / leg_length(self.skeleton)
        self._entries = np.array(PARTS[tree.part])
        self._scaled = np.where(self._entries < 3, self._scale, 1.0)
        self._increment = np.isin(self._entries, _INCREMENTS)
        self._temperature, self._method, self._leaf = float(temperature), method, leaf
        self._noise = noise * tree.forecast_.deviation[self._entries]
        self._weights, self._offset = _filter(tree)
        self._turning = noise * TURN_RATE if 5 in self._entries else 0.0

    def __repr__(self) -> str:
        return f"TreePrior({len(self.tree.frames_)} windows of {self.tree.part}, {self._method}, {self.fps:g} fps)"

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> TreeState:
        """Draw `n` bodies with `rng` in the poses of `start`, with the histories of windows that end similarly."""
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
        return TreeState(poses, history, rest, self._turning * rng.standard_normal(n))

    def propagate(self, state: TreeState, rng: np.random.Generator) -> TreeState:
        tree, entries = self.tree, self._entries
        probes = np.empty((len(state.poses), len(self._offset)), dtype=np.float32)
        kernels.coefficients_of(state.history, self._weights, self._offset, probes)
        key = int(rng.integers(2**64, dtype=np.uint64))
        windows, _ = tree.draw(probes, 1, self._temperature, key, self._method, self._leaf)
        now, after = steps(tree.database_, tree.frames_[windows[:, 0]])
        share = tree.forecast_
        history, poses = np.empty_like(state.history), np.empty_like(state.poses)
        kernels.advance_histories(state.history, entries, now, after, share.pose, share.velocity, FPS, history)
        noise = self._noise * rng.standard_normal(state.rest.shape)
        rest = np.where(self._increment, 0.0, np.exp(-1 / (FPS * _MEMORY)) * state.rest + noise)
        keep = np.exp(-1 / (FPS * TURN_MEMORY))
        turn = keep * state.turn + np.sqrt(1 - keep**2) * self._turning * rng.standard_normal(len(poses))
        half = np.zeros_like(poses)
        half[:, 5] = 0.5 * turn / FPS
        kernels.next_poses(state.poses + half, history, rest, entries, noise, self._scale, poses)
        return TreeState(poses + half, history, rest, turn)

    def diffuse(self, state: TreeState, share: float, rng: np.random.Generator) -> TreeState:
        poses = state.poses.copy()
        poses[:, self._entries] += share * (self._noise / self._scaled) * rng.standard_normal(state.rest.shape)
        return self.moved(state, poses)

    def moved(self, state: TreeState, poses: np.ndarray) -> TreeState:
        """The bodies of `state` with other `poses` (N, 25) [m, rad]: the deviation from the history becomes δ.

        Entries of other parts of the body are ignored.
        """
        new = state.poses.copy()
        new[:, self._entries] = poses[:, self._entries]
        return TreeState(new, state.history, self._left_over(new, state.history[:, -1]), state.turn)

    def _left_over(self, poses: np.ndarray, said: np.ndarray) -> np.ndarray:
        """δ (n, c): `poses` (n, 25) minus the local parameters `said` (n, c)."""
        rest = np.zeros((len(poses), len(POSE)))
        rest[:, self._entries] = np.where(self._increment, 0.0, poses[:, self._entries] * self._scaled - said)
        return turned_towards(rest, np.zeros(len(POSE)))[:, self._entries]

    def _likeness(self, start: Start, candidate: int) -> np.ndarray:
        """Kernel weight (windows,) of each window for a candidate of `start`, by linear search as in the paper."""
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
        return tempered(-0.5 * cost, _ENOUGH)

    def _histories(self, frames: np.ndarray) -> np.ndarray:
        """Local parameters (n, 11, c) of the windows that end at `frames` (n,), and of the frame before each."""
        now, _ = steps(self.tree.database_, frames[:, None] + np.arange(1 - WINDOW, 1))
        history = np.concatenate([now[:, :1, :25] - now[:, :1, 25:] / FPS, now[..., :25]], axis=1)
        return history[..., self._entries].astype(np.float32)


def _filter(tree: MotionTree) -> tuple[np.ndarray, np.ndarray]:
    """Weights (11, c, b) and offsets (b,), float32, that give the coefficients of eleven frames without velocities."""
    weights, offset = tree.basis_.filter  # last frame first; parameters, then velocities
    half = weights.shape[1] // 2
    pose, velocity = weights[::-1, :half], weights[::-1, half:] * FPS
    out = np.zeros((WINDOW + 1, half, weights.shape[2]))
    out[1:] += pose + velocity
    out[:-1] -= velocity
    return out.astype(np.float32), offset.astype(np.float32)
