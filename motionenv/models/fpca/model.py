"""Functional principal components of motion cycles with missing samples (paper A, section 4)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.estimator import Estimator
from motionenv._core.principal_axes import signs
from motionenv._core.representation import curves
from motionenv._core.validation import random_generator
from motionenv.errors import FitWarning, GapError, ModelError, MotionError
from motionenv.models.fpca import observations as obs
from motionenv.models.fpca.calibration import inflation
from motionenv.models.fpca.em_fit import fit_ppca
from motionenv.models.fpca.fourier_basis import fourier_columns, sampled_basis
from motionenv.models.fpca.gaussian import Gaussian, residual_model
from motionenv.models.fpca.mean_band import mean_band
from motionenv.models.fpca.observations import Observations
from motionenv.models.fpca.screening import Summary, pseudo_values, screen, summarised, unwrapped
from motionenv.models.fpca.selection import Curve, choose_by_likelihood, choose_by_share
from motionenv.models.fpca.svd_fit import fit_svd
from motionenv.models.storage.model_file import StoredModel
from motionenv.types import Cycles

CHOICES = {"centre": ("all", "subject"), "method": ("ppca", "svd"), "noise": ("channel", "shared")}
WHOLE = 0.9  # least share of its samples with which a cycle tells about residuals
STORED = (
    "subject_coefficients_", "component_coefficients_", "explained_variance_", "singular_values_", "errors_",
    "residual_spectrum_", "white_variance_",
)  # fmt: skip
DRAWS = 400  # from which simultaneous bands are computed
_BLOCK = 1024  # phases, or cycles, worked on at a time


class Given(NamedTuple):
    """Cycles to fit, or to use a model on."""

    values: np.ndarray  # (K, P, m)
    people: tuple[str, ...]  # (K,) labels
    channels: tuple[str, ...]


class FunctionalPCA(Estimator, StoredModel):
    r"""A cycle is x(τ) = μ(τ) + Σ_j s_j v_j(τ) + r(τ), with scores s ~ N(0, diag λ) and smooth, periodic μ and v_j.

    The residual r of each channel is a smooth, stationary periodic process and white noise, independent of the scores
    (`motionenv.models.fpca.gaussian`). So cycles are normal, and likelihood, shares of variance, draws, filled gaps and
    bands are all those of this one distribution.

    Mean and components can be estimated in two ways when samples are missing:

    - `method="ppca"` (default) maximises the likelihood with white noise by EM (`motionenv.models.fpca.em_fit`). With
      noise="shared" the components of complete cycles are those of PCA (Tipping & Bishop 1999); with a variance per
      channel this is a factor analysis, whose components need not be those of largest variance. Scores shrink towards
      0 the less a cycle shows.
    - `method="svd"` finds the solution of paper A's fig. 8 in the real basis. It minimises the same error as the
      alternation of imputation, projection and truncated SVD, but needs no SVD of all cycles
      (`motionenv.models.fpca.svd_fit`). With many components of cycles with many gaps, it fits noise.

    The residuals' model is then fitted, by EM as well, to what the components leave of cycles that are mostly seen.

    It is an estimator in scikit-learn's sense, also of plain arrays (K, P, m).

    Args:
        n_components: number of components q; a share below 1, for the fewest whose variance is that share of the
            model's; or "likelihood", for the number with which people left out are most likely (`selection_`).
        n_harmonics: a constant and n_harmonics - 1 cosine-sine pairs per channel (fig. 8: 20).
        centre: "all" for one mean, so that components describe differences between people (fig. 9); "subject" for one
            mean per person, so that they describe variation within people (fig. 10).
        method: "ppca" or "svd".
        noise: "channel" or "shared": whether the noise of "ppca" has a variance per channel.
        residual_harmonics: a constant and residual_harmonics - 1 pairs per channel for the smooth part of the
            residuals, or as many as the samples allow. 0 leaves white noise.
        least_seen: least share of its samples, relative to the fullest cycle's, with which a cycle tells about
            components in "ppca". White noise takes the scores of a cycle of few samples for exact, though their errors
            are smooth, and so would make variances too large. 0 uses all.
        robust: give samples far from the model less weight, as a t distribution does (`pseudo_values`).
        unwrap: take jumps by 2π out of each channel, for angles in radians that were wrapped at ±π.
        tol: stop when an iteration improves the objective by less than this fraction.
        max_iter: greatest number of iterations.

    Attributes:
        channels_: names of the channels.
        mean_: (P, m) mean cycle; with centre="subject" the average of the people's means.
        subjects_, subject_means_: people's labels and means (people, P, m); with centre="all" a single one, "all".
        components_: (q, P, m), orthonormal as vectors of P·m samples; the largest sample of each is positive.
        explained_variance_: (q,) λ, variance of the scores [squared units of the channels, summed over samples].
        explained_variance_ratio_: (q,) λ as a share of the model's variance; with `noise_ratio_` they sum to 1.
        singular_values_: (q,) √((K - people)·λ); for "svd" those of X⁽³⁾.
        noise_variance_: (m,) residual variance per sample.
        residual_spectrum_, white_variance_: (m, 2·residual_harmonics - 1) variances of the coefficients of the
            residuals' smooth part, and (m,) of the rest.
        scores_: (K, q) scores of the fitted cycles, relative to their group's mean.
        imputed_: (K, P, m) the fitted cycles with gaps filled; observed samples are unchanged. Like `scores_`, they
            are computed when first asked for.
        errors_: (iterations,) the objective, which never rises: Theorem 1's ‖X⁽²⁾ - X⁽⁵⁾‖ for "svd", the negative
            log-likelihood of the observed samples, with white noise, for "ppca".
        n_iter_, converged_: number of iterations, and whether they reached `tol`; a `FitWarning` tells if not.
        selection_: the held-out log-likelihood by number of components, if that was chosen by it; else None.
        inflation_: (2,) factors on bands around single filled samples and around all of a cycle, with which they hold
            for people left out; computed when first asked for.
        n_components_: the number of components q that was fitted.
        n_cycles_: number of fitted cycles K.
        card_: the model card.
    """

    kind = "fpca"

    def __init__(
        self, n_components: int | float | str = 5, n_harmonics: int = 20, centre: str = "all", method: str = "ppca",
        noise: str = "channel", residual_harmonics: int = 12, least_seen: float = 0.5, robust: bool = False,
        unwrap: bool = False, tol: float = 1e-6, max_iter: int = 200,
    ) -> None:  # fmt: skip
        self.n_components, self.n_harmonics, self.residual_harmonics = n_components, n_harmonics, residual_harmonics
        self.centre, self.method, self.noise = centre, method, noise
        self.least_seen, self.robust, self.unwrap = least_seen, robust, unwrap
        self.tol, self.max_iter = tol, max_iter
        self.card_: dict = {}

    def _repr_html_(self) -> str | None:
        """The mean cycle of each channel, for notebooks; None before `fit`."""
        return curves(self.mean_.T, escape(repr(self))) if hasattr(self, "mean_") else None

    def fit(
        self, cycles: Cycles | ArrayLike, y: None = None, *, channels: Sequence[str] | None = None,
        subjects: Sequence | None = None,
    ) -> Self:  # fmt: skip
        """Estimate mean, components and noise from `cycles`.

        What in the data doesn't suit the model is told by a `FitWarning`: spikes, wrapped angles, phases that hardly
        any cycle shows, channels that never change, people with a single cycle where each has a mean.

        Args:
            cycles: of any number of people, NaN where missing: `Cycles`, or an array (K, P, m). A channel may be
                missing in some of them altogether.
            y: no effect.
            channels: names of the channels to use; by default all that at least one cycle shows, so that a capture of
                the lower body gives a model of the lower body. `channels_` tells which they are.
            subjects: the person's label of each cycle of an array; None takes each for a different person.

        Raises:
            MotionError: no cycles, a setting out of range, an unknown channel, an infinite value, too few cycles.
            GapError: a channel of `channels`, or all channels, without one observed sample.
        """
        given = _given(cycles, channels, subjects)
        if channels is None:
            given = _shown(given)
        if self.unwrap:
            given = given._replace(values=unwrapped(given.values))
        found = self._learn(given)
        if not self.converged_:
            _warn(f"the fit stopped after {self.n_iter_} iterations: raise max_iter or tol, or take fewer components")
        for told in screen(self, given.values, found, given.people):
            _warn(told)
        return self

    def _learn(self, given: Given) -> Summary:
        """`fit` without a look at whether the data suit the model; what they are like."""
        self._check_settings()
        for name in ("imputed_", "scores_", "inflation_"):
            self.__dict__.pop(name, None)
        values = given.values
        if not len(values):
            raise MotionError("fit needs cycles, got none")
        labels = given.people if self.centre == "subject" else ("all",) * len(values)
        subjects, groups = np.unique(labels, return_inverse=True)
        found = _checked(given)
        self.subjects_, self.n_cycles_, self.channels_ = tuple(subjects.tolist()), len(values), given.channels
        self.selection_: Curve | None = None
        rank = self._chosen(given)
        if len(values) - len(subjects) < rank:
            need = f"{rank} components and {len(subjects)} means need at least {rank + len(subjects)} cycles"
            raise MotionError(f"{need}, got {len(values)}: fit more cycles or fewer components")
        used = pseudo_values(values, lambda some: self._estimate(some, groups, rank)) if self.robust else values
        self._estimate(used, groups, rank)
        self._fitted = values, used, groups, given.people
        return found

    def of_others(self, n: int, values: np.ndarray, people: Sequence[str], tol: float) -> FunctionalPCA:
        """A model with the same settings but `n` components and `tol`, of cycles `values` (K, P, m) of `people`."""
        model = FunctionalPCA(**self.get_params() | {"n_components": n, "tol": tol})
        model._learn(Given(values, tuple(people), tuple(map(str, range(values.shape[2])))))
        return model

    def _estimate(self, values: np.ndarray, groups: np.ndarray, rank: int) -> np.ndarray:
        """Set all parameters; returns the cycles (K, P, m) that scores stand for, if they are needed."""
        basis = sampled_basis(values.shape[1], self.n_harmonics)
        shares = np.isfinite(values).mean(axis=(1, 2))
        every = Observations(values, basis, obs.group_centres(values, groups, basis), groups)
        if self.method == "svd":
            found = fit_svd(every, rank, self.tol, self.max_iter)
            scores = found.scores
        else:
            telling = _telling(values, shares, groups, rank, self.least_seen)
            data = every if telling.all() else Observations(values[telling], basis, every.centre, groups[telling])
            found = fit_ppca(data, rank, self.tol, self.max_iter, self.noise == "shared")
            scores = found.scores if data is every else found.infer(every)
        self.errors_, self.n_iter_, self.converged_ = np.array(found.errors), len(found.errors), found.converged
        self._set(basis, found.means, found.components)
        self.explained_variance_, self.white_variance_ = found.variance, found.noise
        self.singular_values_ = np.sqrt((len(values) - len(found.means)) * found.variance)
        self.residual_spectrum_ = np.zeros((len(found.noise), 0))
        if not (self.residual_harmonics or self.robust):
            return values
        fitted = np.tensordot(scores, basis @ found.components, axes=1) + (basis @ found.means)[groups]
        if self.residual_harmonics:
            smooth = sampled_basis(len(basis), min(self.residual_harmonics, (len(basis) + 1) // 2))
            rest = values - fitted
            whole = rest[shares >= min(WHOLE, float(np.quantile(shares, 0.8)))]
            rest = whole if np.isfinite(whole).any(axis=(0, 1)).all() else rest
            self.residual_spectrum_, self.white_variance_ = residual_model(rest, smooth, found.noise, self.tol)
        return fitted

    def _chosen(self, given: Given) -> int:
        """The number of components that `n_components` asks for."""
        if isinstance(self.n_components, int | np.integer):
            return int(self.n_components)
        most = len(given.values) - (len(set(given.people)) if self.centre == "subject" else 1)
        if self.n_components == "likelihood":
            self.selection_ = choose_by_likelihood(self, given.values, given.people, most)
            return self.selection_.best
        return choose_by_share(self, given.values, given.people, most, float(self.n_components))

    @property
    def n_components_(self) -> int:
        """The number of components q."""
        self._check_fitted()
        return len(self.components_)

    @property
    def explained_variance_ratio_(self) -> np.ndarray:
        """(q,) λ as a share of the variance of the model, summed over phases and channels."""
        self._check_fitted()
        return self.explained_variance_ / (self.explained_variance_.sum() + self._noise_total())

    @property
    def noise_ratio_(self) -> float:
        """What is left of the model's variance: the share of the residuals."""
        self._check_fitted()
        return float(self._noise_total() / (self.explained_variance_.sum() + self._noise_total()))

    @property
    def noise_variance_(self) -> np.ndarray:
        """(m,) variance per sample of the residuals of each channel."""
        self._check_fitted()
        return self.white_variance_ + self.residual_spectrum_.sum(axis=1) / len(self.mean_)

    @cached_property
    def scores_(self) -> np.ndarray:
        """(K, q) scores of the fitted cycles, relative to their group's mean."""
        _, used, groups, _ = self._data("scores_ of other cycles are transform(values)")
        return self._scores(used, groups, self.subject_coefficients_)[0]

    @cached_property
    def imputed_(self) -> np.ndarray:
        """(K, P, m) the fitted cycles with gaps filled."""
        values, used, groups, _ = self._data("fill gaps with impute(values)")
        return np.where(np.isnan(values), self._distribution(self.subject_means_).fill(used, groups)[0], values)

    @cached_property
    def inflation_(self) -> np.ndarray:
        """(2,) factors that make bands hold for people left out (`motionenv.models.fpca.calibration`)."""
        values, _, _, people = self._data("fit and save it again, and its bands will be calibrated")
        return inflation(self, values, people)

    def transform(self, values: Cycles | ArrayLike, return_cov: bool = False) -> Any:
        """Scores (..., q) of cycles `values` (..., P, m), NaN where missing, relative to `mean_`.

        "ppca": posterior means, so a cycle without observed samples scores 0. "svd": least squares on the observed
        samples. With `return_cov`, also the covariances (..., q, q) of the scores given what is seen.

        Raises:
            MotionError: another shape, or an infinite value.
        """
        flat, shape = self._checked(values)
        scores, covariances = self._scores(flat, np.zeros(len(flat), dtype=np.int64), self.mean_coefficients_[None])
        q = len(self.components_)
        scores = scores.reshape(*shape, q)
        return (scores, covariances.reshape(*shape, q, q)) if return_cov else scores

    def inverse_transform(self, scores: ArrayLike) -> np.ndarray:
        """Cycles (..., P, m) with the given `scores` (..., q), without residuals."""
        self._check_fitted()
        return self.mean_ + np.tensordot(np.asarray(scores, dtype=np.float64), self.components_, axes=1)

    def impute(
        self, values: Cycles | ArrayLike, return_band: bool = False, *, level: float = 0.9, simultaneous: bool = False,
        seed: int | np.random.Generator = 0,
    ) -> Any:  # fmt: skip
        """Cycles `values` (..., P, m) with gaps filled from the components and from the samples around each gap.

        Args:
            values: NaN where missing.
            return_band: also return half the width (..., P, m) of a band around the filled samples, 0 at seen ones.
            level: probability that the band holds a sample that was not seen; if `simultaneous`, all those of a cycle.
                Bands are widened by `inflation_`, so that this is true of people left out.
            simultaneous: see `level`.
            seed: int or Generator for the draws that simultaneous bands are computed from.

        Raises:
            MotionError: another shape, an infinite value, or a `level` that isn't between 0 and 1.
        """
        flat, shape = self._checked(values)
        normals, scale = None, _half_width(level)
        if return_band and simultaneous:
            normals, scale = random_generator(seed).standard_normal((DRAWS, self._latents())), 1.0
        which = np.zeros(len(flat), dtype=np.int64)
        filled, width = self._distribution(self.mean_[None]).fill(flat, which, normals, level)
        filled = filled.reshape(*shape, *self.mean_.shape)
        if not return_band:
            return filled
        return filled, scale * self.inflation_[int(simultaneous)] * width.reshape(filled.shape)

    def mean_band(
        self, level: float = 0.9, simultaneous: bool = False, seed: int | np.random.Generator = 0
    ) -> np.ndarray:
        """Half the width (P, m) of a band around the mean: how well these people tell that of all people.

        From the spread of people, each of whose cycles count together (`motionenv.models.fpca.mean_band`). With
        `level` it holds the mean at each phase or, if `simultaneous`, a channel's mean at all phases; `seed` draws for
        the latter. NaN where fewer than two people are seen.

        Raises:
            ModelError: not fitted here; a model file doesn't hold its cycles.
            MotionError: `level` isn't between 0 and 1.
        """
        _half_width(level)
        values, _, groups, people = self._data("a band needs the cycles themselves: fit again")
        return mean_band(values - self.subject_means_[groups], people, level, simultaneous, random_generator(seed))

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

    def sample(self, n: int, seed: int | np.random.Generator | None = None, *, noise: bool = True) -> np.ndarray:
        """Draw `n` cycles (n, P, m); `seed` is an int or a Generator.

        With `noise` they vary as what was seen; without, they are smooth walks: mean and components alone.
        """
        rng = random_generator(seed)
        drawn = self.inverse_transform(rng.standard_normal((n, self.n_components_)) * np.sqrt(self.explained_variance_))
        return drawn + self._distribution(self.mean_[None]).draw_residuals(n, rng) if noise else drawn

    def score_samples(self, values: Cycles | ArrayLike) -> np.ndarray:
        """Log-likelihood (...) of the seen samples of each of the cycles `values` (..., P, m); 0 without any."""
        flat, shape = self._checked(values)
        which = np.zeros(len(flat), dtype=np.int64)
        return self._distribution(self.mean_[None]).infer(flat, which).log_p.reshape(shape)

    def score(self, values: Cycles | ArrayLike, y: None = None) -> float:
        """Log-likelihood of the cycles `values` (..., P, m) per seen sample; `y` has no effect.

        Raises:
            GapError: no sample at all.
        """
        flat, _ = self._checked(values)
        seen = int(np.isfinite(flat).sum())
        if not seen:
            raise GapError("these cycles have no samples, so the model can't be scored on them")
        return float(self.score_samples(flat).sum() / seen)

    def describe(self) -> dict[str, Any]:
        """JSON-serialisable description: what was learned from, and each component's share and deviation."""
        pairs = zip(self.explained_variance_ratio_.tolist(), np.sqrt(self.explained_variance_).tolist(), strict=True)
        return {
            "kind": self.kind,
            "card": self.card_,
            "dimensions": {"components": self.n_components_, "cycles": self.n_cycles_, "channels": len(self.channels_)},
            "components": [
                {"name": f"component {j + 1}", "share": share, "deviation": deviation}
                for j, (share, deviation) in enumerate(pairs)
            ],
            "residuals": self.noise_ratio_,
        }

    def save(self, path: str | Path, card: dict | None = None) -> None:
        """Calibrate bands, and write the model to `path` (.npz) with a `card`, as `ModelFile.save`."""
        self._check_fitted()
        if hasattr(self, "_fitted"):
            _ = self.inflation_
        super().save(path, card)

    def to_arrays(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and JSON-serialisable settings from which `from_arrays` restores the model."""
        self._check_fitted()
        arrays = {name: getattr(self, name) for name in STORED}
        if "inflation_" in self.__dict__:
            arrays["inflation_"] = self.inflation_
        labels = {"channels": self.channels_, "subjects": self.subjects_, "samples": len(self.mean_)}
        return arrays, {"settings": self.get_params(), **labels, "n_cycles": self.n_cycles_}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray], meta: dict[str, Any]) -> FunctionalPCA:
        """As `ModelFile.from_arrays`, from `arrays` and `meta`, without the data of its fitted cycles."""
        model = cls(**meta["settings"])
        model._check_settings()
        model.channels_, model.subjects_ = tuple(meta["channels"]), tuple(meta["subjects"])
        model.n_cycles_, model.selection_ = meta["n_cycles"], None
        n, m = 2 * model.n_harmonics - 1, len(model.channels_)
        q = len(arrays["explained_variance_"]) if not isinstance(model.n_components, int) else model.n_components
        shapes: dict[str, tuple] = {"explained_variance_": (q,), "white_variance_": (m,)}
        most = min(model.residual_harmonics, (meta["samples"] + 1) // 2)
        shapes |= {"residual_spectrum_": (m, max(0, 2 * most - 1))}
        shapes |= {"subject_coefficients_": (len(model.subjects_), n, m), "component_coefficients_": (q, n, m)}
        for name in STORED:
            if name in shapes and arrays[name].shape != shapes[name]:
                raise ModelError(f"{name} has shape {arrays[name].shape}, expected {shapes[name]}: fit the model again")
            setattr(model, name, arrays[name])
        if "inflation_" in arrays:
            model.__dict__["inflation_"] = arrays["inflation_"]
        basis = sampled_basis(meta["samples"], model.n_harmonics)
        model._set(basis, model.subject_coefficients_, model.component_coefficients_)
        return model

    def _check_settings(self):
        for name, possible in CHOICES.items():
            if getattr(self, name) not in possible:
                raise MotionError(f"{name} must be one of {', '.join(possible)}, got {getattr(self, name)!r}")
        q = self.n_components
        whole = isinstance(q, int | np.integer) and not isinstance(q, bool) and q >= 1
        if not (whole or q == "likelihood" or (isinstance(q, float) and 0 < q < 1)):
            raise MotionError(f'n_components must be a number from 1 on, a share below 1 or "likelihood", got {q!r}')
        if not 0 <= self.least_seen <= 1:
            raise MotionError(f"least_seen must be a share from 0 to 1, got {self.least_seen}")
        if self.residual_harmonics < 0 or not self.tol > 0 or self.max_iter < 1:
            raise MotionError(
                "max_iter must be at least 1, residual_harmonics at least 0 and tol above 0, got "
                f"{self.max_iter}, {self.residual_harmonics}, {self.tol}"
            )

    def _check_fitted(self):
        if not hasattr(self, "mean_coefficients_"):
            raise ModelError("this FunctionalPCA is not fitted: call fit(cycles) first, or motionenv.load(name)")

    def _data(self, otherwise: str) -> tuple:
        """Values, values used in their place, groups and people of the fitted cycles."""
        self._check_fitted()
        if not hasattr(self, "_fitted"):
            raise ModelError(f"a model from a file doesn't hold its cycles: {otherwise}")
        return self._fitted

    def _checked(self, values) -> tuple[np.ndarray, tuple[int, ...]]:
        """Cycles as an array (K, P, m), and the shape in which they came."""
        self._check_fitted()
        if isinstance(values, Cycles):
            values = _given(values, self.channels_, None).values
        values = np.asarray(values, dtype=np.float64)
        if values.shape[-2:] != self.mean_.shape or np.isinf(values).any():
            raise MotionError(
                f"values must be finite or NaN, of shape (..., {self.mean_.shape}), got {values.shape}; the channels "
                f"are {', '.join(self.channels_)}"
            )
        return values.reshape(-1, *self.mean_.shape), values.shape[:-2]

    def _set(self, basis, means, components):
        """Store people's means (G, n, m) and components (q, n, m), both in the basis; normalise signs."""
        sign = signs((basis @ components).reshape(len(components), -1))
        self.component_coefficients_ = np.ascontiguousarray(components * sign[:, None, None])
        self.subject_coefficients_ = np.ascontiguousarray(means)
        self.mean_coefficients_ = means.mean(axis=0)
        self.components_ = basis @ self.component_coefficients_
        self.subject_means_ = basis @ self.subject_coefficients_
        self.mean_ = basis @ self.mean_coefficients_

    def _latents(self) -> int:
        """Number of normal variables in a cycle: of the scores, of smooth residuals and of white ones."""
        return self.explained_variance_.size + self.residual_spectrum_.size + self.mean_.size

    def _noise_total(self) -> float:
        return float(self.white_variance_.sum() * len(self.mean_) + self.residual_spectrum_.sum())

    def _distribution(self, means: np.ndarray) -> Gaussian:
        """The normal distribution of cycles about `means` (G, P, m)."""
        n, samples = (self.residual_spectrum_.shape[1] + 1) // 2, len(self.mean_)
        basis = sampled_basis(samples, n) if n else np.empty((samples, 0))
        loadings = self.components_ * np.sqrt(self.explained_variance_)[:, None, None]
        return Gaussian(means, loadings, basis, self.residual_spectrum_, self.white_variance_)

    def _scores(self, values: np.ndarray, groups: np.ndarray, means: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Scores (K, q) relative to the groups' `means` (G, n, m), given in the basis, and covariances (K, q, q)."""
        basis = sampled_basis(len(self.mean_), self.n_harmonics)
        found, scale = self._distribution(basis @ means).infer(values, groups), np.sqrt(self.explained_variance_)
        covariances = found.covariance * scale[:, None] * scale
        if self.method == "ppca":
            return found.z * scale, covariances
        w = self.component_coefficients_.reshape(len(self.components_), -1).T
        return _least_squares(Observations(values, basis, means, groups), w), covariances


def _given(cycles: Any, channels: Sequence[str] | None, subjects: Sequence | None) -> Given:
    """Cycles with the named channels; None is all."""
    if isinstance(cycles, Cycles):
        values, people, names = cycles.values, cycles.subject, cycles.channels
    else:
        try:
            values = np.asarray(cycles, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.empty(0)
        if values.ndim != 3:
            raise MotionError(
                f"cycles must be Cycles, as motionenv.segment makes them, or an array (cycles, samples, channels); got "
                f"{type(cycles).__name__}{f' of shape {values.shape}' if values.size else ''}"
            )
        people = tuple(str(s) for s in (range(len(values)) if subjects is None else subjects))
        names = tuple(map(str, range(values.shape[2])))
        if len(people) != len(values):
            raise MotionError(f"subjects must label {len(values)} cycles, got {len(people)}")
    if channels is None:
        return Given(values, people, names)
    unknown = [c for c in channels if c not in names]
    if unknown or not channels:
        raise MotionError(f"no channel is named {unknown}; the cycles have: {', '.join(names)}")
    return Given(values[..., [names.index(c) for c in channels]], people, tuple(channels))


def _shown(given: Given) -> Given:
    """The channels of which a sample is seen."""
    seen = np.flatnonzero(np.isfinite(given.values).any(axis=(0, 1)))
    if len(given.values) and not len(seen):
        raise GapError(f"these cycles have no samples of any channel: {', '.join(given.channels)}")
    if len(seen) == len(given.channels):
        return given
    return given._replace(values=given.values[..., seen], channels=tuple(given.channels[i] for i in seen))


def _telling(values: np.ndarray, shares: np.ndarray, groups: np.ndarray, rank: int, least: float) -> np.ndarray:
    """Which cycles (K,) show enough to tell about components; all if too few do, or none of a group or of a sample."""
    telling = shares >= least * shares.max()
    kept = len(np.unique(groups[telling]))
    if telling.all() or kept < len(np.unique(groups)) or telling.sum() < rank + kept:
        return shares >= 0
    return telling if np.isfinite(values[telling]).any(axis=(0, 1)).all() else shares >= 0


def _least_squares(data: Observations, w) -> np.ndarray:
    """Least-squares scores (K, q) on each cycle's seen samples; the shortest if underdetermined."""
    curves_ = obs.functions(w, data.basis, len(data.squares))
    products = obs.triangle(curves_[..., :, None] * curves_[..., None, :])
    normal, right = np.eye(w.shape[1]) - obs.from_triangle(data.gap_sums(products), w.shape[1]), data.coefficients @ w
    return (np.linalg.pinv(normal, hermitian=True) @ right[..., None])[..., 0]


def _half_width(level: float) -> float:
    """Half the width of the interval that holds a standard normal variable with probability `level`."""
    from scipy.special import ndtri

    if not 0 < level < 1:
        raise MotionError(f"level must be between 0 and 1, got {level}")
    return float(ndtri(0.5 + level / 2))


def _checked(given: Given) -> Summary:
    """What values are like, if they are finite, each channel is observed, and something varies."""
    found = summarised(given.values)
    if empty := [c for c, some in zip(given.channels, found.seen.sum(axis=0), strict=True) if not some]:
        raise GapError(f"no samples of {', '.join(empty)}: leave them out with channels=")
    if np.isinf([found.low, found.high]).any():
        raise MotionError("cycles hold infinite values: mark missing samples with NaN")
    if not (found.high > found.low).any():
        raise MotionError("these cycles are constant, so they have no components: check the data")
    return found


def _warn(text: str):
    warnings.warn(text, FitWarning, stacklevel=3)
