"""Variances of nested effects, such as of people and of strides within people, by EM.

A stride's latents are a sum of effects s = b_person + t_trial + w_stride, each normal with the covariance of its level.
What data tell of latents is a normal likelihood, exp(c + h·s - s·J s / 2). Going up, each level's effect is integrated
out and its children's likelihoods are multiplied; going down, posteriors are conditioned on the parent's. Both are
exact, with any numbers of children and with data that tell nothing of some latents (Di, Crainiceanu, Caffo & Punjabi
2009 estimate the same covariances by moments, which gaps and unequal numbers make inefficient or indefinite).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np


@dataclass(frozen=True)
class Evidence:
    """What data tell of n latents (n, q): log p(data | s) = constant + linear · s - s · information s / 2."""

    information: np.ndarray  # (n, q, q)
    linear: np.ndarray  # (n, q)
    constant: np.ndarray  # (n,)

    def without(self, covariance: np.ndarray) -> tuple[Evidence, np.ndarray]:
        """Evidence about s - e, where e ~ N(0, `covariance` (q, q)); and e's covariance (n, q, q) given s - e."""
        spread = np.eye(len(covariance)) + covariance @ self.information
        given = np.linalg.solve(spread, np.broadcast_to(covariance, spread.shape))
        given = (given + given.swapaxes(1, 2)) / 2
        pulled = _times(given, self.linear)
        information = self.information - self.information @ given @ self.information
        gain = 0.5 * (self.linear * pulled).sum(axis=1) - 0.5 * np.linalg.slogdet(spread)[1]
        linear = self.linear - _times(self.information, pulled)
        return Evidence((information + information.swapaxes(1, 2)) / 2, linear, self.constant + gain), given

    def together(self, parents: np.ndarray) -> Evidence:
        """Evidence about the parents that data share; `parents` (n,) are numbers of them."""
        order = np.argsort(parents, kind="stable")
        starts = np.flatnonzero(np.diff(parents[order], prepend=-1))
        return Evidence(*(np.add.reduceat(part[order], starts) for part in vars(self).values()))


@dataclass(frozen=True)
class Effects:
    """Posterior of all effects.

    Attributes:
        means, covariances: of each level's effects, (n, q) and (n, q, q); people's first.
        shift: (q,) mean of people's latents.
        log_p: log-likelihood of the data.
    """

    means: tuple[np.ndarray, ...]
    covariances: tuple[np.ndarray, ...]
    shift: np.ndarray
    log_p: float


def effects(
    evidence: Evidence, parents: Sequence[np.ndarray], covariances: np.ndarray, shift: np.ndarray | None = None
) -> Effects:
    """The effects that `evidence` about strides (K) tells of.

    Args:
        evidence: about each stride's latents.
        parents: (K,) the number of each stride's trial or person, after that of each trial's person; one array less
            than there are levels, people's children first.
        covariances: (levels, q, q), people's first.
        shift: (q,) mean of people's latents; None takes the most likely.
    """
    above, given = [], []
    for level in range(len(covariances) - 1, -1, -1):
        above.append(evidence)
        evidence, own = evidence.without(covariances[level])
        given.append(own)
        if level:
            evidence = evidence.together(parents[level - 1])
    whole = evidence.together(np.zeros(len(evidence.linear), dtype=int))
    if shift is None:
        shift = np.linalg.lstsq(whole.information[0], whole.linear[0], rcond=None)[0]
    log_p = whole.constant[0] + whole.linear[0] @ shift - 0.5 * shift @ whole.information[0] @ shift
    mean, covariance = shift[None], np.zeros((1, len(shift), len(shift)))
    means, spreads = [], []
    for level, (seen, own) in enumerate(zip(above[::-1], given[::-1], strict=True)):
        which = parents[level - 1] if level else np.zeros(len(seen.linear), dtype=int)
        mean, covariance = mean[which], covariance[which]
        pull = own @ seen.information
        effect = _times(own, seen.linear - _times(seen.information, mean))
        means.append(effect)
        spreads.append(own + pull @ covariance @ pull.swapaxes(1, 2))
        rest = np.eye(len(shift)) - pull
        mean, covariance = mean + effect, own + rest @ covariance @ rest.swapaxes(1, 2)
    return Effects(tuple(means), tuple(spreads), shift, float(log_p))


class Fit(NamedTuple):
    """Most likely covariances (levels, q, q), people's mean (q,), and how the search ended."""

    covariances: np.ndarray
    shift: np.ndarray
    n_iter: int
    converged: bool


def fit_covariances(
    evidence: Evidence, parents: Sequence[np.ndarray], shrinkage: float, tol: float, max_iter: int,
    start: np.ndarray | None = None,
) -> Fit:  # fmt: skip
    """Covariances of all levels by EM, until a round gains less than `tol` nats for each stride.

    A covariance of n effects gives up the share shrinkage / (shrinkage + n) of its correlations: people are few, and
    correlations of few people are mostly noise (a prior of `shrinkage` people whose latents are uncorrelated).

    Args:
        evidence, parents: as in `effects`.
        shrinkage: from 0, for the most likely covariances, to infinity, for diagonal ones.
        tol: least gain.
        max_iter: greatest number of rounds.
        start: (levels, q, q) to begin with; by default each level has the same share.
    """
    q, levels = evidence.linear.shape[1], len(parents) + 1
    found = np.broadcast_to(np.eye(q) / levels, (levels, q, q)) if start is None else start
    before, n = -np.inf, 0
    for n in range(1, max_iter + 1):
        now = effects(evidence, parents, found)
        if now.log_p - before < tol * len(evidence.linear) and n > 1:
            break
        before = now.log_p
        found = np.stack([_shrunk(m, v, shrinkage) for m, v in zip(now.means, now.covariances, strict=True)])
    else:
        return Fit(found, effects(evidence, parents, found).shift, n, False)
    return Fit(found, now.shift, n, True)


def _shrunk(means: np.ndarray, covariances: np.ndarray, shrinkage: float) -> np.ndarray:
    """Second moment (q, q) of effects, with correlations towards 0."""
    moment = covariances.mean(axis=0) + means.T @ means / len(means)
    kept = 0.0 if np.isinf(shrinkage) else len(means) / (len(means) + shrinkage)
    return kept * moment + (1 - kept) * np.diag(np.diag(moment))


def _times(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return (matrices @ vectors[..., None])[..., 0]
