r"""Smoothing of walkers: p(φ_t | J_1 ... J_T), what a whole sequence tells about each of its frames.

From the last frame back, each of n trajectories is extended by a walker φ_t given its next one φ_t+1. Backward
simulation (Godsill, Doucet & West 2004) would draw one of the filter's particles by its weight and p(φ_t+1 | φ_t), but
among a thousand particles of 38 variables only a particle's own parent leads to it. So a particle is drawn from those
in the same phase and heading, and moved there by the regression of φ_t on φ_t+1 over all of them, as ensemble smoothers
do (Raanes 2016, "On the ensemble Rauch-Tung-Striebel smoother"). Where particles are normally distributed, it is exact.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from motionenv.tracking.priors._walk_kernel import EASE, HEADING, PACE, PHASE, SIZE, TURN, X, Y
from motionenv.tracking.priors.base import systematic
from motionenv.tracking.priors.fpca import SHAPED, FPCAPrior, WalkState

if TYPE_CHECKING:
    from motionenv.tracking.particle_filter import Belief

_ALIKE = np.array([0.08, 0.4])  # [cycles, rad] standard deviations of phase and heading within a mode
_GAIT = [PHASE, HEADING, PACE, X, Y, SIZE, TURN, EASE]
_TINY = 1e-12  # variance that keeps what doesn't vary invertible


def smooth(
    prior: FPCAPrior, beliefs: Sequence["Belief"], n: int, centre: np.ndarray, depths: float, rng: np.random.Generator
) -> list["Belief"]:
    """Beliefs about each frame given all of them, as `n` equally weighted walkers.

    Args:
        prior: that made the beliefs.
        beliefs: of a filter, in the order of its frames.
        n: number of trajectories.
        centre: (2,) of the camera [m], along whose rays sizes and distances vary together.
        depths: standard deviation [log] by which the filter shifts them in each frame.
        rng: of the draws.
    """
    after, out = None, []
    for belief, later in zip(reversed(beliefs), [None, *reversed(beliefs[1:])], strict=True):
        if after is None or later is None or later.recovered:  # a restart forgets what was before
            after = belief.state.take(systematic(np.exp(belief.log_weights), n, rng))
        else:
            after = _before(prior, belief, after, centre, depths, rng)
        weights = np.full(n, -np.log(n))
        out.append(replace(belief, state=after, log_weights=weights, effective=float(n)))
    return out[::-1]


def _before(prior: FPCAPrior, belief: "Belief", after: WalkState, centre, depths: float, rng) -> WalkState:
    """Walkers (n,) of a frame given those of the next one, `after`."""
    state = cast(WalkState, belief.state)
    here, there, target = (_variables(s, centre) for s in (state, prior.expected(state), after))
    off = _short(target[:, None, :2] - there[:, :2])
    logs = belief.log_weights - 0.5 * ((off / _ALIKE) ** 2).sum(axis=-1)
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    which = (weights.cumsum(axis=1) < rng.random((len(weights), 1))).sum(axis=1).clip(max=len(here) - 1)
    share, one = weights.mean(axis=0), which[0]
    moved, came = (_short(v - v[one]) for v in (here, there))
    moved, came = moved - share @ moved, came - share @ came
    noise = prior.noise(there[one, 1], depths) + _TINY * np.eye(here.shape[1])
    gain = np.linalg.solve((came.T * share) @ came + noise, (came.T * share) @ moved).T
    drawn = there[which] + rng.standard_normal(target.shape) @ np.linalg.cholesky(noise).T
    return _walkers(prior, state.take(which), here[which] + _short(target - drawn) @ gain.T, centre)


def _variables(state: WalkState, centre: np.ndarray) -> np.ndarray:
    """Variables (N, 30 + q) that change smoothly: phase, heading, pace, apparent position, size, ...; scores, and δ."""
    gait = state.gait[:, _GAIT]
    gait[:, 3:5] = (gait[:, 3:5] - centre) / state.sizes[:, None]
    return np.concatenate([gait, state.scores, state.rest[:, SHAPED]], axis=1)


def _walkers(prior: FPCAPrior, like: WalkState, variables: np.ndarray, centre: np.ndarray) -> WalkState:
    """Walkers with other `variables`, otherwise `like` those given."""
    gait, rest, q = like.gait.copy(), np.zeros_like(like.rest), like.scores.shape[1]
    gait[:, _GAIT] = variables[:, : len(_GAIT)]
    gait[:, [X, Y]] = centre + gait[:, [X, Y]] * np.exp(gait[:, [SIZE]])
    scores, rest[:, SHAPED] = np.split(variables[:, len(_GAIT) :], [q], axis=1)
    return prior.posed(gait, np.ascontiguousarray(scores), rest)


def _short(differences: np.ndarray) -> np.ndarray:
    """Differences of variables, phases within half a cycle and headings within half a turn."""
    differences[..., 0] -= np.round(differences[..., 0])
    differences[..., 1] -= 2 * np.pi * np.round(differences[..., 1] / (2 * np.pi))
    return differences
