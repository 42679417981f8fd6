"""Functional principal components of motion cycles with missing samples (paper A, section 4)."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from functools import cached_property
from html import escape
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.principal_axes import signs
from motionenv._core.representation import curves
from motionenv._core.validation import random_generator
from motionenv.cycles import StoredCycles
from motionenv.errors import GapError, ModelError, MotionError
from motionenv.models.fpca import observations as obs
from motionenv.models.fpca.em_fit import Parameters, fit_ppca, latent_means
from motionenv.models.fpca.fourier_basis import fourier_columns, sampled_basis
from motionenv.models.fpca.observations import Block, Columns, Observations
from motionenv.models.fpca.residual import expected_residual, residual_model, residual_moments
from motionenv.models.fpca.svd_fit import fit_svd
from motionenv.models.storage.blocks import Selected, merged, over, selected
from motionenv.models.storage.model_file import StoredModel
from motionenv.types import Cycles

FITS = {"ppca": fit_ppca, "svd": fit_svd}
CENTRES = ("all", "subject")
NO_VARIANCE = 1e-12  # eigenvalues below this share of the largest λ are rounding errors
SAFE = 1e-6  # determinant above which the normal equations are solved directly
SETTINGS = ("n_components", "n_harmonics", "centre", "method", "residual_harmonics", "tol", "max_iter")
STORED = (
    "subject_coefficients_", "component_coefficients_", "noise_variance_", "explained_variance_",
    "explained_variance_ratio_", "singular_values_", "errors_", "residual_spectrum_", "white_variance_",
)  # fmt: skip
_BLOCK = 1024  # phases evaluated at a time, so that intermediates stay in the cache


class FunctionalPCA(StoredModel):
    r"""A cycle is x(τ) = μ(τ) + Σ_j s_j v_j(τ), with scores s ~ N(0, diag λ) and smooth, periodic μ and v_j.

    Two ways to estimate it when samples are missing:

    - `method="ppca"` (default) maximises the likelihood of the observed samples with EM
      (`motionenv.models.fpca.em_fit`). Scores shrink towards 0 the less a cycle shows, so even a few cycles suffice to
      fill gaps well.
    - `method="svd"` finds the solution of paper A's fig. 8 in the real basis. It minimises the same error as the
      alternation of imputation, projection and truncated SVD, but needs no SVD of all cycles
      (`motionenv.models.fpca.svd_fit`).

    Args:
        n_components: number of components q.
        n_harmonics: a constant and n_harmonics - 1 cosine-sine pairs per channel (fig. 8: 20).
        centre: "all" for one mean, so that components describe differences between people (fig. 9); "subject" for one
            mean per person, so that they describe variation within people (fig. 10).
        method: "ppca" or "svd".
        residual_harmonics: a constant and residual_harmonics - 1 pairs per channel for the smooth part of the
            residuals, with which `impute` fills gaps from their neighbourhood too (`motionenv.models.fpca.residual`).
            0 uses components only, as in fig. 8.
        tol: stop when an iteration improves the objective by less than this fraction.
        max_iter: greatest number of iterations.

    Attributes:
        channels_: names of the channels.
        mean_: (P, m) mean cycle; with centre="subject" the average of the people's means.
        subjects_, subject_means_: people's labels and means (people, P, m); with centre="all" a single one, "all".
        components_: (q, P, m), orthonormal as vectors of P·m samples; the largest sample of each is positive.
        explained_variance_: (q,) λ, variance of the scores [squared units of the channels, summed over samples].
        explained_variance_ratio_: (q,) λ as a share of the variance about the means.
        singular_values_: (q,) √((K - people)·λ); for "svd" those of X⁽³⁾.
        noise_variance_: (m,) residual variance per sample.
        residual_spectrum_, white_variance_: (m, 2·residual_harmonics - 1) spectrum of the residuals' smooth part, and
            (m,) variance of the rest.
        scores_: (K, q) scores of the fitted cycles, relative to their group's mean.
        imputed_: (K, P, m) the fitted cycles with gaps filled; observed samples are unchanged. They are
            computed when first asked for.
        errors_: (iterations,) the objective, which never rises: Theorem 1's ‖X⁽²⁾ - X⁽⁵⁾‖ for "svd", the negative
            log-likelihood of the observed samples for "ppca".
        n_cycles_: number of fitted cycles K.
        card_: the model card.
    """

    kind = "fpca"

    def __init__(
        self, n_components: int = 5, n_harmonics: int = 20, centre: str = "all", method: str = "ppca",
        residual_harmonics: int = 8, tol: float = 1e-6, max_iter: int = 200,
    ) -> None:  # fmt: skip
        self.n_components, self.n_harmonics, self.residual_harmonics = n_components, n_harmonics, residual_harmonics
        self.centre, self.method = centre, method
        self.tol, self.max_iter = tol, max_iter
        self.card_: dict = {}

    def _repr_html_(self) -> str | None:
        """The mean cycle of each channel, for notebooks; None before `fit`."""
        return curves(self.mean_.T, escape(repr(self))) if hasattr(self, "mean_") else None

    def fit(
        self, cycles: Cycles | StoredCycles, channels: Sequence[str] | None = None, executor: Executor | None = None
    ) -> FunctionalPCA:  # fmt: skip
        """Estimate mean and components from `cycles`, of which a block of 32 MB at a time is worked on.

        Args:
            cycles: of any number of people, NaN where missing: `Cycles`, or `motionenv.cycles.StoredCycles` of files
                that don't fit in memory. A channel may be missing in some of them altogether.
            channels: names of the channels to use; by default all that at least one cycle shows, so that a capture of
                the lower body gives a model of the lower body. `channels_` tells which they are.
            executor: any `concurrent.futures.Executor`, whose workers then compute blocks; None uses the threads of
                this process. The model is the same to the bit.

        Raises:
            MotionError: no cycles, a setting out of range, an unknown channel, an infinite value, too few cycles.
            GapError: a channel of `channels`, or all channels, without one observed sample.
        """
        self._check_settings()
        if not isinstance(cycles, (Cycles, StoredCycles)):
            raise MotionError(
                f"cycles must be Cycles, as motionenv.segment makes them, or StoredCycles; got {type(cycles).__name__}"
            )
        self.__dict__.pop("imputed_", None)
        values = _select(cycles, channels)
        labels = cycles.subject if self.centre == "subject" else ("all",) * len(cycles.values)
        subjects, groups = np.unique(labels, return_inverse=True)
        self.subjects_, self.n_cycles_ = tuple(subjects.tolist()), len(cycles.values)
        _check_numbers(self.n_cycles_, self.n_components, len(subjects))
        columns = obs.column_sums(values, groups, executor)
        if channels is None:
            values, columns = _shown(values, columns, cycles.channels)
        self.channels_ = tuple(cycles.channels[i] for i in values.which)
        _check_columns(columns, self.channels_)
        basis = self._basis_of(values.shape[1])
        data = Observations(values, basis, obs.group_centres(columns, basis), groups, executor)
        means, components, variance, noise, errors = FITS[self.method](data, self.n_components, self.tol, self.max_iter)
        self._set(basis, means, components)
        self.explained_variance_, self.noise_variance_, self.errors_ = variance, noise, np.array(errors)
        self._describe(data)
        return self

    @cached_property
    def imputed_(self) -> np.ndarray:
        """(K, P, m) the fitted cycles with gaps filled, computed when they are first asked for."""
        self._check_fitted()
        if not hasattr(self, "_fitted"):
            raise ModelError("a model from a file doesn't hold its cycles: fill gaps with impute(values)")
        return self._filled(*self._fitted, self.scores_, self.subject_means_)

    def transform(self, values: ArrayLike) -> np.ndarray:
        """Scores (..., q) of cycles `values` (..., P, m), NaN where missing, relative to `mean_`.

        "ppca": posterior means, so a cycle without observed samples scores 0. "svd": least squares on the observed
        samples.

        Raises:
            MotionError: another shape, or an infinite value.
        """
        self._check_fitted()
        values = np.asarray(values, dtype=np.float64)
        if values.shape[-2:] != self.mean_.shape or np.isinf(values).any():
            raise MotionError(
                f"values must be finite or NaN, of shape (..., {self.mean_.shape}), got {values.shape}; the channels "
                f"are {', '.join(self.channels_)}"
            )
        flat = values.reshape(-1, *self.mean_.shape)
        centre = self.mean_coefficients_[None]
        data = Observations(flat, self._basis_of(len(self.mean_)), centre, np.zeros(len(flat), dtype=np.int64))
        return self._scores(data, centre).reshape(*values.shape[:-2], -1)

    def inverse_transform(self, scores: ArrayLike) -> np.ndarray:
        """Cycles (..., P, m) with the given `scores` (..., q)."""
        self._check_fitted()
        return self.mean_ + np.tensordot(np.asarray(scores, dtype=np.float64), self.components_, axes=1)

    def impute(self, values: ArrayLike) -> np.ndarray:
        """Cycles `values` (..., P, m) with gaps filled from the components and from the samples around each gap."""
        self._check_fitted()
        values = np.asarray(values, dtype=np.float64)
        flat = values.reshape(-1, *self.mean_.shape)
        scores = self.transform(flat)
        which = np.zeros(len(flat), dtype=np.int64)
        return self._filled(selected(flat), which, scores, self.mean_[None]).reshape(values.shape)

    def evaluate(self, scores: ArrayLike, phase: ArrayLike, derivative: int = 0) -> np.ndarray:
        """The model (..., m) at any phase, from its Fourier series: smooth and periodic in every derivative.

        Args:
            scores: (..., q).
            phase: (...) real numbers [cycles]; broadcasts with the scores.
            derivative: 0 for values, d for the d-th derivative with respect to phase [per cycle^d].
        """
        self._check_fitted()
        scores, phase = np.asarray(scores, dtype=np.float64), np.asarray(phase, dtype=np.float64)
        n_columns, m = self.mean_coefficients_.shape
        shape = np.broadcast_shapes(scores.shape[:-1], phase.shape)
        flat = np.broadcast_to(scores, (*shape, scores.shape[-1])).reshape(-1, scores.shape[-1])
        phases = np.broadcast_to(phase, shape).ravel()
        terms = np.concatenate([self.mean_coefficients_[None], self.component_coefficients_]).reshape(-1, m)
        out = np.empty((len(phases), m))
        for start in range(0, len(phases), _BLOCK):
            part = slice(start, start + _BLOCK)
            columns = fourier_columns(phases[part], (n_columns + 1) // 2, len(self.mean_), derivative)
            factors = np.concatenate([np.ones((1, columns.shape[1])), flat[part].T])
            out[part] = (factors[:, None] * columns).reshape(len(terms), -1).T @ terms
        return out.reshape(*shape, m)

    def sample(self, n: int, seed: int | np.random.Generator | None = None) -> np.ndarray:
        """Draw `n` cycles (n, P, m) with scores from N(0, diag λ); `seed` is an int or a Generator."""
        self._check_fitted()
        normal = random_generator(seed).standard_normal((n, len(self.components_)))
        return self.inverse_transform(normal * np.sqrt(self.explained_variance_))

    def score_samples(self, scores: ArrayLike) -> np.ndarray:
        """Log-density (...) of `scores` (..., q) under N(0, diag λ).

        Excludes components without variance (λ at most 1e-12 of the largest), as in data of lower rank than q.
        """
        self._check_fitted()
        varies = self.explained_variance_ > NO_VARIANCE * self.explained_variance_.max()
        variance = self.explained_variance_[varies]
        scores = np.asarray(scores, dtype=np.float64)[..., varies]
        return -0.5 * (scores**2 / variance + np.log(2 * np.pi * variance)).sum(axis=-1)

    def score(self, values: np.ndarray) -> float:
        """Mean log-density of the scores of cycles `values` (..., P, m)."""
        return float(self.score_samples(self.transform(values)).mean())

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and JSON-serialisable settings from which `from_arrays` restores the model."""
        self._check_fitted()
        arrays = {name: getattr(self, name) for name in STORED}
        settings = {name: getattr(self, name) for name in SETTINGS}
        labels = {"channels": self.channels_, "subjects": self.subjects_, "samples": len(self.mean_)}
        return arrays, {"settings": settings, **labels, "n_cycles": self.n_cycles_}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict[str, Any]) -> FunctionalPCA:
        """As `ModelFile.from_arrays`, from `arrays` and `meta`, without the data of its fitted cycles."""
        model = cls(**meta["settings"])
        model._check_settings()
        model.channels_, model.subjects_ = tuple(meta["channels"]), tuple(meta["subjects"])
        model.n_cycles_ = meta["n_cycles"]
        q, n, m = model.n_components, 2 * model.n_harmonics - 1, len(model.channels_)
        shapes: dict[str, tuple] = {"noise_variance_": (m,), "explained_variance_": (q,)}
        shapes |= {"white_variance_": (m,), "residual_spectrum_": (m, max(0, 2 * model.residual_harmonics - 1))}
        shapes |= {"subject_coefficients_": (len(model.subjects_), n, m), "component_coefficients_": (q, n, m)}
        for name in STORED:
            if name in shapes and arrays[name].shape != shapes[name]:
                raise ModelError(f"{name} has shape {arrays[name].shape}, expected {shapes[name]}: fit the model again")
            setattr(model, name, arrays[name])
        model._set(model._basis_of(meta["samples"]), model.subject_coefficients_, model.component_coefficients_)
        return model

    def _basis_of(self, samples):
        return sampled_basis(samples, self.n_harmonics)

    def _check_settings(self):
        if self.centre not in CENTRES or self.method not in FITS:
            raise MotionError(
                f"centre must be one of {CENTRES}, method one of {tuple(FITS)}, got {self.centre!r}, {self.method!r}"
            )
        if self.n_components < 1 or self.residual_harmonics < 0 or not self.tol > 0 or self.max_iter < 1:
            raise MotionError(
                "n_components and max_iter must be at least 1, residual_harmonics at least 0 and tol above 0, got "
                f"{self.n_components}, {self.max_iter}, {self.residual_harmonics}, {self.tol}"
            )

    def _check_fitted(self):
        if not hasattr(self, "mean_coefficients_"):
            raise ModelError("this FunctionalPCA is not fitted: call fit(cycles) first, or motionenv.load(name)")

    def _set(self, basis, means, components):
        """Store people's means (G, n, m) and components (q, n, m), both in the basis; normalise signs."""
        sign = signs((basis @ components).reshape(len(components), -1))
        self.component_coefficients_ = np.ascontiguousarray(components * sign[:, None, None])
        self.subject_coefficients_ = np.ascontiguousarray(means)
        self.mean_coefficients_ = means.mean(axis=0)
        self.components_ = basis @ self.component_coefficients_
        self.subject_means_ = basis @ self.subject_coefficients_
        self.mean_ = basis @ self.mean_coefficients_

    def _describe(self, data: Observations):
        """Set scores and shares of variance of the fitted cycles, and the model of their residuals."""
        self._fitted = data.values, data.groups
        self.scores_ = self._scores(data, self.subject_coefficients_)
        n, samples = self.residual_harmonics, len(self.mean_)
        self.residual_spectrum_, self.white_variance_ = np.zeros((len(self.channels_), 0)), self.noise_variance_
        if n:
            given = self.subject_means_, self.components_, sampled_basis(samples, n)
            rows = (data.groups, self.scores_)
            moments = merged(over(_residual_moments, data.values, rows, given, data.executor))
            self.residual_spectrum_, self.white_variance_ = residual_model(moments)
        freedom = data.n - len(self.subject_means_)
        self.singular_values_ = np.sqrt(freedom * self.explained_variance_)
        total = data.sum_of_squares(self.subject_coefficients_) / data.n_seen * self.mean_.size * data.n / freedom
        self.explained_variance_ratio_ = self.explained_variance_ / total

    def _filled(self, values: Selected, groups, scores, means) -> np.ndarray:
        """Cycles `values` (K, P, m) with gaps filled from components and the residuals around them.

        `means` (G, P, m) are those of the groups, `groups` (K,) those of the cycles, `scores` (K, q).
        """
        n, samples = self.residual_harmonics, values.shape[1]
        smooth = (sampled_basis(samples, n), self.residual_spectrum_, self.white_variance_) if n else None
        out, done = np.empty(values.shape), 0
        for part in over(_filled, values, (groups, scores), (means, self.components_, smooth)):
            out[done : done + len(part)] = part
            done += len(part)
        return out

    def _scores(self, data: Observations, means) -> np.ndarray:
        """Scores (K, q) relative to the groups' `means` (G, n, m), given in the basis."""
        w = self.component_coefficients_.reshape(len(self.components_), -1).T
        if self.method == "svd":
            return _least_squares(data, w)
        scale = np.sqrt(self.explained_variance_)
        shift = (means - data.centre).reshape(len(means), -1)
        return latent_means(data, Parameters(w * scale, shift, self.noise_variance_)) * scale


def _residual_moments(values, groups, scores, means, components, basis) -> tuple:
    explained = _explained(groups, scores, means, components)
    return residual_moments(np.subtract(values, explained, out=explained), basis)


def _explained(groups, scores, means, components) -> np.ndarray:
    """Cycles (K, P, m) of given `scores` (K, q)."""
    explained = np.tensordot(scores, components, axes=1)
    explained += means if len(means) == 1 else means[groups]
    return explained


def _filled(values, groups, scores, means, components, smooth) -> np.ndarray:
    """A block's cycles with gaps filled; `smooth` is basis, spectrum and white variance of the residuals, or None."""
    explained = _explained(groups, scores, means, components)
    if smooth is not None:
        explained += expected_residual(values - explained, *smooth)
    return np.where(np.isnan(values), explained, values)


def _least_squares(data: Observations, w) -> np.ndarray:
    """Least-squares scores (K, q) on each cycle's seen samples; the shortest if underdetermined."""
    curves = obs.functions(w, data.basis, len(data.squares))
    products = obs.triangle(curves[..., :, None] * curves[..., None, :])
    return np.concatenate(list(data.each(_block_least_squares, w, products)))


def _block_least_squares(data: Block, w, products) -> np.ndarray:
    normal, right = np.eye(w.shape[1]) - obs.from_triangle(data.gap_sums(products), w.shape[1]), data.coefficients @ w
    # All eigenvalues lie in [0, 1], so the least is at least the determinant.
    safe = np.linalg.det(normal) > SAFE
    scores = np.empty_like(right)
    scores[safe] = np.linalg.solve(normal[safe], right[safe, :, None])[..., 0]
    scores[~safe] = (np.linalg.pinv(normal[~safe], hermitian=True) @ right[~safe, :, None])[..., 0]
    return scores


def _select(cycles: Cycles | StoredCycles, channels) -> Selected:
    """Values (K, P, m) of the named channels; None is all."""
    if channels is None:
        return selected(cycles.values)
    unknown = [c for c in channels if c not in cycles.channels]
    if unknown or not channels:
        raise MotionError(f"no channel is named {unknown}; the cycles have: {', '.join(cycles.channels)}")
    return selected(cycles.values, [cycles.channels.index(c) for c in channels])


def _shown(values: Selected, columns: Columns, channels) -> tuple[Selected, Columns]:
    seen = np.flatnonzero(columns.count.any(axis=(0, 1))).tolist()
    if not seen:
        raise GapError(f"these cycles have no samples of any channel: {', '.join(channels)}")
    return selected(values.values, seen), columns.of(seen)


def _check_numbers(cycles: int, rank: int, people: int):
    if cycles - people < rank:
        raise MotionError(
            f"{rank} components and {people} means need at least {rank + people} cycles, got {cycles}: "
            "fit more cycles or fewer components"
        )


def _check_columns(columns: obs.Columns, channels):
    """Check that values are finite, that each channel is observed, and that something varies."""
    if not np.isfinite(columns.total).all():
        raise MotionError("cycles hold infinite values: mark missing samples with NaN")
    empty = [c for c, n in zip(channels, columns.count.sum(axis=(0, 1)), strict=True) if not n]
    if empty:
        raise GapError(f"no samples of {', '.join(empty)}: leave them out with channels=")
    if not (columns.high.max(axis=0) > columns.low.min(axis=0)).any():
        raise MotionError("these cycles are constant, so they have no components: check the data")
