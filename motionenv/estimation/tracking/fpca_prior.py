r"""Walking as paper A tracks it (Ormoneit et al. 2005, section 5): a state space on functional principal components.

A particle is φ = (c, ψ, ρ, τ, θ): scores, phase, pace, and where the walker is and heads. Its pose is

    θ(t) = μ(ψ_t) + Σ_k c_t,k v_k(ψ_t) + δ_t

δ is what a person does beside the components: people who were not learned from leave them by some degrees. The paper
leaves the transition noise to others; here c, log ρ and δ return to their means (Ornstein-Uhlenbeck processes), so
that a walker who is hidden for long becomes any walker again, and c has the model's own covariance: components with
large singular values change most. The root is carried by the components too: how far the body comes per cycle, and how
high it is, is tabulated from the model's contact with the ground.
"""

from dataclasses import dataclass, replace

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.tracking.priors import Start
from motionenv.models.store import load
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


@dataclass(frozen=True, eq=False)
class WalkState:
    """N walkers.

    Attributes:
        poses: (N, 25) [m, rad].
        scores: (N, q), about the model's mean.
        phase: (N,) ψ [cycles].
        log_pace: (N,) log ρ [cycles/s].
        heading: (N,) [rad] of the way.
        place: (N, 2) [m].
        rest: (N, 25) δ.
        flow: (N, 2) [m per cycle], how the body moves forward and to the left.
    """

    poses: np.ndarray
    scores: np.ndarray
    phase: np.ndarray
    log_pace: np.ndarray
    heading: np.ndarray
    place: np.ndarray
    rest: np.ndarray
    flow: np.ndarray

    def take(self, which: np.ndarray) -> "WalkState":
        """The walkers `which` (n,)."""
        return WalkState(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


class FPCAPrior:
    """Walkers that change as the functional components say.

    Args:
        model: a `WalkingModel`, or the name or path of one.
        skeleton: the body; None takes the model's mean one.
        fps: frames per second.

    Raises:
        MotionError: another model, or `fps` out of range.
    """

    def __init__(self, model: WalkingModel | str = "walk/fpca", *, skeleton: Skeleton | None = None, fps: float = 30.0):
        model = load(model) if isinstance(model, str) else model
        if not isinstance(model, WalkingModel):
            raise MotionError(f"an FPCAPrior needs a WalkingModel such as walk/fpca, got {type(model).__name__}")
        self.fps = checked_fps(fps)
        self.skeleton = model.skeleton() if skeleton is None else skeleton
        q = model.fpca_.n_components
        self._covariance = model.person_covariance_[:q, :q] + model.cycle_covariance_
        self._root = np.linalg.cholesky(self._covariance)
        self._log_pace = -float(model.person_mean_[q])
        self._table = _tabulated(model, self.skeleton.height)

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> WalkState:
        """Walkers (n) that look like `start`: phases and scores by how well they explain its poses, the rest is δ.

        Args:
            start: the first frame.
            n: how many.
            rng: of the draws.
        """
        row, poses, _ = start.draw(n, rng)
        weights, means, roots = self._explained(start)
        which = (weights.cumsum(axis=1)[row] < rng.random((n, 1))).sum(axis=1)
        scores = means[row, which] + np.einsum("nij,nj->ni", roots[which], rng.standard_normal((n, len(self._root))))
        phase = (which + rng.random(n)) / _PHASES
        log_pace = self._log_pace + _PACE * rng.standard_normal(n)
        nothing = np.zeros((n, 25))
        state = WalkState(nothing, scores, phase, log_pace, np.zeros(n), poses[:, :2], nothing, np.zeros((n, 2)))
        return self.moved(self._placed(state), poses)

    def propagate(self, state: WalkState, rng: np.random.Generator) -> WalkState:
        """The walkers one frame later; see `motionenv.estimation.tracking.priors.Prior`.

        Args:
            state: (N).
            rng: of the noise.
        """
        n, dt = len(state.phase), 1 / self.fps
        keep = np.exp(-dt / _PACE_MEMORY)
        log_pace = self._log_pace + keep * (state.log_pace - self._log_pace)
        log_pace += np.sqrt(1 - keep**2) * _PACE * rng.standard_normal(n)
        turned = np.exp(log_pace) * dt + _JITTER * np.sqrt(30 * dt) * rng.standard_normal(n)
        ahead = _rotated(state.flow * turned[:, None], state.heading)
        moved = replace(state, log_pace=log_pace, phase=state.phase + turned, place=state.place + ahead)
        return self._stirred(moved, 1.0, rng)

    def diffuse(self, state: WalkState, share: float, rng: np.random.Generator) -> WalkState:
        """The walkers in the same frame, with `share` of a step's noise.

        Args:
            state: (N).
            share: 0 to 1.
            rng: of the noise.
        """
        dt = 1 / self.fps
        phase = state.phase + share * _JITTER * np.sqrt(30 * dt) * rng.standard_normal(len(state.phase))
        pace = state.log_pace + share * _PACE * np.sqrt(2 * dt / _PACE_MEMORY) * rng.standard_normal(len(phase))
        return self._stirred(replace(state, phase=phase, log_pace=pace), share, rng)

    def moved(self, state: WalkState, poses: np.ndarray) -> WalkState:
        """The walkers in other `poses` (N, 25): what the components don't say becomes δ.

        Args:
            state: (N).
            poses: (N, 25) [m, rad].
        """
        said = state.poses - state.rest
        rest = np.zeros_like(poses)
        rest[:, _SHAPED] = (poses - said)[:, _SHAPED]
        heading = state.heading + poses[:, 5] - state.poses[:, 5]
        return replace(state, poses=poses, rest=rest, heading=heading, place=poses[:, :2].copy())

    def _stirred(self, state: WalkState, share: float, rng: np.random.Generator) -> WalkState:
        """Scores, δ, heading and place with the noise of `share` of a frame."""
        n, frames = len(state.phase), share * 30 / self.fps
        keep, noise = _decay(share / self.fps, _MEMORY)
        scores = keep * state.scores + noise * (rng.standard_normal(state.scores.shape) @ self._root.T)
        keep, noise = _decay(share / self.fps, _REST_MEMORY)
        rest = keep * state.rest + (noise * _REST) * rng.standard_normal((n, 25))
        heading = state.heading + _TURNING * np.sqrt(frames) * rng.standard_normal(n)
        place = state.place + _rotated(np.sqrt(frames) * _WANDER * rng.standard_normal((n, 2)), heading)
        return self._placed(replace(state, scores=scores, rest=rest, heading=heading, place=place))

    def _placed(self, state: WalkState) -> WalkState:
        """The walkers with the poses and the flow that their phases and scores say."""
        from motionenv.estimation.tracking._walk_kernel import channels_at

        channels = np.empty((len(state.phase), 25))
        channels_at(self._table, state.phase, state.scores, channels)
        poses = channels + state.rest
        poses[:, :2] = state.place
        poses[:, 5] += state.heading
        return replace(state, poses=poses, flow=channels[:, :2])

    def _explained(self, start: Start) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """How likely each phase is for each of start's poses (m, phases), scores there (m, phases, q), their roots."""
        q = len(self._root)
        precision = 1 / (_REST[_SHAPED] ** 2 + start.spread[_SHAPED] ** 2)
        loadings = np.swapaxes(self._table[:, 1:, _SHAPED], 1, 2)  # (phases, 22, q)
        normal = np.swapaxes(loadings, 1, 2) @ (precision[:, None] * loadings) + np.linalg.inv(self._covariance)
        inverse = np.linalg.inv(normal)
        off = start.poses[:, None, _SHAPED] - self._table[None, :, 0, _SHAPED]
        means = np.einsum("pij,pkj,mpk->mpi", inverse, precision[None, :, None] * loadings, off)
        cost = (off**2 * precision).sum(-1) - np.einsum("mpi,pij,mpj->mp", means, normal, means)
        cost += np.linalg.slogdet(normal)[1] + self._against_flow(start)
        weights = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
        return weights / weights.sum(axis=1, keepdims=True), means.reshape(len(off), -1, q), np.linalg.cholesky(inverse)

    def _against_flow(self, start: Start) -> np.ndarray:
        """Squared misfit (m, phases) of start's velocities with the mean walker's; 0 where there are none."""
        mean = self._table[:, 0, _SHAPED]
        model = 0.5 * (np.roll(mean, -1, axis=0) - np.roll(mean, 1, axis=0)) * _PHASES * np.exp(self._log_pace)
        seen = (start.poses - start.previous)[:, None, _SHAPED] * self.fps
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


def _decay(seconds: float, memory: float) -> tuple[float, float]:
    """What an Ornstein-Uhlenbeck process of variance one keeps over `seconds`, and the noise that joins it."""
    keep = float(np.exp(-seconds / memory))
    return keep, float(np.sqrt(1 - keep**2))


def _rotated(vectors: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """Vectors (n, 2) turned by `heading` (n,) [rad]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack([c * vectors[:, 0] - s * vectors[:, 1], s * vectors[:, 0] + c * vectors[:, 1]], axis=-1)
