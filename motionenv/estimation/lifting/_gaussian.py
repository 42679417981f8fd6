"""What the solvers of lifting share: the model as a Gaussian over walkers, and sequences put in order for kernels."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from motionenv.errors import ModelError, MotionError
from motionenv.types import MARKERS

VARIANCE = 70e-6  # [m²] paper B's best σ² (figure 3)
SHAPE = (5, len(MARKERS))


@dataclass(frozen=True, eq=False)
class Gaussian:
    """Walkers w = mean + Σ k_n e_n + noise, with k_n ~ N(0, 1 / precision_n), precision 0 where nothing is known.

    Attributes:
        mean: (5, 15, 3) [m].
        components: (N, 5, 15, 3).
        precision: (N,) [1/m²].
        noise: (5, 15) [m²], variance of each of the three coordinates.
        measurement: (5, 15) [m²], variance of the error with which each of a picture's two coordinates is measured.
        inflation: (15,) factor for variances of what a view doesn't show.
    """

    mean: np.ndarray
    components: np.ndarray
    precision: np.ndarray
    noise: np.ndarray
    measurement: np.ndarray
    inflation: np.ndarray

    @cached_property
    def basis(self) -> np.ndarray:
        """Mean and components, coordinate by coordinate: (3, 1 + N, 75)."""
        both = np.concatenate([self.mean[None], self.components])
        return np.ascontiguousarray(np.moveaxis(both.reshape(len(both), -1, 3), 2, 0))

    def weights(self, seen: np.ndarray) -> np.ndarray:
        """1 / variance of what is measured where a marker of `seen` (15,) is there, else 0: (5, 15) [1/m²]."""
        return np.where(seen, 1 / (self.noise + self.measurement), 0.0)


def gaussian(model, variance: float | None, n_components: int | None, prior: bool, measurement=0.0) -> Gaussian:
    """The Gaussian of `model`'s first components, with `variance` [m²] for noise or, for None, the model's own."""
    n = len(model.components_)
    kept = n if n_components is None else n_components
    if isinstance(kept, bool) or not isinstance(kept, (int, np.integer)) or not 1 <= kept <= n:
        raise MotionError(f"n_components must be a whole number from 1 to the model's {n}, got {n_components!r}")
    precision = 1 / model.explained_variance_[:kept] if prior else np.zeros(kept)
    inflation = np.asarray(getattr(model, "inflation_", np.ones(len(MARKERS))), dtype=np.float64)
    error = _measurement(measurement)
    return Gaussian(model.mean_, model.components_[:kept], precision, _noise(model, variance), error, inflation)


def _measurement(given) -> np.ndarray:
    try:
        variance = np.broadcast_to(np.asarray(given, dtype=np.float64), SHAPE)
    except (TypeError, ValueError):
        raise MotionError(f"measurement must be variances that fit (5, 15), got {given!r}") from None
    if not ((variance >= 0) & (variance < np.inf)).all():
        raise MotionError("measurement must be finite variances [m²] from 0")
    return variance


def _noise(model, variance: float | None) -> np.ndarray:
    if variance is None:
        if not hasattr(model, "noise_"):
            raise ModelError(
                f"{type(model).__name__} doesn't know its noise: give a variance in m², paper B's is 70e-6"
            )
        return np.asarray(model.noise_, dtype=np.float64)
    if not is_positive(variance):
        raise MotionError(f"variance must be a number of m² above 0, or None for the model's own, got {variance!r}")
    return np.full(SHAPE, float(variance))


def is_positive(value) -> bool:
    """Whether `value` is a finite number above 0."""
    number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    return number and 0 < value < np.inf


def checked_sequences(w2) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients (..., 5, 15, 2) as floats, 0 where missing, and which markers are seen (..., 15).

    Raises:
        MotionError: another shape, infinite values, a marker that is missing in part, a sequence that shows none.
    """
    try:
        w2 = np.ascontiguousarray(w2, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise MotionError(f"w2 must be numbers of shape (..., 5, 15, 2): {error}") from None
    if w2.shape[-3:] != (*SHAPE, 2) or not w2.size:
        raise MotionError(f"w2 must be coefficients of shape (..., 5, 15, 2), at least one sequence, got {w2.shape}")
    if np.isfinite(w2).all():
        return w2, np.ones((*w2.shape[:-3], len(MARKERS)), dtype=bool)
    missing = np.isnan(w2)
    seen = ~missing.any(axis=(-3, -1))
    if np.isinf(w2).any():
        raise MotionError("w2 holds infinite values: mark what is missing as NaN")
    if (seen == missing.all(axis=(-3, -1))).any():
        i = np.argwhere(seen == missing.all(axis=(-3, -1)))[0][-1]
        raise MotionError(f"w2 has the {MARKERS[i]} in part: a marker's 10 coefficients are all there or all NaN")
    if not seen.any(axis=-1).all():
        raise MotionError("w2 has a sequence without any marker: leave it out")
    return np.where(missing, 0.0, w2), seen


def checked_angle(values, name: str, shape: tuple) -> np.ndarray:
    """`values` [rad] as floats of `shape`.

    Raises:
        MotionError: not finite numbers, or of a shape that doesn't fit.
    """
    try:
        values = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise MotionError(f"{name} must be numbers [rad], got {values!r}") from None
    if not np.isfinite(values).all():
        raise MotionError(f"{name} must be finite radians, got {values}")
    try:
        return np.broadcast_to(values, shape)
    except ValueError:
        raise MotionError(f"{name} must fit {shape}, got {values.shape}") from None


def common_shape(*parts) -> tuple:
    """The shape to which sequences and angles of shapes `parts` go together.

    Raises:
        MotionError: they don't.
    """
    try:
        return np.broadcast_shapes(*parts)
    except ValueError:
        raise MotionError(
            f"w2 of (..., 5, 15, 2), alpha and elevation don't fit each other: (...) are {parts}"
        ) from None


def patterns(seen: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Each distinct row of `seen` (n, 15), and which sequences (m,) have it."""
    if (seen == seen[0]).all():
        return [(seen[0], np.arange(len(seen)))]
    rows, which = np.unique(seen, axis=0, return_inverse=True)
    return [(row, np.flatnonzero(which.reshape(-1) == i)) for i, row in enumerate(rows)]


def gram_blocks(basis: np.ndarray, weights: np.ndarray) -> np.ndarray:
    r"""(6, 1 + N, 1 + N): F_iᵀWF_j of coordinates xx, yy, zz, and xy, xz, yz with their transposes added.

    With them the normal matrix is Σ_i F_iᵀWF_i - Σ_ij d_i d_j F_iᵀWF_j for every view that looks along d.

    Args:
        basis: F (3, 1 + N, 75).
        weights: diagonal of W (75,).
    """
    m = basis.shape[1]
    flat = basis.reshape(3 * m, -1)
    gram = ((flat * weights) @ flat.T).reshape(3, m, 3, m)
    mixed = [gram[i, :, j] + gram[j, :, i] for i, j in ((0, 1), (0, 2), (1, 2))]
    return np.ascontiguousarray([gram[0, :, 0], gram[1, :, 1], gram[2, :, 2], *mixed])
