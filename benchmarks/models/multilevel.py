"""Functional principal components between and within people (Di, Crainiceanu, Caffo & Punjabi 2009)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import BaseEstimator

from benchmarks.models.variance_components import Effects, Evidence, effects, fit_covariances
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.fpca.model import FunctionalPCA
from motionenv.types import Cycles

STRENGTHS = (0.0, 3.0, 10.0, 30.0, 100.0, np.inf)  # of shrinkage, to choose from
FOLDS = 5  # of people
LOOSE = 1e-3  # tolerance of fits that only choose


class Nesting(NamedTuple):
    """Who made which stride."""

    people: tuple[str, ...]  # labels
    parents: tuple[np.ndarray, ...]  # each stride's person; or each trial's person, and each stride's trial
    levels: tuple[str, ...]


class MultilevelFPCA(BaseEstimator):
    r"""A stride is x(τ) = μ(τ) + B_person(τ) + T_trial(τ) + W_stride(τ) + r(τ), each effect with components of its own.

    The space of all effects is that of a `FunctionalPCA`'s components, and r its residual. In that space each level has
    a covariance, found by maximum likelihood from strides with gaps and any number of strides of each person, who count
    as people and not as strides in the mean (`benchmarks.models.variance_components`). Where every person has one
    stride, levels can't be told apart.

    With few people, their covariance is mostly noise: correlations of scores are shrunk to zero as far as makes people
    left out most likely.

    Args:
        n_components: of the space of effects; a number, a share or "likelihood", as of `FunctionalPCA`.
        n_harmonics, residual_harmonics, least_seen: as of `FunctionalPCA`.
        shrinkage: as many people as the guess that scores are uncorrelated is worth: from 0, for the most likely
            covariances, to infinity; or "likelihood", for what is best for people left out in folds (`selection_`).
        tol: stop when an iteration gains less than this log-likelihood for each stride.
        max_iter: greatest number of iterations.

    Attributes:
        levels_: "people", "trials" (if people have several, and they have several strides) and "strides".
        fpca_: the `FunctionalPCA` whose components span the space.
        mean_: (P, m) mean of people.
        covariances_: (levels, q, q) of each level's effects, in units of the standard deviations of `fpca_`'s scores.
        explained_variance_: (levels, q) variances of each level's components [squared units, summed over samples].
        components_: (levels, q, P, m) orthonormal within their level, by falling variance.
        variance_ratio_: (levels,) share of each level in the model's variance; with `noise_ratio_` they sum to 1.
        icc_: the functional intraclass correlation: the share of people in the variance without noise (Di et al. 2009).
        icc_curve_: (P, m) the same at each phase of each channel.
        selection_: log-likelihood per sample of people left out, by shrinkage, if that was chosen by it; else None.
        shrinkage_: what was used.
        n_iter_, converged_: number of iterations, and whether they reached `tol`.
    """

    def __init__(
        self, n_components: int | float | str = 10, n_harmonics: int = 20, residual_harmonics: int = 12,
        least_seen: float = 0.5, shrinkage: float | str = "likelihood", tol: float = 1e-5, max_iter: int = 1000,
    ) -> None:  # fmt: skip
        self.n_components, self.n_harmonics, self.residual_harmonics = n_components, n_harmonics, residual_harmonics
        self.least_seen, self.shrinkage, self.tol, self.max_iter = least_seen, shrinkage, tol, max_iter

    def fit(
        self, cycles: Cycles | ArrayLike, y: None = None, *, subjects: Sequence | None = None,
        trials: Sequence | None = None,
    ) -> Self:  # fmt: skip
        """Estimate mean, covariances and components of each level from `cycles`.

        Args:
            cycles: `Cycles`, or an array (K, P, m), NaN where missing.
            y: no effect.
            subjects: the person's label of each cycle of an array. `Cycles` have their own.
            trials: the trial of each cycle of an array; None doesn't tell trials apart. `Cycles` have their own.

        Raises:
            MotionError: as of `FunctionalPCA.fit`, or nobody has two strides, or there is only one person.
        """
        strength = self.shrinkage
        if strength != "likelihood" and not (isinstance(strength, int | float) and strength >= 0):
            raise MotionError(f'shrinkage must be a number from 0 on or "likelihood", got {strength!r}')
        fpca = FunctionalPCA(
            self.n_components, self.n_harmonics, residual_harmonics=self.residual_harmonics, least_seen=self.least_seen
        )
        self.fpca_ = fpca.fit(cycles, subjects=subjects)
        values, people, numbers = _values(fpca, cycles, subjects, trials)
        strides = np.unique(people, return_counts=True)[1]
        if len(strides) < 2 or strides.max() < 2:
            raise MotionError("levels need at least two people, and somebody with two strides")
        nesting, self.selection_ = nest(people, numbers), None
        self.levels_ = nesting.levels
        if isinstance(strength, str):
            self.selection_ = _held_out(fpca, values, people, numbers, self.levels_)
            strength = max(self.selection_, key=self.selection_.__getitem__)
        self.shrinkage_ = float(strength)
        self.covariances_, self.shift_, self.n_iter_, self.converged_ = fit_covariances(
            evidence(fpca, values), nesting.parents, strength, self.tol, self.max_iter
        )
        self._set()
        return self

    def effects(
        self, cycles: Cycles | ArrayLike, subjects: Sequence | None = None, trials: Sequence | None = None
    ) -> tuple[tuple[str, ...], Effects]:
        """People's labels, and what `cycles` tell of the effects of each level: of people of the model or of others.

        Means (n, q) and covariances (n, q, q) of a level's effects are in the units of `covariances_`; `curves` draws
        them. `cycles`, `subjects`, `trials` and errors are as of `fit`.
        """
        self._check_fitted()
        values, people, numbers = _values(self.fpca_, cycles, subjects, trials)
        nesting = nest(people, numbers, self.levels_)
        told = effects(evidence(self.fpca_, values), nesting.parents, self.covariances_, self.shift_)
        return nesting.people, told

    def curves(self, latents: ArrayLike) -> np.ndarray:
        """Curves (..., P, m) of effects `latents` (..., q), as of `effects`."""
        self._check_fitted()
        return np.tensordot(np.asarray(latents, dtype=float), self._loadings(), axes=1)

    def score(
        self, cycles: Cycles | ArrayLike, y: None = None, *, subjects: Sequence | None = None,
        trials: Sequence | None = None,
    ) -> float:  # fmt: skip
        """Log-likelihood per seen sample, of the strides of each person together.

        `cycles`, `subjects` and `trials` are as of `fit`; `y` has no effect.

        Raises:
            GapError: no sample at all.
        """
        seen = int(np.isfinite(_values(self.fpca_, cycles, subjects, trials)[0]).sum())
        if not seen:
            raise GapError("these cycles have no samples, so the model can't be scored on them")
        return self.effects(cycles, subjects, trials)[1].log_p / seen

    def sample(
        self, people: int, strides: int, seed: int | np.random.Generator | None = None, *, noise: bool = True
    ) -> np.ndarray:
        """Draw `strides` of each of `people`, all of one trial: (people, strides, P, m); `seed` is an int or Generator.

        With `noise` they vary as what was seen; without, they are smooth walks.
        """
        self._check_fitted()
        rng, q = np.random.default_rng(seed), self.covariances_.shape[1]
        roots = np.linalg.cholesky(self.covariances_ + 1e-12 * np.eye(q))
        upper = sum(rng.standard_normal((people, 1, q)) @ root.T for root in roots[:-1])
        drawn = self.mean_ + self.curves(upper + rng.standard_normal((people, strides, q)) @ roots[-1].T)
        if noise:
            residuals = self.fpca_._distribution(self.fpca_.mean_[None]).draw_residuals(people * strides, rng)
            drawn += residuals.reshape(drawn.shape)
        return drawn

    def describe(self) -> dict[str, Any]:
        """JSON-serialisable description: `FunctionalPCA.describe` of the space, and each level's share."""
        self._check_fitted()
        levels = dict(zip(self.levels_, self.variance_ratio_.tolist(), strict=True))
        return self.fpca_.describe() | {
            "levels": levels, "residuals": self.noise_ratio_, "icc": self.icc_, "shrinkage": self.shrinkage_,
        }  # fmt: skip

    def _check_fitted(self) -> None:
        if not hasattr(self, "covariances_"):
            raise ModelError("this MultilevelFPCA is not fitted: call fit(cycles) first")

    def _loadings(self) -> np.ndarray:
        return self.fpca_.components_ * np.sqrt(self.fpca_.explained_variance_)[:, None, None]

    def _set(self) -> None:
        """Components and shares of variance, from the covariances."""
        loadings = self._loadings()
        self.mean_ = self.fpca_.mean_ + np.tensordot(self.shift_, loadings, axes=1)
        scale = np.sqrt(self.fpca_.explained_variance_)
        values, axes = np.linalg.eigh(self.covariances_ * scale[:, None] * scale)
        self.explained_variance_ = np.maximum(values[:, ::-1], 0.0)
        found = np.einsum("lij,ipm->ljpm", axes[:, :, ::-1], self.fpca_.components_)
        flat = found.reshape(*found.shape[:2], -1)  # the largest entry of each is positive
        largest = np.take_along_axis(flat, np.abs(flat).argmax(axis=-1, keepdims=True), axis=-1)
        self.components_ = found * np.where(largest < 0, -1.0, 1.0)[..., None]
        by_level, noise = self.explained_variance_.sum(axis=1), self.fpca_._noise_total()
        self.variance_ratio_ = by_level / (by_level.sum() + noise)
        self.noise_ratio_ = float(noise / (by_level.sum() + noise))
        self.icc_ = float(by_level[0] / by_level.sum())
        pointwise = np.einsum("lij,ipm,jpm->lpm", self.covariances_, loadings, loadings)
        total = pointwise.sum(axis=0)
        self.icc_curve_ = np.divide(pointwise[0], total, out=np.zeros_like(total), where=total > 0)


def evidence(fpca: FunctionalPCA, values: np.ndarray) -> Evidence:
    """What cycles `values` (K, P, m) tell of their latents, scores of `fpca` in standard deviations."""
    found = fpca._distribution(fpca.mean_[None]).infer(values, np.zeros(len(values), dtype=np.int64))
    precision = np.linalg.inv(found.covariance)
    linear = (precision @ found.z[..., None])[..., 0]
    constant = found.log_p - 0.5 * (found.z * linear).sum(axis=1) + 0.5 * np.linalg.slogdet(precision)[1]
    return Evidence(precision - np.eye(found.z.shape[1]), linear, constant)


def nest(people: ArrayLike, trials: ArrayLike | None, levels: Sequence[str] | None = None) -> Nesting:
    """Who made which stride, from labels of people and trials (K,).

    Trials are a level, unless `levels` says otherwise, if there are more than people and fewer than strides.
    """
    labels, who = np.unique(np.asarray(people, dtype=str), return_inverse=True)
    pairs = np.zeros((0, 2), dtype=int)
    if trials is not None:
        number = np.unique(np.asarray(trials), return_inverse=True)[1]
        pairs, which = np.unique(np.stack([who, number], axis=1), axis=0, return_inverse=True)
    apart = len(labels) < len(pairs) < len(who) if levels is None else "trials" in levels
    if not apart:
        return Nesting(tuple(labels.tolist()), (who,), ("people", "strides"))
    if not len(pairs):
        raise MotionError("this model tells trials apart: give the trial of each stride with trials=")
    return Nesting(tuple(labels.tolist()), (pairs[:, 0], which.reshape(-1)), ("people", "trials", "strides"))


def _values(fpca: FunctionalPCA, cycles, subjects, trials) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Values (K, P, m), people's labels, and labels of trials if there are any."""
    values, _ = fpca._checked(cycles)
    if isinstance(cycles, Cycles):
        subjects, trials = cycles.subject, cycles.sequence if trials is None else trials
    people = np.array([str(one) for one in (range(len(values)) if subjects is None else subjects)])
    return values, people, None if trials is None else np.asarray(trials)


def _held_out(fpca: FunctionalPCA, values: np.ndarray, people: np.ndarray, trials, levels) -> dict[float, float]:
    """Log-likelihood per sample of people left out in folds, by strength of shrinkage; other arguments as in `nest`."""
    labels, who = np.unique(people, return_inverse=True)
    folds, gained = who % min(FOLDS, len(labels)), dict.fromkeys(STRENGTHS, 0.0)
    parents = lambda some: nest(people[some], None if trials is None else trials[some], levels).parents
    for out in (folds == fold for fold in range(folds.max() + 1)):
        others = fpca.of_others(fpca.n_components_, values[~out], people[~out].tolist(), LOOSE)
        told, new, start = evidence(others, values[~out]), evidence(others, values[out]), None
        for strength in STRENGTHS:
            start, shift, *_ = fit_covariances(told, parents(~out), strength, LOOSE, 200, start)
            gained[strength] += effects(new, parents(out), start, shift).log_p
    return {strength: gain / int(np.isfinite(values).sum()) for strength, gain in gained.items()}
