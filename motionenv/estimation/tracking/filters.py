"""Particle filters: the belief p(φ_t | J_1 ... J_t) of paper A (eqs. 6, 7) and paper C (eq. 1) as weighted poses."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.estimation.likelihood import Learning, Likelihood, log_nobody
from motionenv.estimation.numeric import as_number, checked_whole
from motionenv.estimation.tracking.priors import Prior, Start, State, systematic
from motionenv.estimation.tracking.refinement import refined
from motionenv.types import Skeleton

_BISECTIONS = 30
_COOLING = 0.5  # noise of each annealing layer, as a share of the one's before (Deutscher & Reid 2005, section 3.3)
_WIDER, _PATIENCE = 0.25, 0.5  # [s] lost after which noise is wider, and after which a new start is asked for
_WIDENING = (0.3, 0.6, 1.0)  # shares of a step's noise with which a frame is scored again that could not be scored
_ALIKE = 0.01  # difference of heights of the same body
_NEGLIGIBLE = 30.0  # below the highest log weight, from where on particles don't count


@dataclass(frozen=True, eq=False)
class Belief:
    """What a filter believes about the current frame.

    Attributes:
        state: the particles as the prior knows them.
        log_weights: (N,), normalised.
        effective: effective sample size 1 / Σ w², from 1 to N. With annealing that after the last layer alone; with
            refinement, which resamples at the end, always N: it then says nothing of how prediction and picture met.
        log_evidence: log p(J_t | J_1 ... J_t-1), as far as the likelihood is one; minus infinity where no
            particle could be scored: a track with such a frame is never the likelier one.
        lost: whether the picture is likelier to show nobody than any of the particles, or could not be scored at all:
            the belief is, all but, the prediction alone.
        recovered: whether this frame began anew, after too many that were lost.
    """

    state: State
    log_weights: np.ndarray
    effective: float
    log_evidence: float
    lost: bool
    recovered: bool = False

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""
        return self.state.poses

    @cached_property
    def mean(self) -> np.ndarray:
        """The expected pose (25,) [m, rad]; angles are averaged on the circle, and come out near the likeliest's."""
        weights, poses = np.exp(self.log_weights), self.poses
        mean = weights @ poses
        angles = poses[:, 3:]
        turn = np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))
        near = angles[np.argmax(weights)]
        mean[3:] = near + np.remainder(turn - near + np.pi, 2 * np.pi) - np.pi
        return mean

    def expected_joints(self, skeleton: Skeleton) -> np.ndarray:
        """The expected positions (15, 3) [m] of the markers of `skeleton`: closer to the truth than the mean pose's.

        Args:
            skeleton: the body.
        """
        some = np.flatnonzero(self.log_weights > self.log_weights.max() - _NEGLIGIBLE)
        weights = np.exp(self.log_weights[some])
        return np.einsum("n,nij->ij", weights / weights.sum(), markers(self.poses[some], skeleton))


class ParticleFilter:
    """Follows a person: particles propagated by a prior and weighed by a likelihood (Isard & Blake 1998).

    With one layer this is the bootstrap filter of papers A and C, with systematic resampling when the effective sample
    size falls low. With more, each frame is annealed (Deutscher & Reid 2005): the likelihood is flattened at first, by
    the power that leaves the share `resample` of the particles effective, and between layers particles are resampled
    and stirred with less and less noise. The belief then gathers about the likelihood's highest peaks; it is no longer
    the exact posterior, but few particles find them.

    **Hidden.** In the share `hidden` of frames the person can't be seen, and a picture is then as without a body,
    whatever the pose: p(J | φ) = (1 - hidden) p(J | φ, seen) + hidden p(J | nobody). A tree before someone leaves the
    prediction as it is, instead of driving it out of the picture.

    **Lost.** A frame that is likelier hidden than seen counts as lost. After a quarter of a second of them each comes
    with wider noise, and after half a second `restart` is asked for a new start. Where no particle can be scored at all
    (NaN, or minus infinity), noise is widened at once and the frame scored again; if that doesn't help either, the
    belief is the prediction.

    **Learning.** A likelihood that has a `learn` is taught the weighed particles of each frame (colours of limbs, the
    background beside the body), except where the person is lost, or was found again in that very frame: it then keeps
    what it knows.

    Args:
        prior: of motion.
        likelihood: of observations.
        n: particles.
        resample: share of n below which the effective sample size calls for resampling.
        layers: of annealing; 1 is none.
        refine: rounds of local refinement per frame, see `motionenv.estimation.tracking.refinement`; 0 is none.
        hidden: share of frames in which the person can't be seen; 0 takes the likelihood as it is.
        restart: asked with an observation for a new start where the person was lost; None, or a call that gives None,
            goes on with wider noise.
        seed: int or Generator; the same seed gives the same belief, whatever the number of threads.

    Raises:
        MotionError: an argument out of range, or a prior and a likelihood of bodies of different heights.
    """

    def __init__(
        self,
        prior: Prior,
        likelihood: Likelihood,
        n: int = 1000,
        *,
        resample: float = 0.5,
        layers: int = 1,
        refine: int = 0,
        hidden: float = 0.02,
        restart: Callable[[Mapping[str, Any]], Start | None] | None = None,
        seed=None,
    ):
        check_options(n, resample=resample, layers=layers, refine=refine, hidden=hidden)
        scored = getattr(likelihood, "skeleton", prior.skeleton)  # a likelihood need not know of bodies
        if abs(scored.height / prior.skeleton.height - 1) > _ALIKE:
            raise MotionError(
                f"the prior moves a body of {prior.skeleton.height:.2f} m and the likelihood scores one of "
                f"{scored.height:.2f} m: make both with the same skeleton"
            )
        self.prior, self.likelihood, self.n, self.restart = prior, likelihood, int(n), restart
        self.resample, self.layers, self.refine, self.hidden = resample, int(layers), int(refine), hidden
        self._rng = np.random.default_rng(seed)
        self._state: Any = None

    def start(self, start: Start) -> None:
        """Begin with what is known of the first frame, before that is observed.

        Args:
            start: the first frame.
        """
        self._state = self.prior.initial(start, self.n, self._rng)
        self._log_weights = np.full(self.n, -np.log(self.n))
        self._began, self._lost = False, 0

    def step(self, **observation: Any) -> Belief:
        """The belief after one more frame.

        Args:
            observation: what the likelihood's `observe` takes.

        Raises:
            MotionError: not started, an observation that the likelihood refuses, or a prior whose poses aren't finite.
        """
        if self._state is None:
            raise MotionError("the filter has not started: call start(Start.at(pose)) first")
        self.likelihood.observe(**observation)
        recovered = self._lost >= _PATIENCE * self.prior.fps and self._restarted(observation)
        if self._began:
            self._resample_if_low()
            self._state = self.prior.propagate(self._state, self._rng)
            if self._lost >= _WIDER * self.prior.fps:
                self._state = self.prior.diffuse(self._state, 1.0, self._rng)
        self._began = True
        evidence, lost = self._updated()
        self._lost = self._lost + 1 if lost else 0
        if isinstance(self.likelihood, Learning) and not (lost or recovered):
            self.likelihood.learn(self._state.poses, self._log_weights)
        effective = float(1 / np.exp(2 * self._log_weights).sum())
        return Belief(self._state, self._log_weights.copy(), effective, evidence, lost, recovered)

    def _restarted(self, observation: Mapping[str, Any]) -> bool:
        """Begin anew if `restart` knows where; asked once per stretch of patience."""
        start = None if self.restart is None else self.restart(observation)
        self._lost = 0 if start is not None else int(_WIDER * self.prior.fps)
        if start is None:
            return False
        self.start(start)
        self.likelihood.observe(**observation)
        return True

    def _updated(self) -> tuple[float, bool]:
        """Weigh the predicted particles; returns the log evidence and whether the person is lost."""
        before, self._floor = self._state, self._unseen()
        scores = self._scored()
        for share in _WIDENING:
            if np.isfinite(scores).any():
                break
            self._state = self.prior.diffuse(self._state, share, self._rng)
            scores = self._scored()
        if not np.isfinite(scores).any():
            self._state = before
            return -np.inf, True
        evidence, scores = self._anneal(scores)
        if self.refine:
            which = self._resample()
            self._state, _ = refined(self.prior, self._scored, self._state, scores[which], self.refine, self._rng)
        return evidence, bool(self._floor - evidence > np.log(0.5))

    def _unseen(self) -> float:
        """Log of hidden · p(J | nobody), minus infinity where that can't be said."""
        if not self.hidden:
            return -np.inf
        return float(np.log(self.hidden)) + log_nobody(self.likelihood, self._state.poses[0])

    def _scored(self, state: Any = None) -> np.ndarray:
        """Log-likelihoods (N,) of the particles, or of those of `state`; minus infinity where they aren't numbers."""
        poses = (self._state if state is None else state).poses
        if not np.isfinite(poses).all():
            raise MotionError(
                f"{type(self.prior).__name__} made a pose that isn't finite: check its model and the start"
            )
        scores = np.asarray(self.likelihood.log_likelihood(poses), dtype=np.float64)
        scores = np.where(np.isnan(scores) | (scores == np.inf), -np.inf, scores)
        return np.logaddexp(np.log1p(-self.hidden) + scores, self._floor) if np.isfinite(self._floor) else scores

    def _weigh(self, log_likelihood: np.ndarray) -> float:
        """Multiply the weights by the likelihood (N,); returns the log of their sum, the evidence."""
        joint = self._log_weights + log_likelihood
        evidence = float(_log_sum(joint))
        self._log_weights = joint - evidence
        return evidence

    def _anneal(self, scores: np.ndarray) -> tuple[float, np.ndarray]:
        """Weigh by log-likelihoods (N,), bit by bit with resampling and stirring in between where there are layers.

        Returns the log evidence, and the log-likelihoods (N,) of the particles as they are then.
        """
        done, evidence = 0.0, 0.0
        for layer in range(1, self.layers):
            power = self._bearable(scores, 1.0 - done)
            evidence += self._weigh(_raised(scores, power))
            done += power
            if done >= 1.0:
                return evidence, scores
            scores = self._stirred(scores, _COOLING**layer)
        return evidence + self._weigh(_raised(scores, 1.0 - done)), scores

    def _stirred(self, scores: np.ndarray, share: float) -> np.ndarray:
        """Resample and move the particles, whose log-likelihoods are `scores` (N,); returns those after it."""
        which = self._resample()
        kept = self._state
        self._state = self.prior.diffuse(kept, share, self._rng)
        after = self._scored()
        if np.isfinite(after).any():
            return after
        self._state = kept
        return scores[which]

    def _bearable(self, log_likelihood: np.ndarray, most: float) -> float:
        """The power, up to `most`, that leaves the share `resample` of particles effective."""
        low, high = 0.0, most
        if self._effective(log_likelihood, most) >= self.resample * self.n:
            return most
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            low, high = (
                (middle, high) if self._effective(log_likelihood, middle) > self.resample * self.n else (low, middle)
            )
        return low

    def _effective(self, log_likelihood: np.ndarray, power: float) -> float:
        """Effective sample size after weighing by the likelihood (N,) to a power."""
        joint = self._log_weights + _raised(log_likelihood, power)
        weights = np.exp(joint - joint.max())
        return float(weights.sum() ** 2 / (weights**2).sum())

    def _resample_if_low(self) -> None:
        if self._effective(np.zeros(self.n), 0.0) < self.resample * self.n:
            self._resample()

    def _resample(self) -> np.ndarray:
        """Systematic resampling: equal weights, likelier particles more often; returns which (N,) were drawn."""
        which = systematic(np.exp(self._log_weights), self.n, self._rng)
        self._state = self._state.take(which)
        self._log_weights = np.full(self.n, -np.log(self.n))
        return which


def check_options(
    n: int, *, resample: float = 0.5, layers: int = 1, refine: int = 0, hidden: float = 0.02, restart: Any = None
) -> None:
    """Refuse options of a `ParticleFilter` that are out of range.

    Args:
        n, resample, layers, refine, hidden, restart: as `ParticleFilter` takes them.

    Raises:
        MotionError: one is; names it.
    """
    checked_whole(n, "n", 2, 10_000_000)
    checked_whole(layers, "layers", 1, 50)
    checked_whole(refine, "refine", 0, 50)
    if not 0 < as_number(resample) <= 1 or not 0 <= as_number(hidden) < 1:
        raise MotionError(f"resample must be a share up to 1 and hidden one below 1, got {resample!r}, {hidden!r}")


def _raised(scores: np.ndarray, power: float) -> np.ndarray:
    """Log-likelihoods (N,) of the likelihood to a power; impossible stays impossible, to the power 0 as well."""
    return np.where(np.isfinite(scores), power * np.nan_to_num(scores, neginf=0.0), -np.inf)


def _log_sum(values: np.ndarray) -> float:
    """Log Σ exp of values (N,), one of which is finite at least."""
    most = values.max()
    return float(most + np.log(np.exp(values - most).sum()))
