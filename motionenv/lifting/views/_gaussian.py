"""The Gaussian model of walkers and the input validation that the view solvers share."""

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
