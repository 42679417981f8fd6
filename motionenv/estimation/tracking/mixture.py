"""A learned prior that a general one helps out (paper C, section 7): a share of the particles moves by the latter.

p(φ_t | φ_t-1) = (1 - share) p_learned(φ_t | φ_t-1) + share p_general(φ_t | φ_t-1)

A body that the general prior moves still has what the learned one knows beside the pose (of a walker its phase, pace
and scores), and that goes on as the learned prior says.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.numeric import as_number
from motionenv.estimation.tracking.fpca_prior import FPCAPrior
from motionenv.estimation.tracking.priors import Prior, Start
from motionenv.estimation.tracking.velocity_prior import VelocityPrior

_TOGETHER = 64  # pairs of states scored at a time


@dataclass(frozen=True, eq=False)
class MixtureState:
    """N bodies as both priors know them.

    Attributes:
        learned, general: states of the two priors, in the same poses.
    """

    learned: Any
    general: Any

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""
        return self.learned.poses

    def take(self, which: np.ndarray) -> "MixtureState":
        """The bodies `which` (n,)."""
        return MixtureState(self.learned.take(which), self.general.take(which))


class MixturePrior:
    """Bodies each of which moves in each frame as one of two priors says.

    Args:
        learned: the prior of most; what it can't move stays.
        general: the prior of the others, such as a `VelocityPrior`.
        share: of the particles that `general` moves.

    Raises:
        MotionError: priors of other bodies or frame rates, or `share` out of range.
    """

    def __init__(self, learned: Prior, general: Prior, share: float = 0.1):
        if learned.fps != general.fps:
            raise MotionError(f"both priors must have the same fps, got {learned.fps:g} and {general.fps:g}")
        if not np.allclose(learned.skeleton.offsets, general.skeleton.offsets, atol=1e-9):
            raise MotionError("both priors must move the same body: give both the same skeleton")
        if not 0 <= as_number(share) <= 1:
            raise MotionError(f"share must be from 0 to 1, got {share!r}")
        self.learned, self.general, self.share = learned, general, float(share)
        self.skeleton, self.fps = learned.skeleton, learned.fps

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> MixtureState:
        """Bodies (n) as the learned prior begins with them.

        Args:
            start: the first frame.
            n: how many.
            rng: of the draws.
        """
        learned = self.learned.initial(start, n, rng)
        before = np.where(np.isnan(start.previous), np.nan, start.previous - start.poses)
        nearest = _nearest(learned.poses, start.poses)
        each = Start(learned.poses, np.zeros(n), learned.poses + before[nearest], np.zeros(learned.poses.shape[1]))
        return MixtureState(learned, self.general.initial(each, n, rng))

    def propagate(self, state: MixtureState, rng: np.random.Generator) -> MixtureState:
        """The bodies one frame later; see `motionenv.estimation.tracking.priors.Prior`.

        Args:
            state: (N).
            rng: of draws and noise.
        """
        learned, general = self.learned.propagate(state.learned, rng), self.general.propagate(state.general, rng)
        helped = rng.random((len(learned.poses), 1)) < self.share
        return self.moved(MixtureState(learned, general), np.where(helped, general.poses, learned.poses))

    def diffuse(self, state: MixtureState, share: float, rng: np.random.Generator) -> MixtureState:
        """The bodies in the same frame, with `share` of a step's noise of the learned prior.

        Args:
            state: (N).
            share: 0 to 1.
            rng: of the noise.
        """
        learned = self.learned.diffuse(state.learned, share, rng)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def moved(self, state: MixtureState, poses: np.ndarray) -> MixtureState:
        """The bodies in other `poses` (N, 25), as far as the learned prior can move them there.

        Args:
            state: (N).
            poses: (N, 25) [m, rad].
        """
        learned = self.learned.moved(state.learned, poses)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def log_transition(
        self, before: MixtureState, after: MixtureState, later: MixtureState | None = None
    ) -> np.ndarray:
        """Log density (N, M) of the walkers of `after`, and of those of `later` behind them, after those of `before`.

        With g the gait (scores, phase, pace) and φ = (g, θ) all that `FPCAPrior` says, whose θ is a pose as well as
        place, heading and δ, each step has the density

            (1 - share) p_learned(φ' | φ) + share p_learned(g' | φ) p_general(θ' | θ, θ̇)

        The velocities θ̇ of `after`, seen from `before`, are those with which poses there go to poses here, as in
        `motionenv.estimation.tracking.velocity_prior.VelocityPrior.log_transition`.

        Args:
            before: (N).
            after: (M), one frame later.
            later: (M), two frames later, or None.

        Raises:
            MotionError: other priors than an `FPCAPrior`, and a `VelocityPrior` of the whole body.
        """
        learned, general = self._dense()
        one = general.log_transition(before.general, after.general)
        gait = learned.log_gait(before.learned, after.learned)
        total = self._mixed(learned.log_transition(before.learned, after.learned), gait + one)
        if later is None:
            return total
        both = general.log_transition(before.general, after.general, later.general)
        whole, gait = (_in_pairs(f, after.learned, later.learned) for f in (learned.log_transition, learned.log_gait))
        return total + self._mixed(whole, gait + both - one)

    def _mixed(self, learned: np.ndarray, general: np.ndarray) -> np.ndarray:
        """Log of the two log densities' mixture."""
        by_learned, by_general = (np.log(s) if s > 0 else -np.inf for s in (1 - self.share, self.share))
        return np.logaddexp(by_learned + learned, by_general + general)

    def _dense(self) -> tuple[FPCAPrior, VelocityPrior]:
        """Both priors, if their mixture has a density."""
        learned, general = self.learned, self.general
        if not isinstance(learned, FPCAPrior) or not isinstance(general, VelocityPrior) or not general.moves.all():
            raise MotionError(
                f"smoothing of a mixture needs an FPCAPrior and a VelocityPrior of the whole body: "
                f"{type(learned).__name__} and {type(general).__name__} have no density together"
            )
        return learned, general


def _in_pairs(log_density: Callable[[Any, Any], np.ndarray], before: Any, after: Any) -> np.ndarray:
    """Log densities (M,) of each of `after` (M) given its own one of `before` (M)."""
    m, out = len(after.poses), []
    for first in range(0, m, _TOGETHER):
        some = np.arange(first, min(first + _TOGETHER, m))
        out.append(np.diagonal(log_density(before.take(some), after.take(some))))
    return np.concatenate(out)


def _nearest(poses: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """Index (n,) of the candidate (m, 25) that each of `poses` (n, 25) is nearest to."""
    squared = (candidates**2).sum(1) - 2 * np.einsum("ni,mi->nm", poses, candidates)
    return squared.argmin(axis=1)
