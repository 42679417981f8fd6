"""Mixture of a learned and a general prior (paper C, section 7).

p(φ_t | φ_t-1) = (1 - share) p_learned(φ_t | φ_t-1) + share p_general(φ_t | φ_t-1)

A body that the general prior moves keeps the learned prior's other state variables (a walker's phase, pace and scores),
which continue to evolve by the learned prior.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from motionenv._core.validation import checked_number
from motionenv.errors import MotionError
from motionenv.tracking.priors.base import Prior, Start
from motionenv.tracking.priors.fpca import FPCAPrior
from motionenv.tracking.priors.velocity import VelocityPrior

_TOGETHER = 64  # pairs of states evaluated at a time


@dataclass(frozen=True, eq=False)
class MixtureState:
    """N bodies in the representations of both priors.

    Attributes:
        learned, general: states of the two priors, with equal poses.
    """

    learned: Any
    general: Any

    @property
    def sizes(self) -> np.ndarray:
        """(N,) body sizes of the learned prior, which must know some where its `size` isn't 0."""
        return self.learned.sizes

    @property
    def poses(self) -> np.ndarray:
        """(N, 25) [m, rad]."""
        return self.learned.poses

    def take(self, which: np.ndarray) -> "MixtureState":
        """The bodies with indices `which` (n,)."""
        return MixtureState(self.learned.take(which), self.general.take(which))


class MixturePrior:
    """Bodies that move, in each frame, by one of two priors.

    Args:
        learned: the main prior; pose entries that it can't move stay as they are.
        general: the other prior, such as a `VelocityPrior`.
        share: fraction of the particles that `general` moves.

    Raises:
        MotionError: priors of different bodies or frame rates, or `share` out of range.
    """

    def __init__(self, learned: Prior, general: Prior, share: float = 0.1):
        if learned.fps != general.fps:
            raise MotionError(f"both priors must have the same fps, got {learned.fps:g} and {general.fps:g}")
        if not np.allclose(learned.skeleton.offsets, general.skeleton.offsets, atol=1e-9):
            raise MotionError("both priors must have the same skeleton")
        self.learned, self.general, self.share = learned, general, checked_number(share, "share", 0, 1)
        self.skeleton, self.fps, self.size = learned.skeleton, learned.fps, getattr(learned, "size", 0.0)

    def initial(self, start: Start, n: int, rng: np.random.Generator) -> MixtureState:
        """Draw `n` bodies from the learned prior.

        Args:
            start: the first frame.
            n: number of bodies.
            rng: random generator.
        """
        learned = self.learned.initial(start, n, rng)
        before = np.where(np.isnan(start.previous), np.nan, start.previous - start.poses)
        nearest = _nearest(learned.poses, start.poses)
        each = Start(learned.poses, np.zeros(n), learned.poses + before[nearest], np.zeros(learned.poses.shape[1]))
        return MixtureState(learned, self.general.initial(each, n, rng))

    def propagate(self, state: MixtureState, rng: np.random.Generator) -> MixtureState:
        """The bodies one frame later; see `motionenv.tracking.priors.base.Prior`.

        Args:
            state: N bodies.
            rng: random generator.
        """
        learned, general = self.learned.propagate(state.learned, rng), self.general.propagate(state.general, rng)
        helped = rng.random((len(learned.poses), 1)) < self.share
        return self.moved(MixtureState(learned, general), np.where(helped, general.poses, learned.poses))

    def diffuse(self, state: MixtureState, share: float, rng: np.random.Generator) -> MixtureState:
        """The bodies within the same frame, with the fraction `share` of the learned prior's process noise.

        Args:
            state: N bodies.
            share: from 0 to 1.
            rng: random generator.
        """
        learned = self.learned.diffuse(state.learned, share, rng)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def moved(self, state: MixtureState, poses: np.ndarray) -> MixtureState:
        """The bodies with other `poses` (N, 25), as far as the learned prior can represent them.

        Args:
            state: N bodies.
            poses: (N, 25) [m, rad].
        """
        learned = self.learned.moved(state.learned, poses)
        return MixtureState(learned, self.general.moved(state.general, learned.poses))

    def log_transition(
        self, before: MixtureState, after: MixtureState, later: MixtureState | None = None
    ) -> np.ndarray:
        """Log density (N, M) of `after`, and of `later` following it, given `before`.

        With g the gait (scores, phase, pace), and θ the pose with position, heading and δ of `FPCAPrior`'s φ = (g, θ),
        each step has the density

            (1 - share) p_learned(φ' | φ) + share p_learned(g' | φ) p_general(θ' | θ, θ̇)

        The velocities θ̇ of `after` are the differences of its poses from those of `before`, as in
        `motionenv.tracking.priors.velocity.VelocityPrior.log_transition`.

        Args:
            before: N bodies.
            after: M bodies one frame later.
            later: M bodies two frames later, or None.

        Raises:
            MotionError: priors other than an `FPCAPrior` and a `VelocityPrior` of the whole body.
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
        """Log of the mixture of two log densities."""
        by_learned, by_general = (np.log(s) if s > 0 else -np.inf for s in (1 - self.share, self.share))
        return np.logaddexp(by_learned + learned, by_general + general)

    def _dense(self) -> tuple[FPCAPrior, VelocityPrior]:
        """Both priors, if their mixture has a density."""
        learned, general = self.learned, self.general
        if not isinstance(learned, FPCAPrior) or not isinstance(general, VelocityPrior) or not general.moves.all():
            raise MotionError(
                "smoothing with a mixture needs an FPCAPrior and a VelocityPrior of the whole body, got "
                f"{type(learned).__name__} and {type(general).__name__}"
            )
        return learned, general


def _in_pairs(log_density: Callable[[Any, Any], np.ndarray], before: Any, after: Any) -> np.ndarray:
    """Log densities (M,) of each of `after` (M) given the corresponding one of `before` (M)."""
    m, out = len(after.poses), []
    for first in range(0, m, _TOGETHER):
        some = np.arange(first, min(first + _TOGETHER, m))
        out.append(np.diagonal(log_density(before.take(some), after.take(some))))
    return np.concatenate(out)


def _nearest(poses: np.ndarray, candidates: np.ndarray) -> np.ndarray:
    """Index (n,) of the candidate (m, 25) nearest to each of `poses` (n, 25)."""
    squared = (candidates**2).sum(1) - 2 * np.einsum("ni,mi->nm", poses, candidates)
    return squared.argmin(axis=1)
