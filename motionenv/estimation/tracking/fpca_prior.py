r"""Walking as paper A tracks it (Ormoneit et al. 2005, section 5): a state space on functional principal components.

A particle is φ = (c, ψ, ρ, τ, θ): scores, phase, pace, and where the walker is and heads. Its pose is

    θ(t) = μ(ψ_t) + Σ_k c_t,k v_k(ψ_t) + δ_t

δ is what a person does beside the components: people who were not learned from leave them by some degrees. The paper
takes the transition noise from the singular values, and says no more of it; here c, log ρ and δ return to their means
(Ornstein-Uhlenbeck processes), so that a walker who is hidden for long becomes any walker again, and c has the model's
own covariance: components with large singular values change most. Nothing but the model holds joints within their
ranges. The root is carried by the components too: how far the body comes per cycle, and how high it is, is tabulated
from the model's contact with the ground.
"""

from dataclasses import dataclass

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.tracking._walk_kernel import FORWARD, HEADING, LEFT, PACE, PHASE, X, Y, flowed, stirred
from motionenv.estimation.tracking.priors import Start
from motionenv.models.store import load
from motionenv.models.tree.frames import turned_towards
from motionenv.models.walking import Stride, WalkingModel
from motionenv.types import Skeleton, checked_fps

_PHASES = 256  # in a cycle, at which the model is tabulated
_MEMORY, _PACE_MEMORY, _REST_MEMORY = 1.5, 2.0, 0.5  # [s] of scores, pace and δ
_PACE = 0.12  # standard deviation of log ρ; the model's people differ by 0.09
_JITTER = 0.003  # [cycles] per frame at 30 frames/s
_WANDER = np.array([0.006, 0.004])  # [m] forward and to the side, per frame at 30 frames/s
_TURNING = 0.01  # [rad] per frame at 30 frames/s
_SHAPED = np.array([2, 3, 4, *range(6, 25)])  # entries of the pose that components and δ say
# Standard deviations of δ [m, rad]: about what left-out people leave over beside eight components.
_REST = np.array([0.0, 0.0, 0.02, 0.04, 0.04, 0.0, *[0.10] * 19])
_FLOW = 1.5  # [rad/s] by which velocities of a given start may differ from the model's
_SPEED = 0.1  # [m/s] by which the speed of a given start may differ from the walker's
_SLOWEST = 0.1  # [m/s] from which a given speed says something of the pace
_SHAPED_ANGLES = _SHAPED[1:]


@dataclass(frozen=True, eq=False)
class WalkState:
    """N walkers.

    Attributes:
        poses: (N, 25) [m, rad].
        scores: (N, q), about the model's mean.
        rest: (N, 25) δ; 0 for place and heading.
        ways: (N, 7), what the columns of `motionenv.estimation.tracking._walk_kernel` name: phase ψ [cycles], log ρ
            [cycles/s], heading of the way [rad], place [m], and how the body moves forward and left [m per cycle].
    """

    poses: np.ndarray
    scores: np.ndarray
    rest: np.ndarray
    ways: np.ndarray

    def take(self, which: np.ndarray) -> "WalkState":
        """The walkers `which` (n,)."""
        return WalkState(*(a.take(which, axis=0) for a in (self.poses, self.scores, self.rest, self.ways)))


class FPCAPrior:
    """Walkers that change as the functional components say.

    Args:
        model: a `WalkingModel`, or the name or path of one.
        skeleton: the body; None takes the model's mean one.
        fps: frames per second.
        backwards: whether frames come in the reverse order.

    Raises:
        MotionError: another model, or `fps` out of range.

    Attributes:
        table: mean and components at each phase (phases, 1 + q, 25): how far the body comes forward and left
            [m per cycle], and what poses hold [m, rad].
        root: (q, q) Cholesky factor of the scores' covariance.
        log_pace: mean of log ρ, paces in cycles/s.
        deviation: (26,) stationary standard deviations of δ [m, rad] and of log ρ.
    """

    def __init__(
        self,
        model: WalkingModel | str = "walk/fpca",
        *,
        skeleton: Skeleton | None = None,
        fps: float = 30.0,
        backwards: bool = False,
    ):
        model = load(model) if isinstance(model, str) else model
        if not isinstance(model, WalkingModel):
            raise MotionError(f"an FPCAPrior needs a WalkingModel such as walk/fpca, got {type(model).__name__}")
        self.fps = checked_fps(fps)
        self.skeleton = model.skeleton() if skeleton is None else skeleton
        q = model.fpca_.n_components
        self._covariance = model.person_covariance_[:q, :q] + model.cycle_covariance_
        self.root = np.linalg.cholesky(self._covariance)
        self.log_pace = -float(model.person_mean_[q])
        self.table = _tabulated(model, self.skeleton.height)
        self.deviation = np.append(_REST, _PACE)
        memories = np.array([_PACE_MEMORY, _MEMORY, _REST_MEMORY])
        keep = np.exp(-1 / (self.fps * memories))
        wander = np.sqrt(30 / self.fps) * np.array([_JITTER, _TURNING, *_WANDER])
        self._step = np.concatenate([[(-1 if backwards else 1) / self.fps], keep, np.sqrt(1 - keep**2), wander])

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> WalkState:
        """Walkers (n) that look like `start`: phases and scores by how well they explain its poses, the rest is δ.

        Where the pose one frame earlier is known, its velocities help to tell the phase, and its speed the pace.

        Args:
            start: the first frame.
            n: how many.
            rng: of the draws.
        """
        row, poses, _ = start.draw(n, rng)
        weights, means, roots = self._explained(start)
        which = (weights.cumsum(axis=1)[row] < rng.random((n, 1))).sum(axis=1)
        which = np.minimum(which, _PHASES - 1)
        scores = means[row, which] + np.einsum("nij,nj->ni", roots[which], rng.standard_normal((n, len(self.root))))
        ways = np.zeros((n, 7))
        ways[:, PHASE] = (which + rng.random(n)) / _PHASES
        state = self._at(ways, scores, np.zeros((n, 25)))
        ways[:, PACE] = self._paces(state, start, row, rng)
        return self.moved(state, poses)

    def propagate(self, state: WalkState, rng: np.random.Generator) -> WalkState:
        """The walkers one frame later; see `motionenv.estimation.tracking.priors.Prior`.

        Args:
            state: (N).
            rng: of the noise.
        """
        return self._stirred(state, self._step, rng)

    def diffuse(self, state: WalkState, share: float, rng: np.random.Generator) -> WalkState:
        """The walkers in the same frame, with `share` of a step's noise.

        Args:
            state: (N).
            share: 0 to 1.
            rng: of the noise.
        """
        noise = np.concatenate([[0.0], np.zeros(3), share * self._step[4:]])
        noise[1:4] = np.sqrt(1 - noise[4:7] ** 2)  # so that what returns to a mean stays as wide as it is
        return self._stirred(state, noise, rng)

    def moved(self, state: WalkState, poses: np.ndarray) -> WalkState:
        """The walkers in other `poses` (N, 25): what the components don't say becomes δ.

        Angles come back within half a turn of what the components say.

        Args:
            state: (N).
            poses: (N, 25) [m, rad].
        """
        said = state.poses - state.rest
        poses = np.array(poses, dtype=np.float64)
        poses[:, _SHAPED_ANGLES] = turned_towards(poses, said)[:, _SHAPED_ANGLES]
        rest = np.zeros_like(poses)
        rest[:, _SHAPED] = (poses - said)[:, _SHAPED]
        ways = state.ways.copy()
        ways[:, HEADING] += poses[:, 5] - state.poses[:, 5]
        ways[:, [X, Y]] = poses[:, :2]
        return WalkState(poses, state.scores, rest, ways)

    def log_transition(self, before: WalkState, after: WalkState, later: WalkState | None = None) -> np.ndarray:
        """Log density (N, M) with which `propagate` takes each walker of `before` to each of `after`.

        It is that of the state (c, ψ, log ρ, heading, place, δ), in which each step is Gaussian; the flow, which
        carries the place between the two, is no part of it, as it hangs on the state.

        Args:
            before: (N), one frame earlier.
            after: (M).
            later: of no matter, as the state holds all of the past that counts.
        """
        step, a, b = self._step, before.ways[:, None], after.ways[None]
        total = self.log_gait(before, after)
        total += _gaussian(b[..., HEADING], a[..., HEADING], step[8])
        flow = 0.5 * (a[..., [FORWARD, LEFT]] + b[..., [FORWARD, LEFT]]) * _turned(a, b)[..., None]
        rest = b[..., [X, Y]] - a[..., [X, Y]] - _rotated(flow, a[..., HEADING])
        total += _gaussian(_rotated(rest, -b[..., HEADING]), 0.0, step[9:11]).sum(axis=-1)
        free = _REST > 0
        return total + _ornstein_uhlenbeck(
            before.rest[:, free], after.rest[:, free], np.diag(_REST[free]), step[3], step[6]
        )

    def log_gait(self, before: WalkState, after: WalkState) -> np.ndarray:
        """Log density (N, M) as `log_transition`, of what `moved` leaves alone: scores, phase and pace.

        Args:
            before: (N), one frame earlier.
            after: (M).
        """
        step, a, b = self._step, before.ways[:, None], after.ways[None]
        total = _gaussian(b[..., PACE], self.log_pace + step[1] * (a[..., PACE] - self.log_pace), step[4] * _PACE)
        total += _gaussian(_turned(a, b), np.exp(b[..., PACE]) * step[0], step[7])
        return total + _ornstein_uhlenbeck(before.scores, after.scores, self.root, step[2], step[5])

    def _stirred(self, state: WalkState, noise: np.ndarray, rng: np.random.Generator) -> WalkState:
        """The walkers after the `noise` of `_walk_kernel.stirred`, and where the flow of that time brings them."""
        key = rng.integers(2**64, dtype=np.uint64)
        ways, scores, rest = (np.empty_like(a) for a in (state.ways, state.scores, state.rest))
        given = np.ascontiguousarray(state.ways), np.ascontiguousarray(state.scores), np.ascontiguousarray(state.rest)
        stirred(*given, key, noise, self.log_pace, self.root, self.deviation, ways, scores, rest)
        poses = np.empty_like(rest)
        flowed(self.table, ways, given[0], scores, rest, noise[0] != 0, poses)
        return WalkState(poses, scores, rest, ways)

    def _at(self, ways: np.ndarray, scores: np.ndarray, rest: np.ndarray) -> WalkState:
        """The walkers with the poses that these say."""
        poses = np.empty((len(ways), 25))
        flowed(self.table, ways, ways, scores, rest, False, poses)
        return WalkState(poses, scores, rest, ways)

    def _paces(self, state: WalkState, start: Start, row: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Log paces (n,) of walkers at the candidates `row` (n,) of `start`, as fast as those were."""
        speed = np.hypot(*(start.poses - start.previous)[row, :2].T) * self.fps
        flow = np.maximum(np.hypot(state.ways[:, FORWARD], state.ways[:, LEFT]), 1e-3)
        seen = np.log(np.maximum(speed, _SLOWEST) / flow)
        uncertain = np.where(np.isnan(speed), np.inf, _SPEED / np.maximum(speed, _SLOWEST))
        precision = _PACE**-2 + uncertain**-2
        mean = (self.log_pace * _PACE**-2 + np.nan_to_num(seen) * uncertain**-2) / precision
        return mean + rng.standard_normal(len(row)) / np.sqrt(precision)

    def _explained(self, start: Start) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How likely each phase is for each of start's poses (m, phases), scores there (m, phases, q), their roots."""
        precision = 1 / (_REST[_SHAPED] ** 2 + start.spread[_SHAPED] ** 2)
        loadings = np.swapaxes(self.table[:, 1:, _SHAPED], 1, 2)  # (phases, 22, q)
        normal = np.swapaxes(loadings, 1, 2) @ (precision[:, None] * loadings) + np.linalg.inv(self._covariance)
        inverse = np.linalg.inv(normal)
        means = self.table[:, 0]
        off = turned_towards(start.poses[:, None] - means, np.zeros(25))[..., _SHAPED]
        scores = np.einsum("pij,pkj,mpk->mpi", inverse, precision[None, :, None] * loadings, off, optimize=True)
        cost = (off**2 * precision).sum(-1) - np.einsum("mpi,pij,mpj->mp", scores, normal, scores, optimize=True)
        cost += np.linalg.slogdet(normal)[1] + self._against_flow(start)
        weights = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
        return weights / weights.sum(axis=1, keepdims=True), scores, np.linalg.cholesky(inverse)

    def _against_flow(self, start: Start) -> np.ndarray:
        """Squared misfit (m, phases) of start's velocities with the mean walker's; 0 where there are none."""
        mean = self.table[:, 0, _SHAPED]
        model = 0.5 * (np.roll(mean, -1, axis=0) - np.roll(mean, 1, axis=0)) * _PHASES * np.exp(self.log_pace)
        moved = turned_towards(start.poses - start.previous, np.zeros(25))
        seen = moved[:, None, _SHAPED] * self.fps
        return np.nan_to_num((seen - model) ** 2 / _FLOW**2).sum(-1)


def _tabulated(model: WalkingModel, height: float) -> np.ndarray:
    """Mean and components at each phase (phases, 1 + q, 25): velocity of the root [m per cycle] and what poses hold.

    Contact makes the root's motion of the angles, which isn't linear: components are central differences.
    """
    q = model.fpca_.n_components
    mean, deviation = model.person_mean_[:q], np.sqrt(np.diag(model.person_covariance_)[:q])
    scores = mean + np.concatenate([np.zeros((1, q)), np.diag(deviation), -np.diag(deviation)])
    seconds = np.full(len(scores), np.exp(model.person_mean_[q]))
    fps = _PHASES / seconds[0]
    walks = model.synthesize(
        2 * seconds[0], fps, n=len(scores), stride=Stride(scores, seconds), variation=0.0, height=height, seed=0
    ).poses
    channels = np.concatenate([np.gradient(walks[..., :2], axis=1) * _PHASES, walks[..., 2:]], axis=-1)
    cycle = np.roll(channels[:, _PHASES // 2 : _PHASES // 2 + _PHASES], _PHASES // 2, axis=1)
    components = (cycle[1 : 1 + q] - cycle[1 + q :]) / (2 * deviation[:, None, None])
    return np.ascontiguousarray(np.concatenate([cycle[:1], components]).swapaxes(0, 1))


def _turned(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Phase (...) [cycles] between ways (..., 7), the shorter way round: whole cycles are no difference."""
    turned = after[..., PHASE] - before[..., PHASE]
    return turned - np.round(turned)


def _gaussian(x, mean, deviation) -> np.ndarray:
    """Log of the normal density."""
    return -0.5 * ((x - mean) / deviation) ** 2 - np.log(deviation) - 0.5 * np.log(2 * np.pi)


def _ornstein_uhlenbeck(before: np.ndarray, after: np.ndarray, root: np.ndarray, keep: float, noise: float):
    """Log density (N, M) of steps of an Ornstein-Uhlenbeck process about 0.

    Args:
        before: (N, d).
        after: (M, d).
        root: (d, d) Cholesky factor of the stationary covariance.
        keep: what a step keeps.
        noise: deviation of what joins it, as a share of the stationary one.
    """
    d = len(root)
    a, b = (np.linalg.solve(root, x.T).T / noise for x in (keep * before, after))
    # einsum, as matrix products round by the number of threads
    squared = (a**2).sum(1)[:, None] + (b**2).sum(1) - 2 * np.einsum("nd,md->nm", a, b)
    return -0.5 * squared - np.log(np.diag(root)).sum() - d * (np.log(noise) + 0.5 * np.log(2 * np.pi))


def _rotated(vectors: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Vectors (..., 2) turned by `heading` (...) [rad]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([c * vectors[..., 0] - s * vectors[..., 1], s * vectors[..., 0] + c * vectors[..., 1]], axis=-1)
