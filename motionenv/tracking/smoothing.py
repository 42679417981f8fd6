"""Particle smoothing: motions drawn from p(φ_1 ... φ_T | J_1 ... J_T).

Forward filtering, backward simulation (Godsill, Doucet & West 2004, algorithm 1): the last frame's pose is drawn from
its filtering distribution, and each earlier one from its own, weighted by the transition density to the pose just
drawn. The filter must use the same prior and likelihood; annealing makes the result approximate.

Poses alone are not Markov: a velocity links a pose with its two predecessors. The particles of frame t are therefore
weighted by up to two later frames (Lindsten & Schön 2013, ch. 4).

Priors of high dimension rarely connect one particle with another's child. Their motions mostly follow the particles'
ancestral lines, so early frames have few distinct particles. The motions are coherent, but their means are no better
than the filter's unless there are very many particles (`benchmarks/smoothing.py`).
"""

from collections.abc import Sequence
from typing import Any, Protocol, cast

import numpy as np

from motionenv._core.validation import checked_whole, random_generator
from motionenv.errors import MotionError
from motionenv.tracking.particle_filter import Belief
from motionenv.tracking.priors.base import Prior, systematic

_PIECE = 2_000_000  # transitions evaluated at a time


class Transitions(Protocol):
    """A prior with a transition density."""

    def log_transition(self, before: Any, after: Any, later: Any = None) -> np.ndarray:
        """Log p(after_j, later_j | before_i) (N, M), up to a term that doesn't depend on `before`.

        `before` holds N states, `after` M states one frame later and `later` M two frames later, or None after the last
        frame.
        """


def smooth(beliefs: Sequence[Belief], prior: Prior, n: int = 100, seed=None) -> np.ndarray:
    """Draw motions given all frames.

    Args:
        beliefs: results of `ParticleFilter.step`, one per frame.
        prior: the filter's prior; must have the `log_transition` of `Transitions`, like `FPCAPrior`, `VelocityPrior`
            and the mixture of these two.
        n: number of motions to draw.
        seed: int or Generator.

    Returns:
        (n, T, 25) [m, rad].

    Raises:
        MotionError: no beliefs, n below 1, a prior without a transition density, or a frame that no particle of the
            preceding frame can lead to.
    """
    beliefs = list(beliefs)
    if not beliefs:
        raise MotionError("beliefs must hold at least one frame")
    n = checked_whole(n, "n", 1)
    if not hasattr(prior, "log_transition"):
        raise MotionError(
            "prior must have a transition density log_transition(before, after, later), such as FPCAPrior; "
            f"{type(prior).__name__} has none"
        )
    rng, density = random_generator(seed), cast(Transitions, prior)
    last = beliefs[-1]
    after = last.state.take(systematic(np.exp(last.log_weights), n, rng))
    later, motions = None, [after.poses]
    for t in range(len(beliefs) - 2, -1, -1):
        if beliefs[t + 1].recovered:  # restarted: independent of the frames before
            which, later = systematic(np.exp(beliefs[t].log_weights), n, rng), None
        else:
            which, later = _draw_ancestors(beliefs[t], after, later, density, rng, t), after
        after = beliefs[t].state.take(which)
        motions.append(after.poses)
    return np.stack(motions[::-1], axis=1)


def _draw_ancestors(
    belief: Belief, after: Any, later: Any, prior: Transitions, rng: np.random.Generator, t: int
) -> np.ndarray:
    """One particle of frame `t` for each state in `after` (n), drawn by weight and transition density."""
    n, which = len(after.poses), []
    size = max(1, _PIECE // len(belief.log_weights))
    for first in range(0, n, size):
        some = np.arange(first, min(first + size, n))
        ahead = None if later is None else later.take(some)
        joint = belief.log_weights[:, None] + prior.log_transition(belief.state, after.take(some), ahead)
        most = joint.max(axis=0)
        if not np.isfinite(most).all():
            raise MotionError(
                f"no particle of frame {t} can lead to one of frame {t + 1}: use more particles in the filter"
            )
        edges = np.cumsum(np.exp(joint - most), axis=0)
        points = rng.random(edges.shape[1]) * edges[-1]
        which.append(np.minimum((edges <= points).sum(axis=0), len(edges) - 1))
    return np.concatenate(which)
