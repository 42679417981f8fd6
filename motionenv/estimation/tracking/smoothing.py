"""What was believed of each frame, seen from the end: whole motions drawn from p(φ_1 ... φ_T | J_1 ... J_T).

Forward filtering, backward simulation (Godsill, Doucet & West 2004, algorithm 1): the last frame's pose is drawn from
its belief, and each one before it from its own belief times how likely the prior goes from there to the pose just
drawn. The filter's beliefs must be those of its prior and likelihood: with annealing or refinement motions are as
approximate as those are.

What a frame before leaves open may show in the second frame after only: a velocity is what takes a pose to the next
one, so that poses alone depend on the two before them. The particles of frame t are therefore weighed by all that was
drawn of the frames after t that their prior makes hang on them (Lindsten & Schön 2013, ch. 4), two at most.

A prior of many dimensions hardly goes from one particle to the child of another: motions of such priors mostly follow
the particles' own lines of descent, and early frames are told by few of them. They hang together; their means are no
better than the filter's unless there are very many particles (`benchmarks/smoothing.py`).
"""

from collections.abc import Sequence
from typing import Any, Protocol, cast

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.numeric import checked_whole
from motionenv.estimation.tracking.filters import Belief
from motionenv.estimation.tracking.priors import Prior, systematic

_PIECE = 2_000_000  # transitions scored at a time


class Transitions(Protocol):
    """A prior whose transitions have a density."""

    def log_transition(self, before: Any, after: Any, later: Any = None) -> np.ndarray:
        """Log p(after_j, later_j | before_i) (N, M), up to what is the same for all of `before`.

        `before` holds N states, `after` M one frame later and `later` M two frames later, or None after the last frame.
        """


def smooth(beliefs: Sequence[Belief], prior: Prior, n: int = 100, seed=None) -> np.ndarray:
    """Motions drawn given all frames, later ones included.

    Args:
        beliefs: of every frame in turn, as `ParticleFilter.step` gave them.
        prior: that of the filter; must have the `log_transition` of `Transitions`, as `FPCAPrior`, `VelocityPrior` and
            the mixture of these have it.
        n: motions to draw.
        seed: int or Generator.

    Returns:
        (n, T, 25) [m, rad].

    Raises:
        MotionError: no beliefs, n below 1, a prior without a transition density, or a frame that no particle of the
            one before can have led to.
    """
    beliefs = list(beliefs)
    if not beliefs:
        raise MotionError("smooth needs the beliefs of at least one frame")
    n = checked_whole(n, "n", 1)
    if not hasattr(prior, "log_transition"):
        raise MotionError(
            f"smoothing needs a prior with a transition density, log_transition(before, after, later); "
            f"{type(prior).__name__} has none: take one that has, such as FPCAPrior"
        )
    rng, density = np.random.default_rng(seed), cast(Transitions, prior)
    last = beliefs[-1]
    after = last.state.take(systematic(np.exp(last.log_weights), n, rng))
    later, motions = None, [after.poses]
    for t in range(len(beliefs) - 2, -1, -1):
        if beliefs[t + 1].recovered:  # begun anew: the frames before know nothing of those after
            which, later = systematic(np.exp(beliefs[t].log_weights), n, rng), None
        else:
            which, later = _led_to(beliefs[t], after, later, density, rng, t), after
        after = beliefs[t].state.take(which)
        motions.append(after.poses)
    return np.stack(motions[::-1], axis=1)


def _led_to(belief: Belief, after: Any, later: Any, prior: Transitions, rng: np.random.Generator, t: int) -> np.ndarray:
    """For each state in `after` (n), and `later`, one particle of frame `t`, drawn by weight and transition density."""
    n, which = len(after.poses), []
    size = max(1, _PIECE // len(belief.log_weights))
    for first in range(0, n, size):
        some = np.arange(first, min(first + size, n))
        ahead = None if later is None else later.take(some)
        joint = belief.log_weights[:, None] + prior.log_transition(belief.state, after.take(some), ahead)
        most = joint.max(axis=0)
        if not np.isfinite(most).all():
            raise MotionError(
                f"no particle of frame {t} can have led to one of frame {t + 1}: smooth with more particles"
            )
        edges = np.cumsum(np.exp(joint - most), axis=0)
        points = rng.random(edges.shape[1]) * edges[-1]
        which.append(np.minimum((edges <= points).sum(axis=0), len(edges) - 1))
    return np.concatenate(which)
