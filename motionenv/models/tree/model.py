"""The implicit probabilistic model of human motion (Sidenbladh, Black & Sigal 2002, sections 4 and 5).

Given the last ten frames Φ_t, the next pose is the one that follows a window Ψ_i of the database, drawn with

    p(Ψ_i | Φ_t) ∝ exp(-½ (c_i - c_t)ᵀ Σ̃⁻² (c_i - c_t) / β)                            (eq. 3, Observation 1)

where c are the coefficients in the database's principal components and β is the temperature. `method="tree"` draws
with the paper's probabilistic search (eq. 7, 8), which is very fast and only roughly of that distribution;
`method="exact"` draws from the distribution itself.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.models.mapped import Mapping
from motionenv.models.store import load, save_model
from motionenv.models.tree._exact_kernels import BLOCK
from motionenv.models.tree.basis import fit_basis, project
from motionenv.models.tree.database import Database, leg_length
from motionenv.models.tree.descent import LEAVES, CoefficientTree
from motionenv.models.tree.exact import KernelIndex
from motionenv.models.tree.forecast import fit_forecast, following, steps
from motionenv.models.tree.frames import FPS, WINDOW, local, parameters, placed, turned_towards
from motionenv.models.tree.packing import pack, unpack
from motionenv.types import Motion, frozen

#: Entries of the pose vector that a tree of a part of the body looks at, and predicts.
PARTS = {
    "body": tuple(range(25)),
    "lower": (*range(6), *range(17, 25)),
    "upper": tuple(range(6, 17)),
    "left_arm": tuple(range(9, 13)),
    "right_arm": tuple(range(13, 17)),
}
METHODS = ("tree", "exact")


@dataclass(frozen=True, eq=False)
class Samples:
    """What may come next.

    Attributes:
        poses: (..., n, 25) [m, rad], in the world of the history.
        windows: (..., n) which windows were drawn; `MotionTree.frames_[windows]` is the last frame of each.
        log_probability: (..., n) log of the probability with which each window was drawn, for "exact" up to 0.01 too
            high; None where "exact" wasn't asked for it.
    """

    poses: np.ndarray
    windows: np.ndarray
    log_probability: np.ndarray | None


class MotionTree:
    """A database of motion as a probability distribution over the next pose.

    Args:
        splits: "sign" as in the paper, or "median" for the balanced tree that it mentions.
        part: which part of the body it is about, a key of `PARTS`.

    Attributes:
        database_: the `Database`.
        basis_: the `Basis` of its windows.
        frames_: (n,) last frame of each window.
        index_: the windows' coefficients in a kd-tree.
        descent_: the paper's tree.
        forecast_: how poses go on from a window.
        card_: the model card.
        mapping_: the file that its arrays are mapped from, or None.

    Raises:
        MotionError: an unknown `splits` or `part`.
    """

    kind = "tree"

    def __init__(self, *, splits: str = "sign", part: str = "body"):
        if part not in PARTS:
            raise MotionError(f"part must be one of {', '.join(PARTS)}, got {part!r}")
        if splits not in ("sign", "median"):
            raise MotionError(f"splits must be 'sign' or 'median', got {splits!r}")
        self.splits, self.part = splits, part
        self.card_: dict = {}
        self.mapping_: Mapping | None = None

    def fit(self, database: Database) -> "MotionTree":
        """Learn from `database`; what is kept refers to its arrays, without a copy."""
        channels = np.array(PARTS[self.part])
        self.database_ = database
        self.basis_ = fit_basis(database, np.concatenate([channels, channels + 25]))
        n = len(database.windows)
        rows = np.empty((-(-n // BLOCK) * BLOCK, len(self.basis_.deviation)), dtype=np.float32)
        project(database, self.basis_, rows)
        self.forecast_ = fit_forecast(database, rows[:n])
        order = np.arange(n, dtype=np.int32)
        self.index_ = KernelIndex.build(rows, order)
        self.frames_ = database.windows[order]
        self.descent_ = CoefficientTree.build(self.index_.blocks, self.index_.n, self.splits)
        return self

    def coefficients(self, history) -> np.ndarray:
        """Coefficients over their standard deviations, c / σ (..., b) float32, of what just happened.

        Args:
            history: (..., frames, 25) poses at 30 frames/s, oldest first, or a `Motion` of that rate. The last ten
                frames count, and the two before them for their velocities, where there are any.

        Raises:
            MotionError: fewer than ten frames, another shape or rate, or NaN.
        """
        self.check()
        return self.basis_.coefficients(self.recent(history).parameters).astype(np.float32)

    def sample(
        self,
        history,
        n: int = 1,
        *,
        temperature: float = 0.05,
        seed=None,
        method: str = "tree",
        leaf: str = "uniform",
        noise: float = 0.0,
        carry: bool = False,
        probability: bool = False,
    ) -> Samples:
        """Draw what may come next.

        Args:
            history: (..., frames, 25), as in `coefficients`; each leading axis is a history of its own.
            n: draws for each history.
            temperature: β; near 0 the nearest window follows, at 1 anything of the database's own spread.
            seed: int or Generator.
            method: "tree", the paper's search, or "exact".
            leaf: of "tree": how a window is chosen in the leaf, "uniform" or by the "kernel" p(c_i | c_t).
            noise: Gaussian noise added to the poses, as a share of how far predictions are off on average.
            carry: carry over the difference between the history and the window (`motionenv.models.tree.forecast`);
                False takes the pose after the window, as the paper does.
            probability: also say the probability of each draw; for "exact" this costs a sum over the neighbourhood.

        Raises:
            MotionError: a history as in `coefficients`, or an option out of range.
        """
        self.check()
        n = _checked_options(n, noise)
        recent = self.recent(history)
        probes = self.basis_.coefficients(recent.parameters).astype(np.float32)
        flat = probes.reshape(-1, probes.shape[-1])
        rng = np.random.default_rng(seed)
        key = int(rng.integers(2**64, dtype=np.uint64))
        windows, log_probability = self.draw(flat, n, temperature, key, method, leaf, probability)
        windows = windows.reshape(*probes.shape[:-1], n)
        if carry:
            now, after = steps(self.database_, self.frames_[windows])
            after = self.forecast_.carried(recent.parameters[..., -1:, :], now, after)
        else:
            after = following(self.database_, self.frames_[windows])
        if noise > 0:
            deviation = self.forecast_.deviation if carry else self.forecast_.plain_deviation
            after = after + noise * deviation * rng.standard_normal(after.shape)
        if log_probability is not None:
            log_probability = log_probability.reshape(windows.shape)
        return Samples(self._poses(recent, after), windows, log_probability)

    def draw(
        self, probes, n: int, temperature: float, key: int, method: str, leaf: str, probability: bool
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Windows (B, n) drawn for each of the coefficients `probes`, and the log of their probabilities or None.

        Args:
            probes: (B, b) float32, from `coefficients`.
            n: draws for each probe.
            temperature: β.
            key: whole number that the draws are determined by.
            method, leaf, probability: as in `sample`.

        Raises:
            MotionError: an option out of range.
            ModelError: not fitted, or its file was changed in place.
        """
        self.check()
        if method not in METHODS:
            raise MotionError(f"method must be {' or '.join(map(repr, METHODS))}, got {method!r}")
        if leaf not in LEAVES:
            raise MotionError(f"leaf must be {' or '.join(map(repr, LEAVES))}, got {leaf!r}")
        if method == "tree":
            return self.descent_.draw(probes, n, temperature, key, leaf, self.index_.blocks)
        windows = self.index_.draw(probes, n, temperature, key)
        if not probability:
            return windows, None
        total = self.index_.log_normaliser(probes, temperature)
        return windows, self.index_.log_kernel(probes, windows, temperature) - total[:, None]

    def log_density(self, history, after, *, temperature: float = 0.05, draws: int = 256, seed=None,
                    method: str = "exact") -> np.ndarray:  # fmt: skip
        """Log of the predictive density (...) of the local pose that came next, per metre and radian.

        The density is that of the mean of `draws` Gaussians: predictions with the difference carried over, as wide as
        they are off on average. As a Monte Carlo mean it is on average a little too low.

        Args:
            history: (..., frames, 25), as in `coefficients`.
            after: (..., 25) the pose that came next.
            temperature: β.
            draws: windows drawn for each history.
            seed: int or Generator.
            method: "tree" or "exact".

        Raises:
            MotionError: as `sample`.
        """
        after = frozen(after, (..., 25), "after")
        if not np.isfinite(after).all():
            raise MotionError("after has NaN or infinite values: a pose that is missing has no density")
        drawn = self.sample(history, draws, temperature=temperature, seed=seed, method=method, carry=True)
        chosen = np.array(PARTS[self.part])
        last = (history.poses if isinstance(history, Motion) else np.asarray(history))[..., -1, :]
        error = local(last, after)[..., None, :] - local(last[..., None, :], drawn.poses)
        error = turned_towards(error, np.zeros(25))[..., chosen]
        deviation = self.forecast_.deviation[chosen]
        each = -0.5 * ((error / deviation) ** 2).sum(-1) - np.log(deviation * np.sqrt(2 * np.pi)).sum()
        return np.logaddexp.reduce(each, axis=-1) - np.log(draws)

    def save(self, path, card: dict | None = None) -> None:
        """Write the tree to `path` with its model card, by default `card_`; it is mapped into memory when loaded.

        Raises:
            MotionError: the file can't be written.
        """
        arrays, meta = self.to_arrays()
        save_model(path, self.kind, arrays, {**meta, "card": card or self.card_})

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and settings from which `from_arrays` makes the same tree."""
        self.check()
        return pack(self)

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict) -> "MotionTree":
        """The tree that `to_arrays` took apart into `arrays` and `meta`; the arrays are kept, without a copy.

        Raises:
            ModelError: shapes that don't belong together.
        """
        tree = cls(splits=meta["splits"], part=meta["part"])
        unpack(tree, arrays, meta)
        tree.card_ = meta.get("card", {})
        return tree

    def source(self, windows) -> np.ndarray:
        """Index (...) of the database's sequence that each of `windows` (...) is from."""
        self.check()
        return self.database_.sequence_of(self.frames_[windows])

    def leaf(self, windows) -> np.ndarray:
        """Index (...) of the leaf of the paper's tree that each of `windows` (...) is in."""
        self.check()
        return self.descent_.leaf_of(windows)

    def recent(self, history) -> "Recent":
        """What a history says, in the database's terms.

        Args:
            history: as in `coefficients`.

        Raises:
            MotionError: as `coefficients`.
        """
        poses, scale = _checked_history(history, self.database_)
        if scale != 1.0:
            poses = poses.copy()
            poses[..., :3] *= scale
        return Recent(parameters(poses)[..., -WINDOW:, :], poses[..., -1, :], scale)

    def _poses(self, recent: "Recent", after: np.ndarray) -> np.ndarray:
        """Poses (..., n, 25) in the world of the history that come next by local parameters `after` (..., n, 25)."""
        poses = placed(recent.last, after)
        if self.part != "body":
            others = [i for i in range(25) if i not in PARTS[self.part]]
            poses[..., others] = recent.last[..., None, others]
        if recent.scale != 1.0:
            poses[..., :3] /= recent.scale
        return poses

    def __reduce__(self):
        return super().__reduce__() if self.mapping_ is None else self.mapping_.reduced(load)

    def check(self) -> None:
        """Make sure that the tree can be used.

        Raises:
            ModelError: not fitted, or its file was changed in place.
        """
        if not hasattr(self, "index_"):
            raise ModelError("this MotionTree is not fitted: call fit(database) first, or motionenv.load")
        if self.mapping_ is not None:
            self.mapping_.check()


@dataclass(frozen=True, eq=False)
class Recent:
    """A history in the database's lengths.

    Attributes:
        parameters: (..., 10, 50) of its last ten frames.
        last: (..., 25) its last pose.
        scale: factor from the history's lengths to the database's.
    """

    parameters: np.ndarray
    last: np.ndarray
    scale: float


def _checked_options(n, noise) -> int:
    if isinstance(n, bool) or not isinstance(n, int | np.integer) or n < 1:
        raise MotionError(f"n must be a whole number of draws from 1, got {n!r}")
    if isinstance(noise, str) or noise is None or not 0 <= noise < np.inf:
        raise MotionError(f"noise must be a share of the predictions' error from 0, got {noise!r}")
    return int(n)


def _checked_history(history, database: Database) -> tuple[np.ndarray, float]:
    """The last frames (..., 10 to 12, 25) of a history, and the factor from its lengths to the database's.

    Raises:
        MotionError: fewer than ten frames, another shape or rate, or NaN.
    """
    scale = 1.0
    if isinstance(history, Motion):
        if not np.isclose(history.fps, FPS, rtol=1e-6):
            raise MotionError(
                f"history must be at {FPS:g} frames/s, got {history.fps:g}: see motionenv.models.tree.resample"
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
