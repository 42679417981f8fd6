r"""Walking prior of paper A (Ormoneit et al. 2005, section 5): a state space model on functional principal components.

A particle is φ = (c, ψ, ρ, ω, u, τ, θ): scores, phase, pace, turning rate, speed, position and heading. Its pose is

    θ(t) = μ(ψ_t) + Σ_k c_t,k v_k(ψ_t) + δ_t

δ is the person's deviation from the components; people outside of the training data deviate by some degrees. The paper
derives the transition noise from the singular values and gives no details. Here c, log ρ and δ are Ornstein-Uhlenbeck
processes, so that their distribution stays stationary during long occlusions; c has the model's own covariance, so
components with large singular values change most. Joint limits are not enforced. The components also drive the root:
its velocity per cycle and its height are tabulated from the model's foot contact.

People turn, slow down and stop, but most of the time they go straight ahead at an even speed. So two discrete states
tell whether a person is turning, and whether changing speed; both begin and end at constant rates. While turning, the
rate ω is an Ornstein-Uhlenbeck process, otherwise it is 0; who turns goes where he heads, leans inwards and looks ahead
as in `motionenv.models.paths.bend`. While the speed changes, u is such a process, too, otherwise it stays: below 1,
steps become shorter and slower alike, and movements smaller; at 0 or less the person stands.

An unknown body size is part of φ: it scales the root's height and velocity. Feet stand on the ground, so a camera that
knows where the ground is sees the distance by the feet and the size by the height; a body of a wrong, fixed size would
have to be at a wrong distance. Log size is an Ornstein-Uhlenbeck process too, slow enough to be constant in a film.
Paces ρ are those of a body of the skeleton's size; one of size s steps at ρ / √s, as pendulums swing (Hof 1996).
"""

from dataclasses import dataclass

import numpy as np

from motionenv._core.validation import checked_fps, checked_number
from motionenv.errors import GapError, MotionError
from motionenv.models.motion_tree.features import turned_towards
from motionenv.models.paths.bending import TURN_MEMORY, TURN_RATE
from motionenv.models.registry import load
from motionenv.models.walking.model import WalkerScores, WalkingModel
from motionenv.models.walking.tables import lacking_angles
from motionenv.tracking.priors import _walk_kernel as kernels
from motionenv.tracking.priors._walk_kernel import EASE, FORWARD, HEADING, LEFT, PACE, PHASE, SIZE, STATES, TURN, X, Y
from motionenv.tracking.priors.base import SizedPrior, Start
from motionenv.types import POSE, Skeleton

_PHASES = 256  # phases per cycle at which the model is tabulated
# Correlation times [s] of scores, pace, δ and size.
_MEMORY, _PACE_MEMORY, _REST_MEMORY, _SIZE_MEMORY = 1.5, 2.0, 0.5, 20.0
_PACE = 0.2  # standard deviation of log ρ; the model's people differ by 0.09, others hurry
_JITTER = 0.003  # [cycles] per frame at 30 frames/s
_WANDER = np.array([0.015, 0.010])  # [m] forward and to the side, per frame at 30 frames/s
_TURNING = 0.02  # [rad] per frame at 30 frames/s, beside the turning rate's
# Mean, standard deviation and correlation time [s] of relative speed: 1 % stand, many stop within half a second. No
# others were tried, on 16 films of each course of benchmarks.tracking.turning's split "train".
_EASE, _EASE_WIDE, _EASE_MEMORY = 1.6, 0.7, 1.0
# Rates [1/s] at which turns begin and end, and changes of speed.
_TURNS, _CHANGES = (0.2, 0.4), (0.1, 0.5)
#: Pose entries that components and δ determine.
SHAPED = np.array([2, 3, 4, *range(6, 25)])
# Standard deviations of δ [m, rad]: about the residuals of held-out people with eight components.
_REST = np.array([0.0, 0.0, 0.02, 0.04, 0.04, 0.0, *[0.10] * 19])
_FLOW = 1.5  # [rad/s] standard deviation of a given start's joint velocities from the model's
_LEGS = 0.02  # standard deviation of the log of people's pelvis height relative to their stature
_SPEED = 0.1  # [m/s] standard deviation of a given start's speed from the walker's
_SLOWEST = 0.1  # [m/s] least speed that is informative about the pace
_SHAPED_ANGLES = SHAPED[1:]
_KEPT, _FRESH = [1, 2, 3, 11, 12, 13], [4, 5, 6, 14, 15, 16]  # coefficients and innovations in a kernel's noise
_KNEES = [POSE.index("left_knee_flexion"), POSE.index("right_knee_flexion")]


@dataclass(frozen=True, eq=False)
class WalkState:
    """N walkers.

    Attributes:
        poses: (N, 25) [m, rad].
        scores: (N, q), minus the model's mean.
        rest: (N, 25) δ; 0 for position and heading.
        gait: (N, 12), columns as in `motionenv.tracking.priors._walk_kernel`: phase ψ [cycles], log ρ [cycles/s],
            heading [rad], position x, y [m], root velocity forward and left [m per cycle], log body size, turning rate
            [rad/s], relative speed, and whether turning and changing speed.
    """

    poses: np.ndarray
    scores: np.ndarray
    rest: np.ndarray
    gait: np.ndarray

    @property
    def sizes(self) -> np.ndarray:
        return np.exp(self.gait[:, SIZE])

    def take(self, which: np.ndarray) -> "WalkState":
        return WalkState(*(a.take(which, axis=0) for a in (self.poses, self.scores, self.rest, self.gait)))


class FPCAPrior(SizedPrior):
    """Walkers whose scores, phase and pace drift over time.

    Args:
        model: a `WalkingModel`, or its name or path.
        skeleton: the body; None uses the model's mean body.
        fps: frame rate [Hz].
        size: standard deviation of the log of the body's size relative to `skeleton`; 0 if the size is known. Adults
            have about 0.06.

    Raises:
        MotionError: another model, or a number out of range.

    Attributes:
        table: (phases, 1 + q, 25) mean and components at each phase: root velocity forward and left [m per cycle], and
            pose entries [m, rad].
        root: (q, q) Cholesky factor of the scores' covariance.
        log_pace: mean of log ρ, paces in cycles/s.
        deviation: (29,) stationary standard deviations of δ [m, rad], of log ρ, of the log size, of the turning rate
            [rad/s] and of the relative speed.
        still: (25,) pose entries of who stands [m, rad].
        size: as given.
    """

    def __init__(
        self, model: WalkingModel | str = "walk/fpca", *, skeleton: Skeleton | None = None, fps: float = 30.0,
        size: float = 0.0,
    ) -> None:  # fmt: skip
        model = load(model) if isinstance(model, str) else model
        if not isinstance(model, WalkingModel):
            raise MotionError(f"model must be a WalkingModel such as walk/fpca, got {type(model).__name__}")
        if lacking := lacking_angles(model):
            names = ", ".join(POSE[i] for i in lacking)
            raise GapError(
                f"a tracking prior moves the whole body, and this model doesn't know {names}: fit a model to filled "
                "walks (motionenv.fill, or motionenv fit --fill)"
            )
        self.fps = checked_fps(fps)
        self.skeleton = model.skeleton() if skeleton is None else skeleton
        q = model.fpca_.n_components_
        self._covariance = model.person_covariance_[:q, :q] + model.cycle_covariance_
        self.root = np.linalg.cholesky(self._covariance)
        self.log_pace = -float(model.person_mean_[q])
        self.table = _tabulated(model, self.skeleton)
        self.size = checked_number(size, "size", 0, below=0.5)
        self.still = _standing(self.table[:, 0])
        self.deviation = np.concatenate([_REST, [_PACE, self.size, TURN_RATE, _EASE_WIDE]])
        memories = np.array([_PACE_MEMORY, _MEMORY, _REST_MEMORY, _SIZE_MEMORY, TURN_MEMORY, _EASE_MEMORY])
        keep = np.exp(-1 / (self.fps * memories))
        wander = np.sqrt(30 / self.fps) * np.array([_JITTER, _TURNING, *_WANDER])
        fresh = np.sqrt(1 - keep**2)
        switch = 1 - np.exp(-np.array([*_TURNS, *_CHANGES]) / self.fps)
        self._step = np.concatenate([[1 / self.fps], keep[:3], fresh[:3], wander, keep[3:], fresh[3:], switch])

    def __repr__(self) -> str:
        size = f", size {self.size:g}" if self.size else ""
        return f"FPCAPrior({len(self.root)} components, {self.fps:g} fps{size})"

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> WalkState:
        """Draw `n` walkers with `rng` in the poses of `start`: phase and scores by their posterior, the rest is δ.

        If the previous pose is known, joint velocities inform the phase, and the speed informs the pace.
        """
        row, poses, _ = start.draw(n, rng)
        sizes = self._sizes(start)
        weights, means, roots = self._explained(start, sizes)
        which = (weights.cumsum(axis=1)[row] < rng.random((n, 1))).sum(axis=1)
        which = np.minimum(which, _PHASES - 1)
        scores = means[row, which] + np.einsum("nij,nj->ni", roots[which], rng.standard_normal((n, len(self.root))))
        gait = np.zeros((n, 12))
        gait[:, SIZE], gait[:, EASE] = np.log(sizes[row]), 1.0  # who is searched for walks
        if self.size and start.heights is None:
            gait[:, SIZE] += _LEGS * rng.standard_normal(n)
        gait[:, PHASE] = (which + rng.random(n)) / _PHASES
        state = self.posed(gait, scores, np.zeros((n, 25)))
        gait[:, PACE] = self._paces(state, start, row, rng)
        begins, ends = np.array([_TURNS, _CHANGES]).T
        gait[:, STATES] = rng.random((n, 2)) < begins / (begins + ends)
        gait[:, TURN] = gait[:, STATES[0]] * TURN_RATE * rng.standard_normal(n)
        return self.moved(self.posed(gait, scores, np.zeros((n, 25))), poses)

    def propagate(self, state: WalkState, rng: np.random.Generator) -> WalkState:
        return self._advanced(state, self._step, rng)

    def diffuse(self, state: WalkState, share: float, rng: np.random.Generator) -> WalkState:
        noise = np.concatenate([[0.0], np.zeros(3), share * self._step[4:17], np.zeros(4)])
        noise[_KEPT] = np.sqrt(1 - noise[_FRESH] ** 2)  # keeps the autoregressive processes stationary
        return self._advanced(state, noise, rng)

    def moved(self, state: WalkState, poses: np.ndarray) -> WalkState:
        """The walkers of `state` with other `poses` (N, 25) [m, rad]: the deviation from the components becomes δ.

        Angles are unwrapped to within half a turn of the components' angles.
        """
        said = state.poses - state.rest
        poses = np.array(poses, dtype=np.float64)
        poses[:, _SHAPED_ANGLES] = turned_towards(poses, said)[:, _SHAPED_ANGLES]
        rest = np.zeros_like(poses)
        rest[:, SHAPED] = (poses - said)[:, SHAPED]
        gait = state.gait.copy()
        gait[:, HEADING] += poses[:, 5] - state.poses[:, 5]
        gait[:, [X, Y]] = poses[:, :2]
        return WalkState(poses, state.scores, rest, gait)

    def resized(self, state: WalkState, sizes: np.ndarray, centre: np.ndarray) -> WalkState:
        factors, gait, poses = sizes / state.sizes, state.gait.copy(), state.poses.copy()
        gait[:, SIZE] = np.log(sizes)
        gait[:, [X, Y]] = poses[:, :2] = centre + factors[:, None] * (poses[:, :2] - centre)
        poses[:, 2] *= factors
        return WalkState(poses, state.scores, state.rest, gait)

    def _advanced(self, state: WalkState, noise: np.ndarray, rng: np.random.Generator) -> WalkState:
        """The walkers after the `noise` of `_walk_kernel.add_noise`, moved by the flow of that time step."""
        key = rng.integers(2**64, dtype=np.uint64)
        gait, scores, rest = (np.empty_like(a) for a in (state.gait, state.scores, state.rest))
        given = np.ascontiguousarray(state.gait), np.ascontiguousarray(state.scores), np.ascontiguousarray(state.rest)
        means = np.array([self.log_pace, _EASE])
        kernels.add_noise(*given, key, noise, means, self.root, self.deviation, gait, scores, rest)
        poses = np.empty_like(rest)
        kernels.advance(self.table, self.still, gait, given[0], scores, rest, noise[0] != 0, poses)
        return WalkState(poses, scores, rest, gait)

    def expected(self, state: WalkState) -> WalkState:
        """The walkers of `state` one frame later, without noise."""
        still = self._step.copy()
        still[4:11], still[14:] = 0.0, 0.0
        return self._advanced(state, still, np.random.default_rng(0))

    def noise(self, heading: float, depths: float) -> np.ndarray:
        """Covariance (30 + q, 30 + q) of a step's noise in the variables of `motionenv.tracking.priors.smoothing`.

        Positions are those of a walker with a `heading` [rad]; `depths` [log] is added to the noise of sizes.
        """
        step, wide, q = self._step, self.deviation, len(self.root)
        c, s = np.cos(heading), np.sin(heading)
        turn = np.array([[c, -s], [s, c]])
        size, others = np.hypot(step[14] * wide[26], depths), step[15:17] * wide[27:29]
        scales = [*step[7:9], step[4] * wide[25], 0, 0, size, *others, *np.zeros(q), *step[6] * _REST[SHAPED]]
        out = np.diag(np.square(scales))
        out[3:5, 3:5] = turn @ np.diag(step[9:11] ** 2) @ turn.T
        out[8 : 8 + q, 8 : 8 + q] = step[5] ** 2 * self._covariance
        return out

    def posed(self, gait: np.ndarray, scores: np.ndarray, rest: np.ndarray) -> WalkState:
        """Walkers with `gait` (n, 12), whose flow is written, `scores` (n, q) and `rest` (n, 25)."""
        poses = np.empty((len(gait), 25))
        kernels.advance(self.table, self.still, gait, gait, scores, rest, False, poses)
        return WalkState(poses, scores, rest, gait)

    def _paces(self, state: WalkState, start: Start, row: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Log paces (n,) of walkers at the candidates `row` (n,) of `start`, from the candidates' speeds."""
        speed = np.hypot(*(start.poses - start.previous)[row, :2].T) * self.fps
        flow = np.maximum(np.hypot(state.gait[:, FORWARD], state.gait[:, LEFT]), 1e-3)
        seen = np.log(np.maximum(speed, _SLOWEST) / flow) + 0.5 * state.gait[:, SIZE]
        uncertain = np.where(np.isnan(speed), np.inf, _SPEED / np.maximum(speed, _SLOWEST))
        precision = _PACE**-2 + uncertain**-2
        mean = (self.log_pace * _PACE**-2 + np.nan_to_num(seen) * uncertain**-2) / precision
        return mean + rng.standard_normal(len(row)) / np.sqrt(precision)

    def _sizes(self, start: Start) -> np.ndarray:
        """Body sizes (m,) of start's candidates; where unknown, the root is as high as the mean walker's."""
        if not self.size:
            return np.ones(len(start.poses))
        if start.heights is not None:
            return start.heights / self.skeleton.height
        return np.clip(start.poses[:, 2] / self.table[:, 0, 2].mean(), np.exp(-3 * self.size), np.exp(3 * self.size))

    def _explained(self, start: Start, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Log posterior of each phase for each of start's poses (m, phases), scores (m, phases, q), their roots."""
        poses = start.poses.copy()
        poses[:, 2] /= sizes
        precision = 1 / (_REST[SHAPED] ** 2 + start.spread[SHAPED] ** 2)
        loadings = np.swapaxes(self.table[:, 1:, SHAPED], 1, 2)  # (phases, 22, q)
        normal = np.swapaxes(loadings, 1, 2) @ (precision[:, None] * loadings) + np.linalg.inv(self._covariance)
        inverse = np.linalg.inv(normal)
        means = self.table[:, 0]
        off = turned_towards(poses[:, None] - means, np.zeros(25))[..., SHAPED]
        scores = np.einsum("pij,pkj,mpk->mpi", inverse, precision[None, :, None] * loadings, off, optimize=True)
        cost = (off**2 * precision).sum(-1) - np.einsum("mpi,pij,mpj->mp", scores, normal, scores, optimize=True)
        cost += np.linalg.slogdet(normal)[1] + self._against_flow(start, sizes)
        weights = np.exp(-0.5 * (cost - cost.min(axis=1, keepdims=True)))
        return weights / weights.sum(axis=1, keepdims=True), scores, np.linalg.cholesky(inverse)

    def _against_flow(self, start: Start, sizes: np.ndarray) -> np.ndarray:
        """Squared misfit (m, phases) of start's velocities against mean walkers' of `sizes` (m,); 0 if unknown."""
        mean = self.table[:, 0, SHAPED]
        model = 0.5 * (np.roll(mean, -1, axis=0) - np.roll(mean, 1, axis=0)) * _PHASES * np.exp(self.log_pace)
        moved = turned_towards(start.poses - start.previous, np.zeros(25))
        seen = moved[:, None, SHAPED] * self.fps
        return np.nan_to_num((seen - model / np.sqrt(sizes)[:, None, None]) ** 2 / _FLOW**2).sum(-1)


def _standing(walk: np.ndarray) -> np.ndarray:
    """Pose entries (25,) of who stands: means over a cycle (phases, 25), on the legs of mid-stance."""
    still = walk.mean(axis=0)
    still[2] = np.quantile(walk[:, 2], 0.95)
    still[_KNEES] = np.quantile(walk[:, _KNEES], 0.2, axis=0)
    return still


def _tabulated(model: WalkingModel, skeleton: Skeleton) -> np.ndarray:
    """Mean and components at each phase (phases, 1 + q, 25): root velocity [m per cycle] and pose entries.

    Foot contact makes the root's motion a nonlinear function of the angles; its components are central differences.
    """
    q = model.fpca_.n_components_
    mean, deviation = model.person_mean_[:q], np.sqrt(np.diag(model.person_covariance_)[:q])
    scores = mean + np.concatenate([np.zeros((1, q)), np.diag(deviation), -np.diag(deviation)])
    seconds = np.full(len(scores), np.exp(model.person_mean_[q]))
    fps = _PHASES / seconds[0]
    stride = WalkerScores(scores, seconds)
    walks = model.walks(
        2 * seconds[0], fps, n=len(scores), stride=stride, variation=0.0, skeleton=skeleton, seed=0
    ).poses
    channels = np.concatenate([np.gradient(walks[..., :2], axis=1) * _PHASES, walks[..., 2:]], axis=-1)
    cycle = np.roll(channels[:, _PHASES // 2 : _PHASES // 2 + _PHASES], _PHASES // 2, axis=1)
    components = (cycle[1 : 1 + q] - cycle[1 + q :]) / (2 * deviation[:, None, None])
    return np.ascontiguousarray(np.concatenate([cycle[:1], components]).swapaxes(0, 1))
