r"""Known view: paper B's Approach I, least squares, and Approach II, maximum a posteriori, in closed form.

    k = (ÊᵀÊ)⁻¹ Êᵀ (ŵ - C w̄)                                   (3.9)
    k = [diag(σ²/λ) + ÊᵀÊ]⁻¹ Êᵀ (ŵ - C w̄)                      (3.15, A.5)

with Ê = C(α) E, the projected eigenwalkers. Rows of markers that are missing throughout drop out; a model that knows
its noise per harmonic and marker weights the others by it. What was measured is kept, and the model fills the rest
(3.16).
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.lifting._gaussian import (
    SHAPE,
    VARIANCE,
    Gaussian,
    checked_angle,
    checked_sequences,
    common_shape,
    gaussian,
    gram_blocks,
    patterns,
)
from motionenv.estimation.lifting.geometry import axes
from motionenv.models._threads import CHUNK, in_chunks
from motionenv.models.harmonics import columns

_POINTS = SHAPE[0] * SHAPE[1]


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """Walkers told from one view each; leading axes are the sequences'.

    Attributes:
        scores: (..., N) [m], the estimate of k.
        depth: (..., 5, 15) [m], the model's part of the dimension that the view doesn't show, away from the camera.
        alpha: (...) [rad], the view.
        elevation: (...) [rad].
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
        """(..., 5, 15, 3) [m]: measured coordinates as they were, all others from the model (eq. 3.16)."""
        from motionenv.estimation.lifting._view_kernels import fill

        n = self.alpha.size
        out = np.empty((n, _POINTS, 3))
        seen = np.repeat(self.seen.reshape(n, 1, -1), SHAPE[0], axis=1).reshape(n, -1)
        flat = (self._measured.reshape(n, _POINTS, 2), seen, self.depth.reshape(n, -1), self.scores.reshape(n, -1))
        views = axes(self.alpha, self.elevation).reshape(n, 3, 3)
        w2, there, depth, scores = flat
        basis = self._gaussian.basis
        in_chunks(lambda i, j: fill(w2[i:j], there[i:j], depth[i:j], scores[i:j], views[i:j], basis, out[i:j]), n)
        return out.reshape(*self.alpha.shape, *SHAPE, 3)

    @cached_property
    def covariance(self) -> np.ndarray:
        """(..., N, N) [m²], of the scores given what was seen: the inverse of the normal matrix."""
        out = np.empty((self.alpha.size, *2 * self.scores.shape[-1:]))
        d = axes(self.alpha, self.elevation)[..., 2, :].reshape(-1, 3)
        cross = np.stack([d[:, i] * d[:, j] for i, j in ((0, 1), (0, 2), (1, 2))], axis=1)
        factors = np.concatenate([1 - d**2, -cross], axis=1)
        for seen, rows in patterns(self.seen.reshape(-1, SHAPE[1])):
            blocks = gram_blocks(self._gaussian.basis[:, 1:], self._gaussian.weights(seen).reshape(-1))
            normal = np.tensordot(factors[rows], blocks, axes=1) + np.diag(self._gaussian.precision)
            out[rows] = np.linalg.inv(normal)
        return out.reshape(*self.alpha.shape, *out.shape[1:])

    @cached_property
    def unseen(self) -> np.ndarray:
        """(..., 15, 3, 3): projector onto what wasn't measured, ddᵀ of a marker seen and 1 of one missing."""
        d = axes(self.alpha, self.elevation)[..., 2, :]
        along = d[..., :, None] * d[..., None, :]
        return np.where(self.seen[..., None, None], along[..., None, :, :], np.eye(3))

    def marker_covariance(self) -> np.ndarray:
        """(..., 15, 5, 3, 5, 3) [m²]: of each marker's coefficients given what was seen.

        That of the scores through the eigenwalkers, plus what they leave out, times the model's inflation; 0 for
        measured coordinates, which are kept as they are.
        """
        g = self._gaussian
        away = np.einsum("...mij,nhmj->...nmhi", self.unseen, g.components, optimize=True)
        flat = np.moveaxis(away.reshape(*away.shape[:-2], -1), -3, -2)  # (..., 15, N, 15)
        spread = np.swapaxes(flat, -1, -2) @ self.covariance[..., None, :, :] @ flat
        spread = spread.reshape(*spread.shape[:-2], 5, 3, 5, 3)
        for h in range(5):
            spread[..., h, :, h, :] += g.noise[h][:, None, None] * self.unseen
        return spread * g.inflation[:, None, None, None, None]

    def position_covariance(self, phase) -> np.ndarray:
        """(..., frames, 15, 3, 3) [m²]: of each marker's position at `phase` (frames,) ωt [rad] of the walk."""
        waves = columns(np.asarray(phase, dtype=np.float64))
        return np.einsum("th,...mhigj,tg->...tmij", waves, self.marker_covariance(), waves, optimize=True)


def least_squares(
    model, w2, alpha, *, variance: float = VARIANCE, elevation=0.0, n_components: int | None = None
) -> Reconstruction:
    """Approach I: the walkers of the model whose projection is nearest to what is seen (eq. 3.9).

    Args:
        model: `Eigenwalkers` or `WalkerPrior`.
        w2: (..., 5, 15, 2) [m], 2D coefficients across and upwards; NaN for a marker missing throughout.
        alpha: view angle, fits (...) [rad].
        variance: σ² [m²] of a measured coefficient; the covariance rests on it, the estimate doesn't.
        elevation: by which the camera looks down, fits (...) [rad].
        n_components: the first N of the model's; None for all.

    Raises:
        MotionError: bad shapes or values; too few markers to tell N components.
    """
    return _reconstruct(gaussian(model, variance, n_components, prior=False), w2, alpha, elevation)


def maximum_a_posteriori(
    model,
    w2,
    alpha,
    *,
    variance: float | None = VARIANCE,
    elevation=0.0,
    n_components: int | None = None,
    measurement=0.0,
) -> Reconstruction:
    """Approach II: the walkers that are most probable given what is seen (eqs. 3.15, A.5).

    Measured coordinates are kept (3.16) also where they are known to be noisy.

    Args:
        model: `Eigenwalkers` or `WalkerPrior`.
        w2: (..., 5, 15, 2) [m], 2D coefficients across and upwards; NaN for a marker missing throughout.
        alpha: view angle, fits (...) [rad].
        variance: σ² [m²]; None takes the model's own, per harmonic and marker.
        elevation: by which the camera looks down, fits (...) [rad].
        n_components: the first N of the model's; None for all.
        measurement: variance [m²] of errors in w2, fits (5, 15); on top of σ², which is the walker's own.

    Raises:
        MotionError: bad shapes or values.
        ModelError: `variance` is None and the model doesn't know its own.
    """
    return _reconstruct(gaussian(model, variance, n_components, True, measurement), w2, alpha, elevation)


def _reconstruct(model: Gaussian, w2, alpha, elevation) -> Reconstruction:
    measured, seen = checked_sequences(w2)
    shape = common_shape(seen.shape[:-1], np.shape(alpha), np.shape(elevation))
    measured, seen = np.broadcast_to(measured, (*shape, *SHAPE, 2)), np.broadcast_to(seen, (*shape, SHAPE[1]))
    alpha, elevation = (checked_angle(a, n, shape) for a, n in ((alpha, "alpha"), (elevation, "elevation")))
    n = int(np.prod(shape))
    scores, depth = np.empty((n, len(model.precision))), np.empty((n, _POINTS))
    flat = (measured.reshape(n, _POINTS, 2), alpha.reshape(n), elevation.reshape(n))
    for pattern, rows in patterns(seen.reshape(n, -1)):
        _solve(model, pattern, rows, *flat, scores, depth)
    parts = scores.reshape(*shape, -1), depth.reshape(*shape, *SHAPE)
    return Reconstruction(*parts, alpha, elevation, seen, measured, model)


def _solve(model: Gaussian, seen, rows, w2, alpha, elevation, scores, depth) -> None:
    """Writes scores and depth of the sequences `rows`, which show the same markers, view after view."""
    from motionenv.estimation.lifting._view_kernels import known_views

    order = rows[np.lexsort((elevation[rows], alpha[rows]))]
    new = np.flatnonzero((np.diff(alpha[order]) != 0) | (np.diff(elevation[order]) != 0)) + 1
    starts = np.concatenate([[0], new, [len(order)]])
    views = axes(alpha[order[starts[:-1]]], elevation[order[starts[:-1]]])
    weights = model.weights(seen).reshape(-1)
    blocks = gram_blocks(model.basis, weights)
    given = (model.basis, weights, blocks, model.precision, scores, depth)
    least = max(1, CHUNK * len(views) // len(order))  # views, each of several sequences
    solved = in_chunks(lambda i, j: known_views(w2, order, starts[i : j + 1], views[i:j], *given), len(views), least)
    if not all(solved):
        raise MotionError(
            f"{int(seen.sum())} markers don't tell {len(model.precision)} components by least squares: "
            "lower n_components, or take maximum_a_posteriori"
        )
