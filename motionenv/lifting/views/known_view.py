r"""Known view: paper B's Approach I (least squares) and Approach II (maximum a posteriori), in closed form.

    k = (ÊᵀÊ)⁻¹ Êᵀ (ŵ - C w̄)                                   (3.9)
    k = [diag(σ²/λ) + ÊᵀÊ]⁻¹ Êᵀ (ŵ - C w̄)                      (3.15, A.5)

Ê = C(α) E are the projected eigenwalkers. Rows of missing markers are dropped. A model with a noise estimate per
harmonic and marker weights the rows by it. Measured coordinates are kept; the model fills the others (3.16).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from motionenv._core.representation import OneLine
from motionenv.errors import MotionError
from motionenv.lifting.view_geometry import axes, depth
from motionenv.lifting.views._gaussian import (
    SHAPE,
    VARIANCE,
    Gaussian,
    checked_angle,
    checked_sequences,
    common_shape,
    data_terms,
    gaussian,
    patterns,
    view_factors,
)
from motionenv.models.eigenwalkers.fourier_model import FourierModel

_SINGULAR = 1e-12  # a pivot below this fraction of its diagonal entry is rounding error


@dataclass(frozen=True, eq=False, repr=False)
class Reconstruction(OneLine):
    """Walkers reconstructed from one view each; leading axes are those of the sequences.

    Attributes:
        scores: (..., N) [m], the estimate of k.
        depth: (..., 5, 15) [m], the missing dimension as predicted by the model, away from the camera.
        alpha, elevation: (...) [rad], the view.
        seen: (..., 15) which markers were measured.
    """

    scores: np.ndarray
    depth: np.ndarray
    alpha: np.ndarray
    elevation: np.ndarray
    seen: np.ndarray
    _measured: np.ndarray = field(repr=False)
    _gaussian: Gaussian = field(repr=False)

    @cached_property
    def coefficients(self) -> np.ndarray:
        """(..., 5, 15, 3) [m]: measured coordinates unchanged, all others from the model (eq. 3.16)."""
        views = axes(self.alpha, self.elevation)
        told = np.concatenate([self._measured, self.depth[..., None]], axis=-1) @ views[..., None, :, :]
        if self.seen.all():
            return told
        g = self._gaussian
        return np.where(self.seen[..., None, :, None], told, g.mean + np.tensordot(self.scores, g.components, axes=1))


def least_squares(
    model: FourierModel, w2: np.ndarray, alpha: ArrayLike, *, variance: float = VARIANCE, elevation: float = 0.0,
    n_components: int | None = None,
) -> Reconstruction:  # fmt: skip
    """Approach I: walkers of the model whose projection is closest to the data (eq. 3.9).

    Args:
        model: `Eigenwalkers` or `WalkerPrior`.
        w2: (..., 5, 15, 2) [m], 2D coefficients across and upwards; NaN for a missing marker.
        alpha: view angle [rad], broadcast to (...).
        variance: σ² [m²] of a measured coefficient; scales the covariance only.
        elevation: angle [rad] by which the camera looks down, broadcast to (...).
        n_components: number of leading components to use; None for all.

    Raises:
        MotionError: bad shapes or values; too few markers to determine N components.
    """
    return _reconstruct(gaussian(model, variance, n_components, prior=False), w2, alpha, elevation)


def maximum_a_posteriori(
    model: FourierModel, w2: ArrayLike, alpha: ArrayLike, *, variance: float | None = VARIANCE, elevation: float = 0.0,
    n_components: int | None = None, measurement: ArrayLike = 0.0,
) -> Reconstruction:  # fmt: skip
    """Approach II: most probable walkers given the data (eqs. 3.15, A.5).

    Measured coordinates are kept (3.16), even if they are noisy.

    Args:
        model, w2, alpha, elevation, n_components: as in `least_squares`.
        variance: σ² [m²]; None uses the model's own, per harmonic and marker.
        measurement: variance [m²] of the error of w2, broadcast to (5, 15); added to σ², the walker's own.

    Raises:
        MotionError: bad shapes or values.
        ModelError: `variance` is None and the model has no noise estimate.
    """
    return _reconstruct(gaussian(model, variance, n_components, True, measurement), w2, alpha, elevation)


def _reconstruct(model: Gaussian, w2, alpha, elevation) -> Reconstruction:
    measured, seen = checked_sequences(w2)
    shape = common_shape(seen.shape[:-1], np.shape(alpha), np.shape(elevation))
    measured, seen = np.broadcast_to(measured, (*shape, *SHAPE, 2)), np.broadcast_to(seen, (*shape, SHAPE[1]))
    alpha, elevation = (checked_angle(a, n, shape) for a, n in ((alpha, "alpha"), (elevation, "elevation")))
    flat = measured.reshape(-1, *SHAPE, 2), alpha.reshape(-1), elevation.reshape(-1)
    scores = np.empty((len(flat[0]), len(model.precision)))
    for pattern, rows in patterns(seen.reshape(len(scores), -1)):
        scores[rows] = _scores(model, pattern, *(values[rows] for values in flat))
    told = model.mean + np.tensordot(scores, model.components, axes=1)
    away = depth(told, *flat[1:]).reshape(*shape, *SHAPE)
    return Reconstruction(scores.reshape(*shape, -1), away, alpha, elevation, seen, measured, model)


def _scores(model: Gaussian, seen: np.ndarray, w2: np.ndarray, alpha: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    """Scores (n, N) of sequences `w2` (n, 5, 15, 2), which show the markers `seen` (15,), from views (n,)."""
    places, which = np.unique(np.stack([alpha, elevation]), axis=1, return_inverse=True)
    views, which = axes(*places), which.reshape(-1)
    terms = data_terms(model, w2, seen, turning=False, any_place=False)
    full = np.tensordot(view_factors(views[:, 2]), terms.blocks, axes=1)
    normal = full[:, 1:, 1:] + np.diag(model.precision)
    try:
        pivots = np.diagonal(np.linalg.cholesky(normal), axis1=1, axis2=2) ** 2
    except np.linalg.LinAlgError:
        pivots = np.zeros(1)
    if not (pivots > _SINGULAR * np.diagonal(normal, axis1=1, axis2=2)).all():
        raise MotionError(
            f"{int(seen.sum())} markers don't determine {len(model.precision)} components by least squares: "
            "lower n_components, or use maximum_a_posteriori"
        )
    shown = views[:, [0, 0, 1, 1, 1], [0, 1, 0, 1, 2]]  # across along x, y, and upwards along x, y, z
    right = np.einsum("na,nak->nk", shown[which], terms.data[:, :, 0, 1:]) - full[which, 0, 1:]
    return (np.linalg.inv(normal)[which] @ right[..., None])[..., 0]
