"""The Gaussian model of walkers, its weighted inner products with sequences, and the validation of these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.validation import checked_number, checked_whole
from motionenv.errors import ModelError, MotionError
from motionenv.models.eigenwalkers.fourier_model import FourierModel
from motionenv.types import MARKERS

VARIANCE = 70e-6  # [m²] best σ² in paper B (figure 3)
SHAPE = (5, len(MARKERS))


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Walkers w = mean + Σ k_n e_n + noise with k_n ~ N(0, 1 / precision_n); precision 0 is a flat prior."""

    mean: np.ndarray  # (5, 15, 3) [m]
    components: np.ndarray  # (N, 5, 15, 3)
    precision: np.ndarray  # (N,) [1/m²]
    noise: np.ndarray  # (5, 15) [m²], variance of each of the three coordinates
    measurement: np.ndarray  # (5, 15) [m²], variance of the measurement error of each image coordinate
    inflation: np.ndarray  # (15,) factor on the variances of unseen coordinates

    @cached_property
    def basis(self) -> np.ndarray:
        """Mean and components by coordinate: (3, 1 + N, 75)."""
        both = np.concatenate([self.mean[None], self.components])
        return np.ascontiguousarray(np.moveaxis(both.reshape(len(both), -1, 3), 2, 0))

    def weights(self, seen: np.ndarray) -> np.ndarray:
        """1 / variance of the measurements (5, 15) [1/m²]; 0 for markers that aren't `seen` (15,)."""
        return np.where(seen, 1 / (self.noise + self.measurement), 0.0)


def gaussian(
    model: FourierModel, variance: float | None, n_components: int | None, prior: bool, measurement: ArrayLike = 0.0
) -> Gaussian:
    """The Gaussian of `model`'s first components; `variance` [m²] is the noise, None uses the model's own."""
    n = len(model.components_)
    kept = n if n_components is None else checked_whole(n_components, "n_components", 1, n)
    precision = 1 / model.explained_variance_[:kept] if prior else np.zeros(kept)
    inflation = np.asarray(getattr(model, "inflation_", np.ones(len(MARKERS))), dtype=np.float64)
    error = _measurement(measurement)
    return Gaussian(model.mean_, model.components_[:kept], precision, _noise(model, variance), error, inflation)


def _measurement(given) -> np.ndarray:
    try:
        variance = np.broadcast_to(np.asarray(given, dtype=np.float64), SHAPE)
    except (TypeError, ValueError):
        raise MotionError(f"measurement must be variances that broadcast to (5, 15), got {given!r}") from None
    if not ((variance >= 0) & (variance < np.inf)).all():
        raise MotionError("measurement must be finite variances [m²] of at least 0")
    return variance


def _noise(model, variance: float | None) -> np.ndarray:
    if variance is None:
        if not hasattr(model, "noise_"):
            raise ModelError(
                f"variance must be given in m² (paper B: 70e-6), because {type(model).__name__} has no noise estimate"
            )
        return np.asarray(model.noise_, dtype=np.float64)
    return np.full(SHAPE, checked_number(variance, "variance", above=0, unit="m²"))


def checked_sequences(w2: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (..., 5, 15, 2) as floats, 0 where missing, and which markers are seen (..., 15)."""
    try:
        w2 = np.ascontiguousarray(w2, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MotionError(f"w2 must be numbers of shape (..., 5, 15, 2): {error}") from None
    if w2.shape[-3:] != (*SHAPE, 2) or not w2.size:
        raise MotionError(f"w2 must be at least one sequence of shape (..., 5, 15, 2), got {w2.shape}")
    if np.isfinite(w2).all():
        return w2, np.ones((*w2.shape[:-3], len(MARKERS)), dtype=bool)
    missing = np.isnan(w2)
    seen = ~missing.any(axis=(-3, -1))
    if np.isinf(w2).any():
        raise MotionError("w2 has infinite values: use NaN for missing markers")
    if (seen == missing.all(axis=(-3, -1))).any():
        i = np.argwhere(seen == missing.all(axis=(-3, -1)))[0][-1]
        raise MotionError(f"w2 has a {MARKERS[i]} with some NaN: a marker's 10 coefficients must be finite or all NaN")
    if not seen.any(axis=-1).all():
        raise MotionError("w2 has a sequence without any marker: remove it")
    return np.where(missing, 0.0, w2), seen


def checked_angle(values: ArrayLike, name: str, shape: tuple) -> np.ndarray:
    """`values` [rad] as floats, broadcast to `shape`."""
    try:
        values = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise MotionError(f"{name} must be numbers [rad], got {values!r}") from None
    if not np.isfinite(values).all():
        raise MotionError(f"{name} must be finite [rad], got {values}")
    try:
        return np.broadcast_to(values, shape)
    except ValueError:
        raise MotionError(f"{name} must broadcast to {shape}, got {values.shape}") from None


def common_shape(*parts) -> tuple:
    """The broadcast shape of sequences and angles with shapes `parts`."""
    try:
        return np.broadcast_shapes(*parts)
    except ValueError:
        raise MotionError(
            f"w2 (..., 5, 15, 2), alpha (...) and elevation (...) don't broadcast: (...) are {parts}"
        ) from None


def patterns(seen: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Each distinct row of `seen` (n, 15), with the indices (m,) of its sequences."""
    if (seen == seen[0]).all():
        return [(seen[0], np.arange(len(seen)))]
    rows, which = np.unique(seen, axis=0, return_inverse=True)
    return [(row, np.flatnonzero(which.reshape(-1) == i)) for i, row in enumerate(rows)]


def gram_blocks(basis: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Gram blocks (6, 1 + N, 1 + N): F_iᵀWF_j of coordinates xx, yy, zz, and xy, xz, yz plus their transposes.

    They give the normal matrix Σ_i F_iᵀWF_i - Σ_ij d_i d_j F_iᵀWF_j of any viewing direction d, from the basis
    F (3, 1 + N, 75) and the diagonal (75,) of W.
    """
    m = basis.shape[1]
    flat = basis.reshape(3 * m, -1)
    gram = ((flat * weights) @ flat.T).reshape(3, m, 3, m)
    mixed = [gram[i, :, j] + gram[j, :, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    return np.ascontiguousarray([gram[0, :, 0], gram[1, :, 1], gram[2, :, 2], *mixed])


def view_factors(d: np.ndarray) -> np.ndarray:
    """Factors (n, 6) of the six `gram_blocks` in the normal matrices of viewing directions `d` (n, 3)."""
    return np.concatenate([1 - d**2, -d[:, [0, 0, 1]] * d[:, [1, 2, 2]]], axis=1)


@dataclass(frozen=True, eq=False)
class DataTerms:
    """Inner products for n sequences that show the same markers.

    Attributes:
        blocks: (6, 1 + N, 1 + N), see `gram_blocks`.
        data: (n, 5, J, 1 + N): model coordinates x, y against across, and x, y, z against upwards. J = 1, or 5 for the
            terms 1, sin φ, cos φ, sin 2φ, cos 2φ of an unknown phase.
        squares: (n,) yᵀWy.
        count: number of measured values per sequence, less the degrees of freedom of an unknown offset.
        model_centre: (1 + N, 3) weighted mean of p0 over the markers, removed if the offset is unknown; else 0.
        centres: (n, 2) the same of the sequences.
    """

    blocks: np.ndarray
    data: np.ndarray
    squares: np.ndarray
    count: int
    model_centre: np.ndarray
    centres: np.ndarray


def data_terms(g: Gaussian, y: np.ndarray, seen: np.ndarray, turning: bool, any_place: bool) -> DataTerms:
    """Inner products of model `g` and sequences `y` (n, 5, 15, 2), 0 where missing.

    `seen` (15,) tells which markers are present, `turning` whether the phase is unknown, and `any_place` whether the
    image offset is. With its flat prior, eliminating it means subtracting the weighted mean of p0 from data and model,
    which commutes with projection.
    """
    weights = g.weights(seen)
    share = weights[0] / weights[0].sum() * any_place
    model = np.moveaxis(g.basis.reshape(3, -1, *SHAPE), 0, -1)  # (1 + N, 5, 15, 3)
    model, model_centre = _without(model, share)
    y, centres = _without(y, share)
    basis = np.ascontiguousarray(np.moveaxis(model, -1, 0)).reshape(3, len(model), -1)
    flat = weights.reshape(-1)
    weighted = basis * flat
    turned = _turned(y) if turning else y[:, None]  # (n, J, 5, 15, 2)
    across, upwards = (turned[..., i].reshape(*turned.shape[:2], -1) for i in (0, 1))
    products = [a @ f.T for a, f in zip((across,) * 2 + (upwards,) * 3, weighted[[0, 1, 0, 1, 2]], strict=True)]
    squares = np.einsum("hm,nhmc,nhmc->n", weights, y, y, optimize=True)
    count = 2 * SHAPE[0] * int(seen.sum()) - 2 * any_place
    return DataTerms(gram_blocks(basis, flat), np.stack(products, axis=1), squares, count, model_centre, centres)


def _without(coefficients: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (..., 5, 15, c) minus the mean (..., c) of p0 weighted by `share` (15,), and that mean."""
    centre = np.einsum("m,...mc->...c", share, coefficients[..., 0, :, :])
    moved = coefficients.copy()
    moved[..., 0, :, :] -= centre[..., None, :]
    return moved, centre


def _turned(y: np.ndarray) -> np.ndarray:
    """Parts (n, 5, 5, 15, 2) of `later(y, φ)` that multiply 1, sin φ, cos φ, sin 2φ and cos 2φ."""
    parts = np.zeros((len(y), 5, *y.shape[1:]))
    parts[:, 0, 0] = y[:, 0]
    for h in (1, 2):
        sine, cosine = 2 * h - 1, 2 * h
        parts[:, cosine, sine], parts[:, cosine, cosine] = y[:, sine], y[:, cosine]
        parts[:, sine, sine], parts[:, sine, cosine] = -y[:, cosine], y[:, sine]
    return parts
