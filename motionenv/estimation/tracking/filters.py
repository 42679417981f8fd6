"""Particle filters: the belief p(φ_t | J_1 ... J_t) of paper A (eqs. 6, 7) and paper C (eq. 1) as weighted poses."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.tracking.priors import Prior, Start, systematic

_BISECTIONS = 30
_COOLING = 0.5  # noise of each annealing layer, as a share of the one's before (Deutscher & Reid 2005, section 3.3)


class Likelihood(Protocol):
    """p(J_t | φ_t), up to a factor that doesn't hang on the pose."""

    def observe(self, **observation: Any) -> None:
        """Take in the current observation."""

    def log_likelihood(self, poses: np.ndarray) -> np.ndarray:
        """Log-likelihood (N,) of the current observation given each of `poses` (N, 25)."""


@dataclass(frozen=True, eq=False)
class Belief:
    """What a filter believes about the current frame.

    Attributes:
        poses: (N, 25) [m, rad].
        log_weights: (N,), normalised.
        effective: effective sample size 1 / Σ w², from 1 to N.
        log_evidence: log p(J_t | J_1 ... J_t-1), as far as the likelihood is one.
        lost: whether nothing explained the frame, so that the belief is the prediction alone.
    """

    poses: np.ndarray
    log_weights: np.ndarray
    effective: float
    log_evidence: float
    lost: bool

    @property
    def mean(self) -> np.ndarray:
        """The expected pose (25,); headings of all particles lie within a turn of each other."""
        return np.exp(self.log_weights) @ self.poses


class ParticleFilter:
    """Follows a person: particles propagated by a prior and weighed by a likelihood (Isard & Blake 1998).

    With one layer this is the bootstrap filter of papers A and C, with systematic resampling when the effective sample
    size falls low. With more, each frame is annealed (Deutscher & Reid 2005): the likelihood is flattened at first, and
    between layers particles are resampled and stirred with less and less noise. The belief then gathers about the
    likelihood's highest peaks; it is no longer the exact posterior, but few particles find them.

    Args:
        prior: of motion.
        likelihood: of observations.
        n: particles.
        resample: share of n below which the effective sample size calls for resampling.
        layers: of annealing; 1 is none.
        seed: int or Generator; the same seed gives the same belief, whatever the number of threads.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self, prior: Prior, likelihood: Likelihood, n: int = 1000, *, resample: float = 0.5, layers: int = 1, seed=None
    ):
        if isinstance(n, bool) or n != int(n) or n < 2:
            raise MotionError(f"n must be a whole number of particles from 2, got {n!r}")
        if not 0 < resample <= 1 or isinstance(layers, bool) or layers != int(layers) or not 1 <= layers <= 50:
            raise MotionError(f"resample must be a share up to 1 and layers from 1 to 50, got {resample!r}, {layers!r}")
        self.prior, self.likelihood, self.n = prior, likelihood, int(n)
        self.resample, self.layers = resample, int(layers)
        self._rng = np.random.default_rng(seed)
        self._state: Any = None

    def start(self, start: Start) -> None:
        """Begin with what is known of the first frame, before that is observed.

        Args:
            start: the first frame.
        """
        self._state = self.prior.initial(start, self.n, self._rng)
        self._log_weights = np.full(self.n, -np.log(self.n))
        self._began = False

    def step(self, **observation: Any) -> Belief:
        """The belief after one more frame.

        Args:
            observation: what the likelihood's `observe` takes.

        Raises:
            MotionError: not started, or an observation that the likelihood refuses.
        """
        if self._state is None:
            raise MotionError("the filter has not started: call start(Start.at(pose)) first")
        self.likelihood.observe(**observation)
        if self._began:
            self._resample_if_low()
            self._state = self.prior.propagate(self._state, self._rng)
        self._began = True
        evidence = 0.0
        log_likelihood = self._scored()
        lost = not np.isfinite(log_likelihood).any()
        if not lost:
            evidence = self._anneal(log_likelihood) if self.layers > 1 else self._weigh(log_likelihood)
        effective = float(1 / np.exp(2 * self._log_weights).sum())
        return Belief(self._state.poses, self._log_weights.copy(), effective, evidence, lost)

    def _scored(self) -> np.ndarray:
        """Log-likelihoods (N,), minus infinity where they aren't numbers."""
        scores = self.likelihood.log_likelihood(self._state.poses)
        return np.where(np.isnan(scores), -np.inf, scores)

    def _weigh(self, log_likelihood: np.ndarray) -> float:
        """Multiply the weights by the likelihood (N,); returns the log of their sum, the evidence."""
        joint = self._log_weights + log_likelihood
        evidence = float(np.logaddexp.reduce(joint))
        self._log_weights = joint - evidence
        return evidence

    def _anneal(self, log_likelihood: np.ndarray) -> float:
        """Weigh by the likelihood (N,) bit by bit, resampling and stirring in between; returns the log evidence."""
        done, evidence = 0.0, 0.0
        for layer in range(1, self.layers):
            power = self._bearable(log_likelihood, 1.0 - done)
            evidence += self._weigh(power * log_likelihood)
            done += power
            if done >= 1.0:
                return evidence
            self._resample()
            self._state = self.prior.diffuse(self._state, _COOLING**layer, self._rng)
            log_likelihood = self._scored()
        return evidence + self._weigh((1.0 - done) * log_likelihood)

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
        joint = self._log_weights + power * log_likelihood
        weights = np.exp(joint - joint.max())
        return float(weights.sum() ** 2 / (weights**2).sum())

    def _resample_if_low(self) -> None:
        if self._effective(np.zeros(self.n), 0.0) < self.resample * self.n:
            self._resample()

    def _resample(self) -> None:
        """Systematic resampling: equal weights, likelier particles more often."""
        self._state = self._state.take(systematic(np.exp(self._log_weights), self.n, self._rng))
        self._log_weights = np.full(self.n, -np.log(self.n))
