r"""Motion as a database knows it (paper C, sections 3 and 6): each particle is what just happened, Φ_t, and goes on as
one of the windows that are like it.

    φ_t+1 ~ p(φ_t+1 | Φ_t) = Σ_i p(Ψ_i | Φ_t) N(ψ_i(t + 1) + what differs, noise² diag(deviation²))

Windows are drawn by the tree of `motionenv.models.tree`; what differs between window and history is carried over, and
the noise is as large as such predictions are off (`motionenv.models.tree.forecast`), and slow: it moves the history too, so that
the next window is looked for where the body is, and not where its velocity is noise. The paper's first particles are
windows "whose last time step correspond well" with the given pose: here drawn by a Gaussian kernel, as narrow as leaves
enough of them.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.tracking import _tree_prior_kernels as kernels
from motionenv.estimation.tracking.priors import Start
from motionenv.models.store import load
from motionenv.models.tree.database import leg_length
from motionenv.models.tree.forecast import steps
from motionenv.models.tree.frames import FPS, WINDOW, local
from motionenv.models.tree.model import METHODS, PARTS, MotionTree
from motionenv.types import POSE, Skeleton

_ENOUGH = 20.0  # windows that each candidate of a start is drawn from, as an effective number
_BISECTIONS = 40
_LIKE, _STEP = 0.05, 0.03  # [m, rad] how far windows are from people in poses, and in steps of a frame
_FADING = 0.8  # share that the frame before takes over, of what moves a pose
_FADED = _FADING ** np.arange(WINDOW, -1.0, -1.0)
_INCREMENTS = (0, 1, 5)


@dataclass(frozen=True, eq=False)
class TreeState:
    """N bodies with their histories.

    Attributes:
        poses: (N, 25) [m, rad].
        history: (N, 11, c) float32, local parameters (`motionenv.models.tree.frames.local`) of the last frames, oldest
            first, of the tree's part of the body and in its lengths; the oldest is there for velocities.
    """

    poses: np.ndarray
    history: np.ndarray

    def take(self, which: np.ndarray) -> "TreeState":
        """The bodies `which` (n,)."""
        return TreeState(self.poses[which], self.history[which])


class TreePrior:
    """Bodies that go on as somebody in a database did.

    Args:
        tree: a fitted `MotionTree`, or the name or path of one. One of a part of the body moves that part alone.
        temperature: β of the draws; near 0 the nearest window follows.
        method: "tree", the paper's search, or "exact".
        leaf: of "tree": how a window is chosen in the leaf, "uniform" or by the "kernel".
        noise: as a share of how far predictions are off on average.
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
        method: str = "exact",
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
                f"method must be one of {METHODS}, temperature above 0 and noise from 0, "
                f"got {method!r}, {temperature!r} and {noise!r}"
            )
        self.fps, self.tree = FPS, tree
        self.skeleton = tree.database_.skeleton if skeleton is None else skeleton
        self._scale = leg_length(tree.database_.skeleton) / leg_length(self.skeleton)
        self._entries = np.array(PARTS[tree.part])
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
        row, poses, _ = start.draw(n, rng)
        others = [e for e in range(len(POSE)) if e not in self._entries]
        poses[:, others] = start.poses[row][:, others]
        windows = np.empty(n, dtype=np.int64)
        for candidate in np.unique(row):
            mine = row == candidate
            weights = self._likeness(start, candidate)
            windows[mine] = np.searchsorted(weights.cumsum(), weights.sum() * rng.random(mine.sum()), side="right")
        frames = self.tree.frames_[np.minimum(windows, len(self.tree.frames_) - 1)]
        history = self._histories(frames)
        self._fit_last(history, poses, start.previous[row])
        return TreeState(poses, history.astype(np.float32))

    def propagate(self, state: TreeState, rng: np.random.Generator) -> TreeState:
        """The bodies one frame later; see `motionenv.estimation.tracking.priors.Prior`.

        Args:
            state: (N).
            rng: of draws and noise.
        """
        tree, n = self.tree, len(state.poses)
        probes = np.empty((n, len(self._offset)), dtype=np.float32)
        kernels.coefficients_of(state.history, self._weights, self._offset, probes)
        key = int(rng.integers(2**64, dtype=np.uint64))
        windows, _ = tree.draw(probes, 1, self._temperature, key, self._method, self._leaf, False)
        now, after = steps(tree.database_, tree.frames_[windows[:, 0]])
        noise = self._noise * rng.standard_normal((n, len(self._entries)))
        carried = tree.forecast_
        history, poses = np.empty_like(state.history), np.empty_like(state.poses)
        kernels.carried_on(
            state.history, self._entries, now, after, carried.pose, carried.velocity, FPS, history
        )
        kernels.placed_after(state.poses, history, self._entries, noise, self._scale, poses)
        kernels.shifted(history, self._entries, noise, _FADED)
        return TreeState(poses, history)

    def diffuse(self, state: TreeState, share: float, rng: np.random.Generator) -> TreeState:
        """The bodies in the same frame, with `share` of a step's noise.

        Args:
            state: (N).
            share: 0 to 1.
            rng: of the noise.
        """
        noise = share * self._noise * rng.standard_normal((len(state.poses), len(self._entries)))
        noise[:, self._entries < 3] /= self._scale
        poses = state.poses.copy()
        poses[:, self._entries] += noise
        return self.moved(state, poses)

    def moved(self, state: TreeState, poses: np.ndarray) -> TreeState:
        """The bodies in other `poses` (N, 25): place and heading take the whole history with them.

        Of height and angles the frames before take less and less over, so that velocities change little.

        Args:
            state: (N).
            poses: (N, 25) [m, rad].
        """
        new = state.poses.copy()
        new[:, self._entries] = poses[:, self._entries]
        by = (new - state.poses)[:, self._entries] * np.where(self._entries < 3, self._scale, 1.0)
        history = state.history.copy()
        kernels.shifted(history, self._entries, by, _FADED)
        return TreeState(new, history)

    def _likeness(self, start: Start, candidate: int) -> np.ndarray:
        """How likely (windows,) each window is to end like a candidate of `start`: a linear search, as in the paper."""
        tree, entries = self.tree, self._entries
        pose, previous = start.poses[candidate], start.previous[candidate]
        increment = np.isin(entries, _INCREMENTS)
        scaled = np.where(entries < 3, self._scale, 1.0)
        change = local(previous, pose)[entries]
        seen = np.where(increment, change, pose[entries]) * scaled
        stepped = (pose - previous)[entries] * scaled
        precision = np.stack(
            [
                np.where(increment, 1 / _STEP**2, 1 / (_LIKE**2 + (start.spread[entries] * scaled) ** 2)),
                np.where(increment, 0.0, 1 / _STEP**2),
            ]
        )
        wanted = np.stack([seen, stepped])
        precision[np.isnan(wanted)] = 0.0
        cost = np.empty(len(tree.frames_))
        kernels.misfits(tree.database_.poses, tree.frames_, entries, np.nan_to_num(wanted), precision, cost)
        return _wide_enough(cost - cost.min())

    def _histories(self, frames: np.ndarray) -> np.ndarray:
        """Local parameters (n, 11, c) of the windows that end at `frames` (n,), and of the frame before each."""
        now, _ = steps(self.tree.database_, frames[:, None] + np.arange(1 - WINDOW, 1))
        told = now[..., :25] - np.concatenate([now[:, :1, 25:], np.zeros_like(now[:, 1:, 25:])], axis=1) / FPS
        history = np.concatenate([told[:, :1], now[..., :25]], axis=1)
        return history[..., self._entries]

    def _fit_last(self, history: np.ndarray, poses: np.ndarray, previous: np.ndarray) -> None:
        """Let `history` (n, 11, c) end in `poses` (n, 25), after those before them (n, 25) where they aren't NaN."""
        entries = self._entries
        scaled = np.where(entries < 3, self._scale, 1.0)
        turned = entries > 2
        increment = np.isin(entries, _INCREMENTS)
        last = np.where(increment, local(previous, poses)[:, entries], poses[:, entries]) * scaled
        before = np.where(increment, np.nan, previous[:, entries]) * scaled
        off = np.where(np.isnan(last), 0.0, last - history[:, -1])
        off_before = np.where(np.isnan(before), _FADING * off, before - history[:, -2])
        for each in (off, off_before):
            each[:, turned] -= 2 * np.pi * np.round(each[:, turned] / (2 * np.pi))
        off_before[:, increment] = 0.0
        history[:, -1] += off
        history[:, :-1] += off_before[:, None] * _FADED[1:, None]


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
    """exp(-½ cost · power), with the power up to 1 that leaves an effective number of windows."""
    enough = min(_ENOUGH, 0.5 * len(cost))
    low, high = 0.0, 1.0
    for _ in range(_BISECTIONS):
        power = high if low == 0.0 and high == 1.0 else 0.5 * (low + high)
        weights = np.exp(-0.5 * power * cost)
        effective = weights.sum() ** 2 / (weights**2).sum()
        if effective >= enough and power == 1.0:
            return weights
        low, high = (power, high) if effective >= enough else (low, power)
    return np.exp(-0.5 * low * cost)
