"""Particle filters: the posterior p(φ_t | J_1 ... J_t) of paper A (eqs. 6, 7) and paper C (eq. 1) as weighted poses."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np

from motionenv._core.validation import checked_number, checked_whole, random_generator
from motionenv.body import markers
from motionenv.errors import MotionError
from motionenv.likelihoods.base import Likelihood, apparent, log_nobody
from motionenv.tracking.priors.base import Prior, SizedPrior, Start, State, systematic
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.smoothing import smooth
from motionenv.types import Camera, Skeleton

_BISECTIONS = 30
_COOLING = 0.5  # ratio of the noise of successive annealing layers (Deutscher & Reid 2005, section 3.3)
_WIDER = 0.25  # [s] time lost before noise is increased
_WIDENING = (0.3, 0.6, 1.0)  # fractions of the process noise that are added when no particle can be scored
_ALIKE = 0.01  # relative tolerance for equal body heights
_NEGLIGIBLE = 30.0  # particles with a log weight this far below the highest are ignored
_RECENT, _FEW = 0.3, 3.0  # [s] back to the ancestors that are counted, and number of them that bands need to hold
_DEPTHS = 0.02  # [log] standard deviation per frame of depth and body size together; 0.01 and 0.04 lose more walkers


@dataclass(frozen=True, eq=False)
class Belief:
    """Posterior of the current frame, as weighted particles.

    Attributes:
        state: the particles, in the prior's representation.
        log_weights: (N,), normalised.
        effective: effective sample size 1 / Σ w², from 1 to N; with annealing, that of the last layer.
        ancestors: effective number of particles 0.3 s ago (or at the start, if that is later) from which those of this
            frame descend, from 1 to N.
        log_evidence: log p(J_t | J_1 ... J_t-1), up to the likelihood's normalisation; minus infinity if no particle
            could be scored. Annealing doesn't change it: it is that of the predicted particles.
        lost: whether the person is more probably occluded than visible, or no particle could be scored; the posterior
            is then close to the prediction.
        recovered: whether the filter was started anew at this frame.
    """

    state: State
    log_weights: np.ndarray
    effective: float
    ancestors: float
    log_evidence: float
    lost: bool
    recovered: bool = False

    def __repr__(self) -> str:
        what = ", lost" * self.lost + ", recovered" * self.recovered
        return f"Belief({len(self.log_weights)} particles, effective {self.effective:.0f}{what})"

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""
        return self.state.poses

    @property
    def reliable(self) -> bool:
        """Whether bands made of the particles can be expected to hold: enough ancestors, and not lost.

        With fewer than three effective ancestors, 90 % bands of the depth of walkers who were found hold the truth in
        74 to 88 % of frames, with more in 92 to 100 % (`motionenv bench tracking.calibration`). Errors shared by all
        particles aren't seen, such as a wrong body's: after a given start, bands hold 53 to 73 % with more, too.
        """
        return self.ancestors >= _FEW and not self.lost

    @cached_property
    def mean(self) -> np.ndarray:
        """Expected pose (25,) [m, rad]; angles are averaged on the circle, unwrapped near the most probable pose."""
        weights, poses = np.exp(self.log_weights), self.poses
        mean = weights @ poses
        angles = poses[:, 3:]
        turn = np.arctan2(weights @ np.sin(angles), weights @ np.cos(angles))
        near = angles[np.argmax(weights)]
        mean[3:] = near + np.remainder(turn - near + np.pi, 2 * np.pi) - np.pi
        return mean

    def expected_joints(self, skeleton: Skeleton) -> np.ndarray:
        """Expected marker positions (15, 3) [m]; more accurate than the markers of the mean pose.

        The `skeleton` is the prior's; particles with a size of their own are scaled.
        """
        some = np.flatnonzero(self.log_weights > self.log_weights.max() - _NEGLIGIBLE)
        weights = np.exp(self.log_weights[some])
        joints, roots = markers(self.poses[some], skeleton), self.poses[some, None, :3]
        if self.state.sizes is not None:
            joints = roots + self.state.sizes[some, None, None] * (joints - roots)
        return np.einsum("n,nij->ij", weights / weights.sum(), joints)


class ParticleFilter:
    """Particle filter: a prior proposes poses, a likelihood weights them (Isard & Blake 1998).

    With one layer this is the bootstrap filter of papers A and C, with systematic resampling when the effective sample
    size is low. With more layers, each frame is annealed (Deutscher & Reid 2005): the likelihood is first tempered by
    the power that keeps the fraction `resample` of particles effective; between layers, particles are resampled and
    diffused with decreasing noise. Annealing concentrates particles at the likelihood's highest peaks. It needs fewer
    particles, but the result is no longer the exact posterior.

    **Occlusion.** In the fraction `hidden` of frames the person is occluded, and the image doesn't depend on the pose:
    p(J | φ) = (1 - hidden) [p(J | φ, seen) - p(J | nobody)]₊ + hidden p(J | nobody). An occluder therefore leaves the
    prediction unchanged, and a body that explains no more than nobody, such as one out of the picture, isn't seen.

    **Lost track.** A frame that is more probably occluded than seen counts as lost. After a quarter of a second, noise
    is increased; who knows where the person is calls `start` again. If no particle can be scored (NaN or minus
    infinity), noise is increased at once and the frame is scored again; if that fails, the posterior is the prediction.

    **Adaptation.** The likelihood's `learn` receives the weighted particles of each frame (to update colours of limbs
    or the background), except in frames that are lost or started anew.

    Args:
        prior: motion prior.
        likelihood: observation model.
        n: number of particles.
        resample: effective sample size, as a fraction of n, below which particles are resampled.
        layers: number of annealing layers; 1 disables annealing.
        hidden: prior probability that the person is occluded in a frame; 0 disables the occlusion model.
        keep: whether the beliefs of all frames are kept for `smoothed`: 0.5 MB for each frame and 1,000 particles.
        seed: int or Generator; the result doesn't depend on the number of threads.

    **Body size.** If the prior has a `size` above 0 (see `FPCAPrior`), each particle has a size of its own, relative to
    the skeleton. Silhouettes and colours of a small body nearby are those of a large one far away, so the likelihood is
    asked about the latter; what differs is where the feet stand.

    Raises:
        MotionError: an argument out of range, `keep` with another prior than an `FPCAPrior`, or a prior and a
            likelihood for bodies of different heights.
    """

    def __init__(
        self, prior: Prior, likelihood: Likelihood, n: int = 1000, *, resample: float = 0.5, layers: int = 1,
        hidden: float = 0.02, keep: bool = False, seed: int | np.random.Generator | None = None,
    ) -> None:  # fmt: skip
        check_filter(n, resample, layers, hidden)
        scored = likelihood.skeleton or prior.skeleton
        if abs(scored.height / prior.skeleton.height - 1) > _ALIKE:
            raise MotionError(
                f"prior and likelihood must have the same skeleton, got bodies of {prior.skeleton.height:.2f} m and "
                f"{scored.height:.2f} m"
            )
        self.prior, self.likelihood, self.n = prior, likelihood, int(n)
        self.resample, self.layers, self.hidden, self.keep = resample, int(layers), hidden, keep
        if keep and not isinstance(prior, FPCAPrior):
            raise MotionError(f"only an FPCAPrior's walkers can be smoothed, got {type(prior).__name__}: omit keep")
        self._sized = prior.size > 0
        if self._sized and likelihood.camera is None:
            raise MotionError("a prior of unknown body size needs a likelihood with a camera: give it size=0")
        self._rng = random_generator(seed)
        self._state: Any = None

    def __repr__(self) -> str:
        return f"ParticleFilter({self.prior!r}, {self.likelihood!r}, n={self.n}, layers={self.layers})"

    def start(self, start: Start, beliefs: Sequence[Belief] | None = None) -> None:
        """Draw particles for the first frame, before it is observed, from a `start`: what is known of it.

        In the middle of a film, `beliefs` are those kept of earlier frames, and the next one is `recovered`.
        """
        self._state = self.prior.initial(start, self.n, self._rng)
        self._log_weights = np.full(self.n, -np.log(self.n))
        self._began, self._again, self._lost = False, beliefs is not None, 0
        self._lineage = np.arange(self.n)[None]  # ancestors of the particles in each of the last frames, oldest first
        # Who gives a pose knows where it is; a search guesses size and distance together.
        self._searched = self._sized and start.heights is not None
        self._usual = np.log(self._state.sizes).mean() if self._searched else 0.0
        self.beliefs: list[Belief] = [*(beliefs or ())]

    def resume(self, belief: Belief) -> None:
        """Go on from an earlier `belief` of this filter, as if its frame had been the last; forgets those kept."""
        self._state, self._log_weights = belief.state, belief.log_weights.copy()
        self._lineage, self._lost, self.beliefs = np.arange(self.n)[None], 0, []

    def smoothed(self, n: int = 200) -> list[Belief]:
        """Beliefs about the frames since the start given all of them, as `n` equally weighted walkers.

        Smaller than the filter's where the future tells more than the past, as about somebody behind things; see
        `motionenv.tracking.priors.smoothing`.

        Raises:
            MotionError: made without `keep`, or no frame yet.
        """
        if not self.keep or self._state is None or not self.beliefs:
            raise MotionError("nothing to smooth: make the filter with keep=True, and follow some frames first")
        camera = self.likelihood.camera
        centre = np.zeros(2) if camera is None else camera.centre[:2]
        return smooth(
            cast(FPCAPrior, self.prior), self.beliefs, checked_whole(n, "n", 1), centre,
            _DEPTHS * self._searched, self._rng.spawn(1)[0],
        )  # fmt: skip

    def step(self, **observation: Any) -> Belief:
        """Posterior of one more frame, whose `observation` is the arguments of the likelihood's `observe`.

        Raises:
            MotionError: not started, an observation that the likelihood rejects, or a prior's non-finite poses.
        """
        if self._state is None:
            raise MotionError("the filter is not started: call start(Start.at(pose)) first")
        self.likelihood.observe(**observation)
        recovered = self._again and not self._began
        if self._began:
            if self._effective(np.zeros(self.n), 0.0) < self.resample * self.n:
                self._resample()
            self._state = self.prior.propagate(self._state, self._rng)
            if self._searched and not self._lost:
                self._state = self._shifted_in_depth()
            if self._lost >= _WIDER * self.prior.fps:
                self._state = self.prior.diffuse(self._state, 1.0, self._rng)
            older = self._lineage[-max(1, round(_RECENT * self.prior.fps)) :]
            self._lineage = np.concatenate([older, np.arange(self.n)[None]])
        self._began = True
        evidence, lost = self._updated()
        self._lost = self._lost + 1 if lost else 0
        if not (lost or recovered):
            self.likelihood.learn(self._looks(), self._log_weights)
        effective = float(1 / np.exp(2 * self._log_weights).sum())
        ancestors = float(1 / (np.bincount(self._lineage[0], np.exp(self._log_weights)) ** 2).sum())
        belief = Belief(self._state, self._log_weights.copy(), effective, ancestors, evidence, lost, recovered)
        if self.keep:
            self.beliefs.append(belief)
        return belief

    def _shifted_in_depth(self) -> Any:
        """Particles with new sizes, and as much farther away: the picture hardly tells, so few particles would differ.

        Metropolis' rule keeps the distribution of sizes that of the prior, moved to the size that the search found.
        """
        prior, state = cast(SizedPrior, self.prior), self._state
        old = np.log(state.sizes) - self._usual
        new = old + _DEPTHS * self._rng.standard_normal(self.n)
        accepted = self._rng.random(self.n) < np.exp(0.5 * (old**2 - new**2) / prior.size**2)
        centre = cast(Camera, self.likelihood.camera).centre[:2]
        return prior.resized(state, np.exp(np.where(accepted, new, old) + self._usual), centre)

    def _updated(self) -> tuple[float, bool]:
        """Weight the predicted particles; returns the log evidence and whether the track is lost."""
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
        predicted = float(np.logaddexp.reduce(self._log_weights + scores))
        found = self._anneal(scores)
        return predicted, bool(self._floor - found > np.log(0.5))

    def _unseen(self) -> float:
        """Log of hidden · p(J | nobody); minus infinity if the likelihood doesn't define it."""
        if not self.hidden:
            return -np.inf
        return float(np.log(self.hidden)) + log_nobody(self.likelihood, self._state.poses[0])

    def _scored(self) -> np.ndarray:
        """Log-likelihoods (N,) of the particles; minus infinity instead of NaN."""
        if not np.isfinite(self._state.poses).all():
            raise MotionError(
                f"{type(self.prior).__name__} proposed a pose that isn't finite: check its model and the start"
            )
        scores = np.asarray(self.likelihood.log_likelihood(self._looks()), dtype=np.float64)
        scores = np.where(np.isnan(scores) | (scores == np.inf), -np.inf, scores)
        if not np.isfinite(self._floor):
            return scores
        nobody = self._floor - np.log(self.hidden)
        gain = np.maximum(scores - nobody, 1e-300)
        return np.logaddexp(np.log1p(-self.hidden) + nobody + gain + np.log(-np.expm1(-gain)), self._floor)

    def _looks(self) -> np.ndarray:
        """The particles' poses (N, 25), at the distance at which bodies of the likelihood's skeleton look like them."""
        if not self._sized:
            return self._state.poses
        if self.likelihood.measures_depth:
            raise MotionError("depths can't be tracked with a prior of unknown body size: give it size=0")
        return apparent(self._state.poses, self._state.sizes, cast(Camera, self.likelihood.camera))

    def _weigh(self, log_likelihood: np.ndarray) -> float:
        joint = self._log_weights + log_likelihood
        most = joint.max()
        evidence = float(most + np.log(np.exp(joint - most).sum()))
        self._log_weights = joint - evidence
        return evidence

    def _anneal(self, scores: np.ndarray) -> float:
        """Weight by log-likelihoods (N,) in `layers` steps, resampling and diffusing in between.

        Returns the sum of the layers' log evidences: with more than one, how well the particles explain the image where
        annealing has taken them, which is biased as evidence.
        """
        done, evidence = 0.0, 0.0
        for layer in range(1, self.layers):
            power = self._annealing_power(scores, 1.0 - done)
            evidence += self._weigh(_tempered(scores, power))
            done += power
            if done >= 1.0:
                return evidence
            scores = self._diffused(scores, _COOLING**layer)
        return evidence + self._weigh(_tempered(scores, 1.0 - done))

    def _diffused(self, scores: np.ndarray, share: float) -> np.ndarray:
        """Resample and diffuse the particles, whose log-likelihoods are `scores` (N,); returns the new ones."""
        which = self._resample()
        kept = self._state
        self._state = self.prior.diffuse(kept, share, self._rng)
        after = self._scored()
        if np.isfinite(after).any():
            return after
        self._state = kept
        return scores[which]

    def _annealing_power(self, log_likelihood: np.ndarray, most: float) -> float:
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
        joint = self._log_weights + _tempered(log_likelihood, power)
        weights = np.exp(joint - joint.max())
        return float(weights.sum() ** 2 / (weights**2).sum())

    def _resample(self) -> np.ndarray:
        which = systematic(np.exp(self._log_weights), self.n, self._rng)
        self._state, self._lineage = self._state.take(which), self._lineage[:, which]
        self._log_weights = np.full(self.n, -np.log(self.n))
        return which


def check_filter(n: int, resample: float = 0.5, layers: int = 1, hidden: float = 0.02) -> None:
    """Raise MotionError for n, resample, layers or hidden of a `ParticleFilter` out of range."""
    checked_whole(n, "n", 2, 10_000_000)
    checked_whole(layers, "layers", 1, 50)
    checked_number(resample, "resample", high=1, above=0)
    checked_number(hidden, "hidden", 0, below=1)


def _tempered(scores: np.ndarray, power: float) -> np.ndarray:
    return np.where(np.isfinite(scores), power * np.nan_to_num(scores, neginf=0.0), -np.inf)
